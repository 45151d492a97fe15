"""The conformance kit: laws of the literature pass it, and each kind of broken law or kernel is caught and named."""

from typing import Any

import numpy as np
import pytest
import sympy
import torch
from sympy import exp, sqrt

from creepkit.kernels import lowering, numpy_functions, torch_functions
from creepkit.kernels.multiprecision import MultiprecisionLaw
from creepkit.language import CreepLaw, strain, stress, time
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.testing import check_law, draw_samples
from creepkit.testing.parity import (
    DERIVATIVE_TOLERANCE,
    KernelTable,
    MultiprecisionReference,
    evaluate_numpy,
    largest_differences,
)
from helpers.dyson_mclean import DYSON_MCLEAN
from helpers.literature_laws import EQUATIONS, POWER, RATE, A, law, n, number, s_0

# ---- what passes ---------------------------------------------------------------------------------------------------


def test_laws_that_others_would_write_are_fit_for_every_verb() -> None:
    """All but a step in time, which jumps. sinh(c s)/s, of Dyson and McLean, cancels at low stress, where it is 0/0."""
    reports = {name: check_law(one, samples=8) for name, one in {**EQUATIONS, "Dyson": DYSON_MCLEAN}.items()}

    failed = {name: [check.name for check in report.failures] for name, report in reports.items()}
    assert {name: checks for name, checks in failed.items() if checks} == {
        "step in time": ["rate is continuous in time"]
    }


PLAIN = {A: RATE, n: POWER}


def test_a_report_prints_one_line_a_check_and_digits_that_are_lost_as_written_are_caught() -> None:
    report = check_law(NORTON, samples=16)
    head, *lines = str(report).splitlines()
    assert (head, len(lines)) == ("norton: conforms", len(report.checks))
    assert "  ok   off equals fix: A 0.0e+00, n 0.0e+00" in lines
    lost = law(A * stress * (sqrt(1 + strain) - 1), {A: RATE})
    (found,) = [c for c in check_law(lost, samples=16).failures if c.name == "numpy value against 50 digits"]
    assert ", rate at stress " in found.detail
    assert "does NOT conform" in str(check_law(lost, samples=16))


# ---- kernels that are broken ---------------------------------------------------------------------------------------


@pytest.fixture
def fresh(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """Kernels are lowered anew, so that what is patched counts."""
    monkeypatch.setattr(lowering, "_array_kernel", lowering._array_kernel.__wrapped__)
    return monkeypatch


def failures(of: CreepLaw) -> set[str]:
    return {check.name for check in check_law(of, samples=8).failures}


def without_floor(x: Any, floor: float) -> Any:
    with np.errstate(divide="ignore"):
        return np.log(x)


NUMPY, TORCH = numpy_functions.FUNCTIONS, torch_functions.FUNCTIONS
AT_ZERO = "torch gradients at zero strain and time"
BROKEN = (
    (NUMPY, "exp", lambda x: np.exp(x) * (1 + 3e-11), {"numpy value against 50 digits"}),
    (TORCH, "floored", lambda x, floor: torch.clamp(x, min=floor) * (1 + 1e-9),
     {"torch derivatives against 50 digits", "torch gradients", AT_ZERO}),
    (TORCH, "floored", lambda x, floor: x, {AT_ZERO}),
    (NUMPY, "log_floor", without_floor, {"ln rate and its derivatives are finite at zero strain"}),
)  # fmt: skip
"""(functions of a target, name, its wrong form, checks that fail): a floor is only called by derivatives."""


def test_a_broken_function_of_one_target_is_caught(fresh: pytest.MonkeyPatch) -> None:
    """A wrong eleventh digit, a wrong derivative, a gradient that is nan at zero, a missing floor."""
    for functions, name, wrong, caught in BROKEN:
        with fresh.context() as patch:
            patch.setitem(functions, name, wrong)
            found = failures(STRAIN_HARDENING)
        assert caught <= found, name
        assert "torch value against 50 digits" not in found


# ---- the measure ---------------------------------------------------------------------------------------------------


def test_samples_cover_bounds_and_constraints() -> None:
    halved = law(A * stress**n, PLAIN, constraints=(n >= 4,))

    drawn = draw_samples(halved, 32, seed=1)

    assert len(drawn) == 32
    assert (drawn.theta[:, 1] >= 4).all()
    assert (np.log(1e-40) <= drawn.theta[:, 0]).all()
    assert (drawn.theta[:, 0] <= np.log(1e-5)).all()
    assert drawn.points[:, 0].min() < 1
    assert drawn.points[:, 0].max() > 1000
    np.testing.assert_array_equal(draw_samples(halved, 32, seed=1).points, drawn.points)


def test_exact_derivatives_are_those_of_differences() -> None:
    """By symbols at 50 digits and by central differences at 200."""
    exact, drawn = MultiprecisionLaw(EQUATIONS["Kachanov-Rabotnov"]), draw_samples(EQUATIONS["Kachanov-Rabotnov"], 4)
    for point, theta in zip(drawn.points, drawn.theta, strict=True):
        rows, differences = exact.values_and_derivatives(point, theta), exact.values_and_differences(point, theta)
        for row, line in zip(rows, differences, strict=True):
            for a, b in zip(row, line, strict=True):
                assert abs(a - b) <= 1e-40 * abs(b)


def test_a_result_that_cancels_is_told_from_one_that_is_wrong() -> None:
    """The slope n - 2 k ln s of A s^n exp(-k (ln s)^2) vanishes at ln s = n/2k."""
    curved = law(A * stress**n * exp(-s_0 * sympy.log(stress) ** 2), {**PLAIN, s_0: number(0.1, 0.3)})
    drawn = draw_samples(curved, 4)
    drawn.points[:, 0] = np.exp(drawn.theta[:, 1] / (2 * drawn.theta[:, 2]))
    truth, table = MultiprecisionReference(MultiprecisionLaw(curved), drawn), evaluate_numpy(curved, drawn)

    assert largest_differences(truth, table)[1].size > DERIVATIVE_TOLERANCE
    assert largest_differences(truth, table, allow_cancellation=True)[1].size <= DERIVATIVE_TOLERANCE
    wrong = KernelTable(table.rows * (1 + 1e-9), table.log_rates)
    assert largest_differences(truth, wrong, allow_cancellation=True)[1].size > DERIVATIVE_TOLERANCE


def test_zero_to_fifty_digits_is_looked_at_again() -> None:
    """1 - exp(-500) is 1 to 50 digits, and its logarithm is not 0."""
    late = EQUATIONS["saturating to a power"]
    drawn = draw_samples(late, 4)
    drawn.points[:, 2] = 500.0 / np.exp(drawn.theta[:, 1])
    truth = MultiprecisionReference(MultiprecisionLaw(late), drawn)

    assert truth.rows[0][0][-1] == 0
    assert max(d.size for d in largest_differences(truth, evaluate_numpy(late, drawn))) < 1e-12
    assert time in late.rate.free_symbols
