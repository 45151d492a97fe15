"""The differentiated equations of a stage: exact tangent, right-hand sides, and derivatives of the creep rates."""

from __future__ import annotations

from typing import Any

from numba import njit

from creepkit.arrays import Floats, Ints
from creepkit.fem.assembly import side_force, side_stiffness
from creepkit.fem.banded_system import FiniteElementModel
from creepkit.fem.kinematics import (
    DIFFERENCE,
    HOOP,
    SHEAR,
    SUM,
    Five,
    Kinematics,
    deformation,
    energy_slopes,
    gather,
    kinematics,
    piola_tangent,
    strain_change,
    to_gradient,
)
from creepkit.fem.material_point import (
    EQUIVALENT_STRAIN,
    PointWorkspace,
    StageConditions,
    elastic_predictor,
    log_stress,
    tangent_moduli,
)
from creepkit.fem.point_sensitivities import (
    BY_PRESSURE,
    BY_STIFFNESS,
    SensitivityDirections,
    SensitivityWorkspace,
    creep_response,
    gradient_sensitivity,
    shape_sensitivity,
    stage_history,
    stress_sensitivities,
)
from creepkit.integration.time_discretisation import Tableau

_FAST = {"reassoc", "contract", "nsz"}


@njit(cache=True, error_model="numpy")
def assemble_sensitivities(
    sensitivity: Any,
    theta: Floats,
    stage: StageConditions,
    body: FiniteElementModel,
    columns: SensitivityDirections,
    tableau: Tableau,
    slopes: Floats,
    row: int,
    i: int,
    h: float,
    share: float,
    point: PointWorkspace,
    room: SensitivityWorkspace,
    displacement: Floats,
) -> None:
    """Exact tangent, and minus the out-of-balance forces of every column at fixed displacements."""
    elements, equations, weights = body.elements, body.equations, body.weights
    by_radius, by_height, over_radius = body.by_radius, body.by_height, body.over_radius
    value, change, rates, base, own, follow = room.value, room.change, room.rates, room.base, room.own, room.follow
    local, force, right, element_right = room.local, room.force, room.right, room.element_right
    element, products, history, tangent, dy = (
        room.element,
        room.products,
        room.history,
        point.tangent,
        room.stress_change,
    )
    parameters, count = theta.size, room.change.shape[2]
    directions = columns.directions.shape[0]
    wide = history.reshape(1, history.size)
    for e in range(elements.shape[0]):
        gather(elements, e, displacement, local)
        for a in range(4):
            for b in range(8):
                for c in range(8):
                    element[a, b, c] = 0.0
        clear_rows(element_right)
        for g in range(4):
            k = 4 * e + g
            stage_history(slopes, row, i, k, h, tableau, value, change, rates, history, base)
            at = kinematics(deformation(by_radius, by_height, over_radius, e, g, local))
            elastic = elastic_predictor(stage, at, wide, 0)
            increment = share * slopes[row, i, k, EQUIVALENT_STRAIN] if h > 0.0 else 0.0
            creep_response(
                sensitivity, theta, stage, elastic, slopes, row, i, k, share, increment, h > 0.0, point, room
            )
            by = (follow[k, 0, 0], follow[k, 0, 1], follow[k, 0, 2], follow[k, 0, 3])
            moduli = tangent_moduli(stage, elastic, increment, by, False)
            stress = log_stress(stage, elastic, increment)
            energy = energy_slopes(at, stress)
            piola_tangent(at, moduli, stress, energy, tangent)
            weight = weights[e, g]
            add_full_stiffness(by_radius, by_height, over_radius, e, g, tangent, weight, products, element)
            stress_sensitivities(stage, elastic, moduli, increment, base, own, k, dy)
            unit_forces(at, by_radius, by_height, over_radius, e, g, weight, force)
            for a in range(16):
                fa, fb, fc = force[a, 0], force[a, 1], force[a, 2]
                for c in range(count):
                    element_right[a, c] -= fa * dy[0, c] + fb * dy[1, c] + fc * dy[2, c]
            P = to_gradient(at.F, energy)
            for d in range(directions):
                stiffer = room.inputs[BY_STIFFNESS, d]
                if stiffer != 0.0:
                    add_column(
                        by_radius, by_height, over_radius, e, g, P, -weight * stiffer, parameters + d, element_right
                    )
            for q in range(columns.gradients.shape[0]):
                moved = shape_sensitivity(columns, q, e, g, at, P, tangent)
                add_column(
                    by_radius, by_height, over_radius, e, g, moved, -weight, parameters + directions + q, element_right
                )
        scatter_sensitivities(elements, equations, e, body.width, element, room.rows, element_right, right)


