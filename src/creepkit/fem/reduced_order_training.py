"""Training of a reduced-order model: modes by proper orthogonal decomposition, points by non-negative least squares.

Snapshots are the accepted steps of finite element simulations, on one mesh or on meshes of the same numbering. Modes
leave as little as they can of the elastic energy of the snapshots' displacements, and of their changes from step to
step (Sirovich 1987). Points and their weights make the forces of the snapshots' stresses on the modes, and the elastic
stiffness, what all points make them (energy-conserving sampling and weighting, Farhat et al. 2014), found by the method
of Lawson and Hanson (1974), Solving Least Squares Problems, chapter 23. Then least squares near them make a matrix of
each weight, by which a point stands for others where stress is another.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.errors import SolveError
from creepkit.fem.finite_element_model import FiniteElementModel
from creepkit.fem.reduced_order_model import ReducedBasis, mode_gradients
from creepkit.fem.simulation import LoadHistory, simulate
from creepkit.fem.solver import CREEP_COMPONENTS, SolverSettings
from creepkit.kernels.interface import CompiledLaw

SMALL_DEFLECTION = 0.05
"""Snapshots whose largest displacement is below this share of the deflection limit count less, by the root of it."""


CHANGE_SHARE = 0.1
"""Weight of the changes of displacement over a step beside the displacements, each of the same size."""


SMALLEST_CHANGE = 1e-6
"""mm; smaller changes over a step count less."""


MOST_SNAPSHOTS = 1500
"""That modes are found from; drawn evenly."""


MOST_FORCE_ROWS = 12_000
"""Snapshots times modes that points are chosen by, at most; snapshots are drawn evenly."""


STIFFNESS_SHARE = 0.2
"""Weight of the elastic stiffness beside that of the snapshots' forces when points are chosen."""


LEAST_IMPORTANCE, WORK_WEIGHT = 0.1, 2.0
"""Least weight of the force on a mode, where that of the one that moves most is some one; weight of the work."""


NEARNESS = 0.1
"""Weight of what makes a point's weight a matrix, beside the mean square of what forces follow from."""


AT_ONCE = 32
"""Stresses whose forces are in memory together."""


POISSON, TRACE = 0.3, np.array([1.0, 0.0, 0.0, 1.0, 1.0])


def _energy_norm() -> Floats:
    """(5, 5) R with |R g|^2 the elastic energy density of the gradient g = (F11, F12, F21, F22, F33) at modulus one."""
    shear, first = 0.5 / (1.0 + POISSON), POISSON / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON))
    strains = np.array([[1, 0, 0, 0, 0], [0, 0.5, 0.5, 0, 0], [0, 0.5, 0.5, 0, 0], [0, 0, 0, 1, 0], [0, 0, 0, 0, 1.0]])
    values, vectors = np.linalg.eigh(first * np.outer(TRACE, TRACE) + 2.0 * shear * strains.T @ strains)
    return np.asarray(np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T)


NORM = _energy_norm()


@dataclass(frozen=True, eq=False)
class TrainingRun:
    """A simulation that a reduced-order model learns from; theta : (P,) internal parameters."""

    model: FiniteElementModel
    law: CompiledLaw
    theta: Floats
    load_history: LoadHistory


@dataclass(frozen=True, eq=False)
class Snapshots:
    """Steps of the training simulations.

    displacements, changes : (snapshots, nodes, 2) mm, at the step, and since the step before.
    stresses : (snapshots, points, 5) MPa, first Piola-Kirchhoff stress.
    models : finite element models of the meshes; mesh : (snapshots,) number of each snapshot's.
    """

    displacements: Floats
    changes: Floats
    stresses: Floats
    models: Sequence[FiniteElementModel]
    mesh: Ints


