"""Bars whose load was raised from nothing, in sight of the record."""

from __future__ import annotations

import numpy as np
import pytest

import creepkit as ck
from creepkit.records import Program, RecordedLoading

RAMP, END = 60.0, 1.08e6
TIMES = np.concatenate([np.linspace(0.0, RAMP, 7), np.geomspace(90.0, END, 40)])
TRUTH = {"A": 4e-20, "n": 5.0, "m": -0.6}


def loaded_bar(stress: float) -> ck.History:
    """Strain hardening: strain^(1 - m) is (1 - m) A times the integral of stress^n, which rises in a minute."""
    A, n, m = TRUTH.values()
    raised = np.minimum(TIMES, RAMP)
    integral = stress**n * (raised * (raised / RAMP) ** n / (n + 1.0) + np.maximum(TIMES - RAMP, 0.0))
    noise = 2e-6 * np.random.default_rng(int(stress)).standard_normal(TIMES.size)
    return ck.History(
        name=f"{stress:g} MPa",
        times=TIMES,
        outputs={"strain": ((1.0 - m) * A * integral) ** (1.0 / (1.0 - m)) + noise},
        loading=RecordedLoading(
            Program(np.array([0.0, RAMP, END]), np.array([0.0, stress, stress])), "stress", "stress"
        ),
        temperature=873.15,
        strain_measure="logarithmic",
    )


def test_a_law_is_found_of_bars_that_were_loaded_from_nothing() -> None:
    histories = [loaded_bar(stress) for stress in (120.0, 140.0, 160.0)]
    assert histories[0].load_levels.tolist() == [120.0, 120.0]
    fit = ck.identify("strain-hardening", histories)
    assert fit.values["n"] == pytest.approx(TRUTH["n"], rel=5e-3)
    assert fit.values["m"] == pytest.approx(TRUTH["m"], rel=5e-3)


def test_steps_and_slow_changes_of_load_are_levels() -> None:
    steps = loaded_bar(120.0).replace(loading=ck.StressSteps(((0.0, 100.0), (3600.0, 120.0))))
    assert steps.load_levels.tolist() == steps.loading.program().values.tolist()
    program = Program(np.array([0.0, END]), np.array([0.0, 120.0]))
    assert loaded_bar(120.0).replace(loading=RecordedLoading(program, "stress", "stress")).load_levels.tolist() == [
        0,
        120,
    ]
