"""What the integrators of `src/core` are called with, field by field, and how an integration ends."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from creepkit.arrays import ArrayLike, Floats, Ints, frozen
from creepkit.core import address
from creepkit.errors import SolveError
from creepkit.integration.time_discretisation import Tableau
from creepkit.kernels.interface import CompiledLaw
from creepkit.records import Status

_NUMBER, _COUNT, _POINTER = ctypes.c_double, ctypes.c_int64, ctypes.c_void_p


REACHED_END, STRAIN_LIMIT, STATE_LIMIT, DIVERGED, STEP_TOO_SMALL, TOO_MANY_STEPS = range(6)
"""Codes of an ending, as in `event_location.hpp`; whatever it is, the history so far is kept."""


REASONS = {
    REACHED_END: "",
    STRAIN_LIMIT: "creep strain reached the strain limit",
    STATE_LIMIT: "an internal variable reached its limit",
    DIVERGED: "the creep rate diverged",
    STEP_TOO_SMALL: "the time step became too small",
    TOO_MANY_STEPS: "the cap on steps was reached",
}
"""What each ending means, in words."""


STATUS = np.full(len(REASONS), int(Status.NOT_CONVERGED))
STATUS[REACHED_END] = Status.COMPLETE
STATUS[[STRAIN_LIMIT, STATE_LIMIT, DIVERGED]] = Status.RUPTURED


BACK_STRESS_OF_BARS = (
    "the law has a back stress, whose direction bars alone follow: use the specimen uniaxial or relaxation, or a law "
    "without one"
)


MAX_STATES = 16
"""Internal variables of a law, at most."""


class IntegrationSettings(NamedTuple):
    """How accurately, and how far, to integrate.

    rtol : local error allowed in a step, relative to strain and to each state.
    smallest : strain below which the error is relative to this instead.
    strain_limit : creep strain at which the point has burst.
    max_steps : cap on steps, accepted and rejected, of one history, beside 20 for each further straight piece of its
        programs.
    first, longest : first and longest step, as shares of a segment (in its transformed time).
    """

    rtol: float = 1e-5
    smallest: float = 1e-7
    strain_limit: float = 1.0
    max_steps: int = 2000
    first: float = 0.02
    longest: float = 0.2


class Axes(NamedTuple):
    """Largest principal and mean stress as straight lines in the equivalent stress: offset + slope sigma, MPa."""

    principal: float
    principal_slope: float
    mean: float
    mean_slope: float


UNIAXIAL = Axes(0.0, 1.0, 0.0, 1.0 / 3.0)
"""Uniaxial tension: the largest principal stress is the stress, the mean stress a third of it."""


class AxesStructure(ctypes.Structure):
    """Axes of `stage_problem.hpp`."""

    _fields_ = [(name, _NUMBER) for name in Axes._fields]


class SettingsStructure(ctypes.Structure):
    """IntegrationSettings of `step_control.hpp`."""

    _fields_ = [
        *((name, _NUMBER) for name in ("rtol", "smallest", "strain_limit", "first", "longest")),
        ("max_steps", _COUNT),
    ]


class TableauStructure(ctypes.Structure):
    """Tableau of `tableaux.hpp`."""

    _fields_ = [
        *((name, _COUNT) for name in ("stages", "degree", "error_order")),
        *((name, _POINTER) for name in ("a", "c", "error", "dense")),
    ]


class BatchStructure(ctypes.Structure):
    """BatchIntegration of `batch_integration.cpp`, where every field's shape is given."""

    _fields_ = [
        *((name, _POINTER) for name in ("update", "sensitivity")),
        *((name, _COUNT) for name in ("candidates", "tests", "parameters", "states", "with_sensitivities")),
        *((name, _POINTER) for name in ("theta", "beta", "initial", "limits", "back_stresses")),
        ("stress_controls", _POINTER),
        *((name, _POINTER) for name in ("segments", "segment_offsets", "times", "time_offsets")),
        *((name, _POINTER) for name in ("levels", "level_offsets")),
        ("axes", AxesStructure),
        ("settings", SettingsStructure),
        ("tableau", TableauStructure),
        *(
            (name, _POINTER)
            for name in ("strain", "path", "values", "jacobian", "endings", "end_times", "steps", "end_jacobian")
        ),
        *((name, _POINTER) for name in ("arrivals", "arrival_slopes", "arrival_jacobian")),
    ]


