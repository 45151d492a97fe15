"""Integration of models of fibres in the compiled core.

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

from creepkit.arrays import Floats, frozen
from creepkit.core import function
from creepkit.errors import SolveError
from creepkit.integration.core_structures import (
    REASONS,
    STATUS,
    FibreCallStructure,
    FibreModelStructure,
    IntegrationSettings,
    check_call,
    checked_times,
    refusal,
    settings_structure,
    tableau_structure,
    write_addresses,
)
from creepkit.integration.fibre_model import FibreInput, FibreModel
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
        object.__setattr__(self, "times", checked_times(self.times))
        if not self.times.size:
            raise SolveError("a test of fibres has no output times; give one at least")
        if len(self.loads) != len(self.model.stress) or len(self.loads) > MAX_LOADS:
            raise SolveError(
                f"a test of fibres has {len(self.loads)} programs of loads; its model needs {len(self.model.stress)}, "
                f"and at most {MAX_LOADS} are allowed"
            )
        if not (self.modulus.values > 0).all():
            raise SolveError(f"a modulus of {self.modulus.values.min():g} MPa is not above zero")

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
        return Status(int(STATUS[self.termination]))

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
