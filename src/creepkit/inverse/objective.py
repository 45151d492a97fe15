"""The objective: residuals of all tests on their scales, with exact Jacobians, in conditioned coordinates.

A candidate that bursts before a test ends goes on from the ceiling of its scale and grows with ln(t / t_burst): the
residual stays finite and keeps growing the earlier it burst, so a search can find its way back. A test whose end is
known is compared over its whole life instead: by its distance from the curve (see inverse.distance), and by its
rupture.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.differences import author_values, differentiated
from creepkit.inverse.effects import Unknowns
from creepkit.inverse.entries import Entries
from creepkit.inverse.life import Compared, offset_slope, over_life, predict_life, time_jacobian
from creepkit.inverse.residuals import Residuals
from creepkit.inverse.scales import LinearScale
from creepkit.inverse.together import predict
from creepkit.language import CreepLaw
from creepkit.records import History, Prediction, Predictor

BURST_SLOPE = 3.0
"""Growth of the compared quantity per unit of ln(t / t_burst) after a burst; strains above it are not data."""

REMEMBERED = 4
"""Candidates whose residuals are kept: a search ends at one that it has seen, and the next begins there."""


class Objective:
    """Residuals of a law's candidates against histories."""

    def __init__(
        self, law: CreepLaw, histories: Sequence[History], using: Predictor, coordinates: Coordinates,
        entries: Entries, unknowns: Unknowns,
    ) -> None:  # fmt: skip
        self.law, self.histories, self.using = law, list(histories), using
        self.coordinates, self.entries, self.unknowns = coordinates, entries, unknowns
        self.compared = entries.forward(entries.measured)
        self.evaluations = 0
        self._seen: dict[bytes, Residuals] = {}

    def asking(self, using: Predictor, law: CreepLaw, coordinates: Coordinates) -> Objective:
        """The same entries asked of another predictor or law, unknowns of tests held at their means."""
        return Objective(law, self.histories, using, coordinates, self.entries, replace(self.unknowns, held=True))

    def before_fit(self) -> Residuals:
        """Slopes as the measured values have them, so that a covariance exists before anything was predicted."""
        measured = self.entries.measured
        slopes = np.where(self.entries.present, self.entries.slope(measured), 0.0)
        return self._residuals(np.zeros_like(slopes), slopes, None, slopes * np.maximum(measured, 0.0))

    def screen(self, u: Floats, e: Floats | None = None) -> Floats:
        """Residuals without derivatives: (candidates, parameters) to entries; unknowns of tests at e or their means."""
        values = author_values(self.law, self.coordinates.theta(u))
        if self.entries.whole.any():
            found = predict_life(self.using, self.law, values, self.histories)
        else:
            effects = replace(self.unknowns, held=e is None).effects(np.zeros(0) if e is None else e)
            found = predict(self.using, self.law, values, self.histories, effects=effects)
        self.evaluations += len(u)
        return np.where(self.entries.present, self._compared(self._predicted(found), found).values, 0.0)

    def excess(self, misfit: Floats) -> Floats:
        """(candidates,) by how much rates are too high, in ln: the median over what grows with creep.

        On a logarithmic scale the residual itself; on a linear one ln of predicted over measured growth, and more
        after a burst.
        """
        entries, now = self.entries, misfit + self.compared
        logs = np.where(entries.leading, misfit, np.nan)
        for position, scale in enumerate(entries.scales):
            mine = entries.leading & (entries.output == position) & entries.present
            if not isinstance(scale, LinearScale) or not mine.any():
                continue
            first = mine.argmax(axis=1)[:, None]
            grown = now - np.take_along_axis(now, np.broadcast_to(first, (*now.shape[:2], 1)), axis=2)
            own = self.compared - np.take_along_axis(self.compared, first, axis=1)
            burst = np.maximum(now - scale.ceiling, 0.0)
            same = np.maximum(grown * np.sign(own), 1e-12)  # a stress that relaxes falls in both
            ratio = np.log(same / np.maximum(np.abs(own), 0.01)) + burst
            logs = np.where(mine, np.where(np.abs(own) > 0.01, ratio, np.nan), logs)
        return np.array([np.nanmedian(each) if np.isfinite(each).any() else 0.0 for each in logs[:, entries.present]])

    def early(self, misfit: Floats) -> Floats:
        """(candidates,) by how much ruptures come too early, in ln: the median; 0 where no test ruptured."""
        broken = self.entries.ruptures & ~self.entries.censored[:, None]
        return np.median(misfit[:, broken], axis=1) if broken.any() else np.zeros(len(misfit))

    def at(self, x: Floats) -> Residuals:
        """Residuals of one candidate x = (u, e) with exact derivatives; the last few are remembered."""
        key = x.tobytes()
        if key not in self._seen:
            self._seen = dict([*self._seen.items()][1 - REMEMBERED :])
            self._seen[key] = self._computed(x)
        return self._seen[key]

    def side_by_side(self, u: Floats) -> tuple[Floats, Floats]:
        """Residuals (candidates, tests, entries) of u (candidates, parameters), and their derivatives to u.

        The unknowns of tests stay at their means; one prediction, where the predictor differentiates itself.
        """
        theta, effects = self.coordinates.theta(u), replace(self.unknowns, held=True).effects(np.zeros(0))
        found = predict(
            self.using, self.law, author_values(self.law, theta), self.histories, jacobian=True, effects=effects
        )
        if found.jacobian is None or self.entries.whole.any():
            alone = self.asking(self.using, self.law, self.coordinates)
            each = [alone.at(one) for one in u]
            self.evaluations += alone.evaluations
            return np.stack([r.values for r in each]), np.stack([_known(r.jacobian) for r in each])
        self.evaluations += len(u)
        entries, predicted = self.entries, self._predicted(found)
        alive = np.isfinite(predicted)
        slopes = entries.slope(np.where(alive, predicted, 1.0))
        with np.errstate(invalid="ignore"):
            wide = slopes[..., None] * entries.taken(found.jacobian, found)
        wide = np.where(np.isfinite(wide), wide, np.nan)
        lives = alive & entries.present
        held = np.stack([_held(one, living, entries.output) for one, living in zip(wide, lives, strict=True)])
        to_u = np.einsum("ctep,cpq->cteq", held, self.coordinates.jacobian(u))
        values = np.where(entries.present, self._compared(predicted, found).values, 0.0)
        return values, np.where(entries.present[..., None], to_u, 0.0)

    def _computed(self, x: Floats) -> Residuals:
        size, entries = len(self.law.params), self.entries
        u, e = x[:size], x[size:]
        theta = self.coordinates.theta(u)
        if entries.whole.any():
            values = author_values(self.law, theta[None])
            found = predict_life(self.using, self.law, values, self.histories, jacobian=True)
        else:
            found = differentiated(self.using, self.law, theta, self.histories, self.unknowns.effects(e))
        self.evaluations += 1
        assert found.jacobian is not None
        predicted = self._predicted(found)
        now, alive = self._compared(predicted, found), np.isfinite(predicted[0])
        slopes = entries.slope(np.where(alive, predicted[0], 1.0))
        inner = now.by_strain[0, ..., None] * self._inner(found, slopes, alive)
        slopes = now.by_strain[0] * np.where(alive, slopes, 0.0)
        if found.life is not None:
            inner += now.by_time[0, ..., None] * time_jacobian(entries, found.life)[0]
            slopes += now.by_time[0] * offset_slope(entries, found.life)[0]
        effect = self._rate_effect(inner[..., :size], predicted[0], now)
        to_x = np.concatenate([inner[..., :size] @ self.coordinates.jacobian(u), inner[..., size:]], axis=-1)
        return self._residuals(now.values[0], slopes, to_x, effect, now.heard[0])

    def _predicted(self, found: Prediction) -> Floats:
        """What is predicted at the entries, (candidates, tests, entries); rupture times are compared on their own."""
        return np.where(self.entries.ruptures, self.entries.measured, self.entries.taken(found.values, found))

    def _compared(self, predicted: Floats, found: Prediction) -> Compared:
        vertical = self._extended(predicted, found.end_times) - self.compared
        return over_life(self.entries, vertical, np.isfinite(predicted), found)

    def _inner(self, found: Prediction, slopes: Floats, alive: Bools) -> Floats:
        """Derivatives of what is compared to internal parameters and unknowns of tests."""
        assert found.jacobian is not None
        wide = self.entries.taken(found.jacobian, found)[0]
        if self.unknowns.size:
            own = {kind: self.entries.taken(s, found)[0] for kind, s in found.effect_jacobian.items()}
            wide = np.concatenate([wide, self.unknowns.columns(own)], axis=-1)
        with np.errstate(invalid="ignore"):
            wide = slopes[..., None] * wide
        wide = np.where(np.isfinite(wide), wide, np.nan)
        return _held(wide, alive & self.entries.present, self.entries.output)

    def _residuals(
        self, values: Floats, slopes: Floats, jacobian: Floats | None, effect: Floats, heard: Bools | None = None
    ) -> Residuals:
        entries = self.entries
        mask = entries.present if heard is None else entries.present & heard
        return Residuals(
            np.where(mask, values, 0.0), np.where(mask, slopes, 0.0), mask, entries.clock,
            None if jacobian is None else np.where(mask[..., None], jacobian, 0.0), np.where(mask, effect, 0.0),
            entries.output, entries.loudness, np.ones(len(mask)),
        )  # fmt: skip

    def _rate_effect(self, slopes: Floats, predicted: Floats, now: Compared) -> Floats:
        """Derivative of the compared quantity to ln of a factor on all rates of a test, (tests, entries).

        The sum over the coefficients of terms and of internal variables; where one has none of its own, the slope in
        ln t, which is the same for a law without explicit time at constant stress (strain depends on factor x time
        alone).
        """
        coordinates = self.coordinates
        if len(coordinates.coefficients) == len(self.law.terms) + len(self.law.states):
            return np.asarray(slopes[..., list(coordinates.coefficients)].sum(axis=-1))
        alive = np.isfinite(predicted)
        compared, entries = self.entries.forward(np.where(alive, predicted, self.entries.measured)), self.entries
        effect = np.zeros_like(compared)
        for k, present in enumerate(entries.present):
            for position in np.unique(entries.output[k, present]):
                row = present & (entries.output[k] == position)
                if row.sum() > 1:
                    effect[k, row] = np.gradient(compared[k, row], entries.log_times[k, row])
        return np.asarray(now.by_strain[0] * effect + now.by_time[0])

    def _extended(self, predicted: Floats, ends: Floats) -> Floats:
        """g of the prediction, carried on after a burst; (candidates, tests, entries)."""
        alive = np.isfinite(predicted)
        compared = self.entries.forward(np.where(alive, predicted, 0.0))
        lost = self.entries.present & ~alive
        if lost.any():
            top = self.entries.spread([scale.ceiling for scale in self.entries.scales])
            late = np.log(np.maximum(self.entries.times / np.maximum(ends[..., None], 1e-12), 1.0))
            compared = np.where(lost, top + BURST_SLOPE * late, compared)
        return compared


def _known(jacobian: Floats | None) -> Floats:
    assert jacobian is not None
    return jacobian


def _held(jacobian: Floats, alive: Bools, output: Ints) -> Floats:
    """Derivatives of lost frames: those of the output's last frame alive in the test, a direction back to life."""
    if alive.all():
        return jacobian
    frames = np.broadcast_to(np.arange(alive.shape[1]), alive.shape)
    index = np.array(frames)
    for position in np.unique(output):
        mine = alive & (output == position)
        last = np.maximum.accumulate(np.where(mine, frames, -1), axis=1)
        first = np.where(mine.any(axis=1), mine.argmax(axis=1), 0)
        index = np.where(output == position, np.where(last >= 0, last, first[:, None]), index)
    held = np.take_along_axis(jacobian, index[..., None], axis=1)
    return np.where(np.isfinite(held), held, 0.0)
