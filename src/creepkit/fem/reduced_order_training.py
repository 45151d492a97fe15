"""Training of a reduced-order model: modes by proper orthogonal decomposition, points by non-negative least squares.

Snapshots are the accepted steps of finite element simulations, on one mesh or on meshes of the same numbering. Modes
leave as little as they can of the elastic energy of the snapshots' displacements, and of their changes from step to
step (Sirovich 1987). Points and their weights make the forces of the snapshots' stresses on the modes, and the elastic
stiffness, what all points make them (energy-conserving sampling and weighting, Farhat et al. 2014), found by the method
of Lawson and Hanson (1974), Solving Least Squares Problems, chapter 23.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

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


STIFFNESS_SHARE = 3.0
"""Weight of the elastic stiffness beside that of the forces when points are chosen."""


def _energy_norm(poisson: float = 0.3) -> Floats:
    """(5, 5) R with |R g|^2 the elastic energy density of the gradient g = (F11, F12, F21, F22, F33) at modulus one."""
    shear, first = 0.5 / (1.0 + poisson), poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))
    trace = np.array([1.0, 0.0, 0.0, 1.0, 1.0])
    strains = np.array([[1, 0, 0, 0, 0], [0, 0.5, 0.5, 0, 0], [0, 0.5, 0.5, 0, 0], [0, 0, 0, 1, 0], [0, 0, 0, 0, 1.0]])
    values, vectors = np.linalg.eigh(first * np.outer(trace, trace) + 2.0 * shear * strains.T @ strains)
    return np.asarray(np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T)


NORM = _energy_norm()


@dataclass(frozen=True, eq=False)
class TrainingRun:
    """A simulation that a reduced-order model learns from; theta : (P,) internal values."""

    model: FiniteElementModel
    law: CompiledLaw
    theta: Floats
    load_history: LoadHistory


@dataclass(frozen=True, eq=False)
class Snapshots:
    """Steps of the training simulations.

    displacements, changes : (snapshots, nodes, 2) mm, and since the step before.
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
    """First Piola-Kirchhoff stresses (steps, points, 5) of Hencky's law; creep : (steps, points, 3) as in the core."""
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
    """Modes (count, nodes, 2) that leave the least elastic energy of the snapshots, orthonormal in that energy."""
    chosen = _evenly(len(data.mesh), MOST_SNAPSHOTS)
    displacements, changes = data.displacements[chosen], data.changes[chosen]
    size, step = (np.abs(values).max(axis=(1, 2)) for values in (displacements, changes))
    share = np.sqrt(np.minimum(1.0, size / (SMALL_DEFLECTION * deflection_limit)))
    weights = np.concatenate([share / size, CHANGE_SHARE * share / np.maximum(step, SMALLEST_CHANGE)])
    fields = np.concatenate([displacements, changes]) * weights[:, None, None]
    roots = _energy_roots(data.models[0], fields).reshape(-1, len(fields))
    values, vectors = np.linalg.eigh(roots @ roots.T if len(roots) < len(fields) else roots.T @ roots)
    kept = np.flatnonzero(values > 1e-13 * values[-1])[::-1][:count]
    scaled = vectors[:, kept] / np.sqrt(values[kept])
    if len(roots) < len(fields):  # from directions of the gradients to combinations of the fields
        scaled = roots.T @ scaled / np.sqrt(values[kept])
    return np.asarray(np.tensordot(scaled.T, fields, 1))


def _evenly(total: int, most: int) -> Ints:
    """At most so many of the numbers from 0 to total - 1, evenly spaced."""
    return np.unique(np.linspace(0, total - 1, min(total, most)).round().astype(np.int64))


def _energy_roots(model: FiniteElementModel, modes: Floats) -> Floats:
    """(points, 5, modes) whose sum of squares is the elastic energy of modes (modes, nodes, 2) for a modulus of one."""
    gradients = mode_gradients(model, modes, np.arange(model.weights.size))
    weights = np.sqrt(model.weights.ravel())[:, None, None]
    return np.asarray(NORM @ gradients * weights)


def cubature(data: Snapshots, modes: Floats, count: int) -> tuple[Ints, Floats]:
    """Points (points,) and the factors of their weights, by which the forces on the modes come out right.

    modes : (modes, nodes, 2), orthonormal in the elastic energy, so that forces are measured by the displacements that
        they make.
    """
    every = data.models[0].weights.size
    if count >= every:
        return np.arange(every), np.ones(every)
    chosen = _evenly(len(data.mesh), max(1, MOST_FORCE_ROWS // len(modes)))
    gram, right = np.zeros((every, every)), np.zeros(every)
    for number, model in enumerate(data.models):
        stresses = data.stresses[chosen[data.mesh[chosen] == number]]
        gradients = mode_gradients(model, modes, np.arange(every)) * model.weights.ravel()[:, None, None]
        scale = np.sqrt((stresses**2 * model.weights.ravel()[:, None]).sum(axis=(1, 2)))
        forces = np.einsum("kps,psm->kmp", stresses / scale[:, None, None], gradients).reshape(-1, every)
        roots = _energy_roots(model, modes)
        stiffness = np.einsum("psi,psj->ijp", roots, roots)[np.triu_indices(len(modes))]
        for rows, share in ((forces, 1.0 / len(chosen)), (stiffness, STIFFNESS_SHARE / len(data.models) / len(modes))):
            gram += share * rows.T @ rows
            right += share * rows.T @ rows.sum(axis=1)
    return non_negative_least_squares(gram, right, count)


def non_negative_least_squares(gram: Floats, right: Floats, count: int) -> tuple[Ints, Floats]:
    """The x >= 0 with at most `count` numbers above zero that nearly minimises |A x - b|: their places and values.

    gram : (numbers, numbers) A^T A. right : (numbers,) A^T b. One number is added at a time, the one along which the
        residual falls fastest.
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
