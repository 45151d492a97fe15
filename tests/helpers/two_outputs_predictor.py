"""A closed-form predictor of two outputs with linear transforms, and tests of bars that it would measure."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from creepkit.records import History, Predictor
from helpers.steady_rate_predictor import Steady

GAIN = {"amplitude": 40.0, "width": -100.0}
"""mm per unit of strain."""


class TwoOutputs(Predictor):
    """Predictor: amplitude = 40 mm x strain, and width = 3 mm - 100 mm x strain, with exact derivatives."""

    name = "two outputs"
    outputs = tuple(GAIN)

    def predict_batch(self, law, theta, histories, nuisances, sensitivities):
        found = Steady().predict(law, theta, histories, sensitivities=True)
        gain, base = np.array([*GAIN.values()]), np.array([0.0, 3.0])
        slope = found.jacobian * gain[:, None] if sensitivities else None
        return replace(found, values=base + found.values * gain, outputs=self.outputs, jacobian=slope)


def with_two_outputs(
    tests: Sequence[History], noise: Mapping[str, float], *, seed: int, stated: bool = True
) -> list[History]:
    """The tests of strains (frames,) with these outputs in their place, white noise in mm added."""
    rng, made = np.random.default_rng(seed), []
    for test in tests:
        strain = test.outputs["strain"]
        outputs = {name: base + GAIN[name] * strain for name, base in (("amplitude", 0.0), ("width", 3.0))}
        outputs = {name: y + noise[name] * rng.normal(size=y.size) for name, y in outputs.items()}
        sd = {name: np.full(strain.size, noise[name]) for name in outputs} if stated else {}
        made.append(test.replace(outputs=outputs, standard_deviation=sd))
    return made
