"""What a rig can make: grids of planned tests, and what it refuses."""

import copy
import pickle

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import FitError
from creepkit.experiments.candidate_tests import frame_times, grid_of_rig
from creepkit.experiments.rig import Rig, rigs_of
from creepkit.laws.norton import NORTON
from creepkit.records import PressureJump
from creepkit.specimens.bulge.specimen import Bulge
from helpers.log_rate_predictor import END, LogRates, measured

TRUTH = {"A": float(np.exp(-15.0 - 5.0 * np.log(50.0))), "n": 5.0}
APEX = Bulge().geometry.apex_thickness


def bars_made(*stresses):
    return measured(NORTON, TRUTH, stresses, sd=0.2)


def dimple(**changes):
    return bars_made(50.0)[0].replace(loading=PressureJump(8.0, 10.0, 14400.0), specimen="bulge", **changes)


def test_a_rig_can_do_a_little_more_than_what_it_did():
    (rig,) = rigs_of(bars_made(40.0, 60.0), LogRates())
    assert rig.levels == pytest.approx((0.7 * 40.0, 1.4 * 60.0))
    assert rig.longest_hours == pytest.approx(2.0 * END / 3600.0)
    assert rig.temperatures == (1000.0,)
    assert rig.dimensions == {}
    (bulge,) = rigs_of([dimple()], Bulge())
    assert bulge.dimensions["apex_thickness"] == pytest.approx((0.9 * APEX, APEX, 1.1 * APEX))
    (stated,) = rigs_of([dimple(geometry={"apex_thickness": h}) for h in (0.44, 0.58)], Bulge())
    assert stated.dimensions["apex_thickness"] == (0.44, 0.58)
    assert pickle.loads(pickle.dumps(stated)) == stated
    assert copy.deepcopy(stated) == stated


def test_a_grid_holds_levels_changes_durations_and_dimples():
    rig = Rig("bulge", (4.0, 14.0), 12.0, (1000.0,), {"apex_thickness": (0.44, 0.5, 0.58)}, tests_per_run=3)
    found = grid_of_rig(rig, dimple())
    levels = {float(v) for c in found for h in c.histories for v in h.loading.program().values if v > 0}
    assert (min(levels), max(levels)) == (4.0, 14.0)
    assert max(c.hours for c in found) == pytest.approx(13.0)  # and an hour to set it up
    assert {len(c.histories) for c in found} == {1, 2, 3}
    assert all(c.histories[0].outputs == {} for c in found)
    assert any("a test piece of apex thickness 0.44 mm at 4 MPa" in c.description for c in found)
    assert any("3 test pieces of apex thickness 0.44, 0.5 and 0.58 mm" in c.description for c in found)
    assert len({c.description for c in found}) == len(found)
    short = grid_of_rig(rig, dimple(), budget=4.0)
    assert max(c.hours for c in short) == pytest.approx(4.0)
    with pytest.raises(FitError, match="a budget of 0.5 h leaves no time for a test beside 1 h"):
        grid_of_rig(rig, dimple(), budget=0.5)


def test_temperatures_are_varied_where_the_laws_know_them():
    rig = Rig("uniaxial", (40.0, 80.0), 10.0, (1000.0, 1050.0))
    (base,) = bars_made(50.0)
    assert {c.histories[0].temperature for c in grid_of_rig(rig, base)} == {1000.0, 1050.0}
    assert {c.histories[0].temperature for c in grid_of_rig(rig, base, by_temperature=False)} == {1000.0}


def test_frames_come_at_the_interval_of_the_rig():
    assert frame_times(3600.0, 60.0).size == 60
    assert frame_times(3600.0, 100.0)[0] == pytest.approx(100.0)
    assert frame_times(3600.0, 900.0).size == 8
    assert frame_times(1e6, 60.0).size == 60


def test_any_load_is_varied_in_its_unit_after_the_ramp_that_was_made():
    base = ck.History(
        "beam", np.linspace(3600.0, 36000.0, 10), {}, ck.constant_load("force", 200.0, ramp=30.0), 1000.0,
        "three-point-bend", ck.Elastic(150e3),
    )  # fmt: skip
    found = grid_of_rig(Rig("three-point-bend", (100.0, 400.0), 20.0, (1000.0,)), base)
    assert any(c.description.startswith("400 N for ") for c in found)
    assert any("100 N to " in c.description and " h, then 141 N to " in c.description for c in found)
    for candidate in found:
        loading = candidate.histories[0].loading
        assert loading.quantity == "force"
        assert loading.program().values[0] == 0.0
        assert loading.program().times[1] == 30.0
