"""Bars under tension with white noise of a stated size, by the uniaxial specimen."""

from collections.abc import Mapping, Sequence

import numpy as np

from creepkit.language import CreepLaw
from creepkit.records import History, Loading, Predictor
from creepkit.specimens.uniaxial import Uniaxial

BAR = Uniaxial()
END = 1e5
"""s."""
N, M = 4.0, -0.3
SPL = {"A": 0.02**1.3 / 1.3 / END / 50.0**N, "n": N, "m": M}
"""Strain hardening that reaches a strain of .02 at 50 MPa: strain^(1-m) = (1-m) A stress^n t."""


def bars(
    law: CreepLaw,
    values: Mapping[str, float],
    loadings: Sequence[Loading],
    *,
    seed: int,
    noise: float = 2e-5,
    frames: int = 30,
) -> list[History]:
    """One test for each loading."""
    times = np.geomspace(1e-3, 1.0, frames) * END
    blank = [History(f"bar {k}", times, {"strain": 0 * times}, one, 1000.0) for k, one in enumerate(loadings)]
    return carried_out(BAR, law, values, blank, noise=noise, seed=seed)


def carried_out(
    predictor: Predictor, law: CreepLaw, values: Mapping[str, float], planned: Sequence[History], *,
    seed: int, noise: float = 2e-5,
) -> list[History]:  # fmt: skip
    """Planned tests with the first output that the law predicts, and noise of a size that is stated."""
    rng, found = np.random.default_rng(seed), predictor.predict(law, law.to_internal(values), planned)
    return [
        h.replace(
            outputs={predictor.outputs[0]: found.of(k)[:, 0] + rng.normal(size=h.times.size) * noise},
            standard_deviation={predictor.outputs[0]: np.full(h.times.size, noise)},
        )
        for k, h in enumerate(planned)
    ]
