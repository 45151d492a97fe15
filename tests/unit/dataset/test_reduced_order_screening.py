"""Samples that are not simulated: what a stand-in must say for that, and that nothing of use is lost."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

import creepkit as ck
from creepkit.dataset.generation import GenerationJob
from creepkit.dataset.simulation import empty_dataset, simulate_rows
from creepkit.records import Status, SupportsReducedOrderModel
from creepkit.sampling.criteria import BURST_TIME_FACTOR, SimulationOutcome, conditioned_criteria, paper_criteria
from creepkit.sampling.domains import sampling_design

DIMPLE, NORTON = ck.specimen("bulge").replace(threads=1), ck.law("norton")
PAPER = {c.name: c for c in paper_criteria(ck.specimen("bulge"))}
JUMP, END = 14400.0, 43200.0


def sketch(end=END, growths=(0.1, 0.1), status=Status.RUPTURED):
    """What a stand-in says, by hand: when it ended, mm of growth in each hold."""
    times = np.array([5.0, JUMP, JUMP + 5.0, END])
    marks = np.array([0.05, 0.05 + growths[0], 0.2, 0.2 + growths[1]])
    return SimulationOutcome(times, marks[:, None], marks[:, None], status, end, {})


def test_a_stand_in_that_bursts_far_too_early_rules_out_an_hour():
    limit = 3600.0 / BURST_TIME_FACTOR
    assert PAPER["3"].rejects_early(sketch(0.99 * limit))
    assert not PAPER["3"].rejects_early(sketch(1.01 * limit))
    assert not PAPER["3"].rejects_early(sketch(0.0, status=Status.NOT_CONVERGED))
    assert not PAPER["3"].rejects_early(sketch(END, status=Status.COMPLETE))


def test_a_stand_in_that_bursts_long_before_the_jump_rules_out_a_second_hold():
    limit = (JUMP + 5.0) / BURST_TIME_FACTOR
    assert PAPER["4"].rejects_early(sketch(0.99 * limit))
    assert not PAPER["4"].rejects_early(sketch(1.01 * limit))


@pytest.mark.parametrize("growths", [(0.0, 0.0), (1e-5, 3e-5), (0.1, 0.0)])
def test_little_growth_rules_nothing_out(growths):
    """A stress of 27 times sinh's scale: .00001 mm of the stand-in were .022 mm of the dimple, whose edge yields."""
    assert not PAPER["4"].rejects_early(sketch(growths=growths, status=Status.COMPLETE))


def test_without_a_number_of_seconds_a_burst_rules_nothing_out():
    full = {c.name: c for c in conditioned_criteria(NORTON, ck.specimen("bulge"), END)}["full history"]
    assert not full.rejects_early(sketch(1.0))


# ---- a design ------------------------------------------------------------------------------------------------------


def few(screened, rows=24):
    """Few rows of the paper's sampling domain of Norton's law, at three times, its stresses high."""
    design = replace(sampling_design(NORTON, DIMPLE, "paper", every=21600.0), screened=screened)
    return simulate_rows(design, empty_dataset(design, DIMPLE, {}), 1, 0, rows)


@pytest.fixture(scope="module")
def all_simulated():
    return few(screened=False)


@pytest.fixture(scope="module")
def some_simulated():
    return few(screened=True)


def test_what_was_ruled_out_is_rejected_when_it_is_simulated(all_simulated, some_simulated):
    left_out = (some_simulated.status < 0) & (all_simulated.status >= 0)
    assert left_out.sum() >= 3
    assert (all_simulated.reasons[left_out] > 0).all()
    assert (some_simulated.reasons[left_out] > 2).all()
    assert np.isnan(some_simulated.values[left_out]).all()
    others = ~left_out
    np.testing.assert_array_equal(some_simulated.reasons[others], all_simulated.reasons[others])
    np.testing.assert_array_equal(some_simulated.values[others], all_simulated.values[others])


def test_unscreened_every_draw_that_passes_is_simulated(all_simulated):
    before = (all_simulated.reasons == 1) | (all_simulated.reasons == 2)
    np.testing.assert_array_equal(all_simulated.status < 0, before)


def test_the_description_says_how_many_were_not_simulated(some_simulated):
    third = some_simulated.reasons == 3
    unseen = int((third & (some_simulated.status < 0)).sum())
    assert unseen > 0
    told = f"{third.sum()} rejected: criterion 3, simulation converged and lasted 1 h; "
    told += "not simulated" if unseen == third.sum() else f"{unseen} of them not simulated"
    assert told in str(some_simulated)


def test_whether_samples_are_screened_decides_what_a_generation_is(tmp_path):
    both = [replace(sampling_design(NORTON, DIMPLE, "paper"), screened=screened) for screened in (True, False)]
    assert [design.document()["screened"] for design in both] == [True, False]
    prints = {GenerationJob(design, DIMPLE, 1, tmp_path).fingerprint for design in both}
    assert len(prints) == 2


class Misled:
    """A stand-in that a law of a plugin makes fail."""

    def predict(self, law, theta, histories):
        raise ZeroDivisionError("of no use")


@dataclass(frozen=True)
class Fragile(type(ck.specimen("uniaxial"))):
    """A bar with a stand-in that fails."""

    def reduced_order_model(self):
        return Misled()


def test_a_stand_in_that_fails_leaves_it_to_the_simulation():
    bar = Fragile()
    assert isinstance(bar, SupportsReducedOrderModel)
    design = sampling_design(NORTON, bar, "paper", every=21600.0)
    found = simulate_rows(design, empty_dataset(design, bar, {}), 1, 0, 16)
    assert not found.failures
    np.testing.assert_array_equal(found.status >= 0, (found.reasons == 0) | (found.reasons > 2))
