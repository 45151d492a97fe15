"""Follower pressure on the sides of elements, and its load stiffness.

On a side with current radius r and height z along its coordinate x, solid to the left, the pressure p does the work
p r (r' dz - z' dr) on a displacement (dr, dz), so that with 2 pi dropped

    f_r = -p int N z' r dx,        f_z = p int N r' r dx.

The load stiffness is symmetric but for a term at the two ends of the pressed surface: with the volume V under the
surface, p dV = work + [p r^2 dz / 2] at the ends. It is exactly symmetric where each end lies on the axis, or has u_r
or u_z held: so on the dimple whose bottom is clamped, but not where only the rim at the outer radius is.
Newton's method takes the symmetric part (it is right at convergence in any case), sensitivities the whole.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from creepkit.arrays import Floats

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
