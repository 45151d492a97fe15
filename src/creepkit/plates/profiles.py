"""Displacement of the top at a radius, from amplitude, width and shape: Eq. (3) of Chen et al."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from creepkit.arrays import Floats

PLOT_RADII = (0.0, 2.0, 4.0)
"""mm, those of Fig. 7a."""
PROFILE_OUTPUTS = ("amplitude", "width", "shape")


def profile_displacement(outputs: Mapping[str, Floats], radius: float) -> Floats:
    """D exp(-(r / S)^p), (frames,) mm; NaN where width or shape is not above zero or was not observed."""
    amplitude = np.asarray(outputs["amplitude"], float)
    if radius == 0.0:
        return amplitude
    not_observed = np.full(amplitude.shape, np.nan)
    width, shape = (np.asarray(outputs.get(name, not_observed), float) for name in ("width", "shape"))
    valid = (width > 0) & (shape > 0)
    ratio = np.where(valid, radius / np.where(valid, width, 1.0), np.nan)
    return np.asarray(amplitude * np.exp(-(ratio ** np.where(valid, shape, 1.0))))
