"""Samples of the readers of cameras: one frame of each format, and several images in one file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from file_samples.samples import ReaderSample

import creepkit as ck
from creepkit.records import CameraFrame
from helpers.camera_samples import SAMPLES, vic_3d_images

COMMA_TABLES = ("matchid_2024", "matchid_2023", "pyvale")
"""Samples whose first line names the columns, so that changes of cells have a meaning."""


def read(path: Path) -> list[CameraFrame]:
    """All frames of a file."""
    return list(ck.read_frames(path))


def difference(first: Sequence[CameraFrame], second: Sequence[CameraFrame]) -> str:
    """What distinguishes frames where both have a point; a point that is called lost is no silent change."""
    if len(first) != len(second):
        return f"{len(first)} and {len(second)} frames"
    for k, (one, other) in enumerate(zip(first, second, strict=True)):
        if len(one.points) != len(other.points):
            return f"frame {k}: {len(one.points)} and {len(other.points)} points"
        both = one.valid & other.valid
        for name in ("points", "displacements"):
            if not np.array_equal(getattr(one, name)[both], getattr(other, name)[both]):
                return f"frame {k}: other {name}"
    return ""


def samples() -> Iterator[ReaderSample]:
    """One sample of each spelling of each format."""
    names = {"matchid_2024": ("coor.X [mm]", "coorX [mm]"), "zeiss": ("z_undef [mm]", "z_undf [mm]")}
    names |= {"vic_3d": ('"W [mm]"', '"WW [mm]"'), "pyvale": ("stereo_disp_w_mm", "stereo_dsp_w_mm")}
    units = {"vic_3d": ('"W [mm]"', '"W"'), "matchid_2024": ("coor.Z [mm]", "coor.Z"), "zeiss": ("v [mm]", "v")}
    for name, (write, file, form) in SAMPLES.items():
        yield ReaderSample(
            f"camera {name}",
            {file: write()},
            file,
            read,
            difference,
            delimiter="," if name in COMMA_TABLES else "",
            misspelt=(names[name],) if name in names else (),
            without_unit=(units[name],) if name in units else (),
            reader=f"camera {form}",
        )
    file = "all.csv"
    yield ReaderSample("camera images", {file: vic_3d_images()}, file, read, difference, reader="camera vic-3d")
