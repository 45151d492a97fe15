"""Which frames are at rest, and which are bad and why."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.quality.flags import FlagKind, QualityFlag

MOTION_JUMP = 12.0
"""Robust standard deviations by which the rigid motion of a single frame differs from its neighbours'."""


RESIDUAL_JUMP = 8.0
"""The same of the residual's size, which must also be half as large again."""


LEAST_MOTION_JUMP = 2e-3
"""mm, or the angle that moves a point at the moving radius by as much: less is harmless whatever its cause."""


REST_DEVIATIONS = 5.0
"""Standard deviations within which the signal of frames at rest stays."""


LOAD_AT_REST = 0.005
"""Of the greatest load: below it a frame is at rest."""


def frames_at_rest(signal: Floats, good: Bools, zero_reference: bool, load: Floats | None) -> Ints:
    """Leading frames without load: where `load` (frames,) says so, else those in which `signal` has not yet changed.

    signal : (frames,) mm, mean height about the centre. good : (frames,) which can be used. load : (frames,) imposed,
    in any unit; None where it is not known. zero_reference : whether the first frame is zero by definition. A first
    frame that is zero by definition, being the reference image, is left out where there are others: it shows no noise.
    The others' level must be that of the reference image within its noise, for a deflection that is held is no rest.
    """
    order = np.flatnonzero(good & np.isfinite(signal))
    if load is not None:
        loaded = np.flatnonzero(load > LOAD_AT_REST * max(float(load.max()), 1e-300))
        run = order[order < (loaded[0] if loaded.size else len(load))]
    else:
        run = _constant_run(signal, order, zero_reference)
    if zero_reference and run.size > 1 and run[0] == order[0]:
        run = run[1:]
    return run


def _constant_run(signal: Floats, order: Ints, zero_reference: bool) -> Ints:
    s = signal[order]
    if s.size < 8:
        return order[:1]
    sigma = max(1.4826 * float(np.median(np.abs(np.diff(s, 2)))) / np.sqrt(6.0), 1e-7)
    first = 1 if zero_reference else 0
    end = first + 3
    if np.ptp(s[:end]) > 2.0 * REST_DEVIATIONS * sigma:
        return order[:1]
    while end < s.size and abs(s[end] - np.median(s[first:end])) < REST_DEVIATIONS * sigma:
        end += 1
    end -= max(1, (end - first) // 10)  # the last may be the beginning of the load
    while end - first >= 4:
        t = np.arange(end - first) - 0.5 * (end - first - 1)
        slope, error = float(t @ s[first:end]) / float(t @ t), sigma / np.sqrt(float(t @ t))
        if abs(slope) < 3.0 * error:
            break
        end = first + (end - first) * 3 // 4
    if end - first < 4 or abs(float(np.median(s[first:end])) - s[0]) > 7.0 * sigma:
        return order[:1]
    return order[first:end]


def isolated(values: Floats, good: Bools, threshold: float, floor: float) -> Floats:
    """(frames,) how many robust deviations a frame lies off the median of its five neighbours; 0 below the threshold.

    values : (frames,). good : (frames,) which count. floor : deviations smaller than this count for nothing, in the
    unit of the values.
    """
    result = np.zeros(values.size)
    order = np.flatnonzero(good & np.isfinite(values))
    if order.size < 7:
        return result
    v = values[order]
    padded = np.pad(v, 2, mode="reflect")
    off = np.abs(v - np.median(np.lib.stride_tricks.sliding_window_view(padded, 5), axis=1))
    steps = np.diff(v)
    scale = 1.4826 * max(float(np.median(off)), float(np.median(np.abs(steps - np.median(steps)))), 1e-300)
    high = (off > threshold * scale) & (off > floor)
    result[order[high]] = off[high] / scale
    return result


def motion_reasons(translations: Floats, rotations: Floats, good: Bools, reach: float) -> dict[int, str]:
    """{frame: reason} of frames whose rigid motion differs from that of their neighbours.

    translations : (frames, 3) mm. rotations : (frames, 3) rad. good : (frames,) which count. reach : mm, lever of a
    rotation.
    """
    reasons: dict[int, str] = {}
    for k, axis in enumerate("xyz"):
        for values, floor, what, unit in (
            (translations[:, k], LEAST_MOTION_JUMP, "shift along", "um"),
            (rotations[:, k], LEAST_MOTION_JUMP / reach, "rotation about", "mrad"),
        ):
            off = isolated(values, good, MOTION_JUMP, floor)
            for index in np.flatnonzero(off):
                size = f"{what} {axis} of {1e3 * values[index]:.3g} {unit}"
                reasons.setdefault(int(index), f"{size} is {off[index]:.0f} times the scatter off its neighbours")
    return reasons


def residual_reasons(where: str, size: Floats, good: Bools) -> dict[int, str]:
    """{frame: reason} of frames whose residuals are larger than their neighbours'.

    where : of what. size : (frames,) mm root mean square. good : (frames,) which count.
    """
    reasons: dict[int, str] = {}
    median = float(np.nanmedian(size[good])) if good.any() else 0.0
    for index in np.flatnonzero(isolated(size, good, RESIDUAL_JUMP, 0.5 * median)):
        neighbours = np.nanmedian(size[max(index - 2, 0) : index + 3])
        if size[index] > 1.5 * neighbours:
            beside = f"beside {1e3 * neighbours:.3g} um of its neighbours"
            reasons[int(index)] = f"residual {where} of {1e3 * size[index]:.3g} um {beside}"
    return reasons


class FrameFlags:
    """Which frames of a test piece are good, and flags of the others.

    good : (frames,). flags : one for each reason.
    """

    def __init__(self, name: str, count: int) -> None:
        self.name, self.good, self.flags = name, np.ones(count, bool), list[QualityFlag]()

    def add(self, kind: FlagKind, reasons: Mapping[int, str]) -> None:
        """Flag frames, {frame: reason}, which are no longer good."""
        for frame, reason in reasons.items():
            self.flags.append(QualityFlag((self.name,), kind, (frame,), reason, proposal="it is marked unused"))
            self.good[frame] = False
