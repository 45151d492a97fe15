"""One material point under any mix of prescribed stresses and strains, its temperature a program too."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from typing import Literal

import numpy as np

from creepkit.arrays import ArrayLike, Floats, frozen
from creepkit.errors import SolveError
from creepkit.integration.batch import REASONS
from creepkit.integration.control import IntegrationSettings
from creepkit.integration.endings import DIVERGED, REACHED_END, STATE_LIMIT, STRAIN_LIMIT
from creepkit.integration.tableau import SDIRK2, Tableau
from creepkit.integration.tensor_march import TensorIntegrator, tensor_segments
from creepkit.integration.tensor_point import EQUIVALENT_STRAIN, TensorPoint
from creepkit.kernels.interface import CompiledLaw
from creepkit.records import COMPONENTS, Program, Status

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
    component_controls = [controls.get(name, prescribed_stress(0.0)) for name in COMPONENTS]
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
    law: CompiledLaw, parameters: int, elastic: tuple[float, float], controls: Mapping[str, ComponentControl], outputs: Floats
) -> None:
    """One sentence for what cannot be driven."""
    if not np.isfinite(outputs).all() or (np.diff(outputs) < 0).any() or (outputs < 0).any():
        raise SolveError("output times must be finite, at or after 0 s, and must not decrease")
    if parameters != len(law.names):
        raise SolveError(f"theta has {parameters} numbers, but the law needs {len(law.names)}: {', '.join(law.names)}")
    if not (0 < elastic[0] < inf and -1 < elastic[1] < 0.5):
        raise SolveError(f"E is {elastic[0]:g} MPa and nu {elastic[1]:g}; allowed are E above 0 and nu in (-1, 0.5)")
    for name in controls:
        if name not in COMPONENTS:
            raise SolveError(f"there is no component '{name}' to drive; allowed are {', '.join(COMPONENTS)}")
