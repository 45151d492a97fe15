"""What cameras and instruments measured: extractions with a contact sheet, records, clocks, and what was imposed."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.instruments.clock_alignment import UNIX_TIME
from creepkit.quality.flags import frame_ranges_text
from creepkit.records import output_unit
from creepkit.records.units import ZERO_CELSIUS, celsius_text
from creepkit.reports.figures import Course, Panels, draw_over_time, empty_figure, over_time, panel_grid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.extraction import Extraction
    from creepkit.instruments.imposed import Imposed
    from creepkit.records import Channel, ClockAlignment, InstrumentRecord


_WIDTH, _HEIGHT, _PANEL = 14.0, 11.5, 1.75
"""Inches, of the sheet and of one map."""


_MAPS = {"left": 0.05, "right": 0.91, "bottom": 0.06, "top": 0.89, "wspace": 0.06, "hspace": 0.22}
_COURSES = {"left": 0.05, "right": 0.98, "bottom": 0.08, "top": 0.93, "wspace": 0.18, "hspace": 0.38}
"""Places of maps and of what is drawn over time, as fractions of their halves of the sheet."""


def extraction_figure(extraction: Extraction) -> Figure:
    """A contact sheet.

    Top: heights of some frames over the plate, with the points (white) between two circles from which the rigid motion
    was taken, and lost points (grey crosses); below them what the operator's model leaves. Then the outputs over time
    with 95 % bands, the rigid motion and the residuals, flagged frames in red.
    """
    e = extraction
    figure = empty_figure(_WIDTH, _HEIGHT)
    figure.set_layout_engine("none")  # a constrained layout of so many panels takes as long as all else
    parts: Any = figure.subfigures(2, 1, height_ratios=[1.0, 1.15])
    top, bottom = parts
    heights = 1e3 * np.stack([m.heights for m in e.maps])
    residuals = 1e3 * np.stack([m.residuals for m in e.maps])
    high = float(np.nanmax(np.abs(heights[:, np.hypot(*e.places.T) < e.region.held[0]]), initial=1e-3))
    finite = np.abs(residuals[np.isfinite(residuals)])
    wide = float(np.quantile(finite, 0.99)) if finite.size else 1.0
    rows = top.subplots(2, len(e.maps), squeeze=False, gridspec_kw=_MAPS)
    extent = float(np.ptp(e.places[:, 0])) or 1.0
    _draw_maps(rows[0], e, heights, (-0.05 * high, high), "height, um", extent)
    _draw_maps(rows[1], e, residuals, (-wide, wide), "residual, um", 2.2 * e.region.moving)
    for one, above, below in zip(e.maps, *rows, strict=True):
        above.plot(*e.places[e.clamped].T, ",", color="w", alpha=0.8)
        for radius in e.region.held:
            angle = np.linspace(0.0, 2.0 * np.pi, 90)
            above.plot(radius * np.cos(angle), radius * np.sin(angle), "--", color="r", lw=0.6)
        above.set_title(f"frame {one.frame}, {e.times[one.frame]:.4g} s", fontsize=8)
        reach = 1.1 * e.region.moving
        below.set(xlim=(-reach, reach), ylim=(-reach, reach))
        below.set_title(f"rms {1e3 * float(e.residual[one.frame]):.2f} um", fontsize=8)
    _, panels = panel_grid(
        len(e.outputs) + 3, max(3, (len(e.outputs) + 4) // 2), 0.0, 0.0, part=bottom, gridspec_kw=_COURSES
    )
    for axes, name in zip(panels, e.outputs, strict=False):
        _draw_output(axes, e, name)
    shift, rotation = (1e3 * (v - v[int(np.argmax(e.used))]) for v in (e.motion.translations, e.motion.rotations))
    drawn = {
        "rigid motion: shift, um": dict(zip("xyz", shift.T, strict=True)),
        "rigid motion: rotation, mrad": dict(zip("xyz", rotation.T, strict=True)),
        "root mean square of residuals, um": {
            "of the operator's model": 1e3 * e.residual,
            "of the clamped plate": 1e3 * e.motion.residual,
        },
    }
    for axes, (title, curves) in zip(panels[-3:], drawn.items(), strict=True):
        for label, values in curves.items():
            axes.plot(e.times, np.where(e.used, values, np.nan), lw=1.0, label=label)
        axes.legend(fontsize=7, ncols=3)
        _dress(axes, e, title)
    figure.suptitle("\n".join(extraction_text(e).splitlines()[:2]), fontsize=10, x=0.01, ha="left")
    return figure


def draw_extraction(axes: Axes, extraction: Extraction) -> None:
    """The first output over time with its band."""
    _draw_output(axes, extraction, next(iter(extraction.outputs)))


def _draw_maps(
    panels: Sequence[Axes], e: Extraction, values: Floats, limits: tuple[float, float], label: str, extent: float
) -> None:
    """A row of maps with its colour bar; values : (maps, points) um. extent : mm that a panel shows."""
    size = max((_PANEL * 72.0 * e.spacing / extent) ** 2, 0.3)
    colours = "viridis" if label.startswith("height") else "RdBu_r"
    look: Any = {"s": size, "marker": "s", "cmap": colours, "vmin": limits[0], "vmax": limits[1], "lw": 0}
    for k, (panel, row, one) in enumerate(zip(panels, values, e.maps, strict=True)):
        seen, lost = np.isfinite(row), ~np.isfinite(one.heights)
        image = panel.scatter(*e.places[seen].T, rasterized=True, **{**look, "c": row[seen]})
        crosses: Any = {"c": "0.6", "s": 0.7 * size, "marker": "x", "lw": 0.5}
        panel.scatter(*e.places[lost].T, **crosses)
        panel.plot(0.0, 0.0, "+", color="r", ms=6)
        panel.set_aspect("equal")
        panel.tick_params(labelsize=6, left=k == 0, bottom=k == 0, labelleft=k == 0, labelbottom=k == 0)
    panels[0].set_ylabel("mm about the centre", fontsize=7)
    below, above = panels[-1].get_position().intervaly
    bar = panels[0].figure.colorbar(image, cax=panels[0].figure.add_axes((0.925, below, 0.012, above - below)))
    bar.set_label(label, fontsize=7)
    bar.ax.tick_params(labelsize=6)


def _draw_output(axes: Axes, e: Extraction, name: str) -> None:
    t, values, sd = e.times, e.outputs[name], e.standard_deviation[name]
    used = e.used & np.isfinite(values)
    axes.fill_between(t, values - 1.96 * sd, values + 1.96 * sd, where=used.tolist(), color="C0", alpha=0.3, lw=0)
    axes.plot(t[used], values[used], ".", ms=2.5, color="C0")
    at_rest = np.isin(np.arange(t.size), e.rest)
    axes.plot(t[at_rest & used], values[at_rest & used], ".", ms=3.5, color="C2", label="at rest")
    good = values[used & ~at_rest]
    if good.size and name != next(iter(e.outputs)):
        low, high = np.quantile(good, [0.02, 0.98])
        axes.set_ylim(low - 0.5 * (high - low) - 1e-9, high + 0.5 * (high - low) + 1e-9)
    unit = output_unit(name, e.specimen)
    _dress(axes, e, f"{name}{f' in {unit}' if unit else ''}, 95 % band")


def _dress(axes: Axes, e: Extraction, title: str) -> None:
    """Title and labels of what is drawn over time, with flagged frames in red."""
    for frame in sorted({frame for flag in e.flags for frame in flag.frames})[:200]:
        axes.axvline(float(e.times[frame]), color="r", lw=0.6, alpha=0.6)
    axes.set_title(title, fontsize=9)
    axes.tick_params(labelsize=7)
    axes.set_xlabel("s", fontsize=7)
    axes.grid(alpha=0.3)


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
        f"  rigid motion from {motion.points} points {e.region.held[0]:g} to {e.region.held[1]:g} mm from the centre, "
        f"up to {', '.join(f'{v:.3f}' for v in shift)} mm and {', '.join(f'{v:.3f}' for v in turn)} degrees",
        f"  zero level: {rest}",
    ]
    if e.turned:
        from creepkit.extraction.extraction import TURNED

        lines.append(f"  assumed: {TURNED}")
    last = int(np.flatnonzero(e.used)[-1]) if e.used.any() else -1
    for name, values in e.outputs.items():
        lines.append(f"  {name}: {values[last]:.5g} +- {e.standard_deviation[name][last]:.2g} in frame {last}")
    related = ", ".join(f"{a} {b} {value:.2f}" for (a, b), value in noise.correlation.items())
    lines += [
        f"  noise of one point {1e3 * noise.point_sd:.2f} um, correlated over {noise.correlation_length:.2f} mm, "
        f"by {noise.lag_one:.2f} in successive frames"
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


# ---- instrument records ----------------------------------------------------------------------------------------------


UNITS = {"pressure": "MPa", "temperature": "C", "length": "mm", "force": "N"}


def record_text(record: InstrumentRecord) -> str:
    """Rows, clock, gaps, one line for each channel, and notes."""
    clock = "of unknown date or zone"
    if record.start is not None:
        clock = f"{datetime.fromtimestamp(record.start, UTC):%Y-%m-%d %H:%M:%S} UTC"
    gaps = record.gaps
    lines = [
        f"record '{record.name}': {record.times.size} rows every {record.interval:.6g} s over "
        f"{float(np.ptp(record.times)):.6g} s, time zero {clock}"
    ]
    if gaps.size:
        widest = float(np.diff(gaps, axis=1).max())
        lines.append(f"  {len(gaps)} gap{'s' if len(gaps) > 1 else ''} between rows, the longest of {widest:g} s")
    width = max((len(name) for name in record.channels), default=0)
    lines += [f"  {name:{width}}  {_channel_text(channel)}" for name, channel in record.channels.items()]
    return "\n".join([*lines, *(f"  note: {note}" for note in record.notes)])


def _channel_text(channel: Channel) -> str:
    unit = UNITS.get(channel.quantity, channel.written_unit)
    shift = ZERO_CELSIUS if channel.quantity == "temperature" else 0.0
    what = " ".join(text for text in (channel.reference, channel.quantity) if text)
    if channel.missing == channel.values.size:
        return f"{what}, no reading"
    low, high = float(np.nanmin(channel.values)) - shift, float(np.nanmax(channel.values)) - shift
    lost = f", {channel.missing} readings missing" if channel.missing else ""
    written = f" (written in {channel.written_unit})" if channel.written_unit not in ("", unit) else ""
    return f"{what}, {low:.4g} to {high:.4g} {unit}".rstrip() + written + lost


RECORD_TIME = "time of the record, s"


def record_figure(record: InstrumentRecord) -> Figure:
    """Every channel over time, one panel for each quantity."""
    return over_time(_channels(record), RECORD_TIME)


def draw_record(axes: Axes, record: InstrumentRecord) -> None:
    """The channels of the first quantity over time."""
    draw_over_time(axes, _channels(record), RECORD_TIME)


def _channels(record: InstrumentRecord) -> Panels:
    panels: dict[str, list[Course]] = {}
    for name, channel in record.channels.items():
        shift = ZERO_CELSIUS if channel.quantity == "temperature" else 0.0
        label = ", ".join(filter(None, (channel.quantity, UNITS.get(channel.quantity, ""))))
        panels.setdefault(label, []).append(Course(name, record.times, channel.values - shift))
    return panels or {"": []}


def alignment_text(alignment: ClockAlignment) -> str:
    """The lag with its interval."""
    if not alignment.lags.size:
        return f"clock of the record ahead by {alignment.lag:g} s (stated)"
    low, high = alignment.lag_interval
    return (
        f"clock of the record ahead by {alignment.lag:.4g} s ({low:.4g} to {high:.4g} s, 95 %), from "
        f"{alignment.frames} frames and channel '{alignment.channel}'"
    )


def _camera_time_text(time: float) -> str:
    """A time on the camera's clock, in words; a unix time as a date."""
    if time > UNIX_TIME:
        return f"{datetime.fromtimestamp(time, UTC):%Y-%m-%d %H:%M:%S.%f} UTC of the camera"
    return f"{time:.6g} s of the camera"


def imposed_text(imposed: Imposed) -> str:
    """What was imposed, and how well the programs follow the record."""
    load, warm = imposed.load, imposed.temperature
    lines = [
        f"imposed on {imposed.specimen or 'the specimen'}: '{imposed.channels[0]}' up to {load.values.max():.4g} MPa, "
        f"'{imposed.channels[1]}' {celsius_text(warm.values.min(), warm.values.max())}; the first ramp starts at "
        f"{_camera_time_text(imposed.time_zero)}",
        f"  load: {load.times.size} points, off its record by {imposed.load_error:.2g} MPa at most, noise "
        f"{imposed.load_noise:.2g} MPa",
        f"  temperature: {warm.times.size} points, off its record by {imposed.temperature_error:.2g} K at most, noise "
        f"{imposed.temperature_noise:.2g} K"
        + (f"; at the specimen known to {imposed.temperature_sd:.2g} K" if imposed.temperature_sd else ""),
    ]
    return "\n".join([*lines, *(f"  note: {note}" for note in imposed.notes)])
