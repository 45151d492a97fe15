"""The implicit stage of one material point in six components, and its reduction to a scalar problem.

Small strain, isotropic elasticity, creep along the deviator of stress. Under proportional loading the problem is a
scalar one with exact derivatives. Tensors are vectors of the components 11, 22, 33, 12, 23, 13, with tensor shear
strains (half of the engineering ones).
"""

from __future__ import annotations

from math import isfinite, sqrt
from typing import NamedTuple

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.integration.stage_problem import (
    BY_MEAN,
    BY_PRINCIPAL,
    BY_TRIAL,
    INPUTS,
    SOLVED,
    Axes,
    StageProblem,
    differentiate_stage,
    gradient_of_update,
)
from creepkit.integration.stage_solver import solve_stage
from creepkit.integration.time_discretisation import merge_programs
from creepkit.kernels.interface import POINT_SIZE, STRESS, TEMPERATURE, TIME, CompiledLaw, call_entry
from creepkit.records import TENSOR_COMPONENTS, PointLoading, Program

EQUIVALENT_STRAIN = 6
"""Place of the equivalent creep strain in a point's vector: six creep strains, then this, then the states."""


_UNIT = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])


_TWICE = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])


_ROWS, _COLUMNS = np.array([0, 1, 2, 0, 1, 0]), np.array([0, 1, 2, 1, 2, 2])


_DEVIATOR = np.eye(6) - np.outer(_UNIT, _UNIT) / 3.0


_ITERATIONS = 30


_BALANCE, _NO_STRESS = 1e-9, 1e-12


_LAST_CORRECTION = 1e-8


_FIRST_INCREMENT = 1e-6


class TrialStress(NamedTuple):
    """The stress if nothing crept: mean stress, deviator (6,), von Mises stress q, in MPa, and the axes it fixes.

    along : (6,) derivative of the deviator's largest principal stress to the deviator.
    """

    mean: float
    s: Floats
    q: float
    axes: Axes
    along: Floats


class ConstitutiveResponse(NamedTuple):
    """The vector after a stage, (7 + S,), the stress, (6,), and its consistent tangent to the strain, (6, 6)."""

    vector: Floats
    stress: Floats
    tangent: Floats


def trial_stress(stress: Floats) -> TrialStress:
    """Take a stress apart."""
    mean = float(stress[:3].mean())
    s = stress - mean * _UNIT
    q = sqrt(1.5 * float((_TWICE * s) @ s))
    tensor = np.empty((3, 3))
    tensor[_ROWS, _COLUMNS] = tensor[_COLUMNS, _ROWS] = s
    values, vectors = np.linalg.eigh(tensor)
    axis = vectors[:, -1]
    slope = float(values[-1]) / q if q > 0.0 else 0.0
    return TrialStress(mean, s, q, Axes(mean, slope, mean, 0.0), _TWICE * axis[_ROWS] * axis[_COLUMNS])


