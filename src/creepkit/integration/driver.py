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
from creepkit.integration.control import Settings
from creepkit.integration.endings import DIVERGED, REACHED_END, STATE_LIMIT, STRAIN_LIMIT
from creepkit.integration.tableau import SDIRK2, Tableau
from creepkit.integration.tensor_march import March, segments_along
from creepkit.integration.tensor_point import EQUIVALENT, TensorPoint
from creepkit.kernels.interface import CompiledLaw
from creepkit.records import COMPONENTS, Program, Status

_BURST = (STRAIN_LIMIT, STATE_LIMIT, DIVERGED)


@dataclass(frozen=True)
class Control:
    """What is prescribed in one component: stress in MPa, or total strain (of the tensor), over time."""

    quantity: Literal["stress", "strain"]
    program: Program


def by_stress(value: float | Program) -> Control:
    """A component whose stress is prescribed, MPa."""
    return Control("stress", value if isinstance(value, Program) else Program.constant(value))


def by_strain(value: float | Program) -> Control:
    """A component whose total strain is prescribed."""
    return Control("strain", value if isinstance(value, Program) else Program.constant(value))


@dataclass(frozen=True, eq=False)
class Driven:
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


def drive(
    law: CompiledLaw,
    theta: ArrayLike,
    elastic: tuple[float, float],
    controls: Mapping[str, Control],
    temperature: float | Program,
    times: ArrayLike,
    *,
    settings: Settings | None = None,
    tableau: Tableau = SDIRK2,
) -> Driven:
    """Drive a virgin point from time zero.

    theta : (P,) internal parameters, see CompiledLaw. elastic : E in MPa, and nu.
    controls : by component; those not named are free of stress. temperature : K. times : (times,) s, non-decreasing.
    """
    outputs = np.atleast_1d(np.asarray(times, dtype=float))
    _check(law, np.size(theta), elastic, controls, outputs)
    chosen = [controls.get(name, by_stress(0.0)) for name in COMPONENTS]
    held = np.array([control.quantity == "strain" for control in chosen])
    point = TensorPoint(law, np.array(theta, dtype=float).reshape(-1), elastic, held)
    programs = [*(c.program for c in chosen), by_stress(temperature).program]
    march = March(point, settings or Settings(), tableau, outputs)
    code = march.along(segments_along(programs, float(outputs.max(initial=0.0))))
    rows = np.array(march.history).reshape(-1, EQUIVALENT + 1 + law.states)
    reached = outputs[: len(rows)]
    imposed = np.stack([c.program.at(reached) for c in chosen], axis=-1)
    answers = [point.elastic_answer(i, row[:6]) for i, row in zip(imposed, rows, strict=True)]
    stress, strain = np.array(answers).reshape(-1, 2, 6).swapaxes(0, 1)
    status = Status.COMPLETE if code == REACHED_END else Status.BURST if code in _BURST else Status.NOT_CONVERGED
    return Driven(
        times=frozen(reached),
        stress=frozen(stress),
        strain=frozen(strain),
        creep_strain=frozen(rows[:, :6]),
        equivalent=frozen(rows[:, EQUIVALENT]),
        states=frozen(rows[:, EQUIVALENT + 1 :]),
        status=status,
        end_time=float(march.time),
        reason=REASONS[code],
        steps=march.steps,
    )


def _check(
    law: CompiledLaw, parameters: int, elastic: tuple[float, float], controls: Mapping[str, Control], outputs: Floats
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
