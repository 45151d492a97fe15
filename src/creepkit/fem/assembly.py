"""Assembly of out-of-balance forces and tangent over all points, with follower pressure and its load stiffness."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from creepkit.arrays import Floats
from creepkit.fem.banded_system import FiniteElementModel, band_shape
from creepkit.fem.kinematics import (
    DIFFERENCE,
    HOOP,
    SHEAR,
    SUM,
    Four,
    add_force,
    add_stiffness,
    clear,
    clear_element,
    deformation,
    energy_slopes,
    gather,
    kinematics,
    piola_tangent,
    scatter_force,
    scatter_stiffness,
    set_products,
    to_gradient,
)
from creepkit.fem.material_point import (
    CREEP_COMPONENTS,
    EQUIVALENT_STRAIN,
    PointWorkspace,
    StageConditions,
    axes_of,
    creep_derivatives,
    creep_derivatives_with_states,
    creep_increment,
    elastic_predictor,
    log_stress,
    problem_of,
    strain_derivatives,
    tangent_moduli,
)
from creepkit.integration.stage_problem import INPUTS, NOT_FINITE, SOLVED, TOO_MANY
from creepkit.integration.stage_solver import solve_stage_near_guess
from creepkit.kernels.interface import POINT_SIZE, TEMPERATURE, TIME

BALANCED, INVERTED, POINT_FAILED, RATE_UNDEFINED = range(4)
"""Flags of an assembly."""


class PointStates(NamedTuple):
    """The state of all points, element by element; V = 3 + 1 + S.

    value : (points, V) creep components, equivalent creep strain, states, at the start of the step.
    base : (points, V) history of the stage. increments : (points,) D. states : (points, S) at the end of the stage.
    slopes : (stages, points, V) d value/ds. mises : (points,) von Mises stress of the Cauchy stress, MPa.
    directions : (points, 3) w/e. deviator : (points, 6) derivatives of the stress components y that are conjugate
        to w, from the last tangent: 11, 22, 33, 12, 13, 23. trials : (points, 2) trial stress at which D was found
        last, MPa (negative: none in this stage), and dD/d(trial stress) of the last tangent.
    """

    value: Floats
    base: Floats
    increments: Floats
    states: Floats
    slopes: Floats
    mises: Floats
    directions: Floats
    deviator: Floats
    trials: Floats


class ForceWorkspace(NamedTuple):
    """residual : (size + width + 4,) internal less external forces; band, flat : the tangent, as rows and laid flat.

    block : workspace of the factorisation; element : (3, 8, 8) rr, rz, zz; local : (2, 8) displacements;
    inner : (2, 8) forces; products : (16, 8); side : (2, 3); sides : (4, 3, 3); ends : (2, 3) current coordinates.
    """

    residual: Floats
    band: Floats
    flat: Floats
    block: Floats
    element: Floats
    local: Floats
    inner: Floats
    products: Floats
    side: Floats
    sides: Floats
    ends: Floats


def point_workspace(states: int, parameters: int) -> PointWorkspace:
    """Working arrays for one point."""
    size, width = 1 + states, POINT_SIZE + states
    return PointWorkspace(
        np.zeros(width),
        np.zeros(size * (1 + width + parameters)),
        np.zeros((size, width)),
        np.zeros((size, size)),
        np.zeros((size, INPUTS + states + parameters)),
        np.zeros((5, 5)),
    )


def virgin_points(count: int, states: int, stages: int) -> PointStates:
    """Virgin points."""
    size = EQUIVALENT_STRAIN + 1 + states
    return PointStates(
        np.zeros((count, size)),
        np.zeros((count, size)),
        np.zeros(count),
        np.zeros((count, states)),
        np.zeros((stages, count, size)),
        np.zeros(count),
        np.zeros((count, CREEP_COMPONENTS)),
        np.zeros((count, 6)),
        np.full((count, 2), -1.0),
    )


def force_workspace(body: FiniteElementModel) -> ForceWorkspace:
    """Room for forces and tangent."""
    rows, columns = band_shape(body.size, body.width)
    flat = np.zeros(rows * columns + 1)
    return ForceWorkspace(
        residual=np.zeros(body.size + body.width + 4),
        band=flat[:-1].reshape(rows, columns),
        flat=flat,
        block=np.zeros((4, body.width + 1)),
        element=np.zeros((3, 8, 8)),
        local=np.zeros((2, 8)),
        inner=np.zeros((2, 8)),
        products=np.zeros((16, 8)),
        side=np.zeros((2, 3)),
        sides=np.zeros((4, 3, 3)),
        ends=np.zeros((2, 3)),
    )


@njit(cache=True, error_model="numpy")
def assemble(
    update: Any,
    theta: Floats,
    body: FiniteElementModel,
    stage: StageConditions,
    displacement: Floats,
    points: PointStates,
    room: PointWorkspace,
    forces: ForceWorkspace,
    stiff: bool,
    tolerance: float,
) -> int:
    """Out-of-balance forces, creep increments and von Mises stresses; with `stiff` the tangent made symmetric too.

    tolerance : on the last local Newton correction of ln D; the error left is its square.

    One long loop over arrays with names of their own: views of rows and tuples of arrays cost more than the physics.
    """
    elements, equations, weights, places = body.elements, body.equations, body.weights, body.places
    by_radius, by_height, over_radius = body.by_radius, body.by_height, body.over_radius
    base, increments, states, mises = points.base, points.increments, points.states, points.mises
    directions, deviator, trials = points.directions, points.deviator, points.trials
    row, out, tangent = room.row, room.out, room.tangent
    gradient, matrix, response = room.gradient, room.matrix, room.response
    residual, flat, local, inner = forces.residual, forces.flat, forces.local, forces.inner
    products, element = forces.products, forces.element
    count = states.shape[1]
    creeps = stage.weight > 0.0
    clear(residual)
    if stiff:
        clear(flat)
    row[TIME], row[TEMPERATURE] = stage.time, stage.temperature
    for e in range(elements.shape[0]):
        gather(elements, e, displacement, local)
        clear_element(inner, element, stiff)
        for g in range(4):
            k = 4 * e + g
            at = kinematics(deformation(by_radius, by_height, over_radius, e, g, local))
            if not at.volume > 0.0:
                return INVERTED
            elastic = elastic_predictor(stage, at, base, k)
            increment, axes = 0.0, axes_of(elastic)
            problem = problem_of(stage, elastic, base[k, EQUIVALENT_STRAIN])
            if creeps and elastic.equivalent > 0.0:
                flag = TOO_MANY
                for i in range(count):
                    row[POINT_SIZE + i] = states[k, i]
                if trials[k, 0] >= 0.0:
                    guess = increments[k] + trials[k, 1] * (problem.trial - trials[k, 0])
                    increments[k] = guess if guess > 0.0 else increments[k]
                if count == 0:
                    increment, flag = solve_stage_near_guess(
                        update, theta, axes, problem, row, out, increments[k], tolerance
                    )
                if flag != SOLVED:
                    increment, flag = creep_increment(
                        update, theta, axes, problem, base, k, row, out, increments[k], tolerance
                    )
                if flag != SOLVED:
                    return RATE_UNDEFINED if flag == NOT_FINITE else POINT_FAILED
                for i in range(count):
                    states[k, i] = row[POINT_SIZE + i]
            increments[k], trials[k, 0] = increment, problem.trial
            mises[k] = problem.trial - problem.stiffness * increment
            inverse = 1.0 / elastic.equivalent if elastic.equivalent > 0.0 else 0.0
            directions[k, 0], directions[k, 1] = elastic.hoop * inverse, elastic.difference * inverse
            directions[k, 2] = elastic.shear * inverse
            stress = log_stress(stage, elastic, increment)
            slopes = energy_slopes(at, stress)
            add_force(by_radius, by_height, over_radius, e, g, to_gradient(at.F, slopes), weights[e, g], inner)
            if not stiff:
                continue
            by = (0.0, 0.0, 0.0)
            if increment > 0.0 and count == 0:
                by = creep_derivatives(axes, problem, increment, out)
            elif increment > 0.0:
                by = creep_derivatives_with_states(axes, problem, increment, out, gradient, matrix, response)
            trials[k, 1] = by[0]
            moduli = tangent_moduli(stage, elastic, increment, strain_derivatives(stage, elastic, increment, by), True)
            keep_deviator(moduli, deviator, k)
            piola_tangent(at, moduli, stress, slopes, tangent)
            set_products(by_radius, by_height, over_radius, e, g, tangent, weights[e, g], products)
            if g % 2 == 1:
                add_stiffness(by_radius, by_height, over_radius, e, g, products, element)
        scatter_force(elements, equations, e, inner, residual)
        if stiff:
            scatter_stiffness(places, e, element, flat)
    _press(body, stage.pressure, displacement, forces, stiff)
    return BALANCED


@njit(cache=True, error_model="numpy")
def keep_deviator(moduli: tuple[Four, Four, Four, Four], kept: Floats, k: int) -> None:
    """Derivatives of y to w, from the moduli: w_1 is E33 at fixed trace and E11 - E22."""
    kept[k, 0] = 1.5 * (moduli[HOOP][HOOP] - moduli[HOOP][SUM])
    kept[k, 1], kept[k, 2] = moduli[DIFFERENCE][DIFFERENCE], moduli[SHEAR][SHEAR]
    kept[k, 3] = moduli[DIFFERENCE][HOOP] - moduli[DIFFERENCE][SUM]
    kept[k, 4] = moduli[SHEAR][HOOP] - moduli[SHEAR][SUM]
    kept[k, 5] = moduli[DIFFERENCE][SHEAR]


@njit(cache=True, error_model="numpy")
def error_forces(
    body: FiniteElementModel,
    stage: StageConditions,
    displacement: Floats,
    points: PointStates,
    weights: Floats,
    forces: ForceWorkspace,
) -> None:
    """Out-of-balance forces of a change of all creep strains by sum weights_i slopes_i, into the residual.

    Through the tangent of the stage, which damps what the stage would damp.
    """
    elements, equations, all_weights = body.elements, body.equations, body.weights
    by_radius, by_height, over_radius = body.by_radius, body.by_height, body.over_radius
    rates, kept, local, inner, residual = points.slopes, points.deviator, forces.local, forces.inner, forces.residual
    clear(residual)
    for e in range(elements.shape[0]):
        gather(elements, e, displacement, local)
        clear_element(inner, forces.element, False)
        for g in range(4):
            k = 4 * e + g
            at = kinematics(deformation(by_radius, by_height, over_radius, e, g, local))
            a, b, c = 0.0, 0.0, 0.0
            for i in range(weights.size):
                a += weights[i] * rates[i, k, 0]
                b += weights[i] * rates[i, k, 1]
                c += weights[i] * rates[i, k, 2]
            first = kept[k, 0] * a + kept[k, 3] * b + kept[k, 4] * c
            stress = (
                first / 3.0,
                -(kept[k, 3] * a + kept[k, 1] * b + kept[k, 5] * c),
                -2.0 / 3.0 * first,
                -(kept[k, 4] * a + kept[k, 5] * b + kept[k, 2] * c),
            )
            P = to_gradient(at.F, energy_slopes(at, stress))
            add_force(by_radius, by_height, over_radius, e, g, P, all_weights[e, g], inner)
        scatter_force(elements, equations, e, inner, residual)


@njit(cache=True, error_model="numpy")
def _press(
    body: FiniteElementModel, pressure: float, displacement: Floats, forces: ForceWorkspace, stiff: bool
) -> None:
    """Take the pressure's force off the internal one, and its stiffness (made symmetric) off the tangent."""
    if pressure == 0.0:
        return
    for k in range(body.pressed.shape[0]):
        nodes = body.pressed[k]
        for a in range(3):
            for i in range(2):
                forces.ends[i, a] = body.nodes[nodes[a], i] + displacement[2 * nodes[a] + i]
        side_force(forces.ends[0], forces.ends[1], forces.side)
        for a in range(3):
            for i in range(2):
                equation = body.equations[2 * nodes[a] + i]
                if equation >= 0:
                    forces.residual[equation] -= pressure * forces.side[i, a]
        if stiff:
            side_stiffness(forces.ends[0], forces.ends[1], forces.sides)
            _scatter_side(body, k, pressure, forces)


