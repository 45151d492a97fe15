"""Adaptive integration of one material point under prescribed stresses and strains of its six components."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from math import inf

import numpy as np

from creepkit.arrays import ArrayLike, Bools, Floats, frozen
from creepkit.core import function
from creepkit.errors import SolveError
from creepkit.integration.core_structures import (
    REASONS,
    STATUS,
    IntegrationSettings,
    TensorStructure,
    check_call,
    checked_times,
    refusal,
    settings_structure,
    tableau_structure,
    write_addresses,
)
from creepkit.integration.tensor_point import EQUIVALENT_STRAIN
from creepkit.integration.time_discretisation import SDIRK2, Tableau, merge_programs
from creepkit.kernels.interface import CompiledLaw
from creepkit.records import TENSOR_COMPONENTS, PointLoading, Program, Status


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
    loading: PointLoading,
    temperature: float | Program,
    times: ArrayLike,
    *,
    settings: IntegrationSettings | None = None,
    tableau: Tableau = SDIRK2,
) -> PointTrajectory:
    """Drive a virgin point from time zero.

    theta : (P,) internal parameters, see CompiledLaw. elastic : E in MPa, and nu.
    temperature : K. times : (times,) s, non-decreasing.
    """
    outputs, theta = checked_times(times), np.array(theta, dtype=float).reshape(-1)
    if sentence := refusal(law, theta):
        raise SolveError(sentence)
    if not (0 < elastic[0] < inf and -1 < elastic[1] < 0.5):
        raise SolveError(f"E is {elastic[0]:g} MPa and nu {elastic[1]:g}; allowed are E above 0 and nu in (-1, 0.5)")
    imposed = {**loading.stress, **loading.strain}
    programs = [imposed.get(name, Program.constant(0.0)) for name in TENSOR_COMPONENTS]
    kelvin = temperature if isinstance(temperature, Program) else Program.constant(temperature)
    held = np.array([name in loading.strain for name in TENSOR_COMPONENTS])
    arrays = {
        "theta": theta,
        "initial": np.array(law.initial, dtype=float),
        "limits": np.array(law.limits, dtype=float),
        "held": held.astype(np.int64),
        "segments": merge_programs(*programs, kelvin, end=float(outputs.max(initial=0.0))),
        "outputs": outputs,
        "history": np.zeros((outputs.size, EQUIVALENT_STRAIN + 1 + law.states)),
    }
    call = TensorStructure(
        update=law.update.address,
        states=law.states,
        segment_count=len(arrays["segments"]),
        output_count=outputs.size,
        modulus=elastic[0],
        ratio=elastic[1],
        beta=float(np.reshape(law.leading_exponent(theta[None]), -1)[0]),
        settings=settings_structure(settings or IntegrationSettings()),
        tableau=tableau_structure(tableau),
    )
    write_addresses(call, arrays)
    check_call(function("creepkit_integrate_tensor_point")(ctypes.byref(call)))
    code, rows, reached = call.ending, arrays["history"][: call.reached], outputs[: call.reached]
    values = np.stack([program.at(reached) for program in programs], axis=-1)
    stress, strain = _elastic_response(elastic, held, values, rows[:, :6])
    return PointTrajectory(
        times=frozen(reached),
        stress=frozen(stress),
        strain=frozen(strain),
        creep_strain=frozen(rows[:, :6]),
        equivalent=frozen(rows[:, EQUIVALENT_STRAIN]),
        states=frozen(rows[:, EQUIVALENT_STRAIN + 1 :]),
        status=Status(int(STATUS[code])),
        end_time=float(call.end_time),
        reason=REASONS[code],
        steps=int(call.steps),
    )


def _elastic_response(
    elastic: tuple[float, float], held: Bools, imposed: Floats, creep: Floats
) -> tuple[Floats, Floats]:
    """Stress and strain, (times, 6), of known creep strains; `imposed` holds strains where `held`, else stresses."""
    (E, nu), free = elastic, ~held
    unit = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    shear, bulk = E / (2 * (1 + nu)), E / (3 * (1 - 2 * nu))
    stiffness = 2 * shear * np.eye(6) + (bulk - 2 * shear / 3) * np.outer(unit, unit)
    strain = np.where(free, 0.0, imposed)
    known = (strain - creep) @ stiffness
    strain[:, free] = np.linalg.solve(stiffness[np.ix_(free, free)], (imposed - known)[:, free].T).T
    return np.where(free, imposed, (strain - creep) @ stiffness), strain
