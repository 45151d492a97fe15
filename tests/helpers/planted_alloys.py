"""Small planted alloys whose tests cost next to nothing: bars at several stresses, and made-up bulge histories."""

import os
from dataclasses import dataclass

import numpy as np

import creepkit as ck
from creepkit.language import Elastic
from creepkit.records import History, Predictor, PressureJump, constant_stress

TIMES = np.geomspace(60.0, 2e5, 40)
NORTON = {"A": 2e-16, "n": 4.6}


def bars(alloy, stresses=(60.0, 80.0, 110.0), values=NORTON, seed=1):
    """Tests of one alloy that obeys Norton's law, a bar a stress, with 2 % of noise."""
    rng = np.random.default_rng(seed)
    return [_bar(f"{alloy}-{stress:g}", alloy, stress, values, rng) for stress in stresses]


def _bar(name, alloy, stress, values, rng):
    run = ck.simulate("norton", "uniaxial", values, loading=constant_stress(stress, control="stress"), times=TIMES)
    noisy = run.outputs["strain"] * (1.0 + 0.02 * rng.standard_normal(TIMES.size))
    return History(name, TIMES, {"strain": noisy}, run.loading, run.temperature, "uniaxial", alloy=alloy)


@dataclass(frozen=True)
class Deadly(Predictor):
    """A predictor that takes its process with it."""

    name: str = "deadly"
    outputs: tuple[str, ...] = ("strain",)

    def predict_batch(self, law, theta, histories, nuisances, sensitivities):
        os._exit(3)


def bulge(name="dimple", alloy="", rise=0.2, noise=0.0015, outputs=("amplitude", "width", "shape"), seed=0):
    """A made-up bulge history: 58 um at 8 MPa and 72 um at 10 MPa, and a creep of `rise` mm over all of it."""
    times = np.arange(150.0, 4 * 3600 + 1, 150.0)
    rng, late = np.random.default_rng(seed), times > 7200
    clean = {
        "amplitude": np.where(late, 0.072, 0.058) + rise * (times / times[-1]) ** 0.8,
        "width": np.full(times.size, 3.8),
        "shape": np.full(times.size, 2.2),
    }
    sd = {"amplitude": noise, "width": 0.02, "shape": 0.02}
    rows = {key: clean[key] + sd[key] * rng.standard_normal(times.size) for key in outputs}
    return History(name, times, rows, PressureJump(8.0, 10.0, 7200.0), 1073.15, "bulge", Elastic(150e3), alloy=alloy)
