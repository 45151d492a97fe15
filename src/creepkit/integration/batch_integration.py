"""Integration of many candidates over many tests in one call of compiled code."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numba import njit

from creepkit.arrays import Floats, Ints, frozen
from creepkit.errors import SolveError
from creepkit.integration.event_location import (
    DIVERGED,
    REACHED_END,
    STATE_LIMIT,
    STEP_TOO_SMALL,
    STRAIN_LIMIT,
    TOO_MANY_STEPS,
    LevelEvents,
    TerminationLimits,
)
from creepkit.integration.point_integration import CandidateParameters, integrate_point
from creepkit.integration.runge_kutta_step import StressControl, step_workspace
from creepkit.integration.stage_problem import UNIAXIAL, Axes
from creepkit.integration.step_control import IntegrationSettings
from creepkit.integration.time_discretisation import SDIRK4, Tableau, merge_programs
from creepkit.kernels.interface import CompiledLaw
from creepkit.records import Program, Status

REASONS = {
    REACHED_END: "",
    STRAIN_LIMIT: "creep strain reached the strain limit",
    STATE_LIMIT: "an internal variable reached its limit",
    DIVERGED: "the creep rate diverged",
    STEP_TOO_SMALL: "the time step became too small",
    TOO_MANY_STEPS: "the cap on steps was reached",
}
"""What each ending means, in words."""


_STATUS = np.full(len(REASONS), int(Status.NOT_CONVERGED))


_STATUS[REACHED_END] = Status.COMPLETE


_STATUS[[STRAIN_LIMIT, STATE_LIMIT, DIVERGED]] = Status.RUPTURED


@dataclass(frozen=True, eq=False)
class PointTest:
    """What a material point goes through: sigma = (driving - stiffness p) exp(p) under load, else without exp(p).

    driving : MPa; stress, nominal stress under constant load, or E times the total strain in relaxation.
    temperature : K. times : (times,) s, non-decreasing. stiffness : MPa; 0 unless the strain is prescribed.
    levels : (levels,) increasing creep strains whose times are wanted; until : s, integrate so far for them.
    """

    driving: Program
    temperature: Program
    times: Floats
    stiffness: float = 0.0
    constant_load: bool = False
    levels: Floats = field(default_factory=lambda: np.zeros(0))
    until: float = 0.0

    def __post_init__(self) -> None:
        times = frozen(np.atleast_1d(self.times))
        if not np.isfinite(times).all() or (np.diff(times) < 0).any() or (times < 0).any():
            raise SolveError("output times must be finite, at or after 0 s, and must not decrease")
        if self.stiffness < 0 or (self.stiffness > 0 and self.constant_load):
            raise SolveError("stiffness must not be negative, and goes with prescribed strain, not with constant load")
        levels = frozen(np.atleast_1d(self.levels))
        if not np.isfinite(levels).all() or (np.diff(levels) < 0).any() or (levels <= 0).any():
            raise SolveError("levels of creep strain must be finite, above 0, and must not decrease")
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "levels", levels)

    @cached_property
    def segments(self) -> Floats:
        """The programs merged, (segments, 6); kept, for a fit asks for them a thousand times."""
        return merge_programs(self.driving, self.temperature, end=self.end)

    @property
    def end(self) -> float:
        """How far to integrate, s."""
        return max(float(self.times[-1]) if self.times.size else 0.0, self.until)


@dataclass(frozen=True, eq=False)
class Integration:
    """Strain of candidates x tests; the tests lie one behind another along the last axis of `strain`.

    strain : (candidates, frames), NaN after an end; starts : (tests + 1,) where each test's frames begin.
    jacobian : (candidates, frames, P) or None, derivatives to the internal parameters.
    terminations : (candidates, tests) codes, see REASONS.
    end_times : (candidates, tests) s.
    steps : (candidates, tests, 2) accepted and rejected steps.
    end_jacobian : (candidates, tests, P) or None, derivatives of ln(end time) to the internal parameters; NaN unless
        the test burst.
    level_times, level_rates : (candidates, levels) s at which strains were reached, and dp/d(ln t) there; NaN for
        levels that were not reached; tests one behind another.
    level_time_jacobian : (candidates, levels, P) or None, derivatives of ln t.
    """

    strain: Floats
    starts: Ints
    jacobian: Floats | None
    terminations: Ints
    end_times: Floats
    steps: Ints
    end_jacobian: Floats | None
    level_times: Floats
    level_rates: Floats
    level_time_jacobian: Floats | None

    @property
    def status(self) -> Ints:
        """Status of each row, (candidates, tests)."""
        return np.asarray(_STATUS[self.terminations])

    def of(self, test: int) -> Floats:
        """Strain of one test, (candidates, times)."""
        return np.asarray(self.strain[:, self.starts[test] : self.starts[test + 1]])


def integrate(
    law: CompiledLaw,
    theta: Floats,
    tests: Sequence[PointTest],
    *,
    settings: IntegrationSettings | None = None,
    jacobian: bool = False,
    axes: Axes = UNIAXIAL,
    tableau: Tableau = SDIRK4,
) -> Integration:
    """Integrate every candidate, theta (candidates, P) in internal form, over every test."""
    theta = np.array(theta, dtype=float, order="C", ndmin=2)
    candidates, parameters = theta.shape
    segments = [t.segments for t in tests]
    starts = np.concatenate([[0], np.cumsum([t.times.size for t in tests], dtype=np.int64)])
    level_offsets = np.concatenate([[0], np.cumsum([t.levels.size for t in tests], dtype=np.int64)])
    segment_offsets = np.concatenate([[0], np.cumsum([s.shape[0] for s in segments], dtype=np.int64)])
    frames, rows = int(starts[-1]), candidates if jacobian else 0
    strain = np.full((candidates, frames), np.nan)
    jacobian_values = np.full((rows, frames, parameters), np.nan)
    terminations = np.zeros((candidates, len(tests)), dtype=np.int64)
    end_times = np.zeros((candidates, len(tests)))
    steps = np.zeros((candidates, len(tests), 2), dtype=np.int64)
    end_jacobian = np.full((rows, len(tests), parameters), np.nan)
    levels = int(level_offsets[-1])
    level_times, level_rates = (np.full((candidates, levels), np.nan) for _ in range(2))
    level_time_jacobian = np.full((rows, levels, parameters), np.nan)
    stress_controls = np.array([[t.stiffness, float(t.constant_load)] for t in tests]).reshape(-1, 2)
    integrate_batch(
        law.update,
        law.sensitivity,
        theta,
        np.array(law.leading_exponent(theta), dtype=float).reshape(candidates),
        np.array(law.initial),
        np.array(law.limits),
        stress_controls,
        axes,
        np.concatenate([*segments, np.zeros((0, 6))]),
        segment_offsets,
        np.concatenate([*(t.times for t in tests), np.zeros(0)]),
        starts,
        settings or IntegrationSettings(),
        tableau,
        strain,
        jacobian_values,
        terminations,
        end_times,
        steps,
        end_jacobian,
        np.concatenate([*(t.levels for t in tests), np.zeros(0)]),
        level_offsets,
        level_times,
        level_rates,
        level_time_jacobian,
    )
    if not jacobian:
        return Integration(strain, starts, None, terminations, end_times, steps, None, level_times, level_rates, None)
    return Integration(
        strain,
        starts,
        jacobian_values,
        terminations,
        end_times,
        steps,
        end_jacobian,
        level_times,
        level_rates,
        level_time_jacobian,
    )


@njit(cache=True, error_model="numpy")
def integrate_batch(
    update: Any,
    sensitivity: Any,
    theta: Floats,
    beta: Floats,
    initial: Floats,
    limits: Floats,
    stress_controls: Floats,
    axes: Axes,
    segments: Floats,
    segment_offsets: Ints,
    times: Floats,
    starts: Ints,
    settings: IntegrationSettings,
    tableau: Tableau,
    strain: Floats,
    jacobian: Floats,
    endings: Ints,
    end_times: Floats,
    steps: Ints,
    end_jacobian: Floats,
    levels: Floats,
    level_offsets: Ints,
    arrivals: Floats,
    arrival_slopes: Floats,
    arrival_jacobian: Floats,
) -> None:
    """Integrate candidates x tests without returning to Python; arrays as in Integration, tests laid end to end."""
    work = step_workspace(initial.size, theta.shape[1], tableau.c.size)
    nothing, unused = np.zeros((0, theta.shape[1])), np.zeros(theta.shape[1])
    for c in range(theta.shape[0]):
        kernel = CandidateParameters(theta[c], beta[c], TerminationLimits(settings.strain_limit, initial, limits))
        for k in range(stress_controls.shape[0]):
            drive = StressControl(stress_controls[k, 0], stress_controls[k, 1], axes)
            first, last = starts[k], starts[k + 1]
            low, high = level_offsets[k], level_offsets[k + 1]
            exact = jacobian.shape[0] > 0
            changes = jacobian[c, first:last] if exact else nothing
            goal = LevelEvents(
                levels[low:high],
                arrivals[c, low:high],
                arrival_slopes[c, low:high],
                arrival_jacobian[c, low:high] if exact else nothing,
                end_jacobian[c, k] if exact else unused,
            )
            ending = integrate_point(
                update,
                sensitivity,
                kernel,
                drive,
                segments[segment_offsets[k] : segment_offsets[k + 1]],
                times[first:last],
                settings,
                tableau,
                work,
                strain[c, first:last],
                changes,
                goal,
            )
            endings[c, k], end_times[c, k] = ending.code, ending.time
            steps[c, k, 0], steps[c, k, 1] = ending.steps, ending.rejected
