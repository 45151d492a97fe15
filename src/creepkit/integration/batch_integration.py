"""Integration of many candidates over many tests in one call of the core."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from creepkit.arrays import Floats, Ints, frozen
from creepkit.core import address, function
from creepkit.errors import SolveError
from creepkit.integration.core_structures import (
    STATUS,
    UNIAXIAL,
    Axes,
    AxesStructure,
    BatchStructure,
    IntegrationSettings,
    check_call,
    checked_times,
    refusal,
    settings_structure,
    tableau_structure,
    write_addresses,
)
from creepkit.integration.time_discretisation import SDIRK4, Tableau, merge_programs
from creepkit.kernels.interface import CompiledLaw
from creepkit.records import Program


@dataclass(frozen=True, eq=False)
class PointTest:
    """What a material point goes through: sigma = (driving - stiffness c) exp(c) under load, else without exp(c).

    c is the creep strain, of a bar along its axis: its equivalent creep strain p grows by the size of the stress, and c
    by p in tension, by -p in compression.

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
        object.__setattr__(self, "times", checked_times(self.times))
        if self.stiffness < 0 or (self.stiffness > 0 and self.constant_load):
            raise SolveError("stiffness must not be negative, and goes with prescribed strain, not with constant load")
        levels = frozen(np.atleast_1d(self.levels))
        if not np.isfinite(levels).all() or (np.diff(levels) < 0).any() or (levels <= 0).any():
            raise SolveError("levels of creep strain must be finite, above 0, and must not decrease")
        object.__setattr__(self, "levels", levels)

    @cached_property
    def segments(self) -> Floats:
        """The programs merged, (segments, 6); kept, for a fit asks for them a thousand times."""
        return merge_programs(_with_zeros(self.driving), self.temperature, end=self.end)

    @property
    def end(self) -> float:
        """How far to integrate, s."""
        return max(float(self.times[-1]) if self.times.size else 0.0, self.until)


