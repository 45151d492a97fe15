"""A law whose rate jumps in stress ends a dimple, and the run says so: a point on the jump has no equilibrium."""

import numpy as np
import pytest
from sympy import Piecewise, tanh

import creepkit as ck
from creepkit.kernels.rate_jumps import find_rate_jump
from creepkit.language import stress

A, n = ck.parameters("A n")


def law(factor, name="jump"):
    return ck.CreepLaw(
        name=name,
        title="Norton with a factor",
        terms={"power law": A * stress**n * factor},
        params={A: ck.Param("rate coefficient", (1e-40, 1e-5), "1/s", "log"), n: ck.Param("stress exponent", (1, 8))},
        references=("Norton (1929), The Creep of Steel at High Temperatures",),
    )


def run(chosen):
    return ck.simulate(
        chosen,
        ck.specimen("bulge").replace(threads=1),
        {"A": 1e-15, "n": 4.0},
        loading=ck.PressureJump(8.0, 10.0, 2e4),
        times=np.linspace(100.0, 4e4, 20),
        elastic=ck.Elastic(150e3),
    )


def test_a_jump_in_stress_is_the_reason() -> None:
    """Of the factor 10 at 80 MPa: A 80^4 = 4.1e-8 below, ten times that above."""
    found = run(law(Piecewise((1, stress < 80), (10, True))))

    assert found.status is ck.Status.NOT_CONVERGED
    assert "the law's creep rate jumps from 4.1e-08 to 4.1e-07 1/s at a stress of 80 MPa" in found.reason
    assert "blend them" in found.reason


def test_the_same_factor_blended_is_solved() -> None:
    found = run(law(1 + 9 * (1 + tanh((stress - 80) / 5)) / 2, "blended"))

    assert found.status is ck.Status.COMPLETE


@pytest.mark.parametrize("factor", [0.1, 1.01, 10.0])
def test_a_jump_is_found_to_its_place_and_size(factor: float) -> None:
    jump = find_rate_jump(lambda s: 5 * np.log(s) + np.where(s < 77.7, 0.0, np.log(factor)), 1e-3, 2e3)

    assert jump is not None
    assert jump.place == pytest.approx(77.7, rel=1e-9)
    assert np.exp(jump.after - jump.before) == pytest.approx(factor, rel=1e-6)


@pytest.mark.parametrize("power", [1.0, 3.0, 40.0])
def test_steep_slopes_and_kinks_are_no_jumps(power: float) -> None:
    def kinked(places):
        with np.errstate(divide="ignore"):
            return power * np.log(np.maximum(places - 50.0, 0.0))

    assert find_rate_jump(kinked, 1e-3, 2e3) is None
    assert find_rate_jump(lambda places: power * np.log(places), 1e-3, 2e3) is None
