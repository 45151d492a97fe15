"""Damage laws in the dimple: finite elements with an internal variable, to rupture."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.records import Status

TIMES = np.geomspace(60.0, 1e6, 12)
PRESSED = dict(elastic=ck.Elastic(E=150e3), loading=ck.PressureJump(P1=8, P2=8, Tj=3600), times=TIMES)
POWERS = {"A": 1e-14, "n": 4.0, "B": 1e-13, "alpha": 0.5}
VALUES = {
    "kachanov-rabotnov": {**POWERS, "chi": 4.0, "phi": 5.0, "m": 0.0},
    "liu-murakami": {**POWERS, "p": 4.0, "q_2": 3.0},
    "sinh-damage": {
        **{"A": 1e-9, "s_s": 30.0, "lambda_": 5.0, "M": 1e-5, "s_t": 120.0, "chi": 3.0, "phi": 4.0},
        **{"alpha": 0.5, "beta": 0.0},
    },
}


@pytest.mark.parametrize("name", VALUES)
def test_rupture_ends_the_test_with_its_reason(name: str) -> None:
    """The frames before it are kept; damage is not felt at first and only ever adds to the deflection."""
    law, values = ck.law(name), VALUES[name]
    run = ck.simulate(law, "bulge", values, **PRESSED)
    sound = law.fix(**{"M" if name == "sinh-damage" else "B": 0})
    steady = ck.simulate(sound, "bulge", {name: values[name] for name in sound.names}, **PRESSED)

    assert run.status is Status.RUPTURED
    assert "internal variable" in run.reason
    assert "limit" in run.reason
    assert run.times[-1] <= run.end_time < steady.end_time
    more = run.outputs["amplitude"] / steady.outputs["amplitude"][: run.times.size]
    assert (run.times == TIMES[: run.times.size]).all()
    assert abs(more[0] - 1) < 0.01
    assert (np.diff(more) > -1e-5).all()
    assert more[-1] > 1.01
