"""Exact derivatives of the finite element specimens against central differences: law, modulus, lengths, load."""

from __future__ import annotations

import numpy as np
import pytest
from creepkit_specimens.notched_bar import NotchedBar, NotchedRelaxation
from creepkit_specimens.plate_bulge import DomeBulge, PlateBulge
from creepkit_specimens.tube import OpenTube, Tube

import creepkit as ck

FINE = {"tolerance": 5e-5, "threads": 1}
"""Steps so small that the differences in the steps that two simulations choose do not matter."""
E_OF_T = ck.Elastic(E=150e3 - 60.0 * (ck.temperature - 1000.0))
CASES = {
    "tube": (Tube(**FINE), ck.load_steps("pressure", [(0.0, 20.0), (1e5, 25.0)])),
    "open tube": (OpenTube(**FINE), ck.constant_load("pressure", 15.0, ramp=600.0)),
    "plate": (PlateBulge(**FINE), ck.load_steps("pressure", [(0.0, 0.5), (1e5, 0.6)])),
    "dome": (DomeBulge(**FINE), ck.constant_load("pressure", 4.0)),
    "notched bar": (NotchedBar(**FINE), ck.constant_load("force", 5000.0)),
    "notched relaxation": (
        NotchedRelaxation(**FINE),
        ck.load_steps("displacement", [(0.0, 0.04), (1e5, 0.05)], ramp=60.0),
    ),
}
STEPS = {"modulus": 1e-2, "temperature": 1.0, "load step@50000": 1e-2, "temperature drift": 1.0}


@pytest.mark.parametrize("case", CASES)
def test_derivatives_are_those_of_differences(case: str) -> None:
    """Within 2e-3 of the largest of each; differences of simulations in steps of their own are no better.

    The law's rate depends on temperature, so that a warmer test differs by more than its modulus.
    """
    specimen, loading = CASES[case]
    law = ck.law("norton").times(ck.arrhenius(1000.0, 300e3))
    plan = ck.History(
        name="plan", specimen=specimen.name, loading=loading, temperature=1000.0, elastic=E_OF_T,
        times=np.geomspace(3600.0, 2e5, 8), outputs={name: np.zeros(8) for name in specimen.outputs},
    )  # fmt: skip
    theta = law.to_internal(law.values({"A": 1e-15, "n": 4.0}))
    nuisances = {"modulus": 0.02, "temperature": 3.0, "temperature drift": 2.0, "load step@50000": 0.01}
    nuisances |= {each.name: 1.01 * each.default for each in specimen.dimensions}
    columns = {key: np.array([[value]]) for key, value in nuisances.items()}

    def values(theta, **changes):
        return specimen.predict(law, theta, [plan], nuisances={**columns, **changes}).values[0, 0]

    found = specimen.predict(law, theta, [plan], nuisances=columns, sensitivities=True)
    assert found.status == 0
    for k, step in enumerate((1e-2, 1e-3)):
        move = step * np.eye(2)[k]
        known = (values(theta + move) - values(theta - move)) / (2 * step)
        compare(found.jacobian[0, 0, ..., k], known, f"parameter {k}")
    assert set(found.nuisance_jacobian) == set(nuisances)
    for key, value in nuisances.items():
        step = STEPS.get(key, 1e-3 * value)
        up, down = (values(theta, **{key: columns[key] + s}) for s in (step, -step))
        lost = 1e-5 * np.abs(up).max(axis=0) / max(abs(value), 1.0)  # by the difference of all but equal outputs
        compare(found.nuisance_jacobian[key][0, 0], (up - down) / (2 * step), key, lost)


def compare(found: np.ndarray, known: np.ndarray, what: str, lost=0.0) -> None:
    """Each output's derivatives (times, outputs), against the largest of them; lost : (outputs,) what may be missed."""
    largest = np.abs(known).max(axis=0)
    error = np.abs(found - known).max(axis=0)
    assert (error <= 2e-3 * largest + lost).all(), what
