"""A damage law in the dimple: finite elements with an internal variable, to rupture."""

import numpy as np

import creepkit as ck
from creepkit.records import Status

VALUES = {"A": 1e-14, "n": 4.0, "B": 1e-13, "p": 4.0, "q_2": 3.0, "alpha": 0.5}
TIMES = np.geomspace(60.0, 1e6, 12)
PRESSED = dict(elastic=ck.Elastic(E=150e3), loading=ck.PressureJump(P1=8, P2=8, Tj=3600), times=TIMES)


def test_rupture_ends_the_test_with_its_reason() -> None:
    """The frames before it are kept; damage is not felt at first and only ever adds to the deflection."""
    law = ck.law("liu-murakami")
    run = ck.simulate(law, "bulge", VALUES, **PRESSED)
    sound = law.fix(B=0)
    steady = ck.simulate(sound, "bulge", {name: VALUES[name] for name in sound.names}, **PRESSED)

    assert run.status is Status.BURST
    assert "internal variable" in run.reason
    assert "limit" in run.reason
    assert run.times[-1] <= run.end_time < steady.end_time
    both = run.times.size
    more = run.outputs["amplitude"] / steady.outputs["amplitude"][:both]
    assert (run.times == TIMES[:both]).all()
    assert abs(more[0] - 1) < 0.01
    assert (np.diff(more) > 0).all()
    assert more[-1] > 1.02
