"""Assembly: out-of-balance forces and the tangent of a stage over all points, in one pass of compiled code."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from creepkit.arrays import Floats, Ints
from creepkit.fem.body import Body
from creepkit.fem.material import (
    CREEP_COMPONENTS,
    EQUIVALENT,
    PointRoom,
    Stage,
    creep,
    creep_slopes,
    elastic_part,
    following,
    log_stress,
    tangent_moduli,
)
from creepkit.fem.pressure import side_force, side_stiffness
from creepkit.fem.strain import (
    DIFFERENCE,
    HOOP,
    SHEAR,
    SUM,
    Five,
    Four,
    Kinematics,
    energy_slopes,
    kinematics,
    piola_tangent,
    to_gradient,
)
from creepkit.integration.problem import SOLVED
from creepkit.integration.response import INPUTS
from creepkit.kernels.interface import POINT_SIZE

BALANCED, INVERTED, POINT_FAILED = range(3)
"""Flags of an assembly."""

_FAST = {"reassoc", "contract", "nsz"}


class Points(NamedTuple):
    """The state of all points, element by element; V = 3 + 1 + S.

    value : (points, V) creep components, equivalent creep strain, states, at the start of the step.
    base : (points, V) history of the stage. increments : (points,) D. states : (points, S) at the end of the stage.
    slopes : (stages, points, V) d value/ds. mises : (points,) von Mises stress of the Cauchy stress, MPa.
    directions : (points, 4) w/e and e. deviator : (points, 6) derivatives of the stress components y that are conjugate
        to w, from the last tangent: 11, 22, 33, 12, 13, 23.
    """

    value: Floats
    base: Floats
    increments: Floats
    states: Floats
    slopes: Floats
    mises: Floats
    directions: Floats
    deviator: Floats


class Forces(NamedTuple):
    """residual : (size + width + 4,) internal less external forces; band, flat : the tangent, as rows and laid flat.

    block : room of the factorisation; element : (4, 8, 8) rr, rz, zr, zz; local : (2, 8) displacements;
    inner : (2, 8) forces; products : (7, 8); side : (2, 3); sides : (4, 3, 3); ends : (2, 3) current coordinates.
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


@njit(cache=True, error_model="numpy")
def point_room(states: int, parameters: int) -> PointRoom:
    """Working arrays for one point."""
    size, width = 1 + states, POINT_SIZE + states
    return PointRoom(
        np.zeros(width),
        np.zeros(size * (1 + width + parameters)),
        np.zeros((size, width)),
        np.zeros((size, size)),
        np.zeros((size, INPUTS + states + parameters)),
        np.zeros((5, 5)),
    )


@njit(cache=True, error_model="numpy")
def points_of(count: int, states: int, stages: int) -> Points:
    """Virgin points."""
    size = EQUIVALENT + 1 + states
    return Points(
        np.zeros((count, size)),
        np.zeros((count, size)),
        np.zeros(count),
        np.zeros((count, states)),
        np.zeros((stages, count, size)),
        np.zeros(count),
        np.zeros((count, CREEP_COMPONENTS + 1)),
        np.zeros((count, 6)),
    )


@njit(cache=True, error_model="numpy")
def forces_of(size: int, width: int, rows: int, columns: int) -> Forces:
    """Room for forces and tangent; rows, columns : of `body.band_shape`."""
    flat = np.zeros(rows * columns + 1)
    return Forces(
        np.zeros(size + width + 4),
        flat[:-1].reshape((rows, columns)),
        flat,
        np.zeros((4, width + 1)),
        np.zeros((4, 8, 8)),
        np.zeros((2, 8)),
        np.zeros((2, 8)),
        np.zeros((7, 8)),
        np.zeros((2, 3)),
        np.zeros((4, 3, 3)),
        np.zeros((2, 3)),
    )


@njit(cache=True, error_model="numpy")
def assemble(
    update: Any,
    theta: Floats,
    body: Body,
    stage: Stage,
    displacement: Floats,
    points: Points,
    room: PointRoom,
    forces: Forces,
    stiff: bool,
) -> int:
    """Out-of-balance forces, creep increments and von Mises stresses; with `stiff` the tangent made symmetric too."""
    forces.residual[:] = 0.0
    if stiff:
        forces.flat[:] = 0.0
    for e in range(body.elements.shape[0]):
        gather(body.elements[e], displacement, forces.local)
        forces.inner[:] = 0.0
        if stiff:
            forces.element[:3] = 0.0
        for g in range(4):
            k = 4 * e + g
            by_r, by_z, over_r = body.by_radius[e, g], body.by_height[e, g], body.over_radius[e, g]
            at = kinematics(deformation(by_r, by_z, over_r, forces.local))
            if not at.volume > 0.0:
                return INVERTED
            P, solved = _point(update, theta, stage, at, points, k, room, stiff)
            if not solved:
                return POINT_FAILED
            weight = body.weights[e, g]
            add_force(by_r, by_z, over_r, P, weight, forces.inner)
            if stiff:
                add_stiffness(by_r, by_z, over_r, room.tangent, weight, forces.products, forces.element)
        _scatter(body, e, forces, stiff)
    _press(body, stage.pressure, displacement, forces, stiff)
    return BALANCED


