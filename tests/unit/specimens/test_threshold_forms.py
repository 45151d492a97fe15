"""A threshold written with Max or with Piecewise is one law: every specimen and reduced model predicts the same."""

import numpy as np
import pytest
import sympy

import creepkit as ck


def threshold(form: str) -> ck.CreepLaw:
    A, n, s0 = ck.parameters("A n s0")
    excess = (
        sympy.Max(ck.stress - s0, 0) if form == "Max" else sympy.Piecewise((ck.stress - s0, ck.stress > s0), (0, True))
    )
    return ck.CreepLaw(
        name="threshold",
        title="A stress below which nothing creeps",
        terms={"threshold": A * excess**n},
        params={
            A: ck.Param("rate coefficient", unit="1/s", bounds=(1e-30, 1e-3), scale="log", off=0.0),
            n: ck.Param("stress exponent", bounds=(1, 10)),
            s0: ck.Param("threshold stress", unit="MPa", bounds=(0, 100)),
        },
    )


PRESSURES = ck.History(
    "dimple", np.linspace(100, 14400, 9), {}, ck.PressureJump(8, 10, 7200), 1073.0, "bulge", ck.Elastic(150e3)
)
BAR = ck.History("bar", np.linspace(100, 14400, 9), {}, ck.constant_stress(60.0), 1073.0)


@pytest.mark.parametrize(
    ("using", "history"),
    [(ck.specimen("bulge"), PRESSURES), (ck.specimen("bulge").reduced_order_model(), PRESSURES),
     (ck.specimen("uniaxial"), BAR)],
    ids=["finite elements", "reduced-order model", "bar"],
)  # fmt: skip
def test_both_forms_predict_the_same(using: ck.Predictor, history: ck.History) -> None:
    one, other = (
        using.predict(law, law.to_internal({"A": 1e-12, "n": 3.0, "s0": 40.0}), [history]).of(0)
        for law in map(threshold, ("Max", "Piecewise"))
    )
    assert np.ptp(one[:, 0]) > 0
    np.testing.assert_allclose(other, one, rtol=1e-12)
