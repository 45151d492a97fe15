"""Bounds of parameters and constraints of the law as limits of the unknowns, whose violation is penalised.

A check finds coefficients whose bounds exclude the data.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.observation_vector import ObservationVector
from creepkit.inverse.reference_conditions import reference_stresses
from creepkit.language import CreepLaw
from creepkit.records import History, Predictor


class BoundPenalties:
    """Limits of u, beyond which half of their squares is added to the cost.

    They are those of coefficients, and of exponents whose place a local exponent takes, and the constraints of the law:
    they do not bound single conditioned coordinates.
    """

    WEIGHT = 100.0

    def __init__(self, coordinates: Coordinates, points: Sequence[Floats]) -> None:
        """points : the six variables of a law, (points,) each, at which its constraints must hold."""
        self.coordinates, self.penalised = coordinates, list(coordinates.penalised)
        self.low, self.high = coordinates.law.internal_bounds[:, self.penalised]
        self._constraints = _constraint_margins(coordinates.law_there, points)

    def limits(self, u: Floats) -> Floats:
        """(..., limits) WEIGHT times how far u (..., parameters) is beyond each, below zero within."""
        theta = self.coordinates.theta(u)
        values = theta[..., self.penalised]
        return self.WEIGHT * np.concatenate([values - self.high, self.low - values, -self._constraints(theta)], axis=-1)

    def constraint_violations(self, u: Floats) -> Floats:
        """(constraints,) how far each constraint is violated at u (parameters,); 0 where it holds."""
        return np.maximum(-self._constraints(self.coordinates.theta(u)), 0.0)

    def jacobian(self, u: Floats) -> Floats:
        """(limits, parameters) their derivatives at u (parameters,); those of constraints by central differences."""
        rows = self.coordinates.jacobian(u)[self.penalised]
        columns = [np.zeros(0)] * u.size
        if self._constraints(self.coordinates.theta(u)).size:
            for k, step in enumerate(np.diag(1e-6 * np.maximum(1.0, np.abs(u)))):
                down, up = (self._constraints(self.coordinates.theta(v)) for v in (u + step, u - step))
                columns[k] = (up - down) / (2 * step[k])
        return self.WEIGHT * np.concatenate([rows, -rows, np.stack(columns, axis=1)])


def _constraint_margins(law: CreepLaw, point: Sequence[Floats]) -> Callable[[Floats], Floats]:
    """How far each constraint is from being violated, the worst over the stresses, temperatures and times of the tests.

    The result takes theta (..., parameters) to (..., constraints). A margin that is not a number counts as
    violated.
    """
    import sympy

    from creepkit.language.symbols import POINT_VARIABLES

    if not law.constraints:
        return lambda theta: np.zeros((*theta.shape[:-1], 0))
    margin_expressions = [relation.gts - relation.lts for relation in law.constraints]
    functions = [
        sympy.lambdify((*POINT_VARIABLES, *law.states, *law.params), side, "numpy") for side in margin_expressions
    ]
    initial_states = [state.initial for state in law.states.values()]

    def margins(theta: Floats) -> Floats:
        shape = (*theta.shape[:-1], point[0].size)
        with np.errstate(all="ignore"):
            values = [value[..., None] for value in law.from_internal(theta).values()]
            margins_by_constraint = [
                np.broadcast_to(f(*point, *initial_states, *values), shape).min(axis=-1) for f in functions
            ]
        smallest = np.stack(margins_by_constraint, axis=-1)
        return np.where(np.isfinite(smallest), smallest, -1.0)

    return margins


def constraint_points(
    histories: Sequence[History], predictor: Predictor, observations: ObservationVector, strain: float
) -> list[Floats]:
    """The six variables of a law, (points,) each, over the stresses and temperatures of tests, at times to the last."""
    pairs = {
        (float(s), float(T))
        for h in histories
        for s in reference_stresses(h, predictor)
        for T in h.temperature_program().values
    }
    last_time = float(observations.times[observations.present].max())
    times = np.concatenate([np.zeros(1), np.geomspace(1e-3 * last_time, last_time, 60)])
    stress, temperature = (np.repeat([pair[k] for pair in sorted(pairs)], times.size) for k in (0, 1))
    return [stress, np.full(stress.size, strain), np.tile(times, len(pairs)), temperature, stress, stress / 3]


FORCE_LIMIT = 1.0
"""Force of the data against the bounds of a coefficient, in units of misfit per frame and ln, that is an error."""


AT_BOUND = 1e-6
"""In ln from a bound of a coefficient, within which it lies there."""


EXCESS_LIMIT = 0.1
"""In ln beyond the bounds of a coefficient: further than a penalty of the law's bounds ever lets a minimum lie."""


def check_bounds(bound_penalties: BoundPenalties, u: Floats, gradient: Floats, data: int) -> None:
    """A coefficient that the data force against its bounds is an error: the estimate would be the bound.

    u, gradient : (parameters,) estimate, and derivative of half the chi-square of the data to it; data : their number.
    """
    coordinates, law = bound_penalties.coordinates, bound_penalties.coordinates.law
    theta, force_limit = coordinates.theta(u), FORCE_LIMIT * data
    distances = np.array([theta - law.internal_bounds[0], law.internal_bounds[1] - theta])
    for k in coordinates.coefficients:
        name, param, distance = law.names[k], law.table[law.names[k]], float(distances[:, k].min())
        if distance < AT_BOUND and (abs(gradient[k]) > force_limit or -distance > EXCESS_LIMIT):
            (low, high), side = param.bounds, ("below", "above")[int(np.argmin(distances[:, k]))]
            raise FitError(
                f"law '{law.name}': the bounds exclude the data, which push {name} {side} them "
                f"({low:g} to {high:g} {param.unit}); widen them or choose another law"
            )
