"""Dimple D1 of the group's static test: 16 profiles of 63 nodes, the parameters that were fitted to them, its apex.

The file says nothing of where the nodes lie. They are two halves of one line: solved for the radius, the group's own
fits put each node within 0.02 mm at the same place in all frames beyond 1.2 mm from the middle, evenly spaced.
"""

from typing import NamedTuple

import numpy as np

from creepkit.arrays import Floats
from helpers.paths import SHARED

FOLDER = SHARED / "cameras" / "dabi_static"
HALF = 29
"""Nodes of the first half."""


class StaticTest(NamedTuple):
    """frames (16,), places (63,) mm along the line, heights (16, 63) mm, published (16, 8), apex (474,) mm."""

    frames: np.ndarray
    places: Floats
    heights: Floats
    published: Floats
    apex: Floats


def static_test() -> StaticTest:
    profiles = np.genfromtxt(FOLDER / "D1_profiles_63_nodes.csv", delimiter=",", skip_header=1)
    fits = np.genfromtxt(FOLDER / "D1_gaussian_8_parameters.csv", delimiter=",", skip_header=1)
    apex = np.genfromtxt(FOLDER / "D1_apex_displacement.csv", delimiter=",", skip_header=1)[:, 1]
    heights, (A, _, _, sx, sy, _, p, offset) = profiles[:, 2:], fits[:, 2:].T
    share = np.minimum((heights - offset[:, None]) / A[:, None], 1.0)
    radii = np.median(((-2.0 * np.log(share)) ** (1.0 / p[:, None]) * np.sqrt(sx * sy)[:, None])[8:], axis=0)
    places = np.empty(radii.size)
    for some, sign in ((slice(0, HALF), 1.0), (slice(HALF, None), -1.0)):
        number = np.arange(radii[some].size)
        far = radii[some] > 1.2
        places[some] = sign * np.polyval(np.polyfit(number[far], radii[some][far], 1), number)
    return StaticTest(profiles[:, 0].astype(int), places, heights, fits[:, 2:], apex)
