"""Calls of the finite element solver in the compiled core: its records, mirrored field by field."""

from __future__ import annotations

import ctypes
import math
from typing import NamedTuple

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.core import CoreStructure, address, function
from creepkit.errors import SolveError
from creepkit.fem.finite_element_model import FiniteElementModel, SensitivityDirections
from creepkit.fem.reduced_order_model import ReducedOrderModel
from creepkit.integration.core_structures import refusal
from creepkit.kernels.interface import CompiledEntry, CompiledLaw

(
    REACHED_END, DEFLECTION_LIMIT, STRAIN_LIMIT, STATE_LIMIT, LIMIT_LOAD, LOST_CONVERGENCE, TOO_MANY_STEPS, LAW_FAILED,
    SINGULAR_TANGENT, OUT_OF_MEMORY,
) = range(10)  # fmt: skip
"""Codes of an ending; whatever it is, the history so far is kept."""


START, END, PRESSURE, MOTION = 0, 1, 2, 8
"""Columns of a segment: times s, and the pressure at its start, MPa (or the load that dead forces are for, in its
unit); at its end, and temperature K, modulus MPa and motion of held nodes at both ends follow."""


CREEP_COMPONENTS, EQUIVALENT_STRAIN = 3, 3
"""Creep components of a point, and the place of its equivalent creep strain."""


SolvableModel = FiniteElementModel | ReducedOrderModel
"""What can be simulated."""


class SolverSettings(NamedTuple):
    """How accurately, and how far, to simulate.

    tolerance : estimated error of a step's displacements over (0.01 mm + the largest of those that are observed).
    newton : what the last correction of equilibrium leaves, over the same.
    first : s, the first step after a change of load. growth : by which the time since then may grow in a step.
    deflection_limit : mm, observed displacement at which the body has burst.
    strain_limit : creep strain at which a point has burst. max_steps : cap on steps, accepted and rejected.
    least : mm, that takes the place of the 0.01 mm above.
    """

    tolerance: float = 1e-2
    newton: float = 7e-5
    first: float = 10.0
    growth: float = 2.0
    deflection_limit: float = 3.0
    strain_limit: float = 1.0
    max_steps: int = 1000
    least: float = 0.01


class StepRecord(NamedTuple):
    """Accepted steps of a simulation, from rest at 0 s on.

    times : (steps,) s. segments : (steps,) number of the segment of each.
    displacements : (steps, displacement_count) mm of the nodes, or factors of the modes of a reduced-order model.
    values : (steps, points, 4 + S) creep components, equivalent creep strain and states, or None.
    mises : (steps, points) MPa.
    positions : (steps, 2) where a step began in its segment, and its length, in the transformed time.
    counts : (4,) accepted and rejected steps; equilibrium passes with and without a new tangent.
    code, time : how it ended, and when, s.
    reactions : (steps,) N/rad, force of the displacement that the motion controls; zeros where none is.
    surface : (steps, observed, C) mm, derivatives of the observed displacements, then of that force, or None.
    """

    times: Floats
    segments: Ints
    displacements: Floats
    values: Floats | None
    mises: Floats
    positions: Floats
    counts: Ints
    code: int
    time: float
    reactions: Floats
    surface: Floats | None


def solve(
    law: CompiledLaw,
    theta: Floats,
    model: SolvableModel,
    program: LoadProgram,
    settings: SolverSettings,
    *,
    keep_points: bool = False,
    directions: SensitivityDirections | None = None,
) -> StepRecord:
    """Simulate a body; theta : (P,) internal parameters. directions : None for no derivatives."""
    theta = _contiguous(theta)
    if sentence := refusal(law, theta):
        raise SolveError(sentence)
    segments = _contiguous(program.segments)
    rows, points = settings.max_steps + len(segments) + 2, model.point_count
    initial, limits, script = (_contiguous(a) for a in (law.initial, law.limits, program.script))
    times, positions, counts = _empty_record(rows), _empty_record(rows, 2), np.zeros(4, np.int64)
    numbers = np.zeros(rows, np.int64)
    displacements = _empty_record(rows, model.displacement_count)
    values = _empty_record(rows, points, 4 + law.states) if keep_points else None
    mises, reactions = _empty_record(rows, points), _empty_record(rows)
    pattern = _contiguous(program.pattern)
    record = _Record(
        rows, address(times), address(numbers), address(displacements), None if values is None else address(values),
        address(mises), address(positions), address(counts), points, address(reactions),
    )  # fmt: skip
    entries = _Law(*_entry_addresses(law), address(theta), theta.size, law.states)
    given = _Input(
        program.beta, program.poisson, len(segments), address(segments), address(pattern), address(initial),
        address(limits), len(script), address(script),
    )  # fmt: skip
    surface = along = derivatives = None
    kept: tuple[Floats, ...] = ()
    if directions is not None:
        kept = tuple(map(_contiguous, (directions.segments, *model.core_directions(directions))))
        columns = theta.size + len(directions.segments) + len(directions.velocities)
        surface = _empty_record(rows, model.observed_count, columns)
        moments = _empty_record(rows, len(directions.segments))
        along = _Directions(len(directions.segments), len(directions.velocities), *map(address, kept))
        derivatives = _Derivatives(address(surface), address(moments))
    ended = _Termination()
    function(model.entry, None)(
        *(ctypes.byref(s) for s in (model.compiled.structure, entries, given, _Settings(*settings), record)),
        None if along is None else ctypes.byref(along),
        None if derivatives is None else ctypes.byref(derivatives),
        ctypes.byref(ended),
    )
    if ended.code == OUT_OF_MEMORY:
        raise MemoryError("no memory for a finite element simulation")
    n = ended.records
    return StepRecord(
        times[:n].copy(), numbers[:n].copy(), displacements[:n].copy(), None if values is None else values[:n].copy(),
        mises[:n].copy(), positions[:n].copy(), counts, ended.code, ended.time, reactions[:n].copy(),
        None if surface is None else surface[:n],
    )  # fmt: skip