@njit(cache=True, error_model="numpy")
def unit_forces(
    at: Kinematics, by_r: Floats, by_z: Floats, over_r: Floats, e: int, g: int, weight: float, force: Floats
) -> None:
    """Nodal forces (16, 3), first radial then axial, of unit stresses y."""
    third = weight / 3.0
    first = to_gradient(at.F, energy_slopes(at, (-third, 0.0, 2.0 * third, 0.0)))
    second = to_gradient(at.F, energy_slopes(at, (0.0, weight, 0.0, 0.0)))
    other = to_gradient(at.F, energy_slopes(at, (0.0, 0.0, 0.0, weight)))
    for a in range(8):
        x, y, h = by_r[e, g, a], by_z[e, g, a], over_r[e, g, a]
        force[a, 0] = x * first[0] + y * first[1] + h * first[4]
        force[a, 1] = x * second[0] + y * second[1] + h * second[4]
        force[a, 2] = x * other[0] + y * other[1] + h * other[4]
        force[8 + a, 0] = x * first[2] + y * first[3]
        force[8 + a, 1] = x * second[2] + y * second[3]
        force[8 + a, 2] = x * other[2] + y * other[3]


@njit(cache=True, error_model="numpy")
def add_column(
    by_r: Floats, by_z: Floats, over_r: Floats, e: int, g: int, P: Five, factor: float, column: int, right: Floats
) -> None:
    """Add `factor` times the nodal forces of the stress P to one column of (16, C)."""
    for a in range(8):
        x, y, h = by_r[e, g, a], by_z[e, g, a], over_r[e, g, a]
        right[a, column] += factor * (x * P[0] + y * P[1] + h * P[4])
        right[8 + a, column] += factor * (x * P[2] + y * P[3])


@njit(cache=True, error_model="numpy", fastmath=_FAST)
def add_full_stiffness(
    by_r: Floats, by_z: Floats, over_r: Floats, e: int, g: int, A: Floats, weight: float, products: Floats,
    element: Floats,
) -> None:  # fmt: skip
    """Add the stiffness of a point to the blocks rr, rz, zr, zz of (4, 8, 8)."""
    for b in range(8):
        x, y, h = weight * by_r[e, g, b], weight * by_z[e, g, b], weight * over_r[e, g, b]
        for j in range(5):
            products[j, b] = A[j, 0] * x + A[j, 1] * y + A[j, 4] * h
            products[5 + j, b] = A[j, 2] * x + A[j, 3] * y
    for a in range(8):
        x, y, h = by_r[e, g, a], by_z[e, g, a], over_r[e, g, a]
        for b in range(8):
            element[0, a, b] += x * products[0, b] + y * products[1, b] + h * products[4, b]
            element[1, a, b] += x * products[5, b] + y * products[6, b] + h * products[9, b]
            element[2, a, b] += x * products[2, b] + y * products[3, b]
            element[3, a, b] += x * products[7, b] + y * products[8, b]


@njit(cache=True, error_model="numpy")
def scatter_sensitivities(
    elements: Ints, equations: Ints, e: int, width: int, element: Floats, rows: Floats, element_right: Floats,
    right: Floats,
) -> None:  # fmt: skip
    """Add an element's tangent to the rows and its forces to the right-hand sides."""
    for i in range(2):
        for a in range(8):
            row = equations[2 * elements[e, a] + i]
            if row < 0:
                continue
            for c in range(element_right.shape[1]):
                right[row, c] += element_right[8 * i + a, c]
            for j in range(2):
                for b in range(8):
                    column = equations[2 * elements[e, b] + j]
                    if column >= 0:
                        rows[row, width + column - row] += element[2 * i + j, a, b]


@njit(cache=True, error_model="numpy")
def pressure_sensitivities(
    body: FiniteElementModel,
    pressure: float,
    columns: SensitivityDirections,
    parameters: int,
    displacement: Floats,
    room: SensitivityWorkspace,
) -> None:
    """The pressure's exact load stiffness, and its forces in the columns that change it or move the surface."""
    directions = columns.directions.shape[0]
    ends, sides, side = room.ends, room.sides, room.side
    for k in range(body.pressed.shape[0]):
        nodes = body.pressed[k]
        for a in range(3):
            for i in range(2):
                ends[i, a] = body.nodes[nodes[a], i] + displacement[2 * nodes[a] + i]
        side_force(ends[0], ends[1], side)
        side_stiffness(ends[0], ends[1], sides)
        for a in range(3):
            for i in range(2):
                row = body.equations[2 * nodes[a] + i]
                if row < 0:
                    continue
                for d in range(directions):
                    room.right[row, parameters + d] += room.inputs[BY_PRESSURE, d] * side[i, a]
                for b in range(3):
                    for j in range(2):
                        slope = pressure * sides[2 * i + j, a, b]
                        for q in range(columns.velocities.shape[0]):
                            room.right[row, parameters + directions + q] += (
                                slope * columns.velocities[q, 2 * nodes[b] + j]
                            )
                        column = body.equations[2 * nodes[b] + j]
                        if column >= 0:
                            room.rows[row, body.width + column - row] -= slope


@njit(cache=True, error_model="numpy")
def clear_rows(values: Floats) -> None:
    """Set a matrix to zero."""
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            values[i, j] = 0.0


