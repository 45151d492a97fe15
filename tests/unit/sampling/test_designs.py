"""Designs of experiments: the sequence, the times, the tests that conditions describe, the paper's sampling domain."""

from __future__ import annotations

import json
import pickle
import warnings

import numpy as np
import pytest
from scipy.stats import qmc

import creepkit as ck
from creepkit.errors import DatasetError
from creepkit.records import PressureJump, Status
from creepkit.sampling.conditions import TimeGrid, hold_times, planned_test
from creepkit.sampling.domains import (
    SamplingDomain,
    SimulationOutcome,
    conditioned_criteria,
    paper_criteria,
    sampling_design,
)
from creepkit.sampling.rates import Draws, sobol_rows
from helpers.mistakes import said_otherwise

DIMPLE, BAR = ck.specimen("bulge"), ck.specimen("uniaxial")
GRID = TimeGrid.every()
TEST = {"modulus": 150e3, "P1": 8.0, "P2": 10.0, "Tj": 14400.0}


# ---- the sequence ---------------------------------------------------------------------------------------------------


def test_rows_are_those_of_scipy_whatever_the_block():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        whole = qmc.Sobol(5, scramble=True, seed=3).random(40)
    for first, count in ((0, 40), (0, 1), (1, 39), (7, 5), (39, 1)):
        np.testing.assert_array_equal(sobol_rows(5, first, count, 3), whole[first : first + count])


# ---- times ----------------------------------------------------------------------------------------------------------


def test_the_papers_grid_has_289_frames():
    assert GRID.frames == 289
    assert GRID.end == 43200.0
    assert GRID.times(1.0)[1] == 150.0


# ---- tests ----------------------------------------------------------------------------------------------------------


def test_the_test_of_a_dimple():
    made = planned_test(DIMPLE, {**TEST, "apex_thickness": 0.48, "end_time": 20000.0}, GRID)
    assert made.loading == PressureJump(8.0, 10.0, 14400.0)
    assert made.elastic == ck.Elastic(150e3)
    assert made.geometry == {"apex_thickness": 0.48}
    assert made.times[-1] == 19950.0
    assert made.specimen == "bulge"
    assert made.temperature == 293.15
    np.testing.assert_array_equal(hold_times(made), [5.0, 14400.0, 14405.0, 19950.0])


# ---- the paper's sampling domain -------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "inputs"), [("combined", 13), ("drifting-exponent", 11)])
def test_the_papers_box_has_the_papers_inputs(name, inputs):
    design = sampling_design(ck.law(name), DIMPLE, "paper")
    draws = design.draw(0, 4096, seed=1)
    assert draws.parameters.shape[1] + draws.conditions.shape[1] == inputs
    for column, param in zip(draws.parameters.T, design.law.params.values(), strict=True):
        place = np.log10(column) if param.scale == "log" else column
        ends = np.log10(param.bounds) if param.scale == "log" else np.array(param.bounds)
        share = (place - ends[0]) / np.ptp(ends)
        assert -1e-9 <= share.min() < 0.01
        assert 0.99 < share.max() <= 1 + 1e-9
        assert abs(np.mean(share) - 1 / 2) < 2e-3
        assert abs(np.var(share) - 1 / 12) < 2e-3


def test_pressures_are_uniform_where_the_second_is_not_below_the_first():
    draws = sampling_design(ck.law("norton"), DIMPLE, "paper").draw(0, 4096, seed=1)
    P1, P2 = ((draws.condition(name) - 3) / 22 for name in ("P1", "P2"))
    assert (P1 <= P2).all()
    # Moments of the triangle 0 <= x <= y <= 1: 1/3, 2/3 and E[xy] = 1/4.
    np.testing.assert_allclose([P1.mean(), P2.mean(), (P1 * P2).mean()], [1 / 3, 2 / 3, 1 / 4], atol=3e-3)


def test_the_papers_ranges_of_modulus_and_jump():
    draws = sampling_design(ck.law("norton"), DIMPLE, "paper").draw(0, 1024, seed=1)
    for name, low, high in (("modulus", 50e3, 300e3), ("Tj", 2 * 3600, 10 * 3600)):
        found = draws.condition(name)
        assert low <= found.min() < low + 0.02 * (high - low)
        assert high - 0.02 * (high - low) < found.max() <= high


def test_other_ranges_times_and_numbers():
    changes = {"P1": (5, 10), "P2": 12, "apex_thickness": (0.44, 0.6), "end_time": (7200, 14400), "every": 300}
    design = sampling_design(ck.law("norton"), DIMPLE, "paper", **changes)
    assert design.grid == TimeGrid.every(300.0, 14400.0)
    draws = design.draw(0, 256, seed=1)
    assert (draws.condition("P2") == 12).all()
    assert draws.condition("P1").max() <= 10
    assert (draws.condition("Tj") < draws.condition("end_time")).all()
    assert 0.44 <= draws.condition("apex_thickness").min()


@pytest.mark.parametrize("domain", ["paper", "conditioned"])
def test_a_design_travels_and_says_what_decides_it(domain):
    design = sampling_design(ck.law("combined"), DIMPLE, domain)
    assert isinstance(design, SamplingDomain)
    again = pickle.loads(pickle.dumps(design))
    assert again == design
    text = json.dumps(design.document(), allow_nan=False)
    assert text == json.dumps(again.document(), allow_nan=False)
    other = sampling_design(ck.law("combined"), DIMPLE, domain, P1=(3, 20))
    assert text != json.dumps(other.document(), allow_nan=False)


