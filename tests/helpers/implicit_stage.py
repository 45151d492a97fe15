"""The implicit stage of one material point: what is solved for, and how its solution depends on its inputs.

`stage_problem.hpp` states the problem and `stage_solver.hpp` solves it. Both integrators and the finite elements rest
on them; the functions here give single stages.
"""

from __future__ import annotations

import ctypes
from typing import Literal, NamedTuple

import numpy as np

from creepkit.arrays import Floats
from creepkit.core import address, function
from creepkit.integration.core_structures import UNIAXIAL, Axes
from creepkit.kernels.interface import POINT_SIZE, CompiledLaw

SOLVED, NOT_FINITE, NO_SOLUTION, TOO_MANY = range(4)
"""Flags of a stage: solved; the rate is not finite; no increment satisfies the equation; iterations used up."""


class StageProblem(NamedTuple):
    """What a stage is solved for: trial stress and k in MPa, load 0 or 1, weight w in s, strain p0 so far."""

    trial: float
    stiffness: float
    load: float
    weight: float
    strain: float


INPUTS = 7


BY_TRIAL, BY_STRAIN, BY_TIME, BY_TEMPERATURE, BY_LOG_WEIGHT, BY_PRINCIPAL, BY_MEAN = range(INPUTS)
"""Columns of a response; those of the S initial states z0 and of the P parameters follow."""


class StageSolution(NamedTuple):
    """What a stage ends with.

    increment : D, creep strain, 0 unless solved. flag : see SOLVED.
    row : (6 + S,) the law's input at the end of the stage, in the units of `kernels.interface`.
    """

    increment: float
    flag: int
    row: Floats


class _Problem(ctypes.Structure):
    _fields_ = [(name, ctypes.c_double) for name in (*StageProblem._fields, *Axes._fields)]


def solve_stage(
    law: CompiledLaw,
    theta: Floats,
    problem: StageProblem,
    row: Floats,
    *,
    axes: Axes = UNIAXIAL,
    guess: float = 1e-6,
    tolerance: float = 1e-7,
) -> StageSolution:
    """Solve a stage.

    theta : (P,) internal parameters.
    row : (6 + S,) the law's input, in the units of `kernels.interface`: the states that the stage starts from, and
        its time and temperature.
    guess : of the increment. tolerance : of the last Newton correction of the increment's logarithm.
    """
    theta, row = np.array(theta, dtype=float), np.array(row, dtype=float)
    states, increment = row[POINT_SIZE:].copy(), ctypes.c_double()
    flag = function("creepkit_solve_stage")(
        ctypes.c_void_p(law.update.address),
        address(theta),
        ctypes.byref(_Problem(*problem, *axes)),
        address(states),
        ctypes.c_int64(law.states),
        address(row),
        ctypes.c_double(guess),
        ctypes.c_double(tolerance),
        ctypes.byref(increment),
    )
    return StageSolution(increment.value, flag, row)


def stage_response(
    law: CompiledLaw,
    theta: Floats,
    problem: StageProblem,
    solution: StageSolution,
    *,
    axes: Axes = UNIAXIAL,
    entry: Literal["update", "sensitivity"] = "sensitivity",
) -> Floats | None:
    """Derivatives of (D, z) to the inputs of a solved stage, (1 + S, 7 + S + P), None where the stage is singular.

    theta : (P,) internal parameters.
    entry : from which of the law's entries; `update` knows no parameters, (1 + S, 7 + S).
    """
    theta = np.array(theta, dtype=float)
    parameters = theta.size if entry == "sensitivity" else 0
    response = np.zeros((1 + law.states, INPUTS + law.states + parameters))
    regular = function("creepkit_differentiate_stage")(
        ctypes.c_void_p(getattr(law, entry).address),
        address(theta),
        ctypes.byref(_Problem(*problem, *axes)),
        address(solution.row),
        ctypes.c_int64(law.states),
        ctypes.c_int64(parameters),
        ctypes.c_double(solution.increment),
        address(response),
    )
    return response if regular == 1 else None
