"""Strain of loading that nothing states: planted jumps are questioned, primary creep of ordinary laws is not."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.quality.loading_strain import unstated_loading_strain

HOURS = {
    "dense": np.r_[0.0, np.geomspace(0.01, 500, 80)],
    "sparse": np.r_[0.0, np.geomspace(1, 500, 25)],
    "even": np.r_[0.0, np.arange(1, 500, 3.0)],
    "dense first": np.r_[0.0, 0.02, 0.04, 0.06, 0.08, 0.1, 1, np.arange(2, 400, 2.0)],
}


CURVES = {
    "cube root": lambda t: 2e-3 * t ** (1 / 3) + 1e-5 * t,
    "strain hardening, m = -0.5": lambda t: 1e-3 * t ** (1 / 1.5),
    "strain hardening, m = -2": lambda t: 2e-3 * t ** (1 / 3),
    "quarter power": lambda t: 2e-3 * t**0.25,
    "steady": lambda t: 1e-5 * t,
    "saturating": lambda t: 5e-3 * (1 - np.exp(-t / 20)) + 1e-5 * t,
    "logarithmic": lambda t: 1e-3 * np.log(1 + t / 0.1),
    "to rupture": lambda t: 2e-3 * t ** (1 / 3) + 0.01 * np.expm1(t / 300),
}


def history(hours, strain, **fields):
    return ck.History(
        times=hours * 3600, outputs={"strain": strain}, loading=ck.StressSteps(((0.0, 145.0),)), temperature=923.15,
        specimen="uniaxial", name="x", **fields,
    )  # fmt: skip


@pytest.mark.parametrize("noise", [0.0, 2e-5, 1e-4])
@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.parametrize("frames", HOURS)
def test_primary_creep_is_not_questioned(frames, curve, noise):
    hours = HOURS[frames]
    strain = CURVES[curve](hours) + noise * np.random.default_rng(3).standard_normal(hours.size) * (hours > 0)
    assert unstated_loading_strain(history(hours, strain)) is None


@pytest.mark.parametrize("noise", [0.0, 2e-5])
def test_a_jump_is_questioned(noise):
    hours = np.r_[0.0, 0.05, 0.2, 0.5, np.geomspace(1, 250, 25)]
    creep = 2.75e-4 * hours ** (1 / 1.4)
    scatter = noise * np.random.default_rng(3).standard_normal(hours.size) * (hours > 0)
    total = history(hours, creep + 1.38e-3 * (hours > 0) + scatter)
    (flag,) = [one for one in ck.check_data_quality([total]) if one.kind == "loading"]
    assert flag.frames == (1,)
    assert "looks like loading strain; state loading_strain_pct" in str(flag)
    assert unstated_loading_strain(total.replace(labels={"loading_strain": "0.00138"})) is None
    # 145 MPa over 165 GPa is 0.088 %: 0.05 % of the jump is plastic; a record with the elastic part alone is sound
    stiff = ck.Elastic(165e3)
    assert unstated_loading_strain(total.replace(elastic=stiff, includes_elastic=True)) is not None
    elastic = history(hours, creep + 145 / 165e3 * (hours > 0) + scatter, elastic=stiff, includes_elastic=True)
    assert unstated_loading_strain(elastic) is None


def test_a_fit_says_what_it_took_for_creep():
    hours = np.r_[0.0, 0.05, 0.2, 0.5, np.geomspace(1, 250, 25)]
    total = history(hours, 2.75e-4 * hours ** (1 / 1.4) + 1.38e-3 * (hours > 0))
    law = ck.law("strain-hardening").fix(n=5.0)
    assert any("looks like loading strain" in note for note in ck.identify(law, [total], starts=1).notes)
