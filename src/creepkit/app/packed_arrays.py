"""Arrays for a page: base64 of little-endian numbers, which `creepkit.decode` of the runtime reads."""

from __future__ import annotations

import base64
from typing import Literal

import numpy as np

from creepkit.arrays import Floats, Ints

PackedType = Literal["float64", "float32", "int32"]


def packed(values: Floats | Ints, kind: PackedType) -> dict[str, str]:
    """An array as {"type", "data"}; values : (...,), the last axis fastest, in any unit."""
    numbers = np.ascontiguousarray(values, dtype=np.dtype(kind).newbyteorder("<"))
    return {"type": kind, "data": base64.b64encode(numbers.tobytes()).decode("ascii")}
