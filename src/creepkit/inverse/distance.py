"""How far a curve passes from a measured point, in the plane of ln time and ln strain.

In primary and steady creep one asks how wrong the strain is at a time. Before rupture strain is nearly vertical over
time: there the question is how wrong the time is at a strain, and a candidate that broke too early has no strain.
With a = ln(strain predicted / measured) at the frame's time (inverse.scales: linear for strains of the floor's size)
and b = ln(time measured / predicted) at the frame's strain, the distance of the point from the chord between these
two points of the curve, times the root of two,

    r = sqrt(2) a |b| / sqrt(a^2 + b^2),

is a where the curve is steady (a = b), follows a where it is flat and b where it is steep. After rupture a is
infinite and r is b alone; where a strain is never arrived at b is infinite and r is a. So r is finite and smooth for
every candidate. It is what orthogonal regression minimises, to first order (Boggs, Byrd & Schnabel (1987), SIAM J.
Sci. Stat. Comput. 8, 1052), with equal weights of ln strain and ln time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Floats

_SMALL_DISTANCE = 1e-7
"""Below this distance the ratio of a to b is the slope of the curve."""


@dataclass(frozen=True, eq=False)
class OrthogonalDistance:
    """values : (...,) r; by_strain, by_time : (...,) its derivatives to a and to b."""

    values: Floats
    strain_derivative: Floats
    time_derivative: Floats


def orthogonal_distance(strain_residual: Floats, time_residual: Floats, curve_slope: Floats) -> OrthogonalDistance:
    """The distance of points whose errors are a (`strain`) and b (`time`).

    Either may be infinite, and not both. slope : (...,) of the predicted curve, d(compared strain)/d(ln time), infinite
    at rupture.
    """
    a, b = np.abs(strain_residual), np.abs(time_residual)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        ratio = np.where(np.maximum(np.minimum(a, b), 0.0) > _SMALL_DISTANCE, a / b, np.maximum(curve_slope, 0.0))
        ratio = np.where(np.isinf(b), 0.0, np.where(np.isinf(a), np.inf, ratio))
        strain_weight, time_weight = 1.0 / np.hypot(1.0, ratio), 1.0 / np.hypot(1.0, 1.0 / ratio)
    sign = np.where(np.isinf(a), np.sign(time_residual), np.sign(strain_residual))
    magnitude = np.where(strain_weight >= time_weight, np.where(np.isinf(a), 0.0, a) * strain_weight, np.where(np.isinf(b), 0.0, b) * time_weight)
    return OrthogonalDistance(np.sqrt(2.0) * sign * magnitude, np.sqrt(2.0) * strain_weight**3, np.sqrt(2.0) * time_weight**3)
