"""Runs of the finite element model from which the one-degree-of-freedom model learns a dimple: Norton's and elastic."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from creepkit import kernels
from creepkit.arrays import Floats
from creepkit.fem.body import Body, body_of
from creepkit.fem.record import Settings
from creepkit.fem.simulation import Course, simulate
from creepkit.language import CreepLaw, Param, parameters, stress
from creepkit.records import Program
from creepkit.specimens.dimple import DimpleGeometry
from creepkit.specimens.reduced_curves import EXPONENTS

if TYPE_CHECKING:
    from creepkit.specimens.bulge import Bulge

RATIOS = (0.85, 1.0, 1.2)
"""Apex thicknesses of the runs over the nominal one: those of a plate scatter by 15 %."""
LOAD_RANGE = (1e-7, 3e-3)
"""P/E of the elastic runs."""

_STIFFNESS = 1e6
"""E/P of the Norton runs: elastic strains so small that stresses are steady at the least deflection."""
_RATE = 1e-6
"""1/s, about the first rate of a Norton run; with the longest time any dimple reaches its limit."""
_LONGEST = 1e10

_A, _n = parameters("A n")
_NORTON = CreepLaw(
    name="norton",
    title="Norton power law",
    terms={"power law": _A * stress**_n},
    params={
        _A: Param("rate coefficient", unit="1/s", bounds=(1e-300, 1.0), scale="log", off=0.0),
        _n: Param("stress exponent", bounds=(0.5, 13)),
    },
    references=("Norton (1929), The Creep of Steel at High Temperatures",),
)


class Trial(NamedTuple):
    """One run: times s (or P/E of the elastic one), displacement of the top (records, top) mm, the top's radii mm, and
    ln(A P^n).
    """

    times: Floats
    profiles: Floats
    radii: Floats
    level: float


@lru_cache(maxsize=16)
def trials(specimen: Bulge, geometry: DimpleGeometry) -> tuple[tuple[Trial, ...], ...]:
    """For each thickness the Norton runs and the elastic one."""
    found = []
    for thickness in thicknesses(specimen, geometry):
        body = trial_body(specimen, geometry, thickness)
        guess = 12.5 * (geometry.cavity_radius / 15.0 / thickness) ** 1.15  # as Bulge.reference_stress
        creeping = [_norton(specimen, body, n, guess) for n in EXPONENTS]
        found.append((*creeping, _elastic(specimen, body)))
    return tuple(found)


def trial_body(specimen: Bulge, geometry: DimpleGeometry, thickness: float) -> Body:
    """The body of a trial; the only one of a mesh from files."""
    if specimen.mesh is not None:
        return body_of(specimen.mesh)
    return body_of(replace(geometry, apex_thickness=thickness).mesh(specimen.refinement))


def thicknesses(specimen: Bulge, geometry: DimpleGeometry) -> list[float]:
    """Apex thicknesses of the trials, mm: as the plate allows; the only one of a mesh from files."""
    nominal, most = geometry.apex_thickness, geometry.plate_thickness - geometry.roof_axial
    if specimen.mesh is not None:
        return [nominal]
    return sorted({min(ratio * nominal, most) for ratio in RATIOS})


def _norton(specimen: Bulge, body: Body, exponent: float, guess: float) -> Trial:
    """A Norton run at 1 MPa until the dimple bursts."""
    level = np.log(_RATE) - exponent * np.log(guess)
    pressure = Program(np.array([0.0, 5.0]), np.array([0.0, 1.0]))
    course = Course(pressure, Program.constant(1.0), Program.constant(_STIFFNESS), _LONGEST)
    return observable(specimen, body, course, np.array([level, exponent]), level)


def _elastic(specimen: Bulge, body: Body) -> Trial:
    """An elastic run in which P/E rises to the end of its range, or till the dimple is as deep as can be."""
    end = 1e4
    pressure = Program(np.array([0.0, end]), np.array([0.0, 1.0]))
    course = Course(pressure, Program.constant(1.0), Program.constant(1.0 / LOAD_RANGE[1]), end)
    found = observable(specimen, body, course, np.array([-np.inf, 1.0]), 0.0)
    return found._replace(times=found.times * LOAD_RANGE[1] / end)


def observable(
    specimen: Bulge, body: Body, course: Course, theta: Floats, level: float, tolerance: float = 5e-3
) -> Trial:
    """March, keeping what an operator looks at."""
    settings = Settings(
        tolerance=tolerance, newton=4e-3 * tolerance, deflection_limit=specimen.deflection_limit,
        strain_limit=specimen.strain_limit,
    )  # fmt: skip
    found = simulate(kernels.lower(_NORTON, "numba"), theta, body, course, settings=settings)
    return Trial(found.times, found.displacements[:, body.top, 1], np.asarray(body.nodes[body.top, 0]), level)
