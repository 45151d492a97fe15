"""Adaptive integration of one material point under prescribed stresses and strains of its six components."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import exp, inf, isfinite
from typing import Literal, NamedTuple

import numpy as np

from creepkit.arrays import ArrayLike, Floats, frozen
from creepkit.errors import SolveError
from creepkit.integration.batch_integration import REASONS
from creepkit.integration.event_location import (
    DIVERGED,
    REACHED_END,
    STATE_LIMIT,
    STEP_TOO_SMALL,
    STRAIN_LIMIT,
    TERMINATION_MARGIN,
    TOO_MANY_STEPS,
)
from creepkit.integration.step_control import INITIAL_ERROR_FACTOR, IntegrationSettings, step_factor
from creepkit.integration.tensor_point import EQUIVALENT_STRAIN, TensorPoint
from creepkit.integration.time_discretisation import (
    SDIRK2,
    Tableau,
    TimeTransformation,
    linear_time,
    merge_programs,
    position,
    power_law_time,
    transformed_time,
)
from creepkit.kernels.interface import CompiledLaw
from creepkit.records import TENSOR_COMPONENTS, Program, Status

_SMALLEST_STEP, _SMALLEST_FIRST_STEP = 1e-13, 1e-60


class TensorSegment(NamedTuple):
    """start and end, s; the six imposed quantities and the temperature at both, (7,)."""

    start: float
    end: float
    first: Floats
    last: Floats

    def at(self, time: float) -> Floats:
        """The imposed quantities and the temperature within the segment."""
        return np.asarray(self.first + (time - self.start) / (self.end - self.start) * (self.last - self.first))


def tensor_segments(programs: list[Program], end: float) -> list[TensorSegment]:
    """Merge the programs from 0 to `end`, so that each is a straight line in every segment."""
    rows = merge_programs(*programs, end=end)
    return [TensorSegment(row[0], row[1], row[2::2], row[3::2]) for row in rows]


class TensorIntegrator:
    """The integration of a virgin point from time zero; `history` holds its vectors at the output times reached."""

    def __init__(self, point: TensorPoint, settings: IntegrationSettings, tableau: Tableau, outputs: Floats) -> None:
        self.point, self.settings, self.tableau, self.outputs = point, settings, tableau, outputs
        self.value = np.concatenate([np.zeros(EQUIVALENT_STRAIN + 1), point.law.initial])
        self.slopes = np.zeros((tableau.stages, self.value.size))
        self.history: list[Floats] = []
        self.time, self.steps, self.attempts = 0.0, 0, 0
        self._record()

    def integrate(self, segments: list[TensorSegment]) -> int:
        """Go through the segments; return the code of the ending."""
        for segment in segments:
            code = self._through(segment)
            if code != REACHED_END:
                return code
        return REACHED_END

    def _record(self) -> None:
        while len(self.history) < self.outputs.size and self.outputs[len(self.history)] <= self.time:
            self.history.append(self.value)

    def _through(self, segment: TensorSegment) -> int:
        """Integrate over one segment in its transformed time s, from 0 to 1."""
        clock = self._clock(segment)
        s, h = 0.0, self.settings.first
        while s < 1.0:
            goal, time = self._goal(clock, segment)
            h = min(h, self.settings.longest)
            last = s + 1.001 * h > goal
            step = goal - s if last else h
            if self.attempts >= self.settings.max_steps:
                return TOO_MANY_STEPS
            if not (step >= _SMALLEST_STEP * s and step >= _SMALLEST_FIRST_STEP):
                return self._why_small(clock, s)
            self.attempts += 1
            new, error = self._attempt(segment, clock, s, step)
            if not error <= 1.0:
                h = step * step_factor(self.tableau, error, False)
                continue
            grown = step * step_factor(self.tableau, error, True)
            h = max(h, grown) if last else grown
            code = self._limit(new)
            if code != REACHED_END:
                self.time = transformed_time(clock, s + step * self._crossing(new, step)).time
                return code
            s, self.value, self.steps = (goal if last else s + step), new, self.steps + 1
            self.time = time if last else transformed_time(clock, s).time
            self._record()
        return REACHED_END

    def _clock(self, segment: TensorSegment) -> TimeTransformation:
        """A time transformation in which a virgin point creeps evenly, else plain time."""
        length = segment.end - segment.start
        if self.value[EQUIVALENT_STRAIN] > 0.0:
            return linear_time(segment.start, length)
        beta = float(np.reshape(self.point.law.leading_exponent(self.point.theta[None]), -1)[0])
        return power_law_time(segment.start, length, beta)

    def _goal(self, clock: TimeTransformation, segment: TensorSegment) -> tuple[float, float]:
        """Position and time of the next output, or of the segment's end."""
        done = len(self.history)
        if done < self.outputs.size and self.outputs[done] < segment.end:
            return position(clock, self.outputs[done]), float(self.outputs[done])
        return 1.0, segment.end

    def _attempt(self, segment: TensorSegment, clock: TimeTransformation, s: float, h: float) -> tuple[Floats, float]:
        """The vector after a step and its error over what is allowed, infinite when a stage has no solution."""
        tableau, slopes = self.tableau, np.zeros_like(self.slopes)
        slope = self.slopes[-1] if s > 0.0 else np.zeros_like(self.value)
        for i in range(tableau.stages):
            base = self.value + h * tableau.a[i, :i] @ slopes[:i]
            now, share = transformed_time(clock, s + tableau.c[i] * h), tableau.a[i, i] * h
            imposed = segment.at(now.time)
            answer = self.point.solve_stage(
                base, base + share * slope, imposed[:6], now.time, float(imposed[6]), share * exp(now.log_pace)
            )
            if answer is None:
                return self.value, inf
            slopes[i] = slope = (answer - base) / share
        new = self.value + h * tableau.a[-1] @ slopes
        error = self._error(new, h * tableau.error @ slopes) * (
            INITIAL_ERROR_FACTOR if s == 0.0 and clock.tau == 0.0 else 1
        )
        if error <= 1.0:
            self.slopes = slopes
        return new, error

    def _error(self, new: Floats, errors: Floats) -> float:
        """Largest local error over what is allowed; under prescribed strain the elastic strain counts as well."""
        if new[EQUIVALENT_STRAIN] < self.value[EQUIVALENT_STRAIN]:
            return inf
        reach = np.maximum(np.abs(new), np.abs(self.value))
        reach[:EQUIVALENT_STRAIN] = reach[EQUIVALENT_STRAIN]
        if not self.point.free.all():
            elastic = self.point.equivalent_stress / (3 * self.point.shear)
            reach[: EQUIVALENT_STRAIN + 1] = np.minimum(reach[: EQUIVALENT_STRAIN + 1], elastic)
        worst = float(np.max(np.abs(errors) / (self.settings.rtol * (reach + self.settings.smallest))))
        return worst if isfinite(worst) else inf

    def _limit(self, new: Floats) -> int:
        """STATE_LIMIT or STRAIN_LIMIT when a vector has passed one, else REACHED_END."""
        limits, initial, states = self.point.law.limits, self.point.law.initial, new[EQUIVALENT_STRAIN + 1 :]
        passed = np.where(limits > initial, states >= limits, states <= limits) & np.isfinite(limits)
        if passed.any():
            return STATE_LIMIT
        return STRAIN_LIMIT if new[EQUIVALENT_STRAIN] >= self.settings.strain_limit else REACHED_END

    def _crossing(self, new: Floats, h: float) -> float:
        """Share of the step at which the first limit is passed, by bisection of the dense output."""
        low, high, powers = 0.0, 1.0, 1 + np.arange(self.tableau.dense.shape[1])
        for _ in range(60):
            middle = 0.5 * (low + high)
            between = self.value + h * (self.tableau.dense @ middle**powers) @ self.slopes
            low, high = (low, middle) if self._limit(between) != REACHED_END else (middle, high)
        return high

    def _why_small(self, clock: TimeTransformation, s: float) -> int:
        """A step that shrinks to nothing: at a limit just ahead, or while the rate would burst the point at once."""
        if s > 0.0 and self._limit_ahead(clock, s):
            return STATE_LIMIT
        rate = self.slopes[-1, EQUIVALENT_STRAIN] * max(s, 1e-6)
        return DIVERGED if rate > self.settings.strain_limit else STEP_TOO_SMALL

    def _limit_ahead(self, clock: TimeTransformation, s: float) -> bool:
        """Whether a state that moves ever faster will pass its limit before the time has grown by UNRESOLVED of it."""
        gap = self.point.law.limits - self.value[EQUIVALENT_STRAIN + 1 :]
        first, last = self.slopes[[0, -1], EQUIVALENT_STRAIN + 1 :]
        now = transformed_time(clock, s)
        reach = TERMINATION_MARGIN * np.abs(last) * now.time / exp(now.log_pace)
        faster = (last * gap > 0.0) & (np.abs(last) > np.abs(first))
        return bool((faster & (np.abs(gap) < reach)).any())


