"""Exported stress updates, compiled and driven along strain paths, and an independent integration of the same paths.

The reference is the law's own equations, by sympy's lambdify, with Hooke's law and the flow rule as differential
equations, integrated by scipy's Radau method: no code of the update, and none of creepkit's kernels.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from types import ModuleType

import numpy as np
import sympy
from scipy.integrate import solve_ivp

from creepkit.language import CreepLaw, Elastic
from creepkit.language.symbols import POINT_VARIABLES, temperature, time
from creepkit.records import LawWithValues
from helpers.compiled_fortran import pointer
from helpers.compilers import shared_library

C_FLAGS = ("-std=c99", "-Wall", "-Wextra", "-pedantic", "-O2")
FORTRAN_FLAGS = ("-std=legacy", "-Wall", "-Wno-unused-dummy-argument", "-O1")
SHEAR = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])
"""Engineering over tensor strain, of the components 11, 22, 33, 12, 13, 23."""

CONDITION = 0.05
"""Of every condition of a law, such as grain size in mm."""

STEEL = Elastic(210e3 - 60.0 * temperature, 0.28 + 2e-5 * temperature)


@dataclass
class Point:
    """Stress (6,), MPa, and states (1 + S,) of a point."""

    stress: np.ndarray
    state: np.ndarray

    def copy(self) -> Point:
        return Point(self.stress.copy(), self.state.copy())


class CUpdate:
    """NAME_update of a C file."""

    def __init__(self, gcc: str, text: str, folder: Path, name: str) -> None:
        source = folder / f"{name}.c"
        source.write_text(text)
        library, self.warnings = shared_library([gcc, *C_FLAGS, source], folder / f"{name}.so")
        self._function = getattr(library, f"{name}_update")
        self._function.argtypes = [ctypes.c_double] * 2 + [ctypes.c_void_p] * 5

    def advance(self, point: Point, start: float, step: float, strain: np.ndarray, outside: np.ndarray) -> np.ndarray:
        """Move a point through an increment of engineering strain (6,); the tangent, (6, 6)."""
        tangent, strain, outside = np.empty((6, 6)), np.array(strain), np.array(outside, order="C")
        arrays = (outside, strain, point.stress, point.state, tangent)
        assert self._function(start, step, *map(pointer, arrays)) == 0
        return tangent


class FortranUpdate:
    """What a code calls in a Fortran file, called as the code does, for six components or four.

    target : the name of the target. components : 4 in plane strain and axisymmetry.
    """

    def __init__(self, gfortran: str, text: str, folder: Path, target: str, components: int = 6) -> None:
        source = folder / "update.f"
        source.write_text(text)
        library = folder / "update.so"
        self.library, self.warnings = shared_library([gfortran, *FORTRAN_FLAGS, source], library)
        self.target, self.components = target, components
        shears = [3, 4, 5] if target in ("abaqus-umat", "calculix-umat") else [3, 5, 4]
        self.order = np.array([0, 1, 2, *shears])[:components]
        self.history = np.zeros(0)

    def advance(self, point: Point, start: float, step: float, strain: np.ndarray, outside: np.ndarray) -> np.ndarray:
        """As of CUpdate; components that are not passed stay as they are, and there is no tangent of them."""
        n, states = self.components, point.state.size
        stress, change = point.stress[self.order].copy(), strain[self.order].copy()
        tangent = np.zeros((n, n), order="F")
        if self.history.size == 0:  # beside the states the temperature, of a point that has a stress already
            self.history = np.concatenate([np.zeros(states), outside[0, :1], np.zeros(36)])
        self.history[:states] = point.state
        call = {"abaqus-umat": self._umat, "calculix-umat": self._umat, "ansys-usermat": self._usermat}
        call.get(self.target, self._ls_dyna)(stress, tangent, change, start, step, outside)
        point.stress[self.order], point.state[:] = stress, self.history[:states]
        whole = np.zeros((6, 6))
        whole[np.ix_(self.order, self.order)] = tangent
        return whole

    def _umat(self, stress, tangent, change, start, step, outside):
        u, halved, kelvin = pointer(np.zeros(9)), np.ones(1), outside[:, 0].copy()
        temperatures = [kelvin[:1], np.diff(kelvin)] if "abaqus" in self.target else [kelvin[1:], np.zeros(1)]
        fields = [outside[0, 1:].copy(), np.diff(outside[:, 1:], axis=0).ravel()]
        n = len(stress)
        self.library.umat_(
            pointer(stress), pointer(self.history), pointer(tangent), u, u, u, u, u, u, u, u, pointer(change),
            pointer(np.array([start, start])), pointer(np.array([step])), *map(pointer, temperatures),
            *map(pointer, fields), _text(80), *_integers(3, n - 3, n, len(self.history)), u, *_integers(0), u, u,
            pointer(halved), u, u, u, *[u] * 6, ctypes.c_size_t(80),
        )  # fmt: skip
        assert halved[0] == 1.0

    def _usermat(self, stress, tangent, change, start, step, outside):
        u, kelvin, n = pointer(np.zeros(9)), outside[:, 0].copy(), len(stress)
        keycut = ctypes.c_int(0)
        self.library.usermat_(
            *[u] * 7, ctypes.byref(keycut), *_integers(3, n - 3, n, len(self.history), 0), *map(pointer, (
                np.array([start]), np.array([step]), kelvin[:1], np.diff(kelvin), stress, self.history, tangent)),
            u, u, u, u, pointer(change), *[u] * 15,
        )  # fmt: skip
        assert keycut.value == 0

    def _ls_dyna(self, stress, tangent, change, start, step, outside):
        u, reject, numbers = pointer(np.zeros(9)), ctypes.c_int(0), [np.array([step]), np.array([start + step])]
        first = (u, pointer(change), pointer(stress), u, pointer(self.history), pointer(numbers[0]))
        kelvin = pointer(outside[1, :1].copy())
        last = (u, _text(5), pointer(numbers[1]), kelvin)
        self.library.umat43_(*first, *last, *[u] * 7, ctypes.byref(reject), ctypes.c_size_t(5))
        assert reject.value == 0
        self.library.utan43_(*first, u, *last, pointer(tangent), *[u] * 5, ctypes.c_size_t(5))


def _text(length: int) -> object:
    return ctypes.create_string_buffer(b"solid".ljust(length), length)


def _integers(*values: int) -> list[object]:
    return [ctypes.byref(ctypes.c_int(value)) for value in values]


class NumpyUpdates:
    """`update` of a NumPy module, for points at several shares of a stress at once; the first is followed."""

    def __init__(self, text: str) -> None:
        self.module = ModuleType("exported")
        exec(compile(text, "exported", "exec"), self.module.__dict__)

    def advance(self, point: Point, start: float, step: float, strain: np.ndarray, outside: np.ndarray) -> np.ndarray:
        """As of CUpdate."""
        shares = np.array([[1.0, 0.3], [0.7, 1.2]])
        change, stress, state = (a[:, None, None] * shares for a in (strain, point.stress, point.state))
        stress, state, tangent, failed = self.module.update(start, step, outside[:, :, None], change, stress, state)
        assert not failed.any()
        point.stress[:], point.state[:] = stress[:, 0, 0], state[:, 0, 0]
        return tangent[:, :, 0, 0]


@dataclass(frozen=True)
class Path6:
    """A strain path: times (T,), engineering strains (T, 6) and temperatures (T,), straight between them."""

    times: np.ndarray
    strains: np.ndarray
    temperatures: np.ndarray

    def increments(self, count: int):
        """(start, length, increment of strain, temperatures at both ends) of `count` equal increments a piece."""
        for k, (begin, end) in enumerate(pairwise(self.times)):
            change, warming = self.strains[k + 1] - self.strains[k], self.temperatures[k + 1] - self.temperatures[k]
            for j in range(count):
                kelvin = self.temperatures[k] + warming * np.array([j, j + 1]) / count
                yield begin + (end - begin) * j / count, (end - begin) / count, change / count, kelvin


class Equations:
    """Rates of a law with numbers, of a point (6,) and states (S,)."""

    def __init__(self, source: LawWithValues) -> None:
        law = source.law
        numbers = {s: source.values[s.name] for s in law.params} | dict.fromkeys(law.conditions, CONDITION)
        terms = [sum(law.terms.values()), *(state.rate for state in law.states.values())]
        symbols = [*POINT_VARIABLES, *law.states]
        self._rates = sympy.lambdify(symbols, [sympy.sympify(t).xreplace(numbers) for t in terms], "numpy")
        self.initial = np.array([state.initial for state in law.states.values()])
        self.limits = np.array([np.inf if s.limit is None else s.limit for s in law.states.values()])
        self.law, self.elastic = law, source.elastic
        T = sympy.Symbol("T")
        moduli = [sympy.sympify(e).xreplace({temperature: T}) for e in (source.elastic.E, source.elastic.nu)]
        self._moduli = sympy.lambdify(T, moduli, "numpy")

    def stiffness(self, kelvin: float) -> tuple[float, float]:
        """Shear and bulk modulus, MPa."""
        E, nu = self._moduli(kelvin)
        return E / (2 * (1 + nu)), E / (3 * (1 - 2 * nu))

    def rates(self, stress: np.ndarray, strain: float, t: float, kelvin: float, states: np.ndarray):
        """Creep rate, flow direction (6,) of tensor strains, and rates of states."""
        mean = stress[:3].mean()
        deviator = stress - mean * np.repeat([1.0, 0.0], 3)
        mises = np.sqrt(1.5 * (SHEAR * deviator**2).sum())
        a, b, c, d, e, f = stress
        first = np.linalg.eigvalsh([[a, d, e], [d, b, f], [e, f, c]])[-1]
        rate, *growth = self._rates(mises, strain, t, kelvin, first, mean, *states)
        return rate, 1.5 * deviator / mises, np.array(growth, dtype=float)


def reference(source: LawWithValues, path: Path6, point: Point, tolerance: float = 1e-10) -> Point:
    """The point at the end of a path."""
    equations, one = Equations(source), point.copy()
    size = one.state.size
    for k, (begin, end) in enumerate(pairwise(path.times)):
        low, span = path.temperatures[k], path.temperatures[k + 1] - path.temperatures[k]
        strain = (path.strains[k + 1] - path.strains[k]) / SHEAR
        shear, bulk = equations.stiffness(low)
        mean = one.stress[:3].mean()
        unit = np.repeat([1.0, 0.0], 3)
        elastic = (one.stress - mean * unit) / (2 * shear) + mean / (3 * bulk) * unit

        def stress_at(share, creep, low=low, span=span, strain=strain, elastic=elastic, unit=unit):
            shear, bulk = equations.stiffness(low + share * span)
            e = elastic + share * strain - creep
            return 2 * shear * (e - e[:3].mean() * unit) + 3 * bulk * e[:3].mean() * unit

        def slope(t, y, begin=begin, end=end, low=low, span=span, stress_at=stress_at):
            share = (t - begin) / (end - begin)
            stress = stress_at(share, y[:6])
            rate, direction, growth = equations.rates(stress, y[6], t, low + share * span, equations.initial + y[7:])
            return np.concatenate([rate * direction, [rate], growth])

        start = np.concatenate([np.zeros(6), one.state])
        scale = np.concatenate([np.full(7, 1e-3), np.maximum(np.abs(equations.initial), 1e-2)])
        run = solve_ivp(slope, (begin, end), start, "Radau", rtol=tolerance, atol=1e-3 * tolerance * scale)
        assert run.success, run.message
        last = run.y[:, -1]
        one = Point(stress_at(1.0, last[:6]), last[6 : 6 + size])
    return one


def driven(update, path: Path6, point: Point, count: int, conditions: int = 0) -> Point:
    """The point at the end of a path by an exported update in `count` increments a piece."""
    one = point.copy()
    for start, step, strain, kelvin in path.increments(count):
        update.advance(one, start, step, strain, _outside(kelvin, conditions))
    return one


def tangent_by_differences(update, point: Point, increment, conditions: int) -> tuple[np.ndarray, np.ndarray]:
    """Differences of fourth order of the stress at the end of an increment, and the tangent, (6, 6).

    The steps within the increment may change between the points of a difference: the better of two counts.
    """
    start, step, strain, kelvin = increment
    outside = _outside(kelvin, conditions)
    tangent = update.advance(point.copy(), start, step, strain, outside)

    def difference(j, h):
        stresses = []
        for k in (-2, -1, 1, 2):
            one = point.copy()
            update.advance(one, start, step, strain + k * h * np.eye(6)[j], outside)
            stresses.append(one.stress)
        return np.array([1.0, -8.0, 8.0, -1.0]) @ stresses / (12 * h)

    numeric = [np.stack([difference(j, h) for j in range(6)], 1) for h in (1e-7, 3e-9)]
    return min(numeric, key=lambda n: np.abs(n - tangent).max()), tangent


def _outside(kelvin: np.ndarray, conditions: int) -> np.ndarray:
    """Temperature and conditions at both ends of an increment, (2, 1 + conditions)."""
    return np.column_stack([kelvin, np.full((2, conditions), CONDITION)])


def random_path(source: LawWithValues, seed: int, pieces: int = 4) -> tuple[Path6, Point]:
    """A path of several directions, with unloading and changes of temperature, and a point that has crept already.

    Its pieces last as long as the law needs for a creep strain of the order of the elastic one at 100 MPa.
    """
    rng, equations, level = np.random.default_rng(seed), Equations(source), 100.0
    pull = np.array([1.0, 0, 0, 0, 0, 0])
    while not equations.rates(level * pull, 1e-3, 1.0, 900.0, equations.initial)[0] > 0.0:
        level *= 2.0
    kelvin, began = 900.0 + 30.0 * rng.uniform(-1, 1, pieces + 1), 1.0
    for _ in range(200 if source.law.uses(time) else 1):
        rate, _, growth = equations.rates(level * pull, 1e-3, began, 900.0, equations.initial)
        began = 0.5 * began + 0.5 * 5e-4 / rate
    room = np.abs(equations.limits - equations.initial) / np.maximum(np.abs(growth), 1e-300)
    length = min(5e-4 / rate, *(0.05 * room), np.inf)
    times = began + length * np.concatenate([[0.0], np.cumsum(rng.uniform(0.5, 1.5, pieces))])
    steps = rng.normal(size=(pieces + 1, 6))
    stresses = level * (pull + 0.4 * np.concatenate([[np.zeros(6)], np.cumsum(steps[1:], axis=0)]))
    shear, bulk = equations.stiffness(900.0)
    mean = stresses[:, :3].mean(axis=1, keepdims=True) * np.repeat([1.0, 0.0], 3)
    strains = SHEAR * ((stresses - mean) / (2 * shear) + mean / (3 * bulk))
    state = np.concatenate([[1e-3], np.zeros(equations.initial.size)])
    return Path6(times, strains, kelvin), Point(stresses[0], state)


def centred(law: CreepLaw) -> LawWithValues:
    """A law at the middle of its bounds, with a modulus that depends on temperature."""
    return LawWithValues(law, law.center(), elastic=STEEL, name="mine")
