"""Temperature laws as JSON files: the law as a tree, its numbers, the forms that remain, and what they came from."""

from __future__ import annotations

import json
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from creepkit.inverse.files import to_json as fit_to_json
from creepkit.inverse.writing import write_text
from creepkit.language.tree import law_to_json

if TYPE_CHECKING:
    from creepkit.discovery.trend import Candidate, TemperatureLaw

KIND = "creepkit temperature law"
VERSION = 1
LISTED = 20
"""Combinations that are written, best first."""


def to_json(trend: TemperatureLaw) -> dict[str, Any]:
    """The answer as JSON-able data."""
    points = trend.points
    return {
        "kind": KIND,
        "version": VERSION,
        "creepkit": version("creepkit"),
        "law": law_to_json(trend.law),
        "base": law_to_json(trend.base),
        "T_ref": trend.T_ref,
        "range": list(trend.range),
        "judged_by": trend.judged_by,
        "estimates": [vars(e) for e in trend.estimates],
        "sets": {name: [vars(form) for form in own] for name, own in trend.sets.items()},
        "odds": {name: dict(own) for name, own in trend.odds.items()},
        "candidates": [_plain(one) for one in trend.candidates[:LISTED]],
        "points": {
            "temperatures": points.temperatures.tolist(),
            "internal": points.theta.tolist(),
            "covariance": points.covariance.tolist(),
            "inflation": trend.combinations.inflation,
        },
        "reference": vars(points.reference),
        "fit": None if trend.fit is None else fit_to_json(trend.fit),
        "notes": list(trend.notes),
    }


def _plain(one: Candidate) -> dict[str, Any]:
    return {
        "forms": one.forms,
        "internal": dict(one.internal),
        "covariance": one.covariance.tolist(),
        "excess": one.excess,
        "weight": one.weight,
    }


def save(trend: TemperatureLaw, path: Path) -> Path:
    """Write a file that is whole or absent."""
    return write_text(json.dumps(to_json(trend), indent=1, allow_nan=False) + "\n", path)
