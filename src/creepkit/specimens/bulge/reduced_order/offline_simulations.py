"""Finite element simulations behind the tables of the reduced-order model: Norton creep, and elasticity."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from creepkit import kernels
from creepkit.arrays import Floats
from creepkit.fem.finite_element_model import FiniteElementModel, finite_element_model
from creepkit.fem.simulation import LoadHistory, simulate
from creepkit.fem.solver import SolverSettings
from creepkit.language import CreepLaw, Param, parameters, stress
from creepkit.records import Program
from creepkit.specimens.bulge.geometry import DimpleGeometry
from creepkit.specimens.bulge.reduced_order.deflection_curves import EXPONENTS

if TYPE_CHECKING:
    from creepkit.specimens.bulge.settings import BulgeSettings


THICKNESS_RATIOS = (0.85, 1.0, 1.2)
"""Apex thicknesses of the runs over the nominal one: those of a plate vary by 15 %."""


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


class OfflineSimulation(NamedTuple):
    """One run: times s (or P/E of the elastic one), displacement of the top (records, top) mm, the top's radii mm, and
    ln(A P^n).
    """

    times: Floats
    profiles: Floats
    radii: Floats
    level: float


@lru_cache(maxsize=16)
def offline_simulations(specimen: BulgeSettings, geometry: DimpleGeometry) -> tuple[tuple[OfflineSimulation, ...], ...]:
    """For each thickness the Norton runs and the elastic one."""
    result = []
    for thickness in offline_thicknesses(specimen, geometry):
        body = offline_model(specimen, geometry, thickness)
        guess = 12.5 * (geometry.cavity_radius / 15.0 / thickness) ** 1.15  # as BulgeSettings.reference_stress
        creeping = [_norton(specimen, body, n, guess) for n in EXPONENTS]
        result.append((*creeping, _elastic(specimen, body)))
    return tuple(result)


def offline_model(specimen: BulgeSettings, geometry: DimpleGeometry, thickness: float) -> FiniteElementModel:
    """The finite element model of a simulation; the only one of a mesh from files."""
    if specimen.mesh is not None:
        return finite_element_model(specimen.mesh)
    return finite_element_model(replace(geometry, apex_thickness=thickness).mesh(specimen.refinement))


def offline_thicknesses(specimen: BulgeSettings, geometry: DimpleGeometry) -> list[float]:
    """Apex thicknesses of the simulations, mm: as the plate allows; the only one of a mesh from files."""
    nominal, most = geometry.apex_thickness, geometry.plate_thickness - geometry.roof_axial
    if specimen.mesh is not None:
        return [nominal]
    return sorted({min(ratio * nominal, most) for ratio in THICKNESS_RATIOS})


def _norton(specimen: BulgeSettings, body: FiniteElementModel, exponent: float, guess: float) -> OfflineSimulation:
    """A Norton run at 1 MPa until the dimple ruptures."""
    level = np.log(_RATE) - exponent * np.log(guess)
    pressure = Program(np.array([0.0, 5.0]), np.array([0.0, 1.0]))
    load_history = LoadHistory(pressure, Program.constant(1.0), Program.constant(_STIFFNESS), _LONGEST)
    return simulate_profiles(specimen, body, load_history, np.array([level, exponent]), level)


def _elastic(specimen: BulgeSettings, body: FiniteElementModel) -> OfflineSimulation:
    """An elastic run in which P/E rises to the end of its range, or until the dimple is as deep as it can be."""
    end = 1e4
    pressure = Program(np.array([0.0, end]), np.array([0.0, 1.0]))
    load_history = LoadHistory(pressure, Program.constant(1.0), Program.constant(1.0 / LOAD_RANGE[1]), end)
    result = simulate_profiles(specimen, body, load_history, np.array([-np.inf, 1.0]), 0.0)
    return result._replace(times=result.times * LOAD_RANGE[1] / end)


def simulate_profiles(
    specimen: BulgeSettings,
    body: FiniteElementModel,
    load_history: LoadHistory,
    theta: Floats,
    level: float,
    tolerance: float = 5e-3,
) -> OfflineSimulation:
    """Simulate, keeping the displacement of the top; theta : (2,) ln A and n. level : ln(A P^n)."""
    settings = SolverSettings(
        tolerance=tolerance,
        newton=4e-3 * tolerance,
        deflection_limit=specimen.deflection_limit,
        strain_limit=specimen.strain_limit,
    )
    result = simulate(kernels.lower(_NORTON, "numba"), theta, body, load_history, settings=settings)
    return OfflineSimulation(
        result.times, result.displacements[:, body.top, 1], np.asarray(body.nodes[body.top, 0]), level
    )
