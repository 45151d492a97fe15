"""Input decks of CalculiX for an axisymmetric mesh under pressure, and the numbers in its output files.

Four silent habits of CalculiX 2.20 are worked around: its Norton law raises A to at least 1e-20, so stress is written
in a unit in which A is far larger; increments step over the corners of an amplitude, so these are made points of time;
a jump of the load within *VISCO ends in ever smaller increments, so it has a static step of its own; *NODE FILE
suppresses *NODE PRINT.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import ceil, log10

import numpy as np

from creepkit.arrays import Floats, Ints, frozen
from creepkit.fem.mesh import Mesh
from creepkit.records import Program

SMALLEST_A = 1e-20
"""The smallest rate coefficient that CalculiX does not change."""

INSTANT = 1e-3
"""Length, s, of the static step in which a load jumps; it is part of the total time."""

_SAFE_A = 1e-12
_PER_LINE = 12


@dataclass(frozen=True)
class Norton:
    """CalculiX's own law, rate = A sigma^n t^m with t the total time; A in 1/s and MPa."""

    A: float
    n: float
    m: float = 0.0


@dataclass(frozen=True)
class UserLaw:
    """A law of subroutine CREEP, which takes MPa and s. temperature : K, uniform; CalculiX requires one."""

    temperature: float = 1000.0


@dataclass(frozen=True)
class UserMaterial(UserLaw):
    """A UMAT of Abaqus' interface, elasticity and creep, with so many states; strains are logarithmic."""

    states: int = 2


@dataclass(frozen=True, eq=False)
class Deck:
    """A simulation: a mesh of CAX8R, elastic and perhaps creeping, under a pressure that follows the surface.

    E : MPa. creep : None for an elastic deck. pressure : MPa over s; if it does not start at zero it jumps there.
    times : (times,) s, rising, where results are printed. nodes : those printed, of the mesh.
    cetol : largest difference of the creep strain increments at the ends of an increment.
    first, least, longest : increments, s. large : geometrically nonlinear. stresses : print those of all elements too.
    """

    mesh: Mesh
    E: float
    nu: float
    creep: Norton | UserLaw | UserMaterial | None
    pressure: Program
    times: Floats
    nodes: Ints
    cetol: float = 1e-4
    first: float = 0.01
    least: float = 1e-9
    longest: float = 600.0
    large: bool = True
    stresses: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "times", frozen(np.atleast_1d(self.times)))
        object.__setattr__(self, "nodes", frozen(np.atleast_1d(self.nodes), dtype=np.int64))

    @property
    def stress_unit(self) -> float:
        """The unit of stress of the deck, in MPa: a power of ten that lifts A well above 1e-20."""
        if not isinstance(self.creep, Norton) or self.creep.A >= _SAFE_A:
            return 1.0
        return float(10.0 ** ceil(log10(_SAFE_A / self.creep.A) / self.creep.n))

    def text(self) -> str:
        """The deck."""
        return "\n".join([*self._model(), *self._material(), *self._steps(), ""])

    def _model(self) -> Iterator[str]:
        mesh = self.mesh
        yield "*NODE, NSET=NALL"
        yield from (f"{k}, {r:.10f}, {z:.10f}, 0." for k, (r, z) in enumerate(mesh.nodes, 1))
        yield "*ELEMENT, TYPE=CAX8R, ELSET=EALL"
        yield from (", ".join(map(str, [k, *(element + 1)])) for k, element in enumerate(mesh.elements, 1))
        radial, axial = (np.flatnonzero(mesh.held[:, k]) for k in range(2))
        sets = {"PRINTED": self.nodes, "RADIAL": radial, "AXIAL": axial}
        for name, nodes in sets.items():
            if nodes.size:
                yield f"*NSET, NSET={name}"
                yield from _lines(nodes + 1)
        yield "*BOUNDARY"
        yield from (f"{name}, {k}, {k}" for k, name in ((1, "RADIAL"), (2, "AXIAL")) if sets[name].size)

    def _material(self) -> Iterator[str]:
        unit, name = self.stress_unit, "ALLOY"
        if isinstance(self.creep, UserMaterial):
            name = "ABAQUSNLALLOY" if self.large else "ABAQUSALLOY"
            yield from (f"*MATERIAL, NAME={name}", "*USER MATERIAL, CONSTANTS=1", "0.")
            yield from ("*DEPVAR", f"{self.creep.states}")
        else:
            yield from (f"*MATERIAL, NAME={name}", "*ELASTIC", f"{self.E / unit:.9g}, {self.nu:.9g}")
        if isinstance(self.creep, Norton):
            A = self.creep.A * unit**self.creep.n
            yield from ("*CREEP, LAW=NORTON", f"{A:.9g}, {self.creep.n:.9g}, {self.creep.m:.9g}")
        elif isinstance(self.creep, UserLaw) and not isinstance(self.creep, UserMaterial):
            yield "*CREEP, LAW=USER"
        yield f"*SOLID SECTION, ELSET=EALL, MATERIAL={name}"
        if isinstance(self.creep, UserLaw):
            yield from ("*INITIAL CONDITIONS, TYPE=TEMPERATURE", f"NALL, {self.creep.temperature:.9g}")

    def _steps(self) -> Iterator[str]:
        ramps = without_jumps(self.pressure)
        corners = ramps.times[(ramps.times > 0.0) & (ramps.times < self.times[-1])]
        yield "*AMPLITUDE, NAME=PRESSURE, TIME=TOTAL TIME"
        yield from (f"{t:.9g}, {p / self.stress_unit:.9g}" for t, p in zip(ramps.times, ramps.values, strict=True))
        yield "*TIME POINTS, NAME=PRINTING, TIME=TOTAL TIME"
        yield from (f"{t:.9g}," for t in np.union1d(self.times[self.times > 0.0], corners))
        for procedure, length in self._phases():
            yield from self._step(procedure, length)

    def _phases(self) -> Iterator[tuple[str, float]]:
        """Procedure and length, s, of each step: a load jumps in a static step of its own."""
        times, reached = self.pressure.times, 0.0
        jumps = times[1:][np.diff(times) <= 0.0]
        static = self.creep is None or isinstance(self.creep, UserMaterial)
        creeping = "*STATIC" if static else f"*VISCO, CETOL={self.cetol:.9g}"
        for start in [0.0, *jumps] if self.pressure.values[0] != 0.0 else jumps:
            if start > reached:
                yield creeping, float(start) - reached
            yield "*STATIC", INSTANT
            reached = float(start) + INSTANT
        yield creeping, float(self.times[-1]) - reached

    def _step(self, procedure: str, length: float) -> Iterator[str]:
        yield "*STEP, INC=1000000" + (", NLGEOM" if self.large else "")
        yield procedure
        yield f"{min(self.first, length):.9g}, {length:.9g}, {min(self.least, length):.9g}, {self.longest:.9g}"
        yield "*DLOAD, AMPLITUDE=PRESSURE"
        yield from (f"{element}, P{side}, 1." for element, side in pressed_sides(self.mesh))
        yield from ("*NODE PRINT, NSET=PRINTED, TIME POINTS=PRINTING", "U")
        if self.stresses:
            yield from ("*EL PRINT, ELSET=EALL, TIME POINTS=PRINTING", "S")
        yield "*END STEP"


