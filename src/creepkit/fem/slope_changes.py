"""After the displacements: how the slopes of a stage, creep strains and states, change with each column."""

from __future__ import annotations

from numba import njit

from creepkit.arrays import Floats, Ints
from creepkit.fem.blocks import deformation, gather
from creepkit.fem.body import FiniteElementModel
from creepkit.fem.columns import SensitivityWorkspace, SensitivityDirections
from creepkit.fem.material import EQUIVALENT_STRAIN, StageConditions, elastic_predictor
from creepkit.fem.point_changes import gradient_sensitivity
from creepkit.fem.strain import DIFFERENCE, HOOP, SHEAR, SUM, Kinematics, kinematics, strain_change
from creepkit.integration.tableau import Tableau


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
