"""What the one-degree-of-freedom model knows of a dimple, tabulated from the finite element model itself.

In steady Norton creep of a dimple of apex thickness h the amplitude D grows as if one point crept:

    dD/dt = kappa(D, h) A (k(D, h) P)^n,    that is  ln(dD/dt / (A P^n)) = ln kappa + n ln k

whatever n is, to about 2 %. k and kappa are fitted to runs with some n, at each D, for some h. Beside them stand the
elastic deflection against P/E, and width and shape of the bulge: those of elastic and those of creeping dimples.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from creepkit import kernels
from creepkit.arrays import Bools, Floats, Ints
from creepkit.errors import SolveError
from creepkit.fem.body import Body, body_of
from creepkit.fem.record import Settings
from creepkit.fem.simulation import Course, simulate
from creepkit.language import CreepLaw, Param, parameters, stress
from creepkit.records import Program
from creepkit.specimens.dimple import DimpleGeometry
from creepkit.specimens.observation import Observation

if TYPE_CHECKING:
    from creepkit.specimens.bulge import Bulge

EXPONENTS = (1.0, 3.0, 5.0, 8.0)
"""Of the Norton runs: the range of exponents of creep laws of metals."""
RATIOS = (0.85, 1.0, 1.2)
"""Apex thicknesses of the runs over the nominal one: those of a plate scatter by 15 %."""

_SMALLEST = 0.05
"""Least deflection tabulated, over the apex thickness: below it k and kappa are constant to 2 %."""
_DEFLECTIONS, _LOADS = 64, 48
_LOAD_RANGE = (1e-7, 3e-3)
"""P/E of the elastic table."""
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
        _n: Param("stress exponent", bounds=(1, 8)),
    },
    references=("Norton (1929), The Creep of Steel at High Temperatures",),
)


@dataclass(frozen=True, eq=False)
class Tables:
    """Tables of one observed dimple at some thicknesses; with a row for each.

    thicknesses : (rows,) mm. stress, growth : (rows, deflections) ln k and ln kappa (mm).
    shapes : (rows, exponents, deflections, 2) width mm and shape in steady creep; elastic_shapes : (rows, deflections,
    2) those of an elastic dimple. elastic : (rows, loads) ln of the elastic deflection, mm.
    """

    thicknesses: Floats
    stress: Floats
    growth: Floats
    shapes: Floats
    elastic_shapes: Floats
    elastic: Floats

    def at(self, thickness: float) -> Tables:
        """One row at another thickness: linear in its logarithm, so a power of it beyond the ends."""
        if self.thicknesses.size == 1:
            return self
        known = np.log(self.thicknesses)
        k = int(np.clip(np.searchsorted(known, np.log(thickness)) - 1, 0, known.size - 2))
        share = (np.log(thickness) - known[k]) / (known[k + 1] - known[k])

        def blended(values: Floats) -> Floats:
            return np.asarray((1 - share) * values[k : k + 1] + share * values[k + 1 : k + 2])

        shapes, elastic_shapes = blended(self.shapes), blended(self.elastic_shapes)
        return Tables(
            np.array([thickness]), blended(self.stress), blended(self.growth), shapes, elastic_shapes,
            blended(self.elastic),
        )  # fmt: skip

    @classmethod
    def stacked(cls, parts: list[Tables]) -> Tables:
        """The rows of all."""
        names = cls.__dataclass_fields__
        return cls(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})


class Place(NamedTuple):
    """Where numbers lie in a uniform grid: the interval and the share of it that lies behind."""

    interval: Ints
    share: Floats

    def of(self, values: Floats, row: Ints) -> Floats:
        """Linear interpolation in a table (rows, grid, ...)."""
        share = self.share.reshape(*self.share.shape, *(1,) * (values.ndim - 2))
        low = values[row, self.interval]
        return np.asarray(low + share * (values[row, self.interval + 1] - low))


class Grid(NamedTuple):
    """A grid that is uniform in ln x."""

    first: float
    step: float
    length: int

    @classmethod
    def between(cls, least: float, most: float, length: int) -> Grid:
        """From the least to the most."""
        return cls(float(np.log(least)), float(np.log(most / least)) / (length - 1), length)

    @property
    def points(self) -> Floats:
        """(length,) x."""
        return np.asarray(np.exp(self.first + self.step * np.arange(self.length)))

    def place(self, x: Floats, *, beyond: bool = False) -> Place:
        """Where x lies; beyond : carry the end intervals on instead of holding the end values."""
        position = (np.log(x) - self.first) / self.step
        if not beyond:
            position = np.fmin(np.fmax(position, 0.0), self.length - 1.0)
        interval = np.fmin(np.fmax(position, 0.0), self.length - 2.0).astype(np.int64)
        return Place(interval, position - interval)


def deflection_grid(specimen: Bulge) -> Grid:
    """Deflections of the tables, mm, up to where the dimple has burst."""
    least = _SMALLEST * specimen.geometry.apex_thickness
    return Grid.between(least, max(specimen.deflection_limit, 2 * least), _DEFLECTIONS)


LOAD_GRID = Grid.between(*_LOAD_RANGE, _LOADS)
"""P/E of the elastic tables."""


@lru_cache(maxsize=64)
def tables(specimen: Bulge, geometry: DimpleGeometry, operator: Observation) -> Tables:
    """The tables of a dimple as an operator sees it; one to two seconds of CPU, then kept while the program runs."""
    points, parts = deflection_grid(specimen).points, []
    for thickness, runs in zip(_thicknesses(specimen, geometry), _trials(specimen, geometry), strict=True):
        parts.append(_row(thickness, runs, points, operator))
    return Tables.stacked(parts)


class Trial(NamedTuple):
    """One run: times s (or P/E of the elastic one), displacement of the top (records, top) mm, the top's radii mm, and
    ln(A P^n).
    """

    times: Floats
    profiles: Floats
    radii: Floats
    level: float


def _row(thickness: float, runs: tuple[Trial, ...], points: Floats, operator: Observation) -> Tables:
    """The tables of one thickness from its Norton runs and, last, its elastic one."""
    seen = [operator.observe(run.radii, run.profiles) for run in runs]
    logs = np.array([_log_rate(run, out[:, 0], points) for run, out in zip(runs[:-1], seen[:-1], strict=True)])
    stress, growth = _fitted(np.array(EXPONENTS), logs, points)
    shapes = [_along(points, out) for out in seen]
    known = CubicSpline(np.log(runs[-1].times[1:]), np.log(seen[-1][1:, 0]))
    first, last = np.log(runs[-1].times[[1, -1]])
    x = np.log(LOAD_GRID.points)
    inside = np.clip(x, first, last)
    elastic = known(inside) + known(inside, 1) * (x - inside)
    return Tables(
        np.array([thickness]), stress[None], growth[None], np.array(shapes[:-1])[None], shapes[-1][None], elastic[None]
    )


def _fitted(exponents: Floats, logs: Floats, points: Floats) -> tuple[Floats, Floats]:
    """ln k and ln kappa, (deflections,), from ln(dD/dt / (A P^n)), (exponents, deflections), NaN where not reached.

    Least squares in n at each deflection; beyond where fewer than two exponents led, the last values go on.
    """
    there = np.isfinite(logs)
    count, n = there.sum(axis=0), np.where(there, exponents[:, None], 0.0)
    y = np.where(there, logs, 0.0)
    usable = count >= 2
    if not usable.any():
        raise SolveError(
            f"the dimple did not bulge by {points[0]:g} mm in any trial of its one-degree-of-freedom model; check its "
            "geometry, or predict with the specimen itself"
        )
    with np.errstate(invalid="ignore", divide="ignore"):
        mean_n, mean_y = n.sum(axis=0) / count, y.sum(axis=0) / count
        spread = np.where(there, n - mean_n, 0.0)
        slope = (spread * (y - mean_y)).sum(axis=0) / (spread**2).sum(axis=0)
        level = mean_y - slope * mean_n
    where = np.arange(points.size)
    k, kappa = (np.interp(where, where[usable], values[usable]) for values in (slope, level))
    return k, kappa


def _log_rate(run: Trial, amplitude: Floats, points: Floats) -> Floats:
    """ln(dD/dt / (A P^n)) at each deflection, NaN where the run did not get, (deflections,)."""
    rising = _rising(amplitude)
    rising[np.flatnonzero(rising)[-2:]] = False  # the steps in which a run ends are its worst
    time = CubicSpline(np.log(amplitude[rising]), np.log(run.times[rising]))
    x = np.log(points)
    slope = time(x, 1)
    reached = (points <= amplitude[rising][-1]) & (points >= amplitude[rising][0]) & (slope > 0)
    return np.where(reached, x - time(x) - np.log(np.where(reached, slope, 1.0)) - run.level, np.nan)


def _along(points: Floats, seen: Floats) -> Floats:
    """Width and shape, (deflections, 2), at deflections on the way of a run; its end values beyond."""
    rising = _rising(seen[:, 0])
    x = np.log(seen[rising, 0])
    return np.stack([np.interp(np.log(points), x, seen[rising, k]) for k in (1, 2)], axis=-1)


def _rising(amplitude: Floats) -> Bools:
    """(records,) those that lie above all before."""
    highest = np.maximum.accumulate(np.concatenate([[0.0], amplitude[:-1]]))
    return np.asarray(amplitude > 1.0005 * highest)


@lru_cache(maxsize=16)
def _trials(specimen: Bulge, geometry: DimpleGeometry) -> tuple[tuple[Trial, ...], ...]:
    """For each thickness the Norton runs and the elastic one."""
    trials = []
    for thickness in _thicknesses(specimen, geometry):
        if specimen.mesh is None:
            body = body_of(replace(geometry, apex_thickness=thickness).mesh(specimen.refinement))
        else:
            body = body_of(specimen.mesh)
        guess = 12.5 * (geometry.cavity_radius / 15.0 / thickness) ** 1.15  # as Bulge.reference_stress
        creeping = [_norton(specimen, body, n, guess) for n in EXPONENTS]
        trials.append((*creeping, _elastic(specimen, body)))
    return tuple(trials)


def _thicknesses(specimen: Bulge, geometry: DimpleGeometry) -> list[float]:
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
    return _observable(specimen, body, course, np.array([level, exponent]), level)


def _elastic(specimen: Bulge, body: Body) -> Trial:
    """An elastic run in which P/E rises to the end of its range, or till the dimple is as deep as can be."""
    end = 1e4
    pressure = Program(np.array([0.0, end]), np.array([0.0, 1.0]))
    course = Course(pressure, Program.constant(1.0), Program.constant(1.0 / _LOAD_RANGE[1]), end)
    found = _observable(specimen, body, course, np.array([-np.inf, 1.0]), 0.0)
    return found._replace(times=found.times * _LOAD_RANGE[1] / end)


def _observable(specimen: Bulge, body: Body, course: Course, theta: Floats, level: float) -> Trial:
    """March, keeping what an operator looks at."""
    settings = Settings(
        tolerance=5e-3, newton=2e-5, deflection_limit=specimen.deflection_limit, strain_limit=specimen.strain_limit
    )
    found = simulate(kernels.lower(_NORTON, "numba"), theta, body, course, settings=settings)
    return Trial(found.times, found.displacements[:, body.top, 1], np.asarray(body.nodes[body.top, 0]), level)