class TensorStructure(ctypes.Structure):
    """TensorIntegration of `tensor_integration.cpp`, where every field's shape is given."""

    _fields_ = [
        ("update", _POINTER),
        *((name, _COUNT) for name in ("states", "segment_count", "output_count")),
        *((name, _POINTER) for name in ("theta", "initial", "limits", "held", "segments", "outputs")),
        *((name, _NUMBER) for name in ("modulus", "ratio", "beta")),
        ("settings", SettingsStructure),
        ("tableau", TableauStructure),
        ("history", _POINTER),
        *((name, _COUNT) for name in ("reached", "ending", "steps")),
        ("end_time", _NUMBER),
    ]


class FibreModelStructure(ctypes.Structure):
    """FibreModel of `fibre_stage.hpp`, where every field's shape is given."""

    _fields_ = [
        *((name, _COUNT) for name in ("fibres", "modes", "loads", "rows", "inputs")),
        *((name, _POINTER) for name in ("stress", "strain", "mode_strains", "projection", "observed")),
        *((name, _POINTER) for name in ("stress_change", "strain_change", "mode_change", "projection_change")),
        ("offsets", _POINTER),
    ]


class FibreCallStructure(ctypes.Structure):
    """FibreCall, where every field's shape is given."""

    _fields_ = [
        *((name, _POINTER) for name in ("update", "sensitivity")),
        *((name, _COUNT) for name in ("states", "parameters", "with_sensitivities", "follows_stress")),
        *((name, _COUNT) for name in ("segment_count", "time_count")),
        *((name, _POINTER) for name in ("theta", "initial", "limits", "segments", "times")),
        ("beta", _NUMBER),
        ("model", FibreModelStructure),
        ("settings", SettingsStructure),
        ("tableau", TableauStructure),
        *((name, _POINTER) for name in ("recorded", "jacobian")),
        *((name, _COUNT) for name in ("ending", "steps", "rejected")),
        ("end_time", _NUMBER),
    ]


def settings_structure(settings: IntegrationSettings) -> SettingsStructure:
    """Settings as the core reads them."""
    return SettingsStructure(**{**settings._asdict(), "max_steps": int(settings.max_steps)})


def tableau_structure(tableau: Tableau) -> TableauStructure:
    """A tableau as the core reads it; the caller keeps the tableau alive."""
    return TableauStructure(
        tableau.stages,
        tableau.dense.shape[1],
        tableau.error_order,
        *(address(array) for array in (tableau.a, tableau.c, tableau.error, tableau.dense)),
    )


def write_addresses(structure: ctypes.Structure, arrays: Mapping[str, Floats | Ints]) -> None:
    """Write the addresses of arrays into the fields of their names; the caller keeps the arrays alive.

    arrays : by name, each of any shape, contiguous, of float64 or int64.
    """
    for name, array in arrays.items():
        setattr(structure, name, address(array))


def refusal(law: CompiledLaw, theta: Floats, *, of_bar: bool = False) -> str:
    """Why the core cannot take a law with internal parameters theta (..., P); nothing when it can.

    of_bar : whether it is for a bar, which alone follows a back stress.
    """
    if law.back_stresses.any() and not of_bar:
        return BACK_STRESS_OF_BARS
    if law.states > MAX_STATES:
        return f"a law may have {MAX_STATES} internal variables, but this one has {law.states}"
    if theta.shape[-1] != len(law.names):
        found = theta.shape[-1]
        return f"theta has {found} numbers, but the law needs {len(law.names)}: {', '.join(law.names)}"
    return ""


def checked_times(times: ArrayLike) -> Floats:
    """Output times (times,), s, frozen; SolveError unless they are finite, not negative and do not decrease."""
    checked: Floats = frozen(np.atleast_1d(np.asarray(times, dtype=float)))
    if not np.isfinite(checked).all() or (np.diff(checked) < 0).any() or (checked < 0).any():
        raise SolveError("output times must be finite, at or after 0 s, and must not decrease")
    return checked


def check_call(code: int) -> None:
    """Raise what an integrator has returned."""
    if code == 1:
        raise MemoryError("no memory for the working arrays of an integration of creep")
    if code != 0:
        raise SolveError("an integration of creep was asked for with counts or a tableau that the core does not take")
