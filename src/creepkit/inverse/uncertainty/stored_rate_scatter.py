"""A RateScatter that was read from a file: what is wrong with it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from creepkit.errors import quoted
from creepkit.inverse.uncertainty.rate_scatter import LEVELS, RateScatter

LARGEST_NUMBER = 1e12
"""Of a stored record: larger ones are damage."""


def problem_with(scatter: RateScatter, tests: Sequence[str], unknowns: int) -> str:
    """What is wrong with a record that was read from a file, in one clause; "" for one that fits an identification.

    tests : names of the fitted tests. unknowns : how many the identification has.
    """
    count = len(tests)
    shapes = {
        "log_factor": (count,),
        "variance": (count,),
        "weight": (count,),
        "design": (count, unknowns),
        "precision": (unknowns, unknowns),
        "gradient": (unknowns,),
    }
    if scatter.tests != tuple(tests):
        return "its tests are not those of the identification"
    for name, shape in shapes.items():
        array = np.asarray(getattr(scatter, name))
        if array.shape != shape and not array.size == 0 == np.prod(shape):
            return f"{name} has the shape {array.shape}, not {shape}"
        if not (np.abs(array) < LARGEST_NUMBER**2).all():
            return f"{name} holds numbers that are too large"
    if not ((scatter.variance >= 0).all() and (scatter.weight > 0).all()):
        return "a variance is negative, or a weight not above zero"
    if not (scatter.weight < LARGEST_NUMBER).all():
        return "weight holds numbers that are too large"
    for level, names in scatter.members.items():
        if level not in LEVELS[:-1] or len(names) != count:
            return f"members of '{quoted(level, 20)}' are not one for each test, of a heat or laboratory"
    if not {*scatter.common} <= {*LEVELS[:-1]}:
        return "common names levels that are no heat or laboratory"
    if scatter.known is not None and not 0 <= scatter.known < LARGEST_NUMBER:
        return f"known is {scatter.known:g}, which is no standard deviation"
    for name in ("output_scales", "output_floors"):
        if not all(0 < value < LARGEST_NUMBER for value in getattr(scatter, name).values()):
            return f"{name} must be above zero"
    scale = np.sqrt(np.maximum(np.diag(scatter.precision), 1e-300))
    scaled = scatter.precision / np.outer(scale, scale)
    if unknowns and (not np.allclose(scaled, scaled.T, atol=1e-8) or np.linalg.eigvalsh(scaled)[0] < -1e-6):
        return "precision is not symmetric and positive semi-definite"
    return ""
