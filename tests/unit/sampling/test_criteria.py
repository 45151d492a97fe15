"""Criteria: rates in closed form, and outcomes made by hand."""

from __future__ import annotations

import numpy as np
import pytest

import creepkit as ck
from creepkit.records import Status
from creepkit.sampling.criteria import SimulationOutcome, conditioned_criteria, paper_criteria
from creepkit.sampling.rates import Draws

PAPER = {c.name: c for c in paper_criteria(ck.specimen("bulge"))}
INFORMATIVE = {c.name: c for c in conditioned_criteria(ck.law("drifting-exponent"), ck.specimen("bulge"), 43200.0)}
NAN = float("nan")


def draws(*rows):
    return Draws(np.array(rows, float), np.zeros((len(rows), 0)), ())


def outcome(first=(0.05, 0.05), second=(0.07, 0.07), status=Status.COMPLETE, end=43200.0):
    """Amplitudes, mm, at both ends of each hold; NaN where the simulation did not get; elastic: .05, then .07."""
    marks = np.array([*first, *second])
    jump = 14400.0
    times = np.array([0.0, 5.0, jump, jump + 5.0, 43200.0])
    seen = np.where(times <= end, [0.0, *marks], NAN)
    return SimulationOutcome(times, seen[:, None], marks[:, None], status, end, {})


# ---- before simulation ----------------------------------------------------------------------------------------------


def test_criterion_1_at_600_mpa():
    n = 3.0
    at_limit = 1e-20 / 600.0**n
    np.testing.assert_array_equal(
        PAPER["1"].passes(ck.law("norton"), draws([1.01 * at_limit, n], [0.99 * at_limit, n], [0.0, n])),
        [True, False, False],
    )


def test_criterion_2_at_50_mpa_strain_and_time():
    """Strain hardening at strain .01, time hardening at 10,000 s."""
    A = 50.0**-4.0
    assert PAPER["2"].passes(ck.law("norton"), draws([0.99 * A, 4], [1.01 * A, 4])).tolist() == [True, False]
    strained = A * 0.01**0.5
    found = PAPER["2"].passes(ck.law("strain-hardening"), draws([0.99 * strained, 4, -0.5], [1.01 * strained, 4, -0.5]))
    assert found.tolist() == [True, False]
    aged = A * 1e4**0.5
    found = PAPER["2"].passes(ck.law("time-hardening"), draws([0.99 * aged, 4, -0.5], [1.01 * aged, 4, -0.5]))
    assert found.tolist() == [True, False]


def test_rates_beyond_double_precision_are_judged():
    """sinh(600)^8 is 10^2082; 1e-40 of it is far above 1e-20."""
    assert PAPER["1"].passes(ck.law("hyperbolic-sine"), draws([1e-40, 8.0, 1.0])).all()


def test_bounds_admit_what_is_off():
    bounds, law = INFORMATIVE["bounds"], ck.law("norton")
    found = bounds.passes(law, draws([1e-20, 5.0], [0.0, 5.0], [1e-4, 5.0], [1e-20, 9.0]))
    assert found.tolist() == [True, True, False, False]


def test_an_exponent_that_falls_below_zero_during_the_test():
    """n(t) = 1 + 8 exp(-t/1000) - 8 exp(-t/15000) is -4.7 at 5000 s; without the transient it stays 1."""
    law = ck.law("drifting-exponent")
    rows = draws([1e-12, 1, 1, 8, 1000, 15000, 0], [1e-12, 1, 1, 0, 1000, 15000, 0])
    assert INFORMATIVE["constraints"].passes(law, rows).tolist() == [False, True]


# ---- after simulation -----------------------------------------------------------------------------------------------


def test_elastic_deflection_alone_is_no_creep():
    still = outcome()
    assert not PAPER["4"].passes(still)
    assert PAPER["5"].passes(still)
    assert PAPER["3"].passes(still)
    assert not INFORMATIVE["visible creep"].passes(still)


@pytest.mark.parametrize(
    ("first", "second", "met"),
    [((0.05, 0.0601), (0.08, 0.0901), True), ((0.05, 0.0599), (0.08, 0.5), False), ((0.05, 0.5), (0.52, 0.529), False)],
)
def test_criterion_4_asks_for_creep_in_each_hold(first, second, met):
    assert PAPER["4"].passes(outcome(first, second)) is met


def test_creep_of_both_holds_adds_up():
    assert INFORMATIVE["visible creep"].passes(outcome((0.05, 0.06), (0.08, 0.0901)))
    assert not INFORMATIVE["visible creep"].passes(outcome((0.05, 0.06), (0.08, 0.0899)))


def test_a_burst_in_the_second_hold_counts_up_to_its_last_frame():
    burst = outcome((0.05, 0.3), (0.4, NAN), Status.RUPTURED, 20000.0)
    burst.outputs[3, 0] = 0.6
    assert PAPER["3"].passes(burst)
    assert PAPER["4"].passes(burst)
    assert PAPER["5"].passes(burst)
    assert not INFORMATIVE["full history"].passes(burst)


def test_a_burst_in_the_first_hold_is_no_second_one():
    burst = outcome((0.05, NAN), (NAN, NAN), Status.RUPTURED, 7200.0)
    assert PAPER["3"].passes(burst)
    assert not PAPER["4"].passes(burst)


@pytest.mark.parametrize(
    ("status", "end", "met"),
    [
        (Status.RUPTURED, 3599.0, False),
        (Status.RUPTURED, 3600.0, True),
        (Status.NOT_CONVERGED, 40000.0, False),
        (Status.COMPLETE, 1200.0, True),
    ],
)
def test_criterion_3_asks_for_an_hour_or_the_whole_of_a_shorter_test(status, end, met):
    assert PAPER["3"].passes(outcome(status=status, end=end)) is met


def test_criterion_5_looks_at_the_last_frame_there_is():
    assert not PAPER["5"].passes(outcome((0.001, 0.002), (0.003, 0.0099)))
    assert PAPER["5"].passes(outcome((0.001, 0.002), (0.003, 0.0101)))
    empty = outcome((NAN, NAN), (NAN, NAN), Status.NOT_CONVERGED, 0.0)
    empty.outputs[:] = NAN
    assert not PAPER["5"].passes(empty)
