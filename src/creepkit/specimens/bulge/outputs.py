"""What may be observed of a bulge test: D_amp, S_d and S_p of a fitted generalised Gaussian, or u_z on rings."""

from __future__ import annotations

from creepkit.records import Output

OBSERVED = (
    Output("amplitude", "length", noise=0.0015, visible=0.02),
    Output("width", "length", grows=False, noise=0.02),
    Output("shape", "number", grows=False, noise=0.02),
)
"""Columns of what is observed: D_amp in mm, S_d in mm, S_p. Noise as measured on real dimples."""


MOST_RINGS = 8
"""Radii at which u_z may be observed."""


RING_OUTPUTS = tuple(
    Output(f"displacement_{k}", "length", f"displacement on ring {k}", noise=0.0015, visible=0.02)
    for k in range(1, MOST_RINGS + 1)
)
"""Columns of what is observed on rings: u_z in mm at the first, second ... radius of the operator. Noise as that of the
amplitude."""
