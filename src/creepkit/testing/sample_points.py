"""Sample points of a law: Sobol points of the full bounds and of the ranges that creep tests cover."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from creepkit.arrays import Bools, Floats
from creepkit.kernels.interface import POINT_SIZE
from creepkit.kernels.lowering import ArrayKernel
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import POINT_VARIABLES, State
from creepkit.sampling.domains import constraint_functions, uniform_in_bounds

STRESS_RANGE, STRAIN_RANGE, TIME_RANGE, TEMPERATURE_RANGE = (1e-3, 2000.0), (1e-12, 1.0), (1e-3, 1e6), (600.0, 1600.0)
"""Ranges in MPa, 1, s and K."""


_MOST_BATCHES = 64
"""How many times as many points are drawn, at most, to find enough where the law's constraints hold."""


STRESS_COLUMNS = [0, 4, 5]
"""Of a point, which grow together."""


CHECKED_CONDITION = 0.05
"""In the unit of the law: a usual number for a grain size in mm, a content, a dose."""


def with_numbers(law: CreepLaw) -> CreepLaw:
    """The law with CHECKED_CONDITION for each condition of the material; itself where it has none."""
    return law.at(None, **{condition.name: CHECKED_CONDITION for condition in law.conditions})


@dataclass(frozen=True, eq=False)
class LawSamples:
    """Points at which the constraints of a law hold.

    points : (samples, 6 + states) stress, strain, time, temperature, largest principal and mean stress, then states, in
        MPa, s and K. theta : (samples, parameters) internal values.
    """

    points: Floats
    theta: Floats

    def __len__(self) -> int:
        return len(self.points)

    def arguments(self) -> list[Floats]:
        """The columns of points and theta, each (samples,), as the internal methods of kernels take them."""
        return [*self.points.T, *self.theta.T]

    def at(self, **columns: float) -> LawSamples:
        """The same with variables of the point set to numbers: at(strain=0.0)."""
        points = self.points.copy()
        for name, value in columns.items():
            points[:, [s.name for s in POINT_VARIABLES].index(name)] = value
        return LawSamples(points, self.theta)

    def scaled(self, columns: list[int], factor: float) -> LawSamples:
        """The same with columns of the point times a factor."""
        points = self.points.copy()
        points[:, columns] *= factor
        return LawSamples(points, self.theta)


def log_rate(kernel: ArrayKernel, samples: LawSamples) -> Floats:
    """The ln rate at samples, (samples,)."""
    return np.asarray(kernel.internal_log_rate(*samples.arguments()), float)


def point_text(law: CreepLaw, point: Floats) -> str:
    """What a law uses of a point, in words; point : (6 + states,) MPa, s and K."""
    pairs = zip((*POINT_VARIABLES, *law.states), point, strict=True)
    return ", ".join(f"{s.name} {value:.4g}" for s, value in pairs if law.uses(s))


def draw_samples(law: CreepLaw, samples: int, seed: int = 0) -> LawSamples:
    """Return Sobol points at which the law's constraints hold: `samples`, a power of two, or fewer if such are rare."""
    size = POINT_SIZE + len(law.states) + len(law.params)
    sequence = qmc.Sobol(size, seed=seed)
    points, theta = np.empty((0, POINT_SIZE + len(law.states))), np.empty((0, len(law.params)))
    for _ in range(_MOST_BATCHES):
        unit = sequence.random(samples)
        new_points = _to_points(law, unit[:, : points.shape[1]])
        new_theta = uniform_in_bounds(law, unit[:, points.shape[1] :])
        satisfied = constraints_hold(law, new_points, new_theta)
        points, theta = np.vstack([points, new_points[satisfied]]), np.vstack([theta, new_theta[satisfied]])
        if len(points) >= samples:
            break
    return LawSamples(points[:samples], theta[:samples])


def constraints_hold(law: CreepLaw, points: Floats, theta: Floats) -> Bools:
    """Where every constraint of the law holds, (samples,); points (samples, 6 + S), theta (samples, parameters)."""
    values = [np.exp(t) if p.scale == "log" else t for p, t in zip(law.params.values(), theta.T, strict=True)]
    holds = np.ones(len(points), bool)
    for test in constraint_functions(law):
        holds &= np.asarray(test(*points.T, *values), bool)
    return holds


def _to_points(law: CreepLaw, unit: Floats) -> Floats:
    """Stress, strain, time spread over decades; the mean stress 0 to 1.5 of the von Mises stress, from torsion to
    notches, and the largest principal stress above it by 1/3 to 2/3 of the latter, as any state of stress has it. In
    compression rates of damage are zero, which no relative error can be stated of.
    """
    stress, strain, time = map(_log_between, unit.T, (STRESS_RANGE, STRAIN_RANGE, TIME_RANGE))
    temperature = TEMPERATURE_RANGE[0] + unit[:, 3] * (TEMPERATURE_RANGE[1] - TEMPERATURE_RANGE[0])
    mean = 1.5 * stress * unit[:, 5]
    principal = mean + stress * (1.0 + unit[:, 4]) / 3.0
    point = [stress, strain, time, temperature, principal, mean]
    state_values = [_state_between(u, state) for u, state in zip(unit.T[POINT_SIZE:], law.states.values(), strict=True)]
    return np.stack([*point, *state_values], axis=1)


def _state_between(u: Floats, state: State) -> Floats:
    """From just after the start of an internal variable to just before its limit (or 1 from its start)."""
    distance = 1.0 if state.limit is None else state.limit - state.initial
    return state.initial + (0.01 + 0.94 * u) * distance


def _log_between(u: Floats, bounds: tuple[float, float]) -> Floats:
    low, high = np.log(bounds)
    return np.asarray(np.exp(low + u * (high - low)))