_BURST = (STRAIN_LIMIT, STATE_LIMIT, DIVERGED)


@dataclass(frozen=True)
class ComponentControl:
    """What is prescribed in one component: stress in MPa, or total strain (of the tensor), over time."""

    quantity: Literal["stress", "strain"]
    program: Program


def prescribed_stress(value: float | Program) -> ComponentControl:
    """A component whose stress is prescribed, MPa."""
    return ComponentControl("stress", value if isinstance(value, Program) else Program.constant(value))


def prescribed_strain(value: float | Program) -> ComponentControl:
    """A component whose total strain is prescribed."""
    return ComponentControl("strain", value if isinstance(value, Program) else Program.constant(value))


@dataclass(frozen=True, eq=False)
class PointTrajectory:
    """What a driven point went through, at the output times that it reached.

    times : (times,) s. stress, strain, creep_strain : (times, 6) MPa and tensor strains, in the order of COMPONENTS.
    equivalent : (times,) equivalent creep strain; states : (times, S) internal variables.
    status, end_time, reason : how it ended, when (s), and why ("" when complete); steps : accepted steps.
    """

    times: Floats
    stress: Floats
    strain: Floats
    creep_strain: Floats
    equivalent: Floats
    states: Floats
    status: Status
    end_time: float
    reason: str
    steps: int


