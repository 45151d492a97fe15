"""What a global search sees: the cost of a law's candidates against the histories, and what a search is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.fences import Fences
from creepkit.inverse.objective import Objective
from creepkit.inverse.search.box import Box
from creepkit.inverse.search.refining import Minimum, Progress, refine
from creepkit.inverse.settings import Settings

if TYPE_CHECKING:
    from creepkit.inverse.search.trace import Trace
    from creepkit.inverse.sparsity.penalised import Penalised

WORST = 1e12
"""Cost of a candidate that cannot be predicted at all."""


@dataclass(frozen=True)
class Landscape:
    """The cost of conditioned coordinates u, with the unknowns of tests at their means.

    objective : residuals of the predictor that is searched; factor : (tests, entries, entries) Cholesky factors of
    the covariance by which they are weighed, broad and fixed; loss : of white residuals, scipy's names.
    """

    objective: Objective
    box: Box
    factor: Floats
    settings: Settings
    penalty: Penalised | None = None
    loss: str = "linear"

    def cost(self, u: Floats) -> Floats:
        """(candidates,) half the sum of squared white residuals, walls and penalty; u : (candidates, parameters).

        All candidates and histories are one prediction. Finite, whatever happens to a candidate.
        """
        inside = self.box.clip(u)
        white = self.white(self.objective.screen(inside))
        total = 0.5 * rho(white**2, self.loss).sum(axis=1)
        total += 0.5 * (self._fences.values(inside) ** 2).sum(axis=1)
        if self.penalty is not None:
            total += self.penalty.values(inside)
        return np.where(np.isfinite(total), total, WORST)

    @cached_property
    def _fences(self) -> Fences:
        return Fences(self.objective)

    def white(self, misfit: Floats) -> Floats:
        """(candidates, data) white residuals of residuals (candidates, tests, entries)."""
        found = np.linalg.solve(self.factor, np.moveaxis(misfit, 0, -1))
        return np.asarray(found[self.objective.entries.present].T)

    def refine(
        self, u: Floats, steps: int = 30, tolerance: float = 1e-5, held: Mapping[int, float] | None = None
    ) -> Minimum:
        """Bounded least squares from u; held : {position: value} of coordinates that stay where they are."""
        return refine(
            self.objective, self.box, self.factor, u, loss=self.loss, steps=steps, tolerance=tolerance,
            extra=self.penalty, held=held,
        )  # fmt: skip


def rho(z: Floats, loss: str) -> Floats:
    """scipy's losses of squared residuals z."""
    if loss == "linear":
        return z
    if loss == "soft_l1":
        return np.asarray(2.0 * (np.sqrt(1.0 + z) - 1.0))
    if loss == "huber":
        return np.where(z <= 1.0, z, 2.0 * np.sqrt(np.maximum(z, 1.0)) - 1.0)
    return np.asarray(np.log1p(z) if loss == "cauchy" else np.arctan(z))


def rho_slope(z: Floats, loss: str) -> Floats:
    """Their derivatives: the weights of iteratively reweighted least squares."""
    if loss == "linear":
        return np.ones_like(z)
    if loss == "soft_l1":
        return np.asarray(1.0 / np.sqrt(1.0 + z))
    if loss == "huber":
        return np.where(z <= 1.0, 1.0, 1.0 / np.sqrt(np.maximum(z, 1.0)))
    return np.asarray(1.0 / (1.0 + z) if loss == "cauchy" else 1.0 / (1.0 + z**2))


@dataclass(frozen=True)
class Found:
    """What a search found: minima, best first, and how it got there."""

    minima: tuple[Minimum, ...]
    trace: Trace | None = None


class Search(Protocol):
    """A global search; what identify(search=...) takes."""

    def minima(self, landscape: Landscape, progress: Progress | None = None) -> Found:
        """The minima that it found, best first."""
        ...
