"""Cost functions with known minima, for searches: functions of u within bounds, refined by scipy."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import minimize

from creepkit.inverse.bounds import Bounds
from creepkit.inverse.search.local_refinement import Minimum
from creepkit.inverse.settings import IdentificationSettings


@dataclass
class Known:
    """A problem whose cost is a function of u, (candidates, parameters) to (candidates,); calls counts candidates."""

    of: Callable[[np.ndarray], np.ndarray]
    bounds: Bounds
    settings: IdentificationSettings = field(default_factory=IdentificationSettings)
    calls: list[int] = field(default_factory=list)
    seen: list[np.ndarray] = field(default_factory=list)

    def cost(self, u):
        self.calls.append(len(u))
        self.seen.append(u)
        return self.of(u)

    def check_predicted(self, u: np.ndarray) -> None:
        """A function has a value everywhere."""

    def minimise(self, u: np.ndarray) -> Minimum:
        bounds = list(zip(self.bounds.lower, self.bounds.upper, strict=True))
        found = minimize(lambda x: float(self.of(x[None])[0]), u, bounds=bounds, method="L-BFGS-B")
        return Minimum(found.x, float(found.fun), bool(found.success), int(found.nfev))


def cube(size: int, half_width: float = 5.0) -> Bounds:
    """All coordinates from -half_width to half_width."""
    return Bounds(np.full(size, -half_width), np.full(size, half_width))


def quadratic(u):
    """Minimum 0 at (1, 2, ..), 100 times steeper in each further coordinate of three."""
    k = np.arange(u.shape[1])
    return (100.0**k * (u - (k + 1)) ** 2).sum(axis=1)


def rosenbrock(u):
    """Minimum 0 at (1, 1, ..), at the end of a curved valley (Rosenbrock 1960)."""
    return (100.0 * (u[:, 1:] - u[:, :-1] ** 2) ** 2 + (1.0 - u[:, :-1]) ** 2).sum(axis=1)


def rastrigin(u):
    """Minimum 0 at the origin among one minimum for each whole number in each coordinate (Rastrigin 1974)."""
    return (u**2 - 10.0 * np.cos(2.0 * np.pi * u) + 10.0).sum(axis=1)