@njit(cache=True, error_model="numpy")
def _scatter_side(body: FiniteElementModel, k: int, pressure: float, forces: ForceWorkspace) -> None:
    rr, rz, zr = forces.sides[0], forces.sides[1], forces.sides[2]
    places, flat = body.pressed_places[k], forces.flat
    for a in range(3):
        for b in range(a, 3):
            flat[places[0, a, b]] -= 0.5 * pressure * (rr[a, b] + rr[b, a])
        for b in range(3):
            flat[places[1, a, b]] -= 0.5 * pressure * (rz[a, b] + zr[b, a])


_SPREAD = np.sqrt(0.6)


_X = np.array([-_SPREAD, 0.0, _SPREAD])


_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 9.0


VALUES = np.stack([0.5 * _X * (_X - 1.0), 1.0 - _X**2, 0.5 * _X * (_X + 1.0)], axis=1)
"""Shape functions of a side (first, middle, last node) at three Gauss points, which integrate it exactly."""


SLOPES = np.stack([_X - 0.5, -2.0 * _X, _X + 0.5], axis=1)


GAUSS_WEIGHTS = _WEIGHTS


@njit(cache=True, error_model="numpy")
def side_force(r: Floats, z: Floats, force: Floats) -> None:
    """Force (2, 3) of a unit pressure on a side whose nodes are at r (3,) and z (3,)."""
    for i in range(2):
        for a in range(3):
            force[i, a] = 0.0
    for g in range(3):
        radius, dr, dz = 0.0, 0.0, 0.0
        for a in range(3):
            radius += VALUES[g, a] * r[a]
            dr += SLOPES[g, a] * r[a]
            dz += SLOPES[g, a] * z[a]
        weight = GAUSS_WEIGHTS[g] * radius
        for a in range(3):
            force[0, a] -= weight * dz * VALUES[g, a]
            force[1, a] += weight * dr * VALUES[g, a]


@njit(cache=True, error_model="numpy")
def side_stiffness(r: Floats, z: Floats, stiffness: Floats) -> None:
    """Derivatives (4, 3, 3) of the force of a unit pressure: f_r to r, f_r to z, f_z to r, f_z to z."""
    for i in range(4):
        for a in range(3):
            for b in range(3):
                stiffness[i, a, b] = 0.0
    for g in range(3):
        radius, dr, dz = 0.0, 0.0, 0.0
        for a in range(3):
            radius += VALUES[g, a] * r[a]
            dr += SLOPES[g, a] * r[a]
            dz += SLOPES[g, a] * z[a]
        for a in range(3):
            share = GAUSS_WEIGHTS[g] * VALUES[g, a]
            for b in range(3):
                stiffness[0, a, b] -= share * dz * VALUES[g, b]
                stiffness[1, a, b] -= share * radius * SLOPES[g, b]
                stiffness[2, a, b] += share * (radius * SLOPES[g, b] + dr * VALUES[g, b])
