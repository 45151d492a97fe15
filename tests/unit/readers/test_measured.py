"""Measured curves that lie beside the checkout; the numbers here were retyped from the files."""

from collections import Counter

import numpy as np
import pytest

from creepkit.quality.repeats import duplicate_tests
from creepkit.readers.reading import creepkit_readers, read_histories
from creepkit.records import History, PressureJump
from helpers.paths import SHARED, needs_shared_data

DATA = SHARED
pytestmark = needs_shared_data


def read(folder: str) -> dict[str, History]:
    return {history.name: history for history in read_histories(DATA / folder, creepkit_readers())}


@pytest.fixture(scope="module")
def alloy617() -> dict[str, History]:
    return read("uniaxial/alloy617")


def test_alloy_617_is_complete(alloy617):
    assert len(alloy617) == 94
    assert {round(h.temperature - 273.15) for h in alloy617.values()} == {750, 800, 850, 900, 950, 1000}
    stresses = {history.loading.steps[0][1] for history in alloy617.values()}
    assert (min(stresses), max(stresses)) == (11.0, 137.0)
    products = Counter((h.labels["environment"], h.labels["product"]) for h in alloy617.values())
    assert products == {("Air", "Base"): 63, ("He", "Base"): 21, ("Air", "Weld"): 10}
    assert {h.alloy for h in alloy617.values()} == {"alloy617"}
    assert {(h.strain_measure, h.loading.control) for h in alloy617.values()} == {("engineering", "load")}


def test_alloy_617_spot_values(alloy617):
    coldest = alloy617["inl_1/AirBase_1000_11_G39"]
    assert (coldest.temperature, coldest.elastic.E) == (1273.15, 139000.0)
    assert (coldest.times[1], coldest.outputs["strain"][1]) == (8460.0, 0.000261)
    noisy = alloy617["inl_2/AirBase_750_137_b"]
    assert (noisy.times[2], noisy.outputs["strain"][2]) == (111.6, -0.00155)


def test_how_the_tests_of_alloy_617_ended(alloy617):
    """Its index says of 71 that they ruptured, of one that it was discontinued, nothing of the first laboratory's."""
    assert Counter((h.rupture_time is not None, h.unruptured) for h in alloy617.values()) == {
        (True, False): 71,
        (False, True): 1,
        (False, False): 22,
    }
    assert {h.name.split("/")[0] for h in alloy617.values() if not h.end_known} == {"inl_1"}
    broken = alloy617["kaeri_1/AirBase_900_25_a"]
    assert broken.rupture_time == broken.times[-1]
    assert alloy617["inl_2/AirBase_950_19_a"].unruptured


def test_cmsx_6():
    curves = read("uniaxial/cmsx6")
    assert len(curves) == 9
    assert Counter(h.loading.steps[0][1] for h in curves.values()) == {140.0: 3, 170.0: 2, 200.0: 2, 230.0: 2}
    assert {round(h.temperature, 6) for h in curves.values()} == {1253.15}
    first = curves["Vh5205_C-78"]
    np.testing.assert_allclose(first.times[[1, -1]], [0.0013 * 3600, 78.6658 * 3600], rtol=1e-14)
    np.testing.assert_allclose(first.outputs["strain"][[1, -1]], [7.1e-5, 0.276661], rtol=1e-14)
    assert (first.rupture_time, first.labels["elastic_ext_pct"]) == (pytest.approx(78.7 * 3600), "0.274")
    assert curves["Vh5205_C-85"].unruptured
    assert [h.rupture_time is None for h in curves.values()].count(True) == 3
    assert duplicate_tests(list(curves.values())) == []


def test_inconel_625_bulges():
    tests = read("dabi/in625")
    assert sorted(tests) == [f"test_{k:02d}" for k in (1, 2, 3, 4, 6, 8, 9, 11, 12)]
    assert {history.specimen for history in tests.values()} == {"bulge"}
    assert all(isinstance(history.loading, PressureJump) for history in tests.values())
    first, jumped = tests["test_01"], tests["test_11"]
    assert first.loading == PressureJump(8.0, 8.0, 10800.0)
    assert (jumped.loading.P1, jumped.loading.P2, jumped.loading.Tj) == pytest.approx((8.0, 10.0, 14580.0))
    assert (first.temperature, first.elastic.E) == (pytest.approx(988.91), pytest.approx(108425.0))
    assert [first.outputs[name][0] for name in ("amplitude", "width", "shape")] == [0.069047753, 3.6917447, 1.98580857]
    assert first.labels["specimen"] == "dimple bulge, wrought Inconel 625"


def test_alloy_617_readings_of_one_time_are_merged(alloy617):
    merged = [history.labels.get("merged_frames") for history in alloy617.values()]
    assert Counter(merged) == {None: 84, "1": 10}
    ruptured = alloy617["inl_2/AirBase_750_118_a"]  # at 12040600 s: 0.21372, then 0.22174
    assert (ruptured.times[-1], ruptured.outputs["strain"][-1]) == (12040600.0, pytest.approx(0.21372, abs=1e-12))
    repeated = alloy617["kaeri_2/HeBase_850_50_b"]  # 0.34191 twice
    assert repeated.outputs["strain"][-1] == pytest.approx(0.34191, abs=1e-12)


def test_alloy_617_holds_four_tests_twice(alloy617):
    found = duplicate_tests(list(alloy617.values()))
    assert found == [(f"kaeri_2/AirBase_900_{s}_a", f"kaeri_3/AirBase_900_{s}_a") for s in (25, 40, 45, 50)]
    for one, two in (map(alloy617.get, pair) for pair in found):  # they agree all along, though thinned differently
        times = np.linspace(0.2, 0.9, 8) * one.times[-1]
        strains = [np.interp(times, test.times, test.outputs["strain"]) for test in (one, two)]
        np.testing.assert_allclose(*strains, rtol=0.01)


def test_frames_of_the_unloading_bulges_are_not_used():
    after = {name: history.times[~history.used].tolist() for name, history in read("dabi/in625").items()}
    assert (after.pop("test_11"), set(map(tuple, after.values()))) == ([28950.0, 29100.0], {(14550.0,)})
