"""Whether a simulation ended because its law gives no creep rate there: for laws that others wrote."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats
from creepkit.kernels.calling import call_entry
from creepkit.kernels.interface import MEAN_STRESS, POINT_SIZE, PRINCIPAL_STRESS, STRAIN, STRESS, TEMPERATURE, TIME

if TYPE_CHECKING:
    from creepkit.kernels.interface import CompiledLaw


def uniaxial_points(stresses: Floats, strains: Floats, states: Floats, time: float, temperature: float) -> Floats:
    """Points of a law, (points, 6 + S), under uniaxial stress; stress and strain a little above zero at least."""
    points = np.zeros((stresses.size, POINT_SIZE + states.shape[1]))
    points[:, STRESS] = points[:, PRINCIPAL_STRESS] = np.maximum(stresses, 1e-3)
    points[:, MEAN_STRESS] = points[:, STRESS] / 3.0
    points[:, STRAIN], points[:, TIME], points[:, TEMPERATURE] = np.maximum(strains, 1e-9), time, temperature
    points[:, POINT_SIZE:] = states
    return points


def missing_rate_message(law: CompiledLaw, theta: Floats, points: Floats) -> str:
    """The first of these points where the law has no rate, or one without derivatives, in words; empty when none is.

    Kernels floor what they take logarithms of: where an equation has no number, such as the logarithm of something
    negative, its rate may look small instead, but then its derivatives are not finite. A rate too large for a number
    is one: its logarithm is what the integration works with.
    """
    rates, flags = call_entry(law, "update", points, theta)
    if not flags:
        return ""
    bad = np.flatnonzero(~np.isfinite(rates).all(axis=1))
    point = points[bad[:1]]
    stress, strain, time, temperature = point[0, [STRESS, STRAIN, TIME, TEMPERATURE]]
    return (
        f"law has no finite creep rate, or none with derivatives, at a stress of {stress:.4g} MPa, a creep strain of "
        f"{strain:.3g}, {time:.4g} s and {temperature:.4g} K"
    )
