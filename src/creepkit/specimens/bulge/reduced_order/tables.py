"""Tables of the reduced-order model of a dimple, computed from finite element simulations, and their files.

In steady Norton creep of a dimple of apex thickness h the amplitude D grows as if one point crept: dD/dt = kappa(D,
h) A (k(D, h) P)^n.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from creepkit.arrays import Bools, Floats
from creepkit.errors import SolveError
from creepkit.files.json_documents import DocumentFormat
from creepkit.files.reading import FileKind
from creepkit.files.record_codec import RecordCodec, RecordError
from creepkit.files.safetensors_files import read_safetensors, write_safetensors
from creepkit.specimens.bulge.geometry import DimpleGeometry
from creepkit.specimens.bulge.observation import Observation
from creepkit.specimens.bulge.reduced_order.deflection_curves import (
    AMPLITUDE,
    CURVES,
    ELASTIC_WIDTH,
    EXPONENTS,
    LOG_GROWTH,
    LOG_STRESS,
    RESIDUAL,
    SHAPE,
    WIDTH,
    DimpleCurves,
)
from creepkit.specimens.bulge.reduced_order.offline_simulations import (
    LOAD_RANGE,
    OfflineSimulation,
    offline_simulations,
    offline_thicknesses,
)
from creepkit.specimens.bulge.reduced_order.step_equations import REDISTRIBUTION, redistribution_sizes

if TYPE_CHECKING:
    from creepkit.specimens.bulge.settings import BulgeSettings


_SMALLEST = 0.05
"""Least deflection seen in the runs, over the apex thickness: below it k and kappa are constant to 2 %."""


_STEADY = slice(1, 5)
"""Of the exponents, those that k and kappa are fitted to: 1 to 8."""


_DEFLECTIONS, _LOADS = 64, 48
"""Points of the grids."""


class TableGrid(NamedTuple):
    """x = offset (exp(step i) - 1), i = 0 .. length - 1: even near zero, then in proportion."""

    offset: float
    step: float
    length: int

    @classmethod
    def spanning(cls, most: float, offset: float, length: int) -> TableGrid:
        """From zero to the most."""
        return cls(offset, float(np.log1p(most / offset)) / (length - 1), length)

    @property
    def points(self) -> Floats:
        """(length,) x."""
        return np.asarray(self.offset * np.expm1(self.step * np.arange(self.length)))


LOADS = TableGrid.spanning(LOAD_RANGE[1], 1e-6, _LOADS)
"""P/E of the elastic tables."""


_FORMAT = DocumentFormat(
    "creepkit-reduced-order-tables",
    2,
    FileKind("a file of tables", SolveError, "make it again with 'creepkit reduced-model'", maximum_bytes=2**30),
    remedy="make it again with 'creepkit reduced-model'",
)


@dataclass(frozen=True)
class TablesHeader:
    """What a file of tables says beside its arrays.

    deflections, loads : offset, step and number of points of the grids. exponents : of the Norton laws simulated.
    window : mm, of the observation. geometry : of the dimple; its thickness is that of the middle table.
    """

    deflections: TableGrid
    loads: TableGrid
    exponents: tuple[float, ...]
    window: float
    geometry: DimpleGeometry


_ARRAYS = ("thicknesses", "curves", "elastic", "redistribution")


@dataclass(frozen=True, eq=False)
class ReducedOrderTables:
    """Tables of one observed dimple at some thicknesses.

    thicknesses : (rows,) mm. curves : (rows, CURVES, deflections), named in step_equations, on `grid`.
    elastic : (rows, loads) ln of the elastic deflection, mm, over P/E, on LOADS.
    redistribution : the numbers named in step_equations.
    geometry, window : mm, of the dimple (its apex thickness is the nominal one) and of what was observed.
    """

    thicknesses: Floats
    curves: Floats
    elastic: Floats
    redistribution: Floats
    grid: TableGrid
    geometry: DimpleGeometry
    window: float

    def dimple(self, thickness: float) -> DimpleCurves:
        """The curves of one thickness and their derivatives to it, with a point more at each end."""
        weights, slopes = self._weights(thickness)
        curves, changes = (_extended(np.tensordot(w, self.curves, 1)) for w in (weights, slopes))
        return DimpleCurves(curves, changes, self.redistribution, self.grid.offset, self.grid.step)

    def elastic_deflection(self, load: Floats, thickness: float | Floats) -> tuple[Floats, Floats, Floats]:
        """Elastic deflection, mm, at P/E (..., loads), with its derivatives to the thickness (...) and to ln(P/E)."""
        position = np.minimum(np.log1p(load / LOADS.offset) / LOADS.step, LOADS.length - 1.0)
        weights, changes = (np.expand_dims(np.moveaxis(w, 0, -1), -2) for w in self._weights(thickness))
        rows = self._elastic_rows(position)
        deflection = load * np.exp((rows * weights).sum(axis=-1))
        steeper = (self._elastic_rows(position, 1) * weights).sum(axis=-1)
        bend = steeper * load / (LOADS.step * (LOADS.offset + load))
        return deflection, deflection * (rows * changes).sum(axis=-1), deflection * (1.0 + bend)

    @cached_property
    def _elastic_rows(self) -> CubicSpline:
        """Splines of the elastic rows over places in LOADS, (..., rows)."""
        return CubicSpline(np.arange(LOADS.length), self.elastic.T)

    def _weights(self, thickness: float | Floats) -> tuple[Floats, Floats]:
        """Weights (rows, ...) of the polynomial in ln h through all rows, and their derivatives to h, 1/mm."""
        known, x = np.log(self.thicknesses), np.log(thickness)
        values, slopes = np.ones((known.size, *np.shape(x))), np.zeros((known.size, *np.shape(x)))
        for i, j in product(range(known.size), repeat=2):  # the product rule, factor by factor
            if i != j:
                apart = known[i] - known[j]
                slopes[i] = (slopes[i] * (x - known[j]) + values[i]) / apart
                values[i] *= (x - known[j]) / apart
        return values, slopes / thickness


def _extended(curves: Floats) -> Floats:
    """(points + 2, CURVES)."""
    first, last = 2 * curves[:, :1] - curves[:, 1:2], 2 * curves[:, -1:] - curves[:, -2:-1]
    return np.ascontiguousarray(np.concatenate([first, curves, last], axis=1).T)


def deflection_grid(specimen: BulgeSettings) -> TableGrid:
    """Deflections of the tables, mm, up to where the dimple has ruptured."""
    least = _SMALLEST * specimen.geometry.apex_thickness
    return TableGrid.spanning(max(specimen.deflection_limit, 2 * least), least, _DEFLECTIONS)


@lru_cache(maxsize=64)
def build_tables(specimen: BulgeSettings, geometry: DimpleGeometry, operator: Observation) -> ReducedOrderTables:
    """The tables of a dimple as an operator sees it; some seconds of CPU, then kept while the program runs."""
    grid = deflection_grid(specimen)
    rows = [_row(runs, grid.points, operator) for runs in offline_simulations(specimen, geometry)]
    curves, elastic = (np.array(values) for values in zip(*rows, strict=True))
    heights = np.array(offline_thicknesses(specimen, geometry))
    curves[:, AMPLITUDE] = redistribution_sizes(grid.points / heights[:, None])
    return ReducedOrderTables(heights, curves, elastic, REDISTRIBUTION, grid, geometry, operator.window)


def _row(runs: tuple[OfflineSimulation, ...], points: Floats, operator: Observation) -> tuple[Floats, Floats]:
    """Curves and elastic deflections of one thickness from its Norton runs and, last, its elastic one."""
    outputs = [operator.observe(run.radii, run.profiles) for run in runs]
    logs = np.array([_log_rate(run, out[:, 0], points) for run, out in zip(runs[:-1], outputs[:-1], strict=True)])
    stress, growth = _fitted(np.array(EXPONENTS)[_STEADY], logs[_STEADY], points)
    curves = np.zeros((CURVES, points.size))
    curves[LOG_STRESS], curves[LOG_GROWTH] = stress, growth
    for k, n in enumerate(EXPONENTS):
        curves[RESIDUAL + k] = _filled(logs[k] - growth - n * stress)
        curves[[WIDTH + k, SHAPE + k]] = _outputs_along(points, outputs[k])
    curves[ELASTIC_WIDTH : ELASTIC_WIDTH + 2] = _outputs_along(points, outputs[-1])
    load, deflection = runs[-1].times[1:], outputs[-1][1:, 0]
    known = CubicSpline(np.log(load), np.log(deflection / load))
    inside = np.clip(np.log(np.maximum(LOADS.points, load[0])), np.log(load[0]), np.log(load[-1]))
    return curves, np.asarray(known(inside))


def _filled(values: Floats) -> Floats:
    """Values with what is missing taken from the nearest."""
    there = np.isfinite(values)
    if not there.any():
        return np.zeros_like(values)
    index = np.arange(values.size)
    return np.interp(index, index[there], values[there])


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
            f"the dimple did not bulge by {points[1]:g} mm in any trial of its one-degree-of-freedom model; check its "
            "geometry, or predict with the specimen itself"
        )
    with np.errstate(invalid="ignore", divide="ignore"):
        mean_n, mean_y = n.sum(axis=0) / count, y.sum(axis=0) / count
        spread = np.where(there, n - mean_n, 0.0)
        slope = (spread * (y - mean_y)).sum(axis=0) / (spread**2).sum(axis=0)
        level = mean_y - slope * mean_n
    return _filled(np.where(usable, slope, np.nan)), _filled(np.where(usable, level, np.nan))


def _log_rate(run: OfflineSimulation, amplitude: Floats, points: Floats) -> Floats:
    """ln(dD/dt / (A P^n)) at each deflection, NaN where the run did not get, (deflections,)."""
    rising = _monotonic(amplitude)
    rising[np.flatnonzero(rising)[-2:]] = False  # the steps in which a run ends are its worst
    time = CubicSpline(np.log(amplitude[rising]), np.log(run.times[rising]))
    reached = (points <= amplitude[rising][-1]) & (
        points >= max(amplitude[rising][0], points[1], _LEAST_DEFLECTION * points[-1])
    )
    x = np.log(np.where(reached, points, amplitude[rising][-1]))
    slope = time(x, 1)
    reached &= slope > 0
    return np.where(reached, x - time(x) - np.log(np.where(reached, slope, 1.0)) - run.level, np.nan)


_LEAST_DEFLECTION = 0.008
"""Least deflection that is used, over the largest: before it stresses have not settled."""


def _outputs_along(points: Floats, outputs: Floats) -> Floats:
    """Width and shape, (2, deflections), at deflections on the way of a run; its end values beyond."""
    rising = _monotonic(outputs[:, 0])
    x = np.log(outputs[rising, 0])
    where = np.log(np.maximum(points, outputs[rising, 0][0]))
    return np.stack([np.interp(where, x, outputs[rising, k]) for k in (1, 2)])


def _monotonic(amplitude: Floats) -> Bools:
    """(records,) those that lie above all before."""
    highest = np.maximum.accumulate(np.concatenate([[0.0], amplitude[:-1]]))
    return np.asarray(amplitude > 1.0005 * highest)


def write_tables(tables: ReducedOrderTables, path: str | Path) -> Path:
    """Write the tables; the file is whole or absent."""
    arrays = {name: getattr(tables, name) for name in _ARRAYS}
    header = TablesHeader(tables.grid, LOADS, EXPONENTS, tables.window, tables.geometry)
    return write_safetensors(path, arrays, RecordCodec().to_json(header), _FORMAT)


def read_tables(path: str | Path) -> ReducedOrderTables:
    """The tables of a file; SolveError says what is wrong with any other."""
    arrays, content = read_safetensors(path, _FORMAT)
    try:
        header = RecordCodec().from_json(TablesHeader, content)
        values = {name: np.asarray(arrays[name], float) for name in _ARRAYS}
    except (RecordError, KeyError, ValueError, TypeError) as error:
        raise SolveError(f"{path}: damaged ({error}); {_FORMAT.remedy}") from None
    for name, found, expected in (
        ("loads", tuple(header.loads), tuple(LOADS)),
        ("exponents", header.exponents, EXPONENTS),
    ):
        if found != expected:
            raise SolveError(f"{path}: {name} is {found}, this creepkit reads {expected}; {_FORMAT.remedy}")
    return ReducedOrderTables(**values, grid=header.deflections, geometry=header.geometry, window=header.window)
