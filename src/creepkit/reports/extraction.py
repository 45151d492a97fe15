"""Extractions: text, and a contact sheet that shows whether one is sound at a glance."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import HistoryError
from creepkit.quality.flags import frame_ranges_text
from creepkit.records import output_unit
from creepkit.reports.figures import empty_figure, save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.extraction import Extraction, FieldMap


_WIDTH, _HEIGHT, _PANEL = 14.0, 11.5, 1.75
"""Inches, of the sheet and of one map."""


_MAPS = {"left": 0.05, "right": 0.91, "bottom": 0.06, "top": 0.89, "wspace": 0.06, "hspace": 0.22}
_COURSES = {"left": 0.05, "right": 0.98, "bottom": 0.08, "top": 0.93, "wspace": 0.18, "hspace": 0.38}
"""Places of maps and of what is drawn over time, as fractions of their halves of the sheet."""


def extraction_figure(extraction: Extraction, path: str | Path | None = None) -> Figure:
    """A contact sheet, written to a file where a path is given.

    Top: heights of some frames over the plate, with the points (white) between two circles from which the rigid motion
    was taken, and lost points (grey crosses); below them what the operator's model leaves. Then the outputs over time
    with 95 % bands, the rigid motion and the residuals, flagged frames in red.
    """
    e = extraction
    figure = empty_figure(_WIDTH, _HEIGHT)
    figure.set_layout_engine("none")  # a constrained layout of so many panels takes as long as all else
    outputs = list(e.outputs)
    shown = e.maps
    parts: Any = figure.subfigures(2, 1, height_ratios=[1.0, 1.15])
    top, bottom = parts
    maps = top.subplots(2, len(shown), squeeze=False, gridspec_kw=_MAPS)
    _draw_maps(top, maps, e, shown)
    panels = bottom.subplots(2, max(3, (len(outputs) + 4) // 2), squeeze=False, gridspec_kw=_COURSES).ravel()
    for axes, name in zip(panels, outputs, strict=False):
        _draw_output(axes, e, name)
    rest = panels[len(outputs) :]
    _draw_motion(rest[0], e, 1e3 * (e.motion.translations - _first(e.motion.translations, e)), "shift, um")
    _draw_motion(rest[1], e, 1e3 * (e.motion.rotations - _first(e.motion.rotations, e)), "rotation, mrad")
    if len(rest) > 2:
        _draw_residuals(rest[2], e)
    for axes in rest[3:]:
        axes.set_axis_off()
    figure.suptitle(_title(e), fontsize=10, x=0.01, ha="left")
    return save_figure(figure, path, HistoryError)


def _title(e: Extraction) -> str:
    x, y = e.center
    flagged = len({frame for flag in e.flags for frame in flag.frames})
    kinds = ", ".join(sorted({flag.kind for flag in e.flags}))
    return (
        f"{e.source}, {e.name}: {e.operator}; centre {x:.2f}, {y:.2f} mm "
        f"({'given' if e.center_given else f'+- {1e3 * float(e.center_sd.max()):.0f} um'}); "
        f"{e.used.sum()} of {e.times.size} frames used, {flagged} flagged{f' ({kinds})' if kinds else ''}; "
        f"noise {1e3 * e.noise.point_sd:.2f} um a point, correlated over {e.noise.correlation_length:.2f} mm"
    )


def _draw_maps(figure: Any, axes: Any, e: Extraction, shown: tuple[FieldMap, ...]) -> None:
    heights = 1e3 * np.stack([m.heights for m in shown])
    residuals = 1e3 * np.stack([m.residuals for m in shown])
    inner = np.hypot(*e.places.T) < e.region.held[0]
    high = float(np.nanmax(np.abs(heights[:, inner]), initial=1e-3))
    finite = np.abs(residuals[np.isfinite(residuals)])
    wide = float(np.quantile(finite, 0.99)) if finite.size else 1.0
    extents = float(np.ptp(e.places[:, 0])) or 1.0, 2.2 * e.region.moving
    sizes = [max((_PANEL * 72.0 * e.spacing / extent) ** 2, 0.3) for extent in extents]
    images: list[Any] = []
    for k, one in enumerate(shown):
        for row, values, limits, colours in (
            (0, heights[k], (-0.05 * high, high), "viridis"),
            (1, residuals[k], (-wide, wide), "RdBu_r"),
        ):
            panel = axes[row, k]
            seen = np.isfinite(values)
            size = sizes[row]
            look: Any = {"s": size, "marker": "s", "cmap": colours, "vmin": limits[0], "vmax": limits[1], "lw": 0}
            images.append(panel.scatter(*e.places[seen].T, c=values[seen], rasterized=True, **look))
            lost = ~np.isfinite(one.heights)
            panel.scatter(*e.places[lost].T, c="0.6", s=0.7 * size, marker="x", lw=0.5)
            panel.plot(0.0, 0.0, "+", color="r", ms=6)
            panel.set_aspect("equal")
            panel.tick_params(labelsize=6)
            if k:  # as wide as the first
                panel.set_xticks([])
                panel.set_yticks([])
            if row == 0:
                panel.plot(*e.places[e.clamped].T, ",", color="w", alpha=0.8)
                for radius in e.region.held:
                    _circle(panel, radius)
                panel.set_title(f"frame {one.frame}, {e.times[one.frame]:.4g} s", fontsize=8)
            else:
                reach = 1.1 * e.region.moving
                panel.set_xlim(-reach, reach)
                panel.set_ylim(-reach, reach)
                rms = 1e3 * float(e.residual[one.frame])
                panel.set_title(f"rms {rms:.2f} um", fontsize=8)
    axes[0, 0].set_ylabel("heights, mm about the centre", fontsize=7)
    axes[1, 0].set_ylabel("residuals of the fit", fontsize=7)
    for row, label in ((0, "height, um"), (1, "residual, um")):
        below, above = axes[row, -1].get_position().intervaly
        bar = figure.colorbar(images[row], cax=figure.add_axes((0.925, below, 0.012, above - below)))
        bar.set_label(label, fontsize=7)
        bar.ax.tick_params(labelsize=6)


def _circle(axes: Axes, radius: float) -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 90)
    axes.plot(radius * np.cos(angle), radius * np.sin(angle), "--", color="r", lw=0.6)


def _draw_output(axes: Axes, e: Extraction, name: str) -> None:
    t, values, sd = e.times, e.outputs[name], e.standard_deviation[name]
    used = e.used & np.isfinite(values)
    axes.fill_between(t, values - 1.96 * sd, values + 1.96 * sd, where=used.tolist(), color="C0", alpha=0.3, lw=0)
    axes.plot(t[used], values[used], ".", ms=2.5, color="C0")
    _mark_flagged(axes, e)
    at_rest = np.isin(np.arange(t.size), e.rest)
    axes.plot(t[at_rest & used], values[at_rest & used], ".", ms=3.5, color="C2", label="at rest")
    good = values[used & ~at_rest]
    if good.size and name != next(iter(e.outputs)):
        low, high = np.quantile(good, [0.02, 0.98])
        axes.set_ylim(low - 0.5 * (high - low) - 1e-9, high + 0.5 * (high - low) + 1e-9)
    unit = output_unit(name, e.specimen)
    axes.set_title(f"{name}{f' in {unit}' if unit else ''}, 95 % band", fontsize=9)
    _dress(axes)


def _draw_motion(axes: Axes, e: Extraction, values: Floats, title: str) -> None:
    for k, axis in enumerate("xyz"):
        axes.plot(e.times, np.where(e.used, values[:, k], np.nan), lw=1.0, label=axis)
    _mark_flagged(axes, e)
    axes.legend(fontsize=7, ncols=3)
    axes.set_title(f"rigid motion: {title}", fontsize=9)
    _dress(axes)


def _draw_residuals(axes: Axes, e: Extraction) -> None:
    axes.plot(e.times, 1e3 * e.residual, lw=1.0, label="of the operator's model")
    axes.plot(e.times, 1e3 * e.motion.residual, lw=1.0, label="of the clamped plate")
    _mark_flagged(axes, e)
    axes.set_ylim(bottom=0.0)
    axes.legend(fontsize=7)
    axes.set_title("root mean square of residuals, um", fontsize=9)
    _dress(axes)


def _mark_flagged(axes: Axes, e: Extraction) -> None:
    for frame in sorted({frame for flag in e.flags for frame in flag.frames})[:200]:
        axes.axvline(float(e.times[frame]), color="r", lw=0.6, alpha=0.6)


def _dress(axes: Axes) -> None:
    axes.tick_params(labelsize=7)
    axes.set_xlabel("s", fontsize=7)
    axes.grid(alpha=0.3)


def _first(values: Floats, e: Extraction) -> Floats:
    """(3,) of the first used frame: what matters is how the plate moved since."""
    return np.asarray(values[int(np.argmax(e.used))])


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
