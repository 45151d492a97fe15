"""The planted plate: what it is mixed from, what it is drawn around, and that it is what it says."""

import csv
import sys

import numpy as np
import pytest

import creepkit as ck
from creepkit.inverse.reference_conditions import frame_noise
from creepkit.screening.alloys import read_compositions
from helpers.paths import EXAMPLES

sys.path.append(str(EXAMPLES))
from planted_plate import FIGURE_7A, mix_base_alloys, planted_plate


@pytest.fixture(scope="module")
def planted():
    return planted_plate(2)


def test_a_mixture_of_one_is_that_base_and_mixes_by_weight():
    """Half IN625 and half 316L have (21.5 + 17) / 2 wt.% of chromium and (2 + 66.48) / 2 of iron."""
    pure, half = mix_base_alloys({"Haynes 25": 1.0}), mix_base_alloys({"IN625": 0.5, "316L": 0.5})
    assert max(pure, key=pure.__getitem__) == "Co"
    assert half["Cr"] / half["Fe"] == pytest.approx((38.5 / 51.996) / (68.48 / 55.845), rel=1e-6)
    assert sum(half.values()) == pytest.approx(100.0)


def test_the_three_laws_are_those_of_the_caption_of_figure_7():
    """Rates at 100 MPa and a strain of .01, from the equations as they are printed there."""
    rates = {
        "hyperbolic-sine": 3.16e-7 * np.sinh(100 / 87.16) ** 4.15,
        "strain-hardening": 5.5e-14 * 100**3.28 * 0.01**-0.32,
        "norton": 1.2e-16 * 100**5.2,
    }
    from creepkit.kernels import lower

    for name, values in FIGURE_7A.items():
        told = lower(ck.law(name), "numpy").rate(values, stress=100.0, strain=0.01)
        assert float(told) == pytest.approx(rates[name], rel=1e-12)


def test_tests_are_noisy_as_measured_and_rise_visibly(planted):
    for history in planted.histories:
        for name, sd in {"amplitude": 0.0015, "width": 0.02, "shape": 0.02}.items():
            assert frame_noise(history, name) == pytest.approx(sd, rel=0.2)
        assert 0.2 < history.outputs["amplitude"][-1] < 1.5


def test_the_files_read_back_as_they_were(planted, tmp_path):
    tests, compositions = planted.write(tmp_path)
    for found, one in zip(ck.read_histories(tests), planted.histories, strict=True):
        assert (found.alloy, found.geometry) == (one.alloy, one.geometry)
        np.testing.assert_array_equal(found.outputs["amplitude"], one.outputs["amplitude"])
    assert read_compositions(compositions).class_of("A01") == planted.compositions.class_of("A01")
    with (tmp_path / "truth.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [row["law"] for row in rows] == [t.law for t in planted.truth.values()]
