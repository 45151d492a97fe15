"""Internal values of parameters, the natural logarithm where the scale is log, and those of their author."""

from __future__ import annotations

import numpy as np

from creepkit.arrays import Floats
from creepkit.language import CreepLaw


def author_values(law: CreepLaw, theta: Floats) -> dict[str, Floats]:
    """{parameter: (...,)} in the author's units, from internal values theta (..., parameters)."""
    return {
        name: np.exp(theta[..., k]) if param.scale == "log" else theta[..., k]
        for k, (name, param) in enumerate(law.table.items())
    }


def internal_bounds(law: CreepLaw) -> Floats:
    """(2, parameters) lower and upper bounds of the internal values."""
    ends = [[param.to_internal(bound) for bound in param.bounds] for param in law.params.values()]
    return np.array(ends, float).reshape(-1, 2).T
