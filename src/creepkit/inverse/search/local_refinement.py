"""Parameter bounds, and bounded least squares from one start with an analytic Jacobian.

The trust region reflective method of scipy, with the residuals of bound and prior penalties beside those of the data.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import qmc

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.bound_penalties import BoundPenalties
from creepkit.inverse.coordinates import LARGEST_EXPONENT, Coordinates
from creepkit.inverse.nuisance_parameters import NuisanceParameters
from creepkit.inverse.residuals import ResidualFunction
from creepkit.language import CreepLaw

LOG_RATE_BOUNDS = (-12.0, 6.0)
"""Bounds of the log rate of a term, or of an internal variable, about the measured one: at 1e-5 of the data it is
absent, at 400 times it is wrong."""


EXPONENT_SAMPLES = 256
"""Draws from the bounds that show where local exponents lie."""


@dataclass(frozen=True)
class Bounds:
    """Bounds of the unknowns of a search, (unknowns,) each, and the scale on which it steps."""

    lower: Floats
    upper: Floats

    @classmethod
    def from_law(cls, law: CreepLaw, coordinates: Coordinates, log_rate: float, log_internal_rate: float) -> Bounds:
        """The law's bounds, with rates within RATE_WINDOW of the measured ones.

        log_rate : of strain; log_pace : ln of one over the life of a test, that of internal variables.
        """
        lower, upper = (
            np.array([p.to_internal(p.bounds[index]) for p in law.params.values()], float) for index in (0, 1)
        )
        for local_exponent in coordinates.exponents:
            sampled = lower + qmc.Sobol(lower.size, seed=0).random(EXPONENT_SAMPLES) * (upper - lower)
            exponents = coordinates.u(sampled)[:, local_exponent.position]
            exponents = exponents[np.isfinite(exponents)]
            lower[local_exponent.position], upper[local_exponent.position] = (
                float(exponents.min()),
                float(max(min(exponents.max(), LARGEST_EXPONENT), exponents.min() + 1.0)),
            )
        for k in coordinates.term_rates:
            lower[k], upper[k] = log_rate + LOG_RATE_BOUNDS[0], log_rate + LOG_RATE_BOUNDS[1]
        for k in coordinates.state_rates:
            lower[k], upper[k] = log_internal_rate + LOG_RATE_BOUNDS[0], log_internal_rate + LOG_RATE_BOUNDS[1]
        return cls(lower, upper)

    def with_nuisances(self, nuisances: NuisanceParameters) -> Bounds:
        """The box of x = (u, e), with the limits of the unknowns of tests."""
        count = nuisances.size
        return Bounds(
            np.concatenate([self.lower, nuisances.low[:count]]), np.concatenate([self.upper, nuisances.high[:count]])
        )

    def clip(self, u: Floats) -> Floats:
        """The nearest point inside."""
        return np.clip(u, self.lower, self.upper)

    @property
    def width(self) -> Floats:
        """high - low."""
        return self.upper - self.lower

    @property
    def centre(self) -> Floats:
        """Half way."""
        return 0.5 * (self.lower + self.upper)


PRIOR_STRENGTH = 1e-4
"""How hard each unknown is drawn to the middle of its bounds, in standard deviations of data per width of the bounds.

Far too weak to bias a value. Without it one unknown that moves nothing, as the share of the largest principal stress
in tension, leaves the Jacobian short of its rank, and scipy's steps are then always as long as the trust region.
"""


IterationCallback = Callable[[str, int, int], None]


class AdditionalResiduals(Protocol):
    """Residuals beside those of the data: half the sum of their squares is added to the cost."""

    def residuals(self, x: Floats) -> Floats:
        """(extra,) at x (unknowns,)."""
        ...

    def jacobian(self, x: Floats) -> Floats:
        """(extra, unknowns)."""
        ...


@dataclass(frozen=True)
class Minimum:
    """Where a search ended: coordinates, cost (half the sum of squares), and whether it converged.

    white : (entries of data,) residuals there over their scatter, where they were kept.
    off : terms of a sum that the search switched off.
    """

    u: Floats
    cost: float
    converged: bool
    evaluations: int
    whitened_residuals: Floats | None = field(default=None, repr=False)
    terms_off: tuple[str, ...] = ()


def bounded_least_squares(
    objective: ResidualFunction, bounds: Bounds, covariance_factor: Floats, start: Floats, *, loss: str = "linear",
    max_steps: int = 80, tolerance: float = 1e-10, additional: AdditionalResiduals | None = None, fixed: Mapping[int, float] | None = None,
) -> Minimum:  # fmt: skip
    """Bounded least squares (scipy's trust region reflective).

    factor : (tests, entries, entries) Cholesky factors of the covariance, which stay as they are during the search.
    extra : further residuals; held : {position: value} of unknowns that stay where they are.
    """
    bound_penalties, prior_weight, centre = BoundPenalties(objective), PRIOR_STRENGTH / bounds.width, bounds.centre
    cache: dict[bytes, tuple[Floats, Floats]] = {}
    full = np.array(start, float)
    full[list(fixed or {})] = list((fixed or {}).values())
    free = np.setdiff1d(np.arange(full.size), list(fixed or {}))

    def at(free_values: Floats) -> Floats:
        x = full.copy()
        x[free] = free_values
        return x

    def evaluate(free_values: Floats) -> tuple[Floats, Floats]:
        key = free_values.tobytes()
        if key not in cache:
            cache.clear()
            x = at(free_values)
            residuals = objective.evaluate(x)
            assert residuals.jacobian is not None
            residuals_and_jacobian = np.concatenate([residuals.values[..., None], residuals.jacobian], axis=-1)
            whitened = np.linalg.solve(covariance_factor, residuals_and_jacobian)[objective.observations.present]
            values = [whitened[:, 0], bound_penalties.residuals(x), prior_weight * (x - centre)]
            jacobians = [whitened[:, 1:], bound_penalties.jacobian(x), np.diag(prior_weight)]
            if additional is not None:
                values.append(additional.residuals(x))
                jacobians.append(additional.jacobian(x))
            cache[key] = np.concatenate(values), np.concatenate(jacobians)[:, free]
        return cache[key]

    initial = np.clip(full, bounds.lower + 1e-9 * bounds.width, bounds.upper - 1e-9 * bounds.width)[free]
    if not all(np.isfinite(part).all() for part in evaluate(initial)):
        raise FitError(
            f"law '{objective.law.name}': its prediction is no number where a refinement begins; narrow the bounds of "
            "its parameters, or give more starts"
        )
    scale, nuisance_count = 0.1 * bounds.width, objective.nuisance_parameters.size
    if nuisance_count:
        scale[-nuisance_count:] = np.minimum(objective.nuisance_parameters.sd, bounds.width[-nuisance_count:])
    result = least_squares(
        lambda part: evaluate(part)[0],
        initial,
        jac=lambda part: evaluate(part)[1],
        bounds=(bounds.lower[free], bounds.upper[free]),
        x_scale=scale[free],
        loss=loss,
        max_nfev=max_steps,
        ftol=tolerance,
        xtol=10 * tolerance,
        gtol=tolerance,
    )
    observation_count = int(objective.observations.present.sum())
    return Minimum(
        at(np.asarray(result.x)),
        float(result.cost),
        bool(result.status > 0),
        int(result.nfev),
        result.fun[:observation_count],
    )
