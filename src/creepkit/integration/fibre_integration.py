"""Integration of models of fibres in the compiled core, and single steps of fibres whose strains are given.

The implicit method, its error control and the transformed time are those of a single point; Newton's method in the
amplitudes of the modes rests on the consistent tangents of the fibres. A fibre creeps at the law's rate at the size of
its stress and in its direction: in compression the largest principal stress is zero and the mean stress below it.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from creepkit.arrays import ArrayLike, Floats, frozen
from creepkit.core import function
from creepkit.errors import SolveError
from creepkit.integration.batch_integration import REASONS
from creepkit.integration.core_structures import (
    check_call,
    refusal,
    settings_structure,
    tableau_structure,
    write_addresses,
)
from creepkit.integration.event_location import REACHED_END, STEP_TOO_SMALL, TOO_MANY_STEPS
from creepkit.integration.fibre_model import FibreInput, FibreModel
from creepkit.integration.fibre_structures import FibreCallStructure, FibreModelStructure, FibreStepStructure
from creepkit.integration.step_control import IntegrationSettings
from creepkit.integration.time_discretisation import SDIRK4, Tableau, merge_programs
from creepkit.kernels.interface import CompiledLaw
from creepkit.records import Program, Status

MAX_LOADS = 8
"""Loads of a model of fibres, at most."""


@dataclass(frozen=True, eq=False)
class FibreTest:
    """What a model of fibres goes through.

    loads : one program for each load of the model. temperature : K. modulus : MPa.
    times : (times,) s, non-decreasing, at which sums of the creep strains are recorded.
    follows_stress : keep errors small beside the elastic strains, as where strains are prescribed and forces observed.
    SolveError for other times, or another number of loads, or a modulus that is not above zero.
    """

    model: FibreModel
    loads: tuple[Program, ...]
    temperature: Program
    modulus: Program
    times: Floats
    follows_stress: bool = False

    def __post_init__(self) -> None:
        times = frozen(np.atleast_1d(self.times))
        if not times.size or not np.isfinite(times).all() or (np.diff(times) < 0).any() or (times < 0).any():
            raise SolveError("output times must be finite, at or after 0 s, must not decrease, and there must be one")
        if len(self.loads) != len(self.model.stress) or len(self.loads) > MAX_LOADS:
            raise SolveError(
                f"a test of fibres has {len(self.loads)} programs of loads; its model needs {len(self.model.stress)}, "
                f"and at most {MAX_LOADS} are allowed"
            )
        if not (self.modulus.values > 0).all():
            raise SolveError(f"a modulus of {self.modulus.values.min():g} MPa is not above zero")
        object.__setattr__(self, "times", times)

    @property
    def segments(self) -> Floats:
        """The programs merged, (segments, columns): start and end, s, then loads, temperature and modulus at both."""
        return _merged(float(self.times[-1]), *self.loads, self.temperature, self.modulus)


@lru_cache(maxsize=256)
def _merged(end: float, *programs: Program) -> Floats:
    """Segments of programs; kept, for the sections of a beam, and the evaluations of a fit, share them."""
    return frozen(merge_programs(*programs, end=end))


@dataclass(frozen=True, eq=False)
class FibreHistory:
    """What a model of fibres recorded.

    recorded : (times, rows) sums of the creep strains, NaN after the end.
    jacobian : (times, rows, P + inputs) or None, derivatives to the law's internal parameters, then to the inputs.
    termination : code of the ending, see REASONS; end_time : s. A limit counts where the first fibre reaches it.
    steps, rejected : how many were accepted, and tried in vain.
    """

    recorded: Floats
    jacobian: Floats | None
    termination: int
    end_time: float
    steps: int
    rejected: int

    @property
    def status(self) -> Status:
        """How it ended."""
        if self.termination == REACHED_END:
            return Status.COMPLETE
        return Status.NOT_CONVERGED if self.termination in (STEP_TOO_SMALL, TOO_MANY_STEPS) else Status.RUPTURED

    @property
    def reason(self) -> str:
        """Why it ended early, in words; "" where it did not."""
        return REASONS[self.termination]


def integrate_fibres(
    law: CompiledLaw,
    theta: Floats,
    test: FibreTest,
    *,
    settings: IntegrationSettings | None = None,
    jacobian: bool = False,
    inputs: Sequence[FibreInput] = (),
    tableau: Tableau = SDIRK4,
) -> FibreHistory:
    """Integrate one candidate over one test; SolveError for a law or a theta that the core does not take.

    theta : (P,) internal parameters. jacobian : calculate derivatives too, to theta and to the inputs.
    """
    theta = np.array(theta, dtype=float, order="C")
    if theta.ndim != 1:
        raise SolveError(f"theta has shape {theta.shape}; one candidate of {len(law.names)} numbers is needed")
    if sentence := refusal(law, theta):
        raise SolveError(sentence)
    times, rows = test.times.size, len(test.model.observed)
    columns = theta.size + len(inputs) if jacobian else 0
    recorded, slopes = np.full((times, rows), np.nan), np.full((times, rows, columns), np.nan)
    structure, kept = _model_structure(test.model, inputs if jacobian else ())
    arrays = {
        "theta": theta,
        "initial": np.array(law.initial, dtype=float),
        "limits": np.array(law.limits, dtype=float),
        "segments": test.segments,
        "times": test.times,
        "recorded": recorded,
        "jacobian": slopes,
    }
    call = FibreCallStructure(
        update=law.update.address,
        sensitivity=law.sensitivity.address,
        states=law.states,
        parameters=theta.size,
        with_sensitivities=int(jacobian),
        follows_stress=int(test.follows_stress),
        segment_count=len(arrays["segments"]),
        time_count=times,
        beta=float(np.ravel(law.leading_exponent(theta))[0]),
        model=structure,
        settings=settings_structure(settings or IntegrationSettings()),
        tableau=tableau_structure(tableau),
    )
    write_addresses(call, arrays)
    check_call(function("creepkit_integrate_fibres")(ctypes.byref(call)))
    del kept
    return FibreHistory(
        recorded, slopes if jacobian else None, int(call.ending), float(call.end_time), call.steps, call.rejected
    )


def _model_structure(model: FibreModel, inputs: Sequence[FibreInput]) -> tuple[FibreModelStructure, list[Floats]]:
    """The model as the core reads it, and the arrays that must outlive the call."""
    arrays = {
        "stress": model.stress,
        "strain": model.strain,
        "mode_strains": model.modes,
        "projection": model.projection,
        "observed": model.observed,
    }
    if inputs:
        for name, key in (("stress", "stress"), ("strain", "strain"), ("mode", "modes"), ("projection", "projection")):
            arrays[f"{name}_change"] = np.ascontiguousarray([getattr(each, key) for each in inputs], dtype=float)
        arrays["offsets"] = np.array([(each.temperature, each.modulus) for each in inputs], dtype=float)
    structure = FibreModelStructure(
        model.fibres, model.modes.shape[1], len(model.stress), len(model.observed), len(inputs)
    )
    write_addresses(structure, arrays)
    return structure, list(arrays.values())


@dataclass(frozen=True, eq=False)
class FibreState:
    """Where fibres are.

    creep : (fibres,) signed creep strains. path : (fibres,) lengths of their paths.
    state : (fibres, S) internal variables of the law.
    """

    creep: Floats
    path: Floats
    state: Floats

    @classmethod
    def virgin(cls, law: CompiledLaw, fibres: int) -> FibreState:
        """Fibres that have not crept."""
        return cls(np.zeros(fibres), np.zeros(fibres), np.tile(np.asarray(law.initial, float), (fibres, 1)))


@dataclass(frozen=True, eq=False)
class FibreResponse:
    """What a step of fibres gives.

    stress : (fibres,) MPa. tangent : (fibres,) MPa, d(stress)/d(total strain), both at the end of the step.
    state : the fibres after it.
    """

    stress: Floats
    tangent: Floats
    state: FibreState


def step_fibres(
    law: CompiledLaw,
    theta: Floats,
    strain: ArrayLike,
    before: FibreState,
    interval: tuple[float, float],
    *,
    temperature: float,
    modulus: float,
) -> FibreResponse:
    """One step of the backward Euler method for fibres whose total strains are given, with consistent tangents.

    theta : (P,) internal parameters. strain : (fibres,) total mechanical strains at the end of the step.
    interval : start and end of the step, s; temperature, K, and modulus, MPa, are those at the end.
    SolveError where a fibre has no solution: take a shorter step.
    """
    theta, strain = np.array(theta, dtype=float), np.array(strain, dtype=float)
    if sentence := refusal(law, theta):
        raise SolveError(sentence)
    start, end = interval
    if not (end > start >= 0.0 and modulus > 0.0 and np.isfinite([end, modulus, temperature]).all()):
        raise SolveError(
            f"a step of fibres from {start:g} to {end:g} s with a modulus of {modulus:g} MPa; time must increase from "
            "0 s or later, and the modulus must be above zero"
        )
    fibres, shape = strain.size, (strain.size, law.states)
    arrays = {"theta": theta, "strain": strain}
    for name, size in (("creep", (fibres,)), ("path", (fibres,)), ("state", shape)):
        array = np.array(getattr(before, name), dtype=float)
        if array.shape != size or strain.ndim != 1 or not fibres:
            raise SolveError(f"a step of {fibres} fibres: {name} has shape {array.shape}; it needs {size}")
        arrays[name] = array
    results = {name: np.zeros(fibres) for name in ("stress", "tangent", "new_creep", "new_path")}
    results["new_state"] = np.zeros(shape)
    step = FibreStepStructure(
        update=law.update.address,
        fibres=fibres,
        states=law.states,
        time=end,
        length=end - start,
        temperature=temperature,
        modulus=modulus,
    )
    write_addresses(step, {**arrays, **results})
    solved = function("creepkit_step_fibres")(ctypes.byref(step))
    if solved < 0:
        raise MemoryError("no memory for a step of fibres")
    if solved < fibres:
        raise SolveError(
            f"fibre {solved + 1} of {fibres} has no solution at the end of a step of {end - start:g} s; "
            "take a shorter step"
        )
    after = FibreState(results["new_creep"], results["new_path"], results["new_state"])
    return FibreResponse(results["stress"], results["tangent"], after)