@njit(cache=True, error_model="numpy")
def rate_sensitivities(
    body: FiniteElementModel,
    stage: StageConditions,
    columns: SensitivityDirections,
    parameters: int,
    slopes: Floats,
    row: int,
    i: int,
    h: float,
    share: float,
    tableau: Tableau,
    room: SensitivityWorkspace,
    displacement: Floats,
) -> None:
    """Changes of the slopes of stage `i`, now that the changes of the displacements are known."""
    elements, equations = body.elements, body.equations
    by_radius, by_height, over_radius = body.by_radius, body.by_height, body.over_radius
    local, moved, right, dF, by_strain = room.local, room.moved, room.right, room.gradient_change, room.by_strain
    base, own, follow, rates, value, history = room.base, room.own, room.follow, room.rates, room.value, room.history
    count, size, inverse = room.change.shape[2], value.shape[1], 1.0 / share
    first = parameters + columns.directions.shape[0]
    wide = history.reshape(1, history.size)
    for e in range(elements.shape[0]):
        gather(elements, e, displacement, local)
        _gather_changes(elements, equations, e, right, moved)
        for g in range(4):
            k = 4 * e + g
            for v in range(size):
                history[v] = value[k, v]
                for j in range(i):
                    history[v] += h * tableau.a[i, j] * slopes[row, j, k, v]
            at = kinematics(deformation(by_radius, by_height, over_radius, e, g, local))
            elastic = elastic_predictor(stage, at, wide, 0)
            _gradient_changes(by_radius, by_height, over_radius, e, g, moved, dF)
            for q in range(columns.gradients.shape[0]):
                shift = gradient_sensitivity(columns, q, e, g, at.F)
                for j in range(5):
                    dF[j, first + q] += shift[j]
            _strain_matrix(at, by_strain)
            increment = share * slopes[row, i, k, EQUIVALENT_STRAIN]
            unit = 1.0 / elastic.equivalent if elastic.equivalent > 0.0 else 0.0
            n0, n1, n2 = elastic.hoop * unit, elastic.difference * unit, elastic.shear * unit
            left = increment * unit
            for c in range(count):
                along, across, hoop, shear = 0.0, 0.0, 0.0, 0.0
                for j in range(5):
                    along += by_strain[SUM, j] * dF[j, c]
                    across += by_strain[DIFFERENCE, j] * dF[j, c]
                    hoop += by_strain[HOOP, j] * dF[j, c]
                    shear += by_strain[SHEAR, j] * dF[j, c]
                trace = along + hoop
                w0, w1, w2 = hoop - trace / 3.0 - base[k, 0, c], across - base[k, 1, c], shear - base[k, 2, c]
                creep = own[k, 0, c] + follow[k, 0, 0] * w0 + follow[k, 0, 1] * w1 + follow[k, 0, 2] * w2
                creep += follow[k, 0, 3] * trace
                stretched = n0 * w0 + (n1 * w1 + n2 * w2) / 3.0
                rates[i, k, 0, c] = inverse * (creep * n0 + left * (w0 - n0 * stretched))
                rates[i, k, 1, c] = inverse * (creep * n1 + left * (w1 - n1 * stretched))
                rates[i, k, 2, c] = inverse * (creep * n2 + left * (w2 - n2 * stretched))
                rates[i, k, EQUIVALENT_STRAIN, c] = inverse * creep
                for z in range(1, own.shape[1]):
                    state = own[k, z, c] + follow[k, z, 0] * w0 + follow[k, z, 1] * w1 + follow[k, z, 2] * w2
                    state += follow[k, z, 3] * trace - base[k, EQUIVALENT_STRAIN + z, c]
                    rates[i, k, EQUIVALENT_STRAIN + z, c] = inverse * state


@njit(cache=True, error_model="numpy")
def _gather_changes(elements: Ints, equations: Ints, e: int, right: Floats, moved: Floats) -> None:
    """Changes of an element's displacements, (16, C), radial ones first."""
    for a in range(8):
        for i in range(2):
            row = equations[2 * elements[e, a] + i]
            for c in range(moved.shape[1]):
                moved[8 * i + a, c] = right[row, c] if row >= 0 else 0.0


@njit(cache=True, error_model="numpy")
def _gradient_changes(by_r: Floats, by_z: Floats, over_r: Floats, e: int, g: int, moved: Floats, dF: Floats) -> None:
    """Changes (5, C) of the deformation gradient of a point."""
    for j in range(5):
        for c in range(dF.shape[1]):
            dF[j, c] = 0.0
    for a in range(8):
        x, y, h = by_r[e, g, a], by_z[e, g, a], over_r[e, g, a]
        for c in range(dF.shape[1]):
            u, w = moved[a, c], moved[8 + a, c]
            dF[0, c] += x * u
            dF[1, c] += y * u
            dF[2, c] += x * w
            dF[3, c] += y * w
            dF[4, c] += h * u


@njit(cache=True, error_model="numpy")
def _strain_matrix(at: Kinematics, matrix: Floats) -> None:
    """Derivatives (4, 5) of the strains to F."""
    for j in range(5):
        unit = (
            1.0 if j == 0 else 0.0, 1.0 if j == 1 else 0.0, 1.0 if j == 2 else 0.0, 1.0 if j == 3 else 0.0,
            1.0 if j == 4 else 0.0,
        )  # fmt: skip
        change = strain_change(at, unit)
        for i in range(4):
            matrix[i, j] = change[i]
