"""How much faster a dimple creeps while its stresses turn from elastic ones into those of steady creep: the numbers.

All are without dimension, so they hold for every modulus, rate and pressure. They were fitted, by hand, to Norton runs
of the default dimple with n from 3 to 12, loaded at once and after it had crept to D/h = .2, .8 and 1.8, with jumps by
15 to 150 %, and to histories of other laws. What they describe depends little on the dimple: at lambda = .1 after the
first loading with n = 8 it creeps 2.66 times as fast as steadily for h = .44 mm, 2.57 times for h = .60 mm.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import PchipInterpolator

from creepkit.arrays import Floats
from creepkit.specimens.reduced_step import POWER

REDISTRIBUTION = np.array([0.22, 1.15, 1.15, 8.0, 2.0, 14.0])
"""SLOW_SIZE, SLOW_SPEED, FAST_SIZE, FAST_OFFSET, FAST_SPEED and CEILING of `reduced_step`."""

_DEFLECTIONS = (0.0, 0.2, 0.8, 1.8)
"""Over the apex thickness."""
_SIZES = (1.5, 1.18, 1.0, 0.8)
"""A bulged roof carries more load as a membrane, whose stresses are steady from the first."""


def redistribution_sizes(deflections: Floats) -> Floats:
    """Size of redistribution by D/h."""
    known = PchipInterpolator(np.log(0.1 + np.array(_DEFLECTIONS)), _SIZES)
    return np.asarray(known(np.log(0.1 + np.minimum(deflections, _DEFLECTIONS[-1]))))


def growth_multiplier(strains: Floats, exponent: float, *, size: float = 1.0, share: float = 1.0) -> Floats:
    """Growth over steady growth at creep strains lambda since `share` of the elastic stresses came, in Norton creep."""
    slow_size, slow_speed, fast_size, offset, fast_speed, _ = REDISTRIBUTION
    slow = slow_size * np.log(exponent) * np.exp(-slow_speed * strains)
    fast = fast_size * (exponent - 1.0) ** 2 / (exponent + offset) * np.exp(-fast_speed * exponent * strains)
    return np.asarray((1.0 + size * share * (slow + fast) / POWER) ** POWER)