def without_jumps(program: Program) -> Program:
    """The program with every jump made a ramp of 1 ms, for an amplitude starts at zero and has one value at a time."""
    times, values = program.times, program.values
    if values[0] != 0.0:
        times, values = np.append(0.0, times), np.append(0.0, values)
    after = np.append(False, np.diff(times) <= 0.0)
    times = times + INSTANT * after
    if (np.diff(times) <= 0.0).any():
        raise ValueError("the pressure jumps twice within a millisecond, which an amplitude cannot express")
    return Program(times, values)


def pressed_sides(mesh: Mesh) -> list[tuple[int, int]]:
    """Element and side, from 1, of each pressed edge; side k joins corners k and k + 1, as CalculiX counts."""
    elements, sides = np.nonzero(np.isin(mesh.elements[:, 4:], mesh.pressed[:, 1]))
    by_middle = {int(mesh.elements[e, 4 + k]): (int(e) + 1, int(k) + 1) for e, k in zip(elements, sides, strict=True)}
    return [by_middle[int(middle)] for middle in mesh.pressed[:, 1]]


def _lines(numbers: Ints) -> Iterator[str]:
    for start in range(0, len(numbers), _PER_LINE):
        yield ", ".join(map(str, numbers[start : start + _PER_LINE])) + ","


_HEADING = re.compile(r"^ *(displacements|stresses) .* for set (\S+) and time +(\S+)")


def blocks(lines: Iterable[str]) -> Iterator[tuple[str, float, Floats]]:
    """What was printed, time and rows of each table of a .dat file, in turn; lines that hold no numbers end a table."""
    title, time, rows = "", 0.0, list[list[float]]()
    for line in lines:
        heading = _HEADING.match(line)
        if heading is not None:
            if rows:
                yield title, time, np.array(rows)
            title, time, rows = heading[1], float(heading[3]), []
        elif title and line.strip():
            rows.append([float(cell) for cell in line.split()])
    if rows:
        yield title, time, np.array(rows)


def displacements(lines: Iterable[str], deck: Deck) -> Floats:
    """u_r and u_z at the deck's times and nodes, (times, nodes, 2) mm; NaN where the file holds nothing."""
    result = np.full((deck.times.size, deck.nodes.size, 2), np.nan)
    for title, time, rows in blocks(lines):
        near = np.flatnonzero(np.abs(deck.times - time) <= 1e-6 * time)
        if title == "displacements" and near.size:
            where = {int(node) - 1: k for k, node in enumerate(rows[:, 0])}
            result[near[0]] = rows[[where[int(node)] for node in deck.nodes], 1:3]
    return result


def stresses(lines: Iterable[str], deck: Deck) -> Floats:
    """Radial, axial, hoop and shear stress, (times, elements, points, 4) MPa; NaN where the file holds nothing."""
    result: Floats | None = None
    for title, time, rows in blocks(lines):
        near = np.flatnonzero(np.abs(deck.times - time) <= 1e-6 * time)
        if title != "stresses" or not near.size:
            continue
        table = rows[:, 2:6].reshape(len(deck.mesh.elements), -1, 4)
        result = np.full((deck.times.size, *table.shape), np.nan) if result is None else result
        result[near[0]] = table * deck.stress_unit
    return np.full((deck.times.size, len(deck.mesh.elements), 0, 4), np.nan) if result is None else result


def increments(lines: Iterable[str]) -> tuple[int, int]:
    """Increments and iterations of a .sta file."""
    rows = [line.split() for line in lines if re.match(r"^ *\d", line)]
    return len(rows), sum(int(row[3]) for row in rows)


def extrapolated(coarse: Floats, fine: Floats, steps: tuple[int, int]) -> Floats:
    """Values for ever smaller increments, from two runs of `steps` increments: backward Euler's error is as 1/steps."""
    few, many = steps
    return np.asarray((many * fine - few * coarse) / (many - few))