def snapshots(runs: Sequence[TrainingRun], settings: SolverSettings) -> Snapshots:
    """Simulate all runs and keep their steps."""
    models = list({id(run.model): run.model for run in runs}.values())
    displacements, changes, stresses, mesh = [], [], [], []
    for run in runs:
        made = simulate(run.law, run.theta, run.model, run.load_history, settings=settings, keep_points=True)
        moved = np.flatnonzero(np.abs(made.displacements).max(axis=(1, 2)) > 0.0)
        if not moved.size or made.values is None:
            continue
        modulus = np.array([_at(run.load_history, t) for t in made.times[moved]])
        displacements.append(made.displacements[moved])
        changes.append(np.diff(made.displacements, axis=0, prepend=0.0)[moved])
        creep = made.values[moved, :, :CREEP_COMPONENTS]
        stresses.append(_stresses(run.model, made.displacements[moved], creep, modulus, run.load_history.poisson))
        mesh.append(np.full(moved.size, models.index(run.model)))
    if not displacements:
        raise SolveError("no training simulation of a reduced-order model moved the body; check its loads")
    u, du, P = (np.concatenate(parts) for parts in (displacements, changes, stresses))
    return Snapshots(u, du, P, models, np.concatenate(mesh))


def _at(load_history: LoadHistory, time: float) -> float:
    return float(np.interp(time, load_history.modulus.times, load_history.modulus.values))


def _stresses(
    model: FiniteElementModel, displacements: Floats, creep: Floats, modulus: Floats, poisson: float
) -> Floats:
    """First Piola-Kirchhoff stresses (steps, points, 5) of Hencky's law, MPa.

    displacements : (steps, nodes, 2) mm. creep : (steps, points, 3) components as in the core. modulus : (steps,) MPa.
    """
    points = np.arange(model.weights.size)
    gradient = np.moveaxis(mode_gradients(model, displacements, points), 2, 0)  # (steps, points, 5)
    F = gradient[..., :4].reshape(*gradient.shape[:2], 2, 2) + np.eye(2)
    hoop = 1.0 + gradient[..., 4]
    stretches, axes = np.linalg.eigh(np.swapaxes(F, -1, -2) @ F)
    logs = np.log(stretches)
    strain = (axes * (0.5 * logs)[..., None, :]) @ np.swapaxes(axes, -1, -2)
    trace = 0.5 * logs.sum(axis=-1) + np.log(hoop)
    bulk, shear = (modulus[:, None] / d for d in (3.0 * (1.0 - 2.0 * poisson), 2.0 * (1.0 + poisson)))
    first = np.log(hoop) - trace / 3.0 - creep[..., 0]
    second = strain[..., 0, 0] - strain[..., 1, 1] - creep[..., 1]
    third = 2.0 * strain[..., 0, 1] - creep[..., 2]
    plane, across, shearing = bulk * trace - shear * first, shear * second, shear * third
    conjugate = np.stack([plane + across, shearing, shearing, plane - across], axis=-1).reshape(F.shape)
    # derivatives of ln C between its axes: (ln a - ln b)/(a - b)
    apart, apart_logs = (x[..., 0] - x[..., 1] for x in (stretches, logs))
    between = np.where(np.abs(apart) > 1e-7, apart_logs / np.where(apart == 0.0, 1.0, apart),
                       2.0 / stretches.sum(axis=-1))  # fmt: skip
    factors = np.stack([1.0 / stretches[..., 0], between, between, 1.0 / stretches[..., 1]], axis=-1).reshape(F.shape)
    inner = factors * (np.swapaxes(axes, -1, -2) @ conjugate @ axes)
    piola = F @ (axes @ inner @ np.swapaxes(axes, -1, -2))
    return np.concatenate(
        [piola.reshape(*hoop.shape, 4), ((bulk * trace + 2.0 * shear * first) / hoop)[..., None]], axis=-1
    )


def train(data: Snapshots, mode_count: int, point_count: int, deflection_limit: float) -> ReducedBasis:
    """Modes and points of a reduced-order model; deflection_limit : mm, up to which it is to be used."""
    modes = principal_modes(data, mode_count, deflection_limit)
    points, factors = cubature(data, modes, point_count)
    return ReducedBasis(modes, points, factors)


