"""Temperature laws as JSON files: the law as a tree, its numbers, the forms that remain, and what they came from."""

from __future__ import annotations

import json
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from creepkit.inverse.files import identification_to_json as fit_to_json
from creepkit.inverse.writing import write_text_atomically
from creepkit.language.tree import law_to_json

if TYPE_CHECKING:
    from creepkit.discovery.trend import CandidateLaw, TemperatureLaw

FILE_KIND = "creepkit temperature law"
FILE_VERSION = 1
MAX_COMBINATIONS_WRITTEN = 20
"""Combinations that are written, best first."""


def temperature_law_to_json(temperature_law: TemperatureLaw) -> dict[str, Any]:
    """The answer as JSON-able data."""
    estimates = temperature_law.isothermal_estimates
    return {
        "kind": FILE_KIND,
        "version": FILE_VERSION,
        "creepkit": version("creepkit"),
        "law": law_to_json(temperature_law.law),
        "base": law_to_json(temperature_law.isothermal_law),
        "T_ref": temperature_law.T_ref,
        "range": list(temperature_law.temperature_range),
        "judged_by": temperature_law.criterion_data,
        "estimates": [vars(e) for e in temperature_law.estimates],
        "sets": {name: [vars(form) for form in forms] for name, forms in temperature_law.plausible_forms.items()},
        "odds": {name: dict(own) for name, own in temperature_law.prior_odds.items()},
        "candidates": [_candidate_to_json(candidate) for candidate in temperature_law.candidates[:MAX_COMBINATIONS_WRITTEN]],
        "points": {
            "temperatures": estimates.temperatures.tolist(),
            "internal": estimates.theta.tolist(),
            "covariance": estimates.covariance.tolist(),
            "inflation": temperature_law.combinations.overdispersion,
        },
        "reference": vars(estimates.reference),
        "fit": None if temperature_law.fit is None else fit_to_json(temperature_law.fit),
        "notes": list(temperature_law.notes),
    }


def _candidate_to_json(candidate: CandidateLaw) -> dict[str, Any]:
    return {
        "forms": candidate.forms,
        "internal": dict(candidate.internal_values),
        "covariance": candidate.covariance.tolist(),
        "excess": candidate.criterion_difference,
        "weight": candidate.weight,
    }


def write_temperature_law(temperature_law: TemperatureLaw, path: Path) -> Path:
    """Write a file that is whole or absent."""
    return write_text_atomically(json.dumps(temperature_law_to_json(temperature_law), indent=1, allow_nan=False) + "\n", path)
