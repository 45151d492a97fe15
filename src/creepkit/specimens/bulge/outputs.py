"""What may be observed of a bulge test: D_amp, S_d and S_p of a fitted generalised Gaussian, or u_z on rings."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from creepkit.arrays import Floats
from creepkit.records import Output

OBSERVED = (
    Output("amplitude", "length", noise=0.0015, weight=0.99, visible=0.02),
    Output("width", "length", grows=False, noise=0.02, weight=0.005),
    Output("shape", "number", grows=False, noise=0.02, weight=0.005),
)
"""Columns of what is observed: D_amp in mm, S_d in mm, S_p. Noise as measured on real dimples; the paper's weights."""


MOST_RINGS = 8
"""Radii at which u_z may be observed."""


RING_OUTPUTS = tuple(
    Output(f"displacement_{k}", "length", f"displacement on ring {k}", noise=0.0015, visible=0.02)
    for k in range(1, MOST_RINGS + 1)
)
"""Columns of what is observed on rings: u_z in mm at the first, second ... radius of the operator. Noise as that of the
amplitude."""


PLOT_RADII = (0.0, 2.0, 4.0)
"""mm, those of the paper's Fig. 7a."""


def profile_displacement(outputs: Mapping[str, Floats], radius: float) -> Floats:
    """D exp(-(r / S)^p), (frames,) mm; NaN where width or shape is not above zero or was not observed.

    outputs : {name: (frames,)}, "amplitude" and "width" in mm, "shape". radius : mm.
    """
    amplitude = np.asarray(outputs["amplitude"], float)
    if radius == 0.0:
        return amplitude
    not_observed = np.full(amplitude.shape, np.nan)
    width, shape = (np.asarray(outputs.get(name, not_observed), float) for name in ("width", "shape"))
    valid = (width > 0) & (shape > 0)
    ratio = np.where(valid, radius / np.where(valid, width, 1.0), np.nan)
    return np.asarray(amplitude * np.exp(-(ratio ** np.where(valid, shape, 1.0))))