def principal_modes(data: Snapshots, count: int, deflection_limit: float) -> Floats:
    """Modes (count, nodes, 2) that leave the least elastic energy of the snapshots, orthonormal in that energy; mm."""
    chosen = _evenly(len(data.mesh), MOST_SNAPSHOTS)
    displacements, changes = data.displacements[chosen], data.changes[chosen]
    size, step = (np.abs(values).max(axis=(1, 2)) for values in (displacements, changes))
    share = np.sqrt(np.minimum(1.0, size / (SMALL_DEFLECTION * deflection_limit)))
    weights = np.concatenate([share / size, CHANGE_SHARE * share / np.maximum(step, SMALLEST_CHANGE)])
    fields = np.concatenate([displacements, changes]) * weights[:, None, None]
    roots = _energy_roots(data.models[0], fields).reshape(-1, len(fields))
    values, vectors = np.linalg.eigh(roots @ roots.T)
    kept = np.flatnonzero(values > 1e-13 * values[-1])[::-1][:count]
    scaled = roots.T @ vectors[:, kept] / values[kept]  # from directions of the gradients to combinations of the fields
    return np.asarray(np.tensordot(scaled.T, fields, 1))


def _evenly(total: int, most: int) -> Ints:
    """At most so many of the numbers from 0 to total - 1, evenly spaced."""
    return np.unique(np.linspace(0, total - 1, min(total, most)).round().astype(np.int64))


def _energy_roots(model: FiniteElementModel, modes: Floats) -> Floats:
    """(points, 5, modes) whose sum of squares is the elastic energy of the modes for a modulus of one.

    modes : (modes, nodes, 2) mm.
    """
    gradients = mode_gradients(model, modes, np.arange(model.weights.size))
    weights = np.sqrt(model.weights.ravel())[:, None, None]
    return np.asarray(NORM @ gradients * weights)


def cubature(data: Snapshots, modes: Floats, count: int) -> tuple[Ints, Floats]:
    """Points (points,) and the factors (points, 5, 5) of their stresses by which forces on the modes come out right.

    modes : (modes, nodes, 2) mm, orthonormal in the elastic energy, so that forces are measured by the displacements
        they make. count : points at most.
    """
    every = data.models[0].weights.size
    if count >= every:
        return np.arange(every), np.broadcast_to(np.eye(5), (every, 5, 5))
    parts = [part for number in range(len(data.models)) for part in _forces_wanted(data, modes, number)]
    gram, right = np.zeros((every, every)), np.zeros(every)
    for part in parts:
        rows = part.of_points()
        gram += rows.T @ rows
        right += rows.T @ rows.sum(axis=1)
    points, weights = non_negative_least_squares(gram, right, count)
    return points, _matrix_weights(parts, points, weights)


class _Forces(NamedTuple):
    """Forces that a cubature is to be right for: those of stresses on the modes, and their work along a motion each.

    stresses, motions : (k, points, 5), gradients : (points, 5, modes), the latter two times the points' weights.
    """

    stresses: Floats
    motions: Floats
    gradients: Floats

    def of_points(self) -> Floats:
        """Contributions (k modes + k, points) of all points."""
        forces = np.einsum("kps,psm->kmp", self.stresses, self.gradients)
        work = np.einsum("kps,kps->kp", self.stresses, self.motions)
        return np.concatenate([forces.reshape(-1, forces.shape[2]), work])

    def of_components(self, points: Ints) -> Floats:
        """As `of_points` for some, (..., 25 points), of component t of the stress by component s of the gradient."""
        stresses = self.stresses[:, points]
        forces = np.einsum("kpt,psm->kmpst", stresses, self.gradients[points])
        work = np.einsum("kpt,kps->kpst", stresses, self.motions[:, points])
        return np.concatenate([each.reshape(-1, 25 * points.size) for each in (forces, work)])