@dataclass(frozen=True, eq=False)
class Integration:
    """Strain of candidates x tests; the tests lie one behind another along the last axis of `strain`.

    strain : (candidates, frames), of a bar along its axis, NaN after an end; starts : (tests + 1,) where each test's
        frames begin. path : (candidates, frames) equivalent creep strain; None unless states were to be kept.
    jacobian : (candidates, frames, P) or None, derivatives to the internal parameters.
    terminations : (candidates, tests) codes, see REASONS.
    end_times : (candidates, tests) s.
    steps : (candidates, tests, 2) accepted and rejected steps.
    end_jacobian : (candidates, tests, P) or None, derivatives of ln(end time) to the internal parameters; NaN unless
        the test burst.
    level_times, level_rates : (candidates, levels) s at which strains were reached, and dp/d(ln t) there; NaN for
        levels that were not reached; tests one behind another.
    level_time_jacobian : (candidates, levels, P) or None, derivatives of ln t.
    states : (candidates, frames, S) internal variables, NaN after an end; None unless they were to be kept.
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
    states: Floats | None = None
    path: Floats | None = None

    @property
    def status(self) -> Ints:
        """Status of each row, (candidates, tests)."""
        return np.asarray(STATUS[self.terminations])

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
    keep_states: bool = False,
    axes: Axes = UNIAXIAL,
    tableau: Tableau = SDIRK4,
) -> Integration:
    """Integrate every candidate over every test.

    theta : (candidates, P) internal parameters, or (candidates, tests, P) where tests have values of their own.
    jacobian : calculate derivatives too. keep_states : keep the internal variables at the output times.
    """
    theta = np.array(theta, dtype=float, order="C", ndmin=2)
    if theta.ndim > 2 and theta.shape[1:-1] != (len(tests),):
        raise SolveError(f"parameters of shape {theta.shape} are not (candidates, {len(tests)} tests, parameters)")
    if sentence := refusal(law, theta, of_bar=axes == UNIAXIAL):
        raise SolveError(sentence)
    result, inputs = _unfilled(theta, tests, jacobian), _inputs(law, theta, tests)
    if keep_states:
        result["values"] = np.full((*result["strain"].shape, law.states), np.nan)
        result["path"] = np.full_like(result["strain"], np.nan)
    batch = BatchStructure(
        update=law.update.address,
        sensitivity=law.sensitivity.address,
        candidates=len(theta),
        tests=len(tests),
        parameters=theta.shape[-1],
        states=law.states,
        with_sensitivities=int(jacobian),
        axes=AxesStructure(*axes),
        settings=settings_structure(settings or IntegrationSettings()),
        tableau=tableau_structure(tableau),
    )
    write_addresses(batch, {**inputs, **result})
    if law.back_stresses.any():
        batch.back_stresses = address(law.back_stresses)
    call = function("creepkit_integrate_batch")
    if theta.ndim == 2:
        check_call(call(ctypes.byref(batch)))
    else:
        batch.candidates = batch.tests = 1
        for c, k in np.ndindex(theta.shape[:2]):
            write_addresses(batch, _of_one_test({**inputs, **result}, c, k))
            check_call(call(ctypes.byref(batch)))
    return Integration(
        strain=result["strain"],
        starts=inputs["time_offsets"],
        jacobian=result["jacobian"] if jacobian else None,
        terminations=result["endings"],
        end_times=result["end_times"],
        steps=result["steps"],
        end_jacobian=result["end_jacobian"] if jacobian else None,
        level_times=result["arrivals"],
        level_rates=result["arrival_slopes"],
        level_time_jacobian=result["arrival_jacobian"] if jacobian else None,
        states=result.get("values"),
        path=result.get("path"),
    )


def _inputs(law: CompiledLaw, theta: Floats, tests: Sequence[PointTest]) -> dict[str, Any]:
    """The arrays that the core reads, by the names of its fields; tests laid end to end."""
    return {
        "theta": theta,
        "beta": np.array(law.leading_exponent(theta), dtype=float).reshape(theta.shape[:-1]),
        "initial": np.array(law.initial, dtype=float),
        "limits": np.array(law.limits, dtype=float),
        **_of_tests(tuple(tests)),
    }


@lru_cache(maxsize=256)
def _of_tests(tests: tuple[PointTest, ...]) -> dict[str, Any]:
    """What the core reads of tests; kept, for a fit asks for them a thousand times."""
    segments = [test.segments for test in tests]
    return {
        "stress_controls": np.array([[t.stiffness, float(t.constant_load)] for t in tests]).reshape(-1, 2),
        "segments": np.concatenate([*segments, np.zeros((0, 6))]),
        "segment_offsets": _offsets([s.shape[0] for s in segments]),
        "times": np.concatenate([*(t.times for t in tests), np.zeros(0)]),
        "time_offsets": _offsets([t.times.size for t in tests]),
        "levels": np.concatenate([*(t.levels for t in tests), np.zeros(0)]),
        "level_offsets": _offsets([t.levels.size for t in tests]),
    }


def _of_one_test(arrays: dict[str, Any], candidate: int, test: int) -> dict[str, Any]:
    """Where the arrays of a call of one candidate in one test begin, of those of all with values of their own.

    Offsets count from the beginning of the segments, times and levels of all tests, as in the call of all.
    """
    by_test = ("theta", "beta", "endings", "end_times", "steps", "end_jacobian")
    by_candidate = ("strain", "path", "values", "jacobian", "arrivals", "arrival_slopes", "arrival_jacobian")
    of_tests = ("stress_controls", "segment_offsets", "time_offsets", "level_offsets")
    return {
        **{name: arrays[name][candidate, test:] for name in by_test if len(arrays[name])},
        **{name: arrays[name][candidate] for name in by_candidate if name in arrays and len(arrays[name])},
        **{name: arrays[name][test:] for name in of_tests},
    }


def _with_zeros(program: Program) -> Program:
    """The program with a breakpoint wherever it passes zero between two others: a segment's stress has one sign."""
    times, values = program.times, program.values
    crossed = np.flatnonzero((values[:-1] * values[1:] < 0.0) & (times[1:] > times[:-1]))
    if not crossed.size:
        return program
    share = values[crossed] / (values[crossed] - values[crossed + 1])
    zeros = times[crossed] + share * (times[crossed + 1] - times[crossed])
    return Program(np.insert(times, crossed + 1, zeros), np.insert(values, crossed + 1, 0.0))


def _offsets(sizes: list[int]) -> Ints:
    """Where each of several arrays begins when they are laid end to end, and where the last ends."""
    return np.concatenate([[0], np.cumsum(sizes, dtype=np.int64)]).astype(np.int64)


def _unfilled(theta: Floats, tests: Sequence[PointTest], jacobian: bool) -> dict[str, Any]:
    """The arrays that the core writes, by the names of its fields, NaN so far; derivatives only where wanted."""
    candidates, parameters = len(theta), theta.shape[-1]
    frames, levels, count = sum(t.times.size for t in tests), sum(t.levels.size for t in tests), len(tests)
    rows = candidates if jacobian else 0
    return {
        "strain": np.full((candidates, frames), np.nan),
        "jacobian": np.full((rows, frames, parameters), np.nan),
        "endings": np.zeros((candidates, count), dtype=np.int64),
        "end_times": np.zeros((candidates, count)),
        "steps": np.zeros((candidates, count, 2), dtype=np.int64),
        "end_jacobian": np.full((rows, count, parameters), np.nan),
        "arrivals": np.full((candidates, levels), np.nan),
        "arrival_slopes": np.full((candidates, levels), np.nan),
        "arrival_jacobian": np.full((rows, levels, parameters), np.nan),
    }
