"""Bars under tension with white noise of a stated size, by the uniaxial specimen."""

from collections.abc import Mapping, Sequence

import numpy as np

from creepkit.language import CreepLaw
from creepkit.records import History, Loading
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
    rng, times = np.random.default_rng(seed), np.geomspace(1e-3, 1.0, frames) * END
    blank = [History(f"bar {k}", times, {"strain": 0 * times}, one, 1000.0) for k, one in enumerate(loadings)]
    found = BAR.predict(law, law.to_internal(values), blank)
    sd = {"strain": np.full(frames, noise)}
    return [
        h.replace(outputs={"strain": found.of(k)[:, 0] + rng.normal(size=frames) * noise}, standard_deviation=sd)
        for k, h in enumerate(blank)
    ]
