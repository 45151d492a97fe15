"""Pictures of the pages on camera frames and on records: a contact sheet, and clocks before and after their alignment.

    python docs/pictures/cameras_and_clocks.py

A dimple is simulated and watched by the virtual camera of the tests, with rigid motion, lost subsets and noise; a
logger whose clock is 37 s ahead records the pressure each second.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))

import creepkit as ck
from creepkit.records import Channel, InstrumentRecord
from helpers.virtual_camera import Dimple, VirtualCamera, simulated_dimple

FOLDER = Path(__file__).resolve().parent

AHEAD, PRESSURE = 37.0, 8.0
"""s by which the logger's clock is ahead, and MPa."""

MOMENTS, REST, INTERVAL, KEPT = 240, 90, 5.0, 3
"""Simulated moments in all, those before the load, s between them, and of how many one is a frame.

The load comes with the last moment before it, which is no frame.
"""


def main() -> None:
    """Write contact_sheet.png and clock_alignment.png beside this file."""
    every = simulated_dimple(MOMENTS, REST, INTERVAL, PRESSURE, A=2e-15, refinement=3.0)
    dimple = Dimple(every.times[::KEPT], every.radii, every.rise[::KEPT], every.widening[::KEPT])
    camera = VirtualCamera()
    (test,) = ck.extract(camera.frames(dimple), subset=camera.subset)
    sheet = test.plot()
    sheet.savefig(FOLDER / "contact_sheet.png", dpi=70)
    times = test.times + test.first_time
    record = logger(times)
    signal = np.where(test.used, test.outputs["amplitude"], np.nan)
    alignment = ck.align_clocks(record, "P1", times, signal)
    print(alignment)
    draw_alignment(record, times, signal, alignment)


def logger(times: np.ndarray) -> InstrumentRecord:
    """The pressure each second, of a clock that is ahead."""
    seconds = np.arange(0.0, times[-1] + 240.0)
    began = (REST - 1) * INTERVAL + AHEAD
    noise = np.random.default_rng(1).normal(0.0, 0.02, seconds.size)
    values = PRESSURE * (seconds >= began) + noise
    return InstrumentRecord("logger", seconds, {"P1": Channel("P1", "pressure", values, "gauge")})


def draw_alignment(
    record: InstrumentRecord, times: np.ndarray, signal: np.ndarray, alignment: ck.ClockAlignment
) -> None:
    """The load step of both clocks, as written and aligned, and the probability of lags."""
    figure = Figure(figsize=(11.0, 3.2), layout="constrained")
    panels = figure.subplots(1, 3)
    step = (REST - 1) * INTERVAL
    for axes, moments, title in (
        (panels[0], record.times, "each on its own clock"),
        (panels[1], alignment.camera_time(record.times), "aligned"),
    ):
        axes.plot(times, signal, "o", ms=3, color="tab:blue")
        axes.set(xlim=(step - 90, step + 150), title=title, xlabel="time of the camera, s")
        axes.set_ylabel("amplitude, mm", color="tab:blue")
        other = axes.twinx()
        other.plot(moments, record.channels["P1"].values, lw=0.8, color="tab:red")
        other.set_ylabel("pressure, MPa", color="tab:red")
    panels[2].plot(alignment.lags, alignment.probability / alignment.probability.max(), color="black")
    panels[2].axvspan(*alignment.lag_interval, color="0.85")
    panels[2].axvline(AHEAD, ls="--", color="tab:green")
    low, high = alignment.lag_interval
    panels[2].set(
        xlim=(low - (high - low), high + (high - low)), xlabel="lag of the logger, s", ylabel="relative probability",
        title="95 % (grey), true lag (dashed)",
    )  # fmt: skip
    figure.savefig(FOLDER / "clock_alignment.png", dpi=80)


if __name__ == "__main__":
    main()