@pytest.mark.parametrize("domain", ["paper", "conditioned"])
def test_a_row_is_the_same_in_every_block(domain):
    design = sampling_design(ck.law("combined"), DIMPLE, domain)
    whole = design.draw(0, 64, seed=5)
    for first, count in ((0, 1), (1, 7), (60, 4)):
        part = design.draw(first, count, seed=5)
        np.testing.assert_array_equal(part.parameters, whole.parameters[first : first + count])
        np.testing.assert_array_equal(part.conditions, whole.conditions[first : first + count])


def test_a_law_of_temperature_needs_its_range():
    law = ck.law("norton").times(ck.arrhenius(T_ref=1073))
    assert "temperature" in sampling_design(law, DIMPLE, temperature=(1000, 1100)).condition_names


def design(**changes):
    return sampling_design(ck.law("norton"), DIMPLE, **changes)


MISTAKES = [
    (lambda: sobol_rows(2, 0, 0, 1), "ask for at least one"),
    (lambda: sobol_rows(2, 2**30, 1, 1), "change the seed"),
    (lambda: sobol_rows(2, 0, 1, -1), "seed -1"),
    (lambda: TimeGrid(np.array([0.0])), "two or more"),
    (lambda: TimeGrid(np.array([0.0, 5.0, 5.0])), "increase"),
    (lambda: TimeGrid(np.array([0.0, 2.0]), relative=True), "from 0 to 1"),
    (lambda: TimeGrid(np.array([0.0, 1.0]), relative=True).end, "give the condition end_time"),
    (lambda: TimeGrid.every(100.0, 50.0), "every 100 s until 50 s"),
    (lambda: planned_test(DIMPLE, {"P1": 8.0}, GRID), "needs the condition 'modulus'"),
    (lambda: planned_test(DIMPLE, {**TEST, "stress": 3.0}, GRID), "no condition 'stress'"),
    (lambda: planned_test(DIMPLE, {"modulus": 150e3, "P1": 8.0, "P2": 9.0}, GRID), "both P2 and Tj"),
    (
        lambda: planned_test(ck.specimen("point"), TEST, GRID),
        "'point' does not say between which values of its load .* add the attribute",
    ),
    (lambda: design(domain="Paper domain"), "there is no sampling domain 'Paper domain'"),
    (lambda: design(P3=(1, 2)), "a bulge test has no condition 'P3'"),
    (lambda: design(P1=(20, 3)), r"the range \(20, 3\) is reversed; write \(3, 20\)"),
    (lambda: design(P1="low"), "condition 'P1' is 'low'"),
    (lambda: design(P1=(1, 2, 3)), "give a number or"),
    (lambda: design(modulus=(0, 3e5)), "finite and above zero"),
    (lambda: design(P1=(10, 20)), "P2 from 3 to 25 MPa reaches below P1"),
    (lambda: design(Tj=(7200, 90000)), "Tj reaches 90000 s, and tests may end at 43200 s"),
    (lambda: design(grid=TimeGrid(np.array([0.0, 1.0]), relative=True)), "give end_time"),
    (lambda: design(every=-5), "frames every -5 s"),
    (lambda: design(domain="paper").draw(0, 0, seed=1), "0 samples"),
    (lambda: sampling_design(ck.law("norton").times(ck.arrhenius(T_ref=1073)), DIMPLE), "depends on temperature"),
    (lambda: Draws(np.zeros((2, 2)), np.zeros((2, 1)), ("P1",)).condition("P2"), "no condition 'P2'"),
]


def test_what_is_no_sequence_grid_test_or_design_is_said_in_a_sentence():
    assert not said_otherwise(MISTAKES, DatasetError)


# ---- criteria --------------------------------------------------------------------------------------------------------

# Criteria: rates in closed form, and outcomes made by hand.


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


def test_a_burst_in_the_second_hold_counts_up_to_its_last_frame():
    burst = outcome((0.05, 0.3), (0.4, NAN), Status.RUPTURED, 20000.0)
    burst.outputs[3, 0] = 0.6
    assert PAPER["3"].passes(burst)
    assert PAPER["4"].passes(burst)
    assert PAPER["5"].passes(burst)
    assert not INFORMATIVE["full history"].passes(burst)


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


def test_what_criteria_1_and_2_reject_of_nortons_law():
    """log10 A uniform in -40 .. -5, n in 1 .. 8: the shares are integrals of a clipped line over n."""
    design = sampling_design(ck.law("norton"), DIMPLE, "paper")
    met = np.array([one.passes(design.law, design.draw(0, 4096, 1)) for one in design.criteria[:2]])
    n = np.linspace(1, 8, 100_001)
    first = np.clip((-5 - (-20 - n * np.log10(600))) / 35, 0, 1).mean()
    second = np.clip((-n * np.log10(50) + 40) / 35, 0, 1).mean()
    np.testing.assert_allclose(met.mean(axis=1), [first, second], atol=2e-3)
    np.testing.assert_allclose(met.all(axis=0).mean(), first + second - 1, atol=4e-3)  # no law breaks both