def _forces_wanted(data: Snapshots, modes: Floats, mesh: int) -> list[_Forces]:
    """Of the snapshots on one mesh, and of elastic changes of volume, and of shape, along the modes, apart: a body that
    creeps resists the former alone. Work counts more than forces, for what an error of them does is work on the motion.
    """
    model, energy = data.models[mesh], NORM.T @ NORM
    weights, every = model.weights.ravel(), np.arange(model.weights.size)
    chosen = _evenly(len(data.mesh), max(1, MOST_FORCE_ROWS // len(modes)))
    own = chosen[data.mesh[chosen] == mesh]
    gradients = mode_gradients(model, modes, every)
    volume = np.outer(TRACE, TRACE) @ gradients / (3.0 * (1.0 - 2.0 * POISSON))
    elastic = np.concatenate([volume, energy @ gradients - volume], axis=2)
    given = (
        (data.stresses[own], mode_gradients(model, data.changes[own], every), 1.0 / len(chosen)),
        (np.moveaxis(elastic, 2, 0), np.tile(gradients, 2), STIFFNESS_SHARE / len(data.models) / (2.0 * len(modes))),
    )
    found = []
    for stresses, motions, share in given:
        along = np.moveaxis(motions, 2, 0)
        sizes = (stresses**2 * weights[:, None]).sum(axis=(1, 2))
        energies = (along * (along @ energy) * weights[:, None]).sum(axis=(1, 2))
        stresses = stresses * np.sqrt(share / sizes)[:, None, None]
        along = along * weights[:, None] * (WORK_WEIGHT / np.sqrt(energies))[:, None, None]
        forces = gradients * weights[:, None, None] * _importance(data, modes)
        for part in np.array_split(np.arange(len(stresses)), -(-len(stresses) // AT_ONCE)):
            found.append(_Forces(stresses[part], along[part], forces))
    return found


def _importance(data: Snapshots, modes: Floats) -> Floats:
    """Weights (modes,) of the forces on the modes, at most some one: by how much each takes part in changes."""
    changes = data.changes[_evenly(len(data.mesh), MOST_SNAPSHOTS)]
    roots, fields = (_energy_roots(data.models[0], each).reshape(-1, len(each)) for each in (modes, changes))
    parts = roots.T @ fields
    share = np.sqrt(((parts / np.linalg.norm(parts, axis=0)) ** 2).mean(axis=1))
    return np.asarray(share / share.max() + LEAST_IMPORTANCE)


def _matrix_weights(parts: Sequence[_Forces], points: Ints, weights: Floats) -> Floats:
    """The factors (points, 5, 5) near weights (points,) times one by which forces are those of all points."""
    count, scalar = 25 * points.size, weights[:, None, None] * np.eye(5)
    gram, right = np.zeros((count, count)), np.zeros(count)
    for part in parts:
        rows = part.of_components(points)
        gram += rows.T @ rows
        right += rows.T @ (part.of_points().sum(axis=1) - rows @ scalar.ravel())
    nearness = NEARNESS * np.trace(gram) / count * np.repeat(weights**-2.0, 25)
    return np.asarray(scalar + np.linalg.solve(gram + np.diag(nearness), right).reshape(scalar.shape))


def non_negative_least_squares(gram: Floats, right: Floats, count: int) -> tuple[Ints, Floats]:
    """The x >= 0 with at most `count` numbers above zero that nearly minimises |A x - b|: their places and values.

    gram : (unknowns, unknowns) A^T A. right : (unknowns,) A^T b.
    Places and values are (found,). One number is added at a time, the one along which the residual falls fastest.
    """
    scale = np.sqrt(np.diag(gram))
    scale = np.where(scale > 0.0, scale, 1.0)
    gram, right = gram / scale[:, None] / scale, right / scale
    active: list[int] = []
    x = np.zeros(len(right))
    for _ in range(4 * count):
        if len(active) >= count:
            break
        slope = right - gram @ x
        slope[active] = -np.inf
        best = int(np.argmax(slope))
        if not slope[best] > 1e-12 * right.max():
            break
        active.append(best)
        while True:
            inner = np.ix_(active, active)
            solution = np.linalg.lstsq(gram[inner], right[active], rcond=1e-13)[0]
            if (solution > 0.0).all():
                break
            before = x[active]
            falling = solution <= 0.0
            step = float(np.min(before[falling] / np.maximum(before[falling] - solution[falling], 1e-300)))
            after = before + step * (solution - before)
            keep = after > 1e-12 * max(1.0, after.max())
            x[active] = np.where(keep, after, 0.0)
            if keep.all():
                keep[int(np.argmin(after))] = False
                x[active] = np.where(keep, after, 0.0)
            active = [k for k, kept in zip(active, keep, strict=True) if kept]
        x[:] = 0.0
        x[active] = solution
    places = np.sort(np.array(active, dtype=np.int64))
    return places, np.asarray(x[places] / scale[places])
