"""The objective: residuals of all tests on their scale, with exact Jacobians, in conditioned coordinates.

A candidate that bursts before a test ends keeps its last value and then grows with ln(t / t_burst): the residual
stays finite and keeps growing the earlier it burst, so a search can find its way back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.errors import FitError
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.scales import LogScale
from creepkit.language import CreepLaw
from creepkit.records import History, Predictor

BURST_SLOPE = 3.0
"""Growth of the compared quantity per unit of ln(t / t_burst) after a burst; strains above it are not data."""


@dataclass(frozen=True)
class Residuals:
    """Predicted minus measured, padded to the longest test.

    values, slopes : (tests, frames) residual, and dg/dy at the prediction (what one unit of offset changes).
    jacobian : (tests, frames, parameters) with respect to u, or None.
    rate_effect : (tests, frames) derivative with respect to ln of a factor on this test's creep rate, or None.
    present : (tests, frames) which entries are data; the others are zero.
    """

    values: Floats
    slopes: Floats
    present: Bools
    jacobian: Floats | None = None
    rate_effect: Floats | None = None


class Objective:
    """Residuals of a law's candidates against histories."""

    def __init__(
        self, law: CreepLaw, histories: Sequence[History], using: Predictor, coordinates: Coordinates, scale: LogScale,
        output: str = "strain",
    ) -> None:  # fmt: skip
        self.law, self.histories, self.using = law, list(histories), using
        self.coordinates, self.scale, self.output = coordinates, scale, output
        frames = max(h.times.size for h in self.histories)
        shape = (len(self.histories), frames)
        self.measured, self.times, self.present = np.zeros(shape), np.ones(shape), np.zeros(shape, bool)
        for k, h in enumerate(self.histories):
            size = h.times.size
            if output not in h.outputs:
                raise FitError(f"history '{h.name}' has no output '{output}'; it has {', '.join(h.outputs)}")
            self.measured[k, :size], self.times[k, :size] = h.outputs[output], h.times
            self.present[k, :size] = h.used
        self.compared = self.scale.forward(self.measured)
        self.evaluations = 0

    def before_fit(self) -> Residuals:
        """Slopes as the measured values have them, so that a covariance exists before anything was predicted."""
        slopes = np.where(self.present, self.scale.slope(self.measured), 0.0)
        effect = slopes * np.maximum(self.measured, 0.0)
        return Residuals(np.zeros_like(slopes), slopes, self.present, None, effect)

    def screen(self, u: Floats) -> Floats:
        """Residuals without derivatives: u (candidates, parameters) -> (candidates, tests, frames)."""
        predicted, ends, _ = self._predict(u, jacobian=False)
        return np.where(self.present, self._extended(predicted, ends) - self.compared, 0.0)

    def at(self, u: Floats) -> Residuals:
        """Residuals of one candidate with exact derivatives."""
        predicted, ends, jacobian = self._predict(u[None], jacobian=True)
        assert jacobian is not None
        values = self._extended(predicted, ends)[0] - self.compared
        strain, inner = predicted[0], jacobian[0]
        alive = np.isfinite(strain)
        slopes = self.scale.slope(np.where(alive, strain, 1.0))
        with np.errstate(invalid="ignore"):
            wide = slopes[..., None] * inner
        wide = np.where(np.isfinite(wide), wide, np.nan)
        wide = _held(wide, alive & self.present)
        slopes = np.where(alive, slopes, 0.0)
        effect = self._rate_effect(wide, values)
        mask = self.present
        to_u = wide @ self.coordinates.jacobian(u)
        return Residuals(
            np.where(mask, values, 0.0), np.where(mask, slopes, 0.0), mask,
            np.where(mask[..., None], to_u, 0.0), np.where(mask, effect, 0.0),
        )  # fmt: skip

    def _rate_effect(self, slopes: Floats, residual: Floats) -> Floats:
        """Derivative of the compared quantity to ln of a factor on all rates of a test, (tests, frames).

        The sum over the terms' coefficients; where a term has none of its own, the slope in ln t, which is the same
        for a law without explicit time at constant stress (strain depends on factor x time alone).
        """
        if len(self.coordinates.rates) == len(self.law.terms):
            return np.asarray(slopes[..., list(self.coordinates.rates)].sum(axis=-1))
        compared = residual + self.compared
        effect = np.zeros_like(compared)
        for k, present in enumerate(self.present):
            if present.sum() > 1:
                effect[k, present] = np.gradient(compared[k, present], np.log(self.times[k, present]))
        return effect

    def _predict(self, u: Floats, jacobian: bool) -> tuple[Floats, Floats, Floats | None]:
        theta = self.coordinates.theta(u)
        values = {
            name: np.exp(theta[:, k]) if param.scale == "log" else theta[:, k]
            for k, (name, param) in enumerate(self.law.table.items())
        }
        found = self.using.predict(self.law, values, self.histories, jacobian=jacobian)
        self.evaluations += len(u)
        column = found.outputs.index(self.output)
        slope = None if found.jacobian is None else found.jacobian[..., column, :]
        return found.values[..., column], found.end_times, slope

    def _extended(self, predicted: Floats, ends: Floats) -> Floats:
        """g of the prediction, carried on after a burst; (candidates, tests, frames)."""
        alive = np.isfinite(predicted)
        compared = self.scale.forward(np.where(alive, predicted, 0.0))
        lost = self.present & ~alive
        if lost.any():
            top = self.scale.forward(np.asarray(1.0))
            late = np.log(np.maximum(self.times / np.maximum(ends[..., None], 1e-12), 1.0))
            compared = np.where(lost, top + BURST_SLOPE * late, compared)
        return compared


def _held(jacobian: Floats, alive: Bools) -> Floats:
    """Derivatives of lost frames: those of the last frame alive in the test, a direction back to life."""
    if alive.all():
        return jacobian
    frames = np.arange(alive.shape[1])
    last = np.maximum.accumulate(np.where(alive, frames, -1), axis=1)
    first = np.where(alive.any(axis=1), alive.argmax(axis=1), 0)
    index = np.where(last >= 0, last, first[:, None])
    held = np.take_along_axis(jacobian, index[..., None], axis=1)
    return np.where(np.isfinite(held), held, 0.0)
