"""Bounds of the unknowns, and penalties by which the bounds of parameters and the constraints of a law hold.

The unknowns are conditioned coordinates, within bounds of a law and near the measured creep rate. A check finds
coefficients whose bounds exclude the data.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import qmc

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.coordinates import LARGEST_EXPONENT, Coordinates
from creepkit.inverse.nuisance_parameters import NuisanceParameters
from creepkit.inverse.observation_vector import ObservationVector
from creepkit.inverse.reference_conditions import reference_stresses
from creepkit.inverse.uncertainty.laplace_approximation import NORMAL_QUANTILE
from creepkit.language import CreepLaw
from creepkit.records import History, Predictor

LOG_RATE_BOUNDS = (-12.0, 6.0)
"""Bounds of the log rate of a term, or of an internal variable, about the measured one: at 1e-5 of the data it is
absent, at 400 times it is wrong."""


EXPONENT_SAMPLES = 256
"""Points within the bounds of the parameters at which the range of local exponents is evaluated."""


@dataclass(frozen=True)
class Bounds:
    """Bounds of the unknowns of a least-squares problem, and the scale on which a search steps.

    lower, upper : (unknowns,) in the units of the unknowns, of u or of x = (u, e).
    """

    lower: Floats
    upper: Floats

    @classmethod
    def from_law(cls, law: CreepLaw, coordinates: Coordinates, log_rate: float, log_internal_rate: float) -> Bounds:
        """The bounds of a law's conditioned coordinates u, with log rates within LOG_RATE_BOUNDS of the measured ones.

        log_rate : ln of the measured strain rate in 1/s; log_internal_rate : ln of one over the duration of a test in
            1/s, about which the rates of internal variables lie.
        """
        lower, upper = law.internal_bounds
        for local_exponent in coordinates.exponents:
            sampled = lower + qmc.Sobol(lower.size, seed=0).random(EXPONENT_SAMPLES) * (upper - lower)
            exponents = coordinates.u(sampled)[:, local_exponent.position]
            exponents = exponents[np.isfinite(exponents)]
            lower[local_exponent.position] = exponents.min()
            upper[local_exponent.position] = max(min(exponents.max(), LARGEST_EXPONENT), exponents.min() + 1.0)
        for positions, middle in ((coordinates.term_rates, log_rate), (coordinates.state_rates, log_internal_rate)):
            lower[list(positions)], upper[list(positions)] = (middle + end for end in LOG_RATE_BOUNDS)
        return cls(lower, upper)

    def with_nuisances(self, nuisances: NuisanceParameters) -> Bounds:
        """Those of x = (u, e): bounds of u, then the limits of the nuisance parameters."""
        count = nuisances.size
        return Bounds(
            np.concatenate([self.lower, nuisances.low[:count]]), np.concatenate([self.upper, nuisances.high[:count]])
        )

    def of(self, positions: Sequence[int]) -> Bounds:
        """The bounds of some of the unknowns."""
        index = np.asarray(positions, np.int64)
        return Bounds(self.lower[index], self.upper[index])

    def clip(self, u: Floats) -> Floats:
        """(..., unknowns) the nearest points within the bounds; u : (..., unknowns)."""
        return np.clip(u, self.lower, self.upper)

    @property
    def width(self) -> Floats:
        """(unknowns,) upper less lower bound."""
        return self.upper - self.lower

    @property
    def centre(self) -> Floats:
        """(unknowns,) half way between the bounds."""
        return 0.5 * (self.lower + self.upper)


WIDER_FACTOR, WIDER_SHARE = 100.0, 1.0 / 3.0
"""By what a bound is widened: that of a coefficient, and the larger end of an exponent, by a share of itself."""


MOST_WIDENINGS, NEAR_BOUND = 4, 1e-3
"""How often bounds are widened, and the share of their width within which a value ends at one."""


def widened(law: CreepLaw, theta: Floats) -> CreepLaw | None:
    """The law with wider bounds where an estimate ends at bounds that nobody stated; None where it ends at none.

    theta : (parameters,) internal values. A coefficient may pass both of its bounds, an exponent that of larger size.
    """
    params = dict(law.params)
    for (symbol, param), value in zip(law.params.items(), theta, strict=True):
        low, high = ends = [param.to_internal(bound) for bound in param.bounds]
        margin, bounds = NEAR_BOUND * (high - low), list(param.bounds)
        reached = (value < low + margin, value > high - margin)
        for k, sign in enumerate((-1.0, 1.0)):
            if param.scale == "log" and reached[k]:
                bounds[k] *= WIDER_FACTOR**sign
            elif reached[k] and sign * ends[k] >= max(map(abs, ends)):
                bounds[k] += WIDER_SHARE * bounds[k]
        if param.widens:
            params[symbol] = replace(param, bounds=tuple(np.clip(bounds, *(param.limits or (-np.inf, np.inf)))))
    return replace(law, params=params) if params != dict(law.params) else None


def with_determined(usual: CreepLaw, wider: CreepLaw, theta: Floats, deviations: Floats) -> CreepLaw:
    """The law with those of its wider bounds within which the tests determine a value, and else its usual ones.

    theta, deviations : (parameters,) internal values and their standard deviations within the wider bounds. A 95 %
    interval, not cut at bounds, that is as wide as the usual bounds and holds one of them says less than these do: far
    along a valley of values that describe the tests alike, others are predicted worse.
    """
    params = dict(usual.params)
    for symbol, value, half in zip(usual.params, theta, NORMAL_QUANTILE * deviations, strict=True):
        low, high = (params[symbol].to_internal(bound) for bound in params[symbol].bounds)
        if 2.0 * half < high - low or value - half > high or value + half < low:
            params[symbol] = wider.params[symbol]
    return replace(usual, params=params)


def widened_notes(law: CreepLaw, wider: CreepLaw) -> tuple[str, ...]:
    """How far parameters were sought beyond the bounds of a law, a sentence each; wider : that law as it was fitted."""
    pairs = zip(wider.table.items(), law.params.values(), strict=True)
    return tuple(
        f"{name} was searched from {found.bounds[0]:.3g} to {found.bounds[1]:.3g}, beyond the usual bounds of the law"
        for (name, found), usual in pairs
        if found.bounds != usual.bounds
    )


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
        rows, steps = self.coordinates.jacobian(u)[self.penalised], 1e-6 * np.maximum(1.0, np.abs(u))
        of_constraints = np.zeros((0, u.size))
        if self.coordinates.law_there.constraints:
            ends = u + np.stack([np.diag(steps), np.diag(-steps)])
            up, down = self._constraints(self.coordinates.theta(ends))
            of_constraints = ((up - down) / (2.0 * steps[:, None])).T
        return self.WEIGHT * np.concatenate([rows, -rows, of_constraints])


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