class TensorPoint:
    """A material and the components of strain that are free, with working arrays; its vector is (7 + S,)."""

    def __init__(self, law: CompiledLaw, theta: Floats, elastic: tuple[float, float], held: Bools) -> None:
        E, nu = elastic
        size = 1 + law.states
        self.law, self.theta, self.free = law, theta, ~held
        self.shear, self.bulk = E / (2 * (1 + nu)), E / (3 * (1 - 2 * nu))
        self.stiffness = self.bulk * np.outer(_UNIT, _UNIT) + 2 * self.shear * _DEVIATOR
        self.row, self.out = np.zeros(POINT_SIZE + law.states), np.zeros(size * (1 + POINT_SIZE + law.states))

    @property
    def equivalent_stress(self) -> float:
        """The von Mises stress at the end of the last stage, MPa."""
        return float(self.row[STRESS])

    def elastic_response(self, imposed: Floats, creep: Floats) -> tuple[Floats, Floats]:
        """Stress and strain when creep strains are known; `imposed` mixes stresses and strains."""
        free, strain = self.free, np.where(self.free, 0.0, imposed)
        known = self.stiffness @ (strain - creep)
        strain[free] = np.linalg.solve(self.stiffness[np.ix_(free, free)], (imposed - known)[free])
        return np.where(free, imposed, self.stiffness @ (strain - creep)), strain

    def solve_stage(
        self, base: Floats, guess: Floats, imposed: Floats, time: float, temperature: float, weight: float
    ) -> Floats | None:
        """The vector at the end of a stage that starts from `base` with a weight in s; None when there is none."""
        free = self.free
        _, strain = self.elastic_response(imposed, guess[:6])
        self.row[TIME], self.row[TEMPERATURE] = time, temperature
        for _ in range(_ITERATIONS):
            answer = self.constitutive_response(strain, base, guess, weight)
            if answer is None:
                return None
            residual = (answer.stress - imposed)[free]
            if np.abs(residual).max(initial=0.0) <= _BALANCE * np.abs(answer.stress).max() + _NO_STRESS:
                return answer.vector
            strain[free] -= np.linalg.solve(answer.tangent[np.ix_(free, free)], residual)
        return None

    def constitutive_response(
        self, strain: Floats, base: Floats, guess: Floats, weight: float
    ) -> ConstitutiveResponse | None:
        """What follows from a strain at the end of the stage whose time and temperature stand in the row."""
        trial = trial_stress(self.stiffness @ (strain - base[:6]))
        if not isfinite(trial.q):
            return None
        problem = StageProblem(trial.q, 3 * self.shear, 0.0, weight, max(float(base[EQUIVALENT_STRAIN]), 0.0))
        vector = self._creep(base, guess, trial, problem)
        if vector is None:
            return None
        tangent = self._tangent(trial, problem, float(vector[EQUIVALENT_STRAIN] - base[EQUIVALENT_STRAIN]))
        stress = trial.mean * _UNIT + self._share(trial) * trial.s
        return None if tangent is None else ConstitutiveResponse(vector, stress, tangent)

    def _share(self, trial: TrialStress) -> float:
        """What creep leaves of the deviator."""
        return float(self.row[STRESS]) / trial.q if trial.q > 0.0 else 1.0

    def _creep(self, base: Floats, guess: Floats, trial: TrialStress, problem: StageProblem) -> Floats | None:
        """The vector after the creep that a trial stress brings about; the law's row is left at the solution."""
        states = base[EQUIVALENT_STRAIN + 1 :].copy()
        self.row[POINT_SIZE:] = guess[EQUIVALENT_STRAIN + 1 :]
        first = float(guess[EQUIVALENT_STRAIN] - base[EQUIVALENT_STRAIN])
        first = first if first > 0.0 else _FIRST_INCREMENT
        increment, flag = solve_stage(
            self.law.update, self.theta, trial.axes, problem, states, self.row, self.out, first, _LAST_CORRECTION
        )
        flow = 1.5 * increment * trial.s / trial.q if trial.q > 0.0 else np.zeros(6)
        change = np.concatenate([flow, [increment], self.row[POINT_SIZE:] - states])
        return base + change if flag == SOLVED else None

    def _tangent(self, trial: TrialStress, problem: StageProblem, increment: float) -> Floats | None:
        """Derivative of stress to strain after `_creep`, (6, 6); None when it has none."""
        if trial.q == 0.0:
            return self.stiffness
        answer = self._response(trial.axes, problem, increment)
        if answer is None:
            return None
        share, G = self._share(trial), self.shear
        d_q = 3 * G * _TWICE * trial.s / trial.q
        d_mean = self.bulk * _UNIT
        d_slope = (2 * G * (trial.along - _UNIT / 3) - trial.axes.principal_slope * d_q) / trial.q
        d_principal = d_mean + self.row[STRESS] * d_slope
        d_increment = answer[BY_TRIAL] * d_q + answer[BY_PRINCIPAL] * d_principal + answer[BY_MEAN] * d_mean
        d_share = ((1 - share) * d_q - problem.stiffness * d_increment) / trial.q
        return np.outer(_UNIT, d_mean) + 2 * G * share * _DEVIATOR + np.outer(trial.s, d_share)

    def _response(self, axes: Axes, problem: StageProblem, increment: float) -> Floats | None:
        """Derivatives of the creep increment to the inputs of the stage."""
        size = 1 + self.law.states
        out, _ = call_entry(self.law, "update", self.row[None], self.theta)
        gradient, response = np.zeros((size, self.row.size)), np.zeros((size, INPUTS + size - 1))
        gradient_of_update(out[0], problem, increment, gradient)
        rates, stress = out[0, 1:size].copy(), float(self.row[STRESS])
        regular = differentiate_stage(
            axes, problem, increment, stress, rates, gradient, np.zeros((size, size)), response
        )
        return response[0] if regular and np.isfinite(response[0]).all() else None