def integrate_tensor_point(
    law: CompiledLaw,
    theta: ArrayLike,
    elastic: tuple[float, float],
    controls: Mapping[str, ComponentControl],
    temperature: float | Program,
    times: ArrayLike,
    *,
    settings: IntegrationSettings | None = None,
    tableau: Tableau = SDIRK2,
) -> PointTrajectory:
    """Drive a virgin point from time zero.

    theta : (P,) internal parameters, see CompiledLaw. elastic : E in MPa, and nu.
    controls : by component; those not named are free of stress. temperature : K. times : (times,) s, non-decreasing.
    """
    outputs = np.atleast_1d(np.asarray(times, dtype=float))
    _check(law, np.size(theta), elastic, controls, outputs)
    component_controls = [controls.get(name, prescribed_stress(0.0)) for name in TENSOR_COMPONENTS]
    strain_controlled = np.array([control.quantity == "strain" for control in component_controls])
    point = TensorPoint(law, np.array(theta, dtype=float).reshape(-1), elastic, strain_controlled)
    programs = [*(c.program for c in component_controls), prescribed_stress(temperature).program]
    integrator = TensorIntegrator(point, settings or IntegrationSettings(), tableau, outputs)
    code = integrator.integrate(tensor_segments(programs, float(outputs.max(initial=0.0))))
    rows = np.array(integrator.history).reshape(-1, EQUIVALENT_STRAIN + 1 + law.states)
    reached = outputs[: len(rows)]
    imposed = np.stack([c.program.at(reached) for c in component_controls], axis=-1)
    elastic_responses = [point.elastic_response(i, row[:6]) for i, row in zip(imposed, rows, strict=True)]
    stress, strain = np.array(elastic_responses).reshape(-1, 2, 6).swapaxes(0, 1)
    status = Status.COMPLETE if code == REACHED_END else Status.RUPTURED if code in _BURST else Status.NOT_CONVERGED
    return PointTrajectory(
        times=frozen(reached),
        stress=frozen(stress),
        strain=frozen(strain),
        creep_strain=frozen(rows[:, :6]),
        equivalent=frozen(rows[:, EQUIVALENT_STRAIN]),
        states=frozen(rows[:, EQUIVALENT_STRAIN + 1 :]),
        status=status,
        end_time=float(integrator.time),
        reason=REASONS[code],
        steps=integrator.steps,
    )


def _check(
    law: CompiledLaw,
    parameters: int,
    elastic: tuple[float, float],
    controls: Mapping[str, ComponentControl],
    outputs: Floats,
) -> None:
    """One sentence for what cannot be driven."""
    if not np.isfinite(outputs).all() or (np.diff(outputs) < 0).any() or (outputs < 0).any():
        raise SolveError("output times must be finite, at or after 0 s, and must not decrease")
    if parameters != len(law.names):
        raise SolveError(f"theta has {parameters} numbers, but the law needs {len(law.names)}: {', '.join(law.names)}")
    if not (0 < elastic[0] < inf and -1 < elastic[1] < 0.5):
        raise SolveError(f"E is {elastic[0]:g} MPa and nu {elastic[1]:g}; allowed are E above 0 and nu in (-1, 0.5)")
    for name in controls:
        if name not in TENSOR_COMPONENTS:
            raise SolveError(f"there is no component '{name}' to drive; allowed are {', '.join(TENSOR_COMPONENTS)}")