@njit(cache=True, error_model="numpy")
def _point(
    update: Any, theta: Floats, stage: Stage, at: Kinematics, points: Points, k: int, room: PointRoom, stiff: bool
) -> tuple[Five, bool]:
    """First Piola-Kirchhoff stress of one point; with `stiff` its tangent dP/dF too, in the room."""
    base = points.base[k]
    elastic = elastic_part(stage, at, base)
    for i in range(points.states.shape[1]):
        room.row[POINT_SIZE + i] = points.states[k, i]
    increment, flag = creep(update, theta, stage, elastic, base, points.increments[k], room)
    if flag != SOLVED:
        return (0.0, 0.0, 0.0, 0.0, 0.0), False
    for i in range(points.states.shape[1]):
        points.states[k, i] = room.row[POINT_SIZE + i]
    points.increments[k] = increment
    points.mises[k] = 3.0 * stage.shear * (elastic.equivalent - increment) / elastic.volume
    inverse, direction = 1.0 / elastic.equivalent if elastic.equivalent > 0.0 else 0.0, points.directions[k]
    direction[0], direction[1] = elastic.hoop * inverse, elastic.difference * inverse
    direction[2], direction[3] = elastic.shear * inverse, elastic.equivalent
    stress = log_stress(stage, elastic, increment)
    slopes = energy_slopes(at, stress)
    if stiff:
        by_trial, by_principal, by_mean = creep_slopes(stage, elastic, base, increment, room)
        follow = following(stage, elastic, increment, by_trial, by_principal, by_mean)
        moduli = tangent_moduli(stage, elastic, increment, follow, True)
        _keep_deviator(moduli, points.deviator[k])
        piola_tangent(at, moduli, stress, slopes, room.tangent)
    return to_gradient(at.F, slopes), True


@njit(cache=True, error_model="numpy")
def _keep_deviator(moduli: tuple[Four, Four, Four, Four], kept: Floats) -> None:
    """Derivatives of y to w, from the moduli: w_1 is E33 at fixed trace and E11 - E22."""
    kept[0] = 1.5 * (moduli[HOOP][HOOP] - moduli[HOOP][SUM])
    kept[1], kept[2] = moduli[DIFFERENCE][DIFFERENCE], moduli[SHEAR][SHEAR]
    kept[3] = moduli[DIFFERENCE][HOOP] - moduli[DIFFERENCE][SUM]
    kept[4] = moduli[SHEAR][HOOP] - moduli[SHEAR][SUM]
    kept[5] = moduli[DIFFERENCE][SHEAR]


@njit(cache=True, error_model="numpy")
def error_forces(
    body: Body, stage: Stage, displacement: Floats, points: Points, weights: Floats, forces: Forces
) -> None:
    """Out-of-balance forces of a change of all creep strains by sum weights_i slopes_i, into the residual.

    Through the tangent of the stage, which damps what the stage would damp.
    """
    forces.residual[:] = 0.0
    for e in range(body.elements.shape[0]):
        gather(body.elements[e], displacement, forces.local)
        forces.inner[:] = 0.0
        for g in range(4):
            k = 4 * e + g
            by_r, by_z, over_r = body.by_radius[e, g], body.by_height[e, g], body.over_radius[e, g]
            at = kinematics(deformation(by_r, by_z, over_r, forces.local))
            a, b, c = 0.0, 0.0, 0.0
            for i in range(weights.size):
                a += weights[i] * points.slopes[i, k, 0]
                b += weights[i] * points.slopes[i, k, 1]
                c += weights[i] * points.slopes[i, k, 2]
            kept = points.deviator[k]
            first = kept[0] * a + kept[3] * b + kept[4] * c
            stress = (
                first / 3.0,
                -(kept[3] * a + kept[1] * b + kept[5] * c),
                -2.0 / 3.0 * first,
                -(kept[4] * a + kept[5] * b + kept[2] * c),
            )
            P = to_gradient(at.F, energy_slopes(at, stress))
            add_force(by_r, by_z, over_r, P, body.weights[e, g], forces.inner)
        _scatter(body, e, forces, False)


