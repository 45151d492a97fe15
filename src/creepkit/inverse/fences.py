"""Fences: residuals that keep a search where the author's bounds, the law's constraints and priors want it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.nominal import stresses
from creepkit.inverse.objective import Objective
from creepkit.language import CreepLaw


class Fences:
    """Extra residuals of x = (u, e).

    Bounds of coefficients, and of exponents whose place a local exponent takes, and the law's constraints give zero
    inside and grow linearly outside: these are not box variables in conditioned coordinates. Unknowns of tests give
    their distance from the prior mean, over its sd.
    """

    SLOPE = 100.0

    def __init__(self, objective: Objective) -> None:
        self.coordinates, self.unknowns, law = objective.coordinates, objective.unknowns, objective.law
        ends = [(p.to_internal(p.bounds[0]), p.to_internal(p.bounds[1])) for p in law.params.values()]
        self.low = np.array([ends[k][0] for k in self.coordinates.walled])
        self.high = np.array([ends[k][1] for k in self.coordinates.walled])
        self._constraints = _margins(law, objective)

    def values(self, x: Floats) -> Floats:
        """(..., fences) residuals at x (..., unknowns)."""
        u, e = self._parts(x)
        theta = self.coordinates.theta(u)
        margins = self._constraints(theta)
        walls = self.SLOPE * np.concatenate([np.abs(self.outside(theta)), np.maximum(-margins, 0.0)], axis=-1)
        own = (e - self.unknowns.mean[: e.shape[-1]]) * np.sqrt(self.unknowns.precision)
        return np.concatenate([walls, own], axis=-1)

    def violations(self, u: Floats) -> Floats:
        """How far each constraint is violated at u; 0 where it holds."""
        return np.maximum(-self._constraints(self.coordinates.theta(u)), 0.0)

    def jacobian(self, x: Floats) -> Floats:
        """(fences, unknowns); constraints by central differences."""
        u, e = self._parts(x)
        theta = self.coordinates.theta(u)
        rates = list(self.coordinates.walled)
        slopes = np.sign(self.outside(theta))[:, None] * self.coordinates.jacobian(u)[rates]
        columns = [np.zeros(0)] * u.size
        if self._constraints(theta).size:
            for k in range(u.size):
                step = np.zeros(u.size)
                step[k] = 1e-6 * max(1.0, abs(u[k]))
                ends = (np.maximum(-self._constraints(self.coordinates.theta(v)), 0.0) for v in (u + step, u - step))
                columns[k] = np.subtract(*ends) / (2 * step[k])
        walls = self.SLOPE * np.concatenate([slopes, np.stack(columns, axis=1)])
        prior = np.diag(np.sqrt(self.unknowns.precision))
        return np.block([[walls, np.zeros((len(walls), e.size))], [np.zeros((e.size, u.size)), prior]])

    def _parts(self, x: Floats) -> tuple[Floats, Floats]:
        size = len(self.coordinates.names)
        return x[..., :size], x[..., size:]

    def outside(self, theta: Floats) -> Floats:
        """How far each walled parameter lies beyond its bounds (coefficients in ln): above positive, below negative."""
        own = theta[..., list(self.coordinates.walled)]
        return np.asarray(np.maximum(own - self.high, 0.0) + np.minimum(own - self.low, 0.0))


def _margins(law: CreepLaw, objective: Objective) -> Callable[[Floats], Floats]:
    """How far each constraint is from being violated, the worst over the stresses, temperatures and times of the tests.

    The function found takes theta (..., parameters) to (..., constraints). A margin that is not a number counts as
    violated.
    """
    import sympy

    from creepkit.language.symbols import POINT

    if not law.constraints:
        return lambda theta: np.zeros((*theta.shape[:-1], 0))
    sides = [relation.gts - relation.lts for relation in law.constraints]
    functions = [sympy.lambdify((*POINT, *law.states, *law.params), side, "numpy") for side in sides]
    point = _visited(objective)
    inner = [state.initial for state in law.states.values()]

    def margins(theta: Floats) -> Floats:
        columns = zip(law.params.values(), np.moveaxis(theta, -1, 0)[..., None], strict=True)
        shape = (*theta.shape[:-1], point[0].size)
        with np.errstate(all="ignore"):
            values = [np.exp(t) if p.scale == "log" else t for p, t in columns]
            found = [np.broadcast_to(f(*point, *inner, *values), shape).min(axis=-1) for f in functions]
        worst = np.stack(found, axis=-1)
        return np.where(np.isfinite(worst), worst, -1.0)

    return margins


def _visited(objective: Objective) -> list[Floats]:
    """The six variables of the point over every test's stresses and temperatures, and times from first to last."""
    pairs = {
        (float(s), float(T))
        for h in objective.histories
        for s in stresses(h, objective.using)
        for T in h.temperature_program().values
    }
    end = float(objective.entries.times[objective.entries.present].max())
    times = np.concatenate([np.zeros(1), np.geomspace(1e-3 * end, end, 60)])
    stress, temperature = (np.repeat([pair[k] for pair in sorted(pairs)], times.size) for k in (0, 1))
    strain = np.full(stress.size, objective.coordinates.reference.strain)
    return [stress, strain, np.tile(times, len(pairs)), temperature, stress, stress / 3]
