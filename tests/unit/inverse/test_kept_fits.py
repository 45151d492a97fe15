"""Kept identifications: what was written is read, and what no identification has written is not."""

from __future__ import annotations

import copy
import json
from typing import Any

import numpy as np
import pytest

import creepkit as ck
from creepkit.files.json_documents import json_text
from creepkit.files.record_codec import RecordError
from creepkit.inverse.kept_fits import kept_from_json, kept_to_json


@pytest.fixture(scope="module")
def document() -> Any:
    times, rng = np.linspace(10.0, 3600.0, 40), np.random.default_rng(1)
    tests = [
        ck.History(
            f"{s:g}",
            times,
            {"strain": 1e-15 * s**5 * times + rng.normal(0.0, 2e-6, times.size)},
            ck.constant_stress(s, control="stress"),
            1000.0,
            standard_deviation={"strain": 2e-6},
        )
        for s in (60.0, 80.0, 100.0)
    ]
    return json.loads(
        json_text(kept_to_json(ck.identify("norton", tests, starts=4, sobol_points=64, weights="likelihood")))
    )


def test_what_was_kept_is_read(document: Any) -> None:
    fit = kept_from_json(copy.deepcopy(document), "a.json")
    assert fit.values["n"] == pytest.approx(5.0, rel=0.05)
    assert fit.linearised is not None


@pytest.mark.parametrize(
    ("name", "change", "problem"),
    [
        ("precision", lambda old: [None, *old[1:]], "precision holds what is no number"),
        ("precision", lambda old: [-1.0, *old[1:]], "precision holds what is below zero"),
        ("precision", lambda old: [*old, 1.0], r"prior_residual has the shape \(\d,\), not \(\d,\)"),
        ("prior_residual", lambda old: [None, *old[1:]], "prior_residual holds what is no number"),
        ("step_bounds", lambda old: old[:1], r"step_bounds has the shape \(1, \d\), not \(2, \d\)"),
        ("free", lambda old: [*old, True], "free has the shape"),
    ],
)
def test_what_no_identification_has_written_is_refused(document: Any, name: str, change: Any, problem: str) -> None:
    changed = copy.deepcopy(document)
    changed["linearised"][name] = change(changed["linearised"][name])
    with pytest.raises(RecordError, match=f"linearised: {problem}"):
        kept_from_json(changed, "a.json")