@njit(cache=True, error_model="numpy")
def gather(nodes: Ints, displacement: Floats, local: Floats) -> None:
    for a in range(8):
        local[0, a] = displacement[2 * nodes[a]]
        local[1, a] = displacement[2 * nodes[a] + 1]


@njit(cache=True, error_model="numpy", fastmath=_FAST)
def deformation(by_r: Floats, by_z: Floats, over_r: Floats, local: Floats) -> Five:
    """Deformation gradient of a point from the displacements (2, 8) of its element."""
    f11, f12, f21, f22, f33 = 1.0, 0.0, 0.0, 1.0, 1.0
    for a in range(8):
        f11 += by_r[a] * local[0, a]
        f12 += by_z[a] * local[0, a]
        f33 += over_r[a] * local[0, a]
        f21 += by_r[a] * local[1, a]
        f22 += by_z[a] * local[1, a]
    return f11, f12, f21, f22, f33


@njit(cache=True, error_model="numpy", fastmath=_FAST)
def add_force(by_r: Floats, by_z: Floats, over_r: Floats, P: Five, weight: float, inner: Floats) -> None:
    """Add the internal force of a point to (2, 8)."""
    p0, p1, p2, p3, p4 = weight * P[0], weight * P[1], weight * P[2], weight * P[3], weight * P[4]
    for a in range(8):
        inner[0, a] += by_r[a] * p0 + by_z[a] * p1 + over_r[a] * p4
        inner[1, a] += by_r[a] * p2 + by_z[a] * p3


@njit(cache=True, error_model="numpy", fastmath=_FAST)
def add_stiffness(
    by_r: Floats, by_z: Floats, over_r: Floats, A: Floats, weight: float, products: Floats, element: Floats
) -> None:
    """Add the symmetric stiffness of a point to the blocks rr, rz, zz of (4, 8, 8)."""
    for b in range(8):
        x, y, h = weight * by_r[b], weight * by_z[b], weight * over_r[b]
        products[0, b] = A[0, 0] * x + A[0, 1] * y + A[0, 4] * h
        products[1, b] = A[1, 0] * x + A[1, 1] * y + A[1, 4] * h
        products[2, b] = A[4, 0] * x + A[4, 1] * y + A[4, 4] * h
        products[3, b] = A[0, 2] * x + A[0, 3] * y
        products[4, b] = A[1, 2] * x + A[1, 3] * y
        products[5, b] = A[4, 2] * x + A[4, 3] * y
    for a in range(8):
        x, y, h = by_r[a], by_z[a], over_r[a]
        rr, rz = element[0, a], element[1, a]
        for b in range(8):
            rr[b] += x * products[0, b] + y * products[1, b] + h * products[2, b]
        for b in range(8):
            rz[b] += x * products[3, b] + y * products[4, b] + h * products[5, b]
    for b in range(8):
        x, y = weight * by_r[b], weight * by_z[b]
        products[0, b] = A[2, 2] * x + A[2, 3] * y
        products[1, b] = A[3, 2] * x + A[3, 3] * y
    for a in range(8):
        x, y, zz = by_r[a], by_z[a], element[2, a]
        for b in range(8):
            zz[b] += x * products[0, b] + y * products[1, b]


@njit(cache=True, error_model="numpy")
def _scatter(body: Body, e: int, forces: Forces, stiff: bool) -> None:
    nodes, flat = body.elements[e], forces.flat
    for i in range(2):
        for a in range(8):
            equation = body.equations[2 * nodes[a] + i]
            if equation >= 0:
                forces.residual[equation] += forces.inner[i, a]
    if not stiff:
        return
    rr, rz, zz = forces.element[0], forces.element[1], forces.element[2]
    places = body.places[e]
    for a in range(8):
        for b in range(a, 8):
            flat[places[0, a, b]] += rr[a, b]
            flat[places[2, a, b]] += zz[a, b]
        for b in range(8):
            flat[places[1, a, b]] += rz[a, b]


@njit(cache=True, error_model="numpy")
def _press(body: Body, pressure: float, displacement: Floats, forces: Forces, stiff: bool) -> None:
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
def _scatter_side(body: Body, k: int, pressure: float, forces: Forces) -> None:
    rr, rz, zr = forces.sides[0], forces.sides[1], forces.sides[2]
    places, flat = body.pressed_places[k], forces.flat
    for a in range(3):
        for b in range(a, 3):
            flat[places[0, a, b]] -= 0.5 * pressure * (rr[a, b] + rr[b, a])
        for b in range(3):
            flat[places[1, a, b]] -= 0.5 * pressure * (rz[a, b] + zr[b, a])
