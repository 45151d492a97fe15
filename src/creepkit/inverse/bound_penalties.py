"""Penalty residuals for parameter bounds, constraints of the law and priors of nuisance parameters; a check that the data do not push against the bounds."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.reference_conditions import reference_stresses
from creepkit.inverse.residuals import ResidualFunction
from creepkit.language import CreepLaw


class BoundPenalties:
    """Extra residuals of x = (u, e).

    Bounds of coefficients, and of exponents whose place a local exponent takes, and the law's constraints give zero
    inside and grow linearly outside: these are not box variables in conditioned coordinates. Unknowns of tests give
    their distance from the prior mean, over its sd.
    """

    WEIGHT = 100.0

    def __init__(self, residual_function: ResidualFunction) -> None:
        self.coordinates, self.nuisance_parameters, law = (
            residual_function.coordinates,
            residual_function.nuisance_parameters,
            residual_function.law,
        )
        internal_bounds = [(p.to_internal(p.bounds[0]), p.to_internal(p.bounds[1])) for p in law.params.values()]
        self.low = np.array([internal_bounds[k][0] for k in self.coordinates.penalised])
        self.high = np.array([internal_bounds[k][1] for k in self.coordinates.penalised])
        self._constraints = _constraint_margins(law, residual_function)

    def residuals(self, x: Floats) -> Floats:
        """(..., fences) residuals at x (..., unknowns)."""
        u, e = self._split(x)
        theta = self.coordinates.theta(u)
        margins = self._constraints(theta)
        penalties = self.WEIGHT * np.concatenate([np.abs(self.bound_excess(theta)), np.maximum(-margins, 0.0)], axis=-1)
        prior_residuals = (e - self.nuisance_parameters.mean[: e.shape[-1]]) * np.sqrt(
            self.nuisance_parameters.precision
        )
        return np.concatenate([penalties, prior_residuals], axis=-1)

    def constraint_violations(self, u: Floats) -> Floats:
        """How far each constraint is violated at u; 0 where it holds."""
        return np.maximum(-self._constraints(self.coordinates.theta(u)), 0.0)

    def jacobian(self, x: Floats) -> Floats:
        """(fences, unknowns); constraints by central differences."""
        u, e = self._split(x)
        theta = self.coordinates.theta(u)
        penalised = list(self.coordinates.penalised)
        bound_derivatives = np.sign(self.bound_excess(theta))[:, None] * self.coordinates.jacobian(u)[penalised]
        columns = [np.zeros(0)] * u.size
        if self._constraints(theta).size:
            for k in range(u.size):
                step = np.zeros(u.size)
                step[k] = 1e-6 * max(1.0, abs(u[k]))
                violations = (
                    np.maximum(-self._constraints(self.coordinates.theta(v)), 0.0) for v in (u + step, u - step)
                )
                columns[k] = np.subtract(*violations) / (2 * step[k])
        penalties = self.WEIGHT * np.concatenate([bound_derivatives, np.stack(columns, axis=1)])
        prior = np.diag(np.sqrt(self.nuisance_parameters.precision))
        return np.block([[penalties, np.zeros((len(penalties), e.size))], [np.zeros((e.size, u.size)), prior]])

    def _split(self, x: Floats) -> tuple[Floats, Floats]:
        size = len(self.coordinates.names)
        return x[..., :size], x[..., size:]

    def bound_excess(self, theta: Floats) -> Floats:
        """How far each walled parameter lies beyond its bounds (coefficients in ln): above positive, below negative."""
        penalised = theta[..., list(self.coordinates.penalised)]
        return np.asarray(np.maximum(penalised - self.high, 0.0) + np.minimum(penalised - self.low, 0.0))


def _constraint_margins(law: CreepLaw, residual_function: ResidualFunction) -> Callable[[Floats], Floats]:
    """How far each constraint is from being violated, the worst over the stresses, temperatures and times of the tests.

    The function found takes theta (..., parameters) to (..., constraints). A margin that is not a number counts as
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
    point = _test_points(residual_function)
    initial_states = [state.initial for state in law.states.values()]

    def margins(theta: Floats) -> Floats:
        columns = zip(law.params.values(), np.moveaxis(theta, -1, 0)[..., None], strict=True)
        shape = (*theta.shape[:-1], point[0].size)
        with np.errstate(all="ignore"):
            values = [np.exp(t) if p.scale == "log" else t for p, t in columns]
            margins_by_constraint = [
                np.broadcast_to(f(*point, *initial_states, *values), shape).min(axis=-1) for f in functions
            ]
        smallest = np.stack(margins_by_constraint, axis=-1)
        return np.where(np.isfinite(smallest), smallest, -1.0)

    return margins


def _test_points(residual_function: ResidualFunction) -> list[Floats]:
    """The six variables of the point over every test's stresses and temperatures, and times from first to last."""
    pairs = {
        (float(s), float(T))
        for h in residual_function.histories
        for s in reference_stresses(h, residual_function.predictor)
        for T in h.temperature_program().values
    }
    last_time = float(residual_function.observations.times[residual_function.observations.present].max())
    times = np.concatenate([np.zeros(1), np.geomspace(1e-3 * last_time, last_time, 60)])
    stress, temperature = (np.repeat([pair[k] for pair in sorted(pairs)], times.size) for k in (0, 1))
    strain = np.full(stress.size, residual_function.coordinates.reference.strain)
    return [stress, strain, np.tile(times, len(pairs)), temperature, stress, stress / 3]


FORCE_LIMIT = 1.0
"""Force of the data against the bounds of a coefficient, in units of misfit per frame and ln, that is an error."""


EXCESS_LIMIT = 0.1
"""In ln beyond the bounds of a coefficient: no wall gives way so far unless the search never came back inside."""


def check_bounds(residual_function: ResidualFunction, u: Floats, gradient: Floats) -> None:
    """A coefficient that the data push hard against its bounds is an error: the answer would be the bound's.

    force : (parameters,) derivative of half the chi-square of the data to u.
    """
    law, coordinates, bound_penalties = (
        residual_function.law,
        residual_function.coordinates,
        BoundPenalties(residual_function),
    )
    theta = coordinates.theta(u)
    force_limit = FORCE_LIMIT * int(residual_function.observations.present.sum())
    for k, excess in zip(coordinates.penalised, bound_penalties.bound_excess(theta), strict=True):
        name, param = law.names[k], law.table[law.names[k]]
        excluded = bound_penalties.WEIGHT**2 * abs(excess) > force_limit and (
            abs(gradient[k]) > force_limit or abs(excess) > EXCESS_LIMIT
        )
        if k in coordinates.coefficients and excluded:
            low, high = param.bounds
            side = "below" if excess < 0 else "above"
            raise FitError(
                f"law '{law.name}': the bounds exclude the data, which push {name} {side} them "
                f"({low:g} to {high:g} {param.unit}); widen them or choose another law"
            )