_PROPORTIONALITY_TOLERANCE = 1e-9
"""Of the largest stress: what differs by less is the same direction."""


_SHEAR_WEIGHTS = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])


_MEAN_DIRECTION = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])


class ProportionalLoading(NamedTuple):
    """A scalar problem.

    driving : von Mises stress if nothing crept, over time, MPa; stiffness : k, MPa; axes : of the scalar problem.
    flow : (6,) d(creep strain)/d(equivalent); along : (6,) stress by von Mises stress, where a strain is prescribed.
    """

    driving: Program
    stiffness: float
    axes: Axes
    flow: Floats
    along: Floats


def proportional_loading(
    loading: PointLoading, end: float, elastic: tuple[float, float] | None = None
) -> ProportionalLoading | None:
    """The scalar problem of a loading up to `end`, s; None where there is none. elastic : E, MPa, and nu."""
    if loading.strain:
        return None if elastic is None else _single_strain(loading, elastic)
    programs = [loading.stress.get(name, Program.constant(0.0)) for name in TENSOR_COMPONENTS]
    times, stresses = _segment_ends(programs, end)
    means = stresses[:, :3].mean(axis=1)
    deviators = stresses - means[:, None] * _MEAN_DIRECTION
    size, room = (
        np.sqrt(1.5 * (deviators**2 @ _SHEAR_WEIGHTS)),
        _PROPORTIONALITY_TOLERANCE * max(float(np.abs(stresses).max()), 1e-300),
    )
    along = deviators[np.argmax(size)] / size.max() if size.max() > room else np.zeros(6)
    level = 1.5 * (deviators * _SHEAR_WEIGHTS) @ along
    line = _line(level, means, room)
    if line is None or np.abs(deviators - level[:, None] * along).max() > room or level.min() < -room:
        return None
    offset, slope = line
    axes = Axes(offset, trial_stress(along).axes.principal_slope + slope, offset, slope)
    return ProportionalLoading(Program(times, np.maximum(level, 0.0)), 0.0, axes, 1.5 * along, np.zeros(6))


def _single_strain(loading: PointLoading, elastic: tuple[float, float]) -> ProportionalLoading | None:
    """One strain that never falls, and no stress but its own."""
    if loading.stress or len(loading.strain) > 1:
        return None
    ((name, strain),) = loading.strain.items()
    if (np.diff(strain.values) < 0.0).any() or strain.values[0] < 0.0:
        return None
    (E, nu), shear = elastic, name[0] != name[1]
    along = np.where(np.arange(6) == TENSOR_COMPONENTS.index(name), 1.0 / np.sqrt(3.0) if shear else 1.0, 0.0)
    stiffness = 1.5 * E / (1.0 + nu) if shear else E
    driving = stiffness * strain.values * (2.0 / np.sqrt(3.0) if shear else 1.0)
    trial = trial_stress(along)
    axes = Axes(0.0, trial.axes.principal_slope + trial.mean, 0.0, trial.mean)
    return ProportionalLoading(Program(strain.times, driving), stiffness, axes, 1.5 * trial.s, along)


def _segment_ends(programs: list[Program], end: float) -> tuple[Floats, Floats]:
    """Times and values (times, programs) at both ends of every segment."""
    rows = merge_programs(*programs, end=end)
    if not len(rows):
        return np.zeros(1), np.array([[float(p.at(0.0)) for p in programs]])
    values = np.stack([rows[:, 2::2], rows[:, 3::2]], axis=1)
    return rows[:, :2].reshape(-1), values.reshape(-1, len(programs))


def _line(x: Floats, y: Floats, room: float) -> tuple[float, float] | None:
    """Offset and slope of y over x, where it is a straight line."""
    slope = float(np.polyfit(x, y, 1)[0]) if float(np.ptp(x)) > room else 0.0
    offset = float(np.mean(y - slope * x))
    return (offset, slope) if np.abs(y - offset - slope * x).max() <= 10 * room else None
