"""Likely directions: along which the parameters of an identification may move together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from creepkit.arrays import Floats

MOST_DIRECTIONS = 2


NOTICEABLE = 0.25
"""Share of the largest motion of a direction below which a parameter is not mentioned in its words."""


def likely_directions(names: Sequence[str], covariance: Floats, widths: Floats) -> list[dict[str, Any]]:
    """The least determined combinations of parameters, the widest first: a step of one standard deviation, and words.

    covariance : (parameters, parameters) of the internal values. widths : (parameters,) of their bounds, on which
    parameters of different kinds are compared.
    """
    if len(names) < 2 or not np.isfinite(covariance).all():
        return []
    values, vectors = np.linalg.eigh(covariance / np.outer(widths, widths))
    found = []
    for k in np.argsort(values)[::-1][:MOST_DIRECTIONS]:
        if not values[k] > 0.0:
            continue
        share = vectors[:, k] * np.sign(vectors[np.argmax(np.abs(vectors[:, k])), k])
        found.append({"step": (np.sqrt(values[k]) * share * widths).tolist(), "words": _words(names, share)})
    return found


def _words(names: Sequence[str], share: Floats) -> str:
    order = np.argsort(-np.abs(share))
    moving = [k for k in order if abs(share[k]) >= NOTICEABLE * abs(share[order[0]])]
    return ", ".join(f"{names[k]} {'up' if share[k] > 0 else 'down'}" for k in moving)
