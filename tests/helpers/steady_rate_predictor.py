"""A closed-form predictor for laws without memory at constant stress: strain = rate x time, and planted tests."""

from collections.abc import Mapping, Sequence

import numpy as np

from creepkit.kernels import lower
from creepkit.language import CreepLaw
from creepkit.records import History, Prediction, Predictor, constant_stress


class Steady(Predictor):
    """Predictor: strain = rate(stress, temperature) x time, with exact derivatives."""

    name = "steady"
    outputs = ("strain",)

    def predict_batch(self, law, theta, histories, nuisances, sensitivities):
        kernel, count, values = lower(law, "numpy"), len(theta), law.from_internal(theta)
        shape = (count, len(histories), max(h.times.size for h in histories), 1)
        strain, slope = np.full(shape, np.nan), np.full((*shape, len(law.names)), np.nan)
        for k, h in enumerate(histories):
            stress, T = h.loading.program().values[0], h.temperature
            found = kernel.derivatives(values, stress=stress, temperature=T)
            size = h.times.size
            strain[:, k, :size, 0] = np.broadcast_to(found.rate, (count,))[:, None] * h.times
            for p, name in enumerate(law.names):
                slope[:, k, :size, 0, p] = np.broadcast_to(found.params[name], (count,))[:, None] * h.times
        lengths = np.array([h.times.size for h in histories])
        ends = np.full((count, len(histories)), np.inf)
        status = np.zeros((count, len(histories)), np.int64)
        return Prediction(strain, ("strain",), lengths, status, ends, slope if sensitivities else None)


def planted(
    law: CreepLaw, values: Mapping[str, float], conditions: Sequence[tuple[float, float]], *, seed: int,
    rate: float = 0.0, offset: float = 0.0, noise: float = 0.0, frames: int = 40, end: float = 0.02,
) -> list[History]:  # fmt: skip
    """Tests at (stress MPa, temperature K) up to the strain `end`, with scatter of the sizes given."""
    rng = np.random.default_rng(seed)
    tests = []
    for stress, T in conditions:
        own = float(lower(law, "numpy").rate(values, stress=stress, temperature=T)) * np.exp(rng.normal(0, 1) * rate)
        times = np.geomspace(1e-2, 1, frames) * end / own
        strain = own * times + rng.normal(0, 1) * offset + rng.normal(0, 1, frames) * noise
        tests.append(
            History(
                f"{stress:g}MPa_{T:g}K_{len(tests)}", times, {"strain": strain}, constant_stress(stress, "stress"), T
            )
        )
    return tests
