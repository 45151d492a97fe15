"""The model at the reference stress, in closed form."""

from __future__ import annotations

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import SurrogateError
from creepkit.records import History
from creepkit.surrogates.reference_stress_model import ReferenceStressModel
from helpers.cantilever import Cantilever

NORTON, HOUR = ck.law("norton"), 3600.0
VALUES = {"A": 1e-16, "n": 4.0}
TIMES = np.array([0.0, HOUR, 4 * HOUR, 10 * HOUR])


def held(**geometry: float) -> History:
    return History("beam", TIMES, {}, ck.load_steps("force", [(0, 10.0), (4 * HOUR, 12.0)]), 293.15,
                   specimen="cantilever", geometry=geometry)  # fmt: skip


def deflection(span: float = 50.0, height: float = 2.0) -> np.ndarray:
    """By hand: Norton's strain at 0.7 of the stress at the root, times L^2/(3 h)."""
    stresses = [0.7 * 6.0 * force * span / (10.0 * height**2) for force in (10.0, 12.0)]
    rates = [VALUES["A"] * stress ** VALUES["n"] for stress in stresses]
    strain = rates[0] * np.minimum(TIMES, 4 * HOUR) + rates[1] * np.maximum(TIMES - 4 * HOUR, 0.0)
    return span**2 / (3.0 * height) * strain


def test_the_deflection_is_that_of_a_bar_under_the_reference_stress() -> None:
    found = ReferenceStressModel(Cantilever()).predict(NORTON, NORTON.to_internal(VALUES), [held(), held(span=60.0)])
    assert found.outputs == ("deflection",)
    np.testing.assert_allclose(found.values[0, 0, :, 0], deflection(), rtol=1e-5, atol=1e-12)
    np.testing.assert_allclose(found.values[0, 1, :, 0], deflection(span=60.0), rtol=1e-5, atol=1e-12)


def test_candidates_with_lengths_of_their_own() -> None:
    theta = np.repeat(NORTON.to_internal(VALUES), 2, axis=0)
    nuisances = {"height": np.array([[1.9], [2.1]])}
    found = ReferenceStressModel(Cantilever()).predict(NORTON, theta, [held()], nuisances=nuisances)
    for row, height in enumerate((1.9, 2.1)):
        np.testing.assert_allclose(found.values[row, 0, :, 0], deflection(height=height), rtol=1e-5, atol=1e-12)


def test_an_output_that_falls_has_no_such_model() -> None:
    with pytest.raises(SurrogateError, match="its output falls under creep"):
        ReferenceStressModel(ck.specimen("relaxation"))
