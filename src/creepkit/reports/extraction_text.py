"""The text of an extraction for a terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from creepkit.quality.flags import frame_ranges_text

if TYPE_CHECKING:
    from creepkit.extraction import Extraction


def extraction_text(extraction: Extraction) -> str:
    """What was found, how well it is known, and what is wrong with it."""
    e, noise, motion = extraction, extraction.noise, extraction.motion
    x, y = e.center
    sd = f" +- {1e3 * e.center_sd[0]:.1f}, {1e3 * e.center_sd[1]:.1f} um" if not e.center_given else ", as given"
    rest = frame_ranges_text(list(map(int, e.rest))) if e.rest.size else "none"
    shift = np.abs(motion.translations[e.used]).max(axis=0, initial=0.0)
    turn = np.degrees(np.abs(motion.rotations[e.used]).max(axis=0, initial=0.0))
    lines = [
        f"{e.name} of {e.source}: {e.used.sum()} of {e.times.size} frames used, {e.operator}",
        f"  centre {x:.3f}, {y:.3f} mm{sd}; points {e.spacing:.2f} mm apart"
        + (f", smoothing of subsets of {e.subset:g} mm taken out" if e.subset else ", smoothing of subsets left in"),
        f"  rigid motion from {motion.points} points {e.region.held[0]:g} to {e.region.held[1]:g} mm from the centre "
        f"({motion.in_all_frames} in every frame, {motion.in_one_frame} in one): up to "
        f"{', '.join(f'{v:.3f}' for v in shift)} mm and {', '.join(f'{v:.3f}' for v in turn)} degrees; "
        f"one frame's error {1e3 * motion.standard_errors[2]:.2f} um along z",
        f"  zero level: {rest}",
    ]
    if e.turned:
        from creepkit.extraction.extraction import TURNED

        lines.append(f"  assumed: {TURNED}")
    last = int(np.flatnonzero(e.used)[-1]) if e.used.any() else -1
    for name, values in e.outputs.items():
        lines.append(
            f"  {name}: {values[last]:.5g} +- {e.standard_deviation[name][last]:.2g} in frame {last}; noise of one "
            f"frame {noise.block_sd[name]:.2g} from patches, {noise.rest_sd[name]:.2g} from frames at rest"
        )
    related = ", ".join(f"{a} {b} {value:.2f}" for (a, b), value in noise.correlation.items())
    lines += [
        f"  noise of one point {1e3 * noise.point_sd:.2f} um, correlated over {noise.correlation_length:.2f} mm "
        f"(patches of {noise.patch:.2f} mm); in successive frames {noise.lag_one:.2f}, "
        f"{noise.integral_frames:.1f} frames share one error"
    ]
    if related:
        lines.append(f"  correlation of the outputs' noise: {related}")
    if not e.subset:
        lines.append(
            "  subsets flatten what they average over; give their side, in mm, as subset, which the noise puts at "
            f"{noise.correlation_length:.1f} mm or less"
        )
    lines += [f"  {flag}" for flag in e.flags]
    return "\n".join(lines)