class LoadProgram(NamedTuple):
    """The load history as the solver takes it.

    beta : exponent of the time transformation. poisson : Poisson's ratio.
    segments : (segments, 10) s, MPa, K, MPa and a number: times, pressures, temperatures, moduli and motion of held
        nodes, each at the segment's start and end.
    pattern : (2 nodes,) mm, displacement of held nodes for a unit of motion; (0,) in a reduced-order model.
    script : (steps, 2) positions of another simulation, to make the very same steps; (0, 2) for steps by error control.
    """

    beta: float
    poisson: float
    segments: Floats
    pattern: Floats
    script: Floats


def _entry_addresses(law: CompiledLaw) -> tuple[int, int]:
    """Addresses of the entries that the core calls; SolveError for what is no entry of a compiled law."""
    for entry in (law.update, law.sensitivity):
        if not isinstance(entry, CompiledEntry) or not entry.address:
            raise SolveError(
                f"a compiled law has {entry!r} for an entry, which is no compiled function of this package"
            )
    return law.update.address, law.sensitivity.address


def _empty_record(rows: int, *shape: int) -> Floats:
    """Room (rows, ...) for the core to write; SolveError, with the memory needed, where there is not enough.

    The core writes all of a row; of the first, where nothing has happened yet, some arrays stay zeros.
    """
    try:
        record = np.empty((rows, *shape))
        record[0] = 0.0
        return record
    except MemoryError:
        size = 8 * rows * math.prod(shape) / 2**30
        raise SolveError(
            f"a record of up to {rows} steps needs {size:.3g} GiB in one piece, which is more memory than there is; "
            "lower max_steps, or the refinement of the mesh"
        ) from None


def _contiguous(values: Floats) -> Floats:
    return np.ascontiguousarray(values, dtype=float)


_NUMBER, _REAL, _ARRAY = ctypes.c_int64, ctypes.c_double, ctypes.c_void_p


class _Law(CoreStructure):
    _fields_ = (
        ("update", _ARRAY), ("sensitivity", _ARRAY), ("theta", _ARRAY), ("parameters", _NUMBER), ("states", _NUMBER),
    )  # fmt: skip


class _Input(CoreStructure):
    _fields_ = (
        ("beta", _REAL), ("poisson", _REAL), ("segment_count", _NUMBER), ("segments", _ARRAY), ("pattern", _ARRAY),
        ("initial", _ARRAY), ("limits", _ARRAY), ("script_steps", _NUMBER), ("script", _ARRAY),
    )  # fmt: skip


class _Settings(CoreStructure):
    _fields_ = (
        ("tolerance", _REAL), ("newton", _REAL), ("first", _REAL), ("growth", _REAL), ("deflection_limit", _REAL),
        ("strain_limit", _REAL), ("max_steps", _NUMBER), ("least", _REAL),
    )  # fmt: skip


class _Record(CoreStructure):
    _fields_ = (
        ("rows", _NUMBER), ("times", _ARRAY), ("segments", _ARRAY), ("displacements", _ARRAY), ("values", _ARRAY),
        ("mises", _ARRAY), ("places", _ARRAY), ("counts", _ARRAY), ("points", _NUMBER), ("reactions", _ARRAY),
    )  # fmt: skip


class _Directions(CoreStructure):
    _fields_ = (
        ("directions", _NUMBER), ("geometries", _NUMBER), ("segments", _ARRAY), ("gradients", _ARRAY),
        ("hoops", _ARRAY), ("velocities", _ARRAY), ("forces", _ARRAY),
    )  # fmt: skip


class _Derivatives(CoreStructure):
    _fields_ = (("surface", _ARRAY), ("times", _ARRAY))


class _Termination(CoreStructure):
    _fields_ = (("records", _NUMBER), ("code", _NUMBER), ("time", _REAL))
