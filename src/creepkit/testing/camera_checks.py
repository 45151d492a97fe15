"""Checks of camera formats: a table in a format's own words comes back as it was meant, and to it alone."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from creepkit.arrays import Floats
from creepkit.cameras.reading import read_frames
from creepkit.cameras.recognition import is_for_matlab
from creepkit.records.camera_format import COORDINATES, DISPLACEMENTS, CameraFormat, ColumnName
from creepkit.registry import default_registry, kinds
from creepkit.testing.reader_checks import foreign_places, refusal
from creepkit.testing.reports import finding

POINTS = 25


LOST = 4
"""The point that is lost in the tables of the checks."""


@finding("tables in its own words")
def check_own_tables(format: CameraFormat, _: Path | None) -> str:
    """Each version, with columns in another order, as a table with commas and with decimal commas."""
    for number, version in enumerate(format.versions, start=1):
        with tempfile.TemporaryDirectory() as folder:
            for label, content in _written(format, version).items():
                path = Path(folder) / f"frame_{number}.csv"
                path.write_bytes(content)
                gap = _difference(format, version, path)
                assert not gap, f"version {number}, {label}: {gap}".replace(f"{folder}/", "")
                if not is_for_matlab(format):  # else others are meant than tables of text
                    _require_alone(format, path)
    return f"{len(format.versions)} versions of {POINTS} points read as they were meant, 1 of them lost"


@finding("foreign files")
def check_foreign_files(format: CameraFormat, _: Path | None) -> str:
    """What holds no frame is refused in one sentence."""
    errors = {place.name: refusal(_read, format, place) for place in foreign_places() if place.is_file()}
    for name, error in errors.items():
        assert error, f"{name} is taken for points"
        assert "\n" not in error, f"{error!r}; an error is one sentence"
    return f"{len(errors)} files refused in one sentence"


def _read(format: CameraFormat, path: Path) -> object:
    return read_frames(path, [format], format)[0]


@finding("example")
def check_example(format: CameraFormat, path: Path | None) -> str:
    """An example of the author's has this format alone, and points in every frame."""
    if path is None:
        return "none given; check_camera_format(format, path) checks what is read of it"
    _require_alone(format, path)
    found = [int(frame.valid.sum()) for frame in read_frames(path, [format])]
    assert all(found), f"frame {found.index(0)} has no valid point"
    return f"{len(found)} frames of {min(found)} to {max(found)} valid points"


def _require_alone(format: CameraFormat, path: Path) -> None:
    """AssertionError where another registered format takes a file as well."""
    for name, entry in default_registry().all(kinds.CAMERAS).items():
        taken = name != format.name and not refusal(lambda path, other=entry.value: read_frames(path, [other]), path)
        assert not taken, f"the format '{name}' takes it as well; name a column that only one of them has"


_AXIS = np.linspace(-4.0, 4.0, 5)
_X, _Y = (grid.ravel() for grid in np.meshgrid(_AXIS, _AXIS))
_LENGTHS = (_X, _Y, 0.1 + 0.01 * _X, 0.002 * _Y, -0.003 * _X, 0.25 - 0.01 * _X**2)
_PLANTED: dict[str, Floats] = dict(zip((*COORDINATES, *DISPLACEMENTS), _LENGTHS, strict=True))
"""{quantity: (points,)}, mm."""


def _columns(format: CameraFormat, version: Mapping[str, tuple[str, ...]]) -> dict[str, Floats]:
    """{head: (points,)} of a table of one version, with units where its names state none."""
    columns: dict[str, Floats] = {}
    for quantity, (word, *_) in version.items():
        unit = "mm" if quantity in _PLANTED else "s" if quantity == "time" else ""
        head = word if ColumnName.of(word).unit or not unit else f"{word} [{unit}]"
        columns[head] = _PLANTED.get(quantity, np.full(POINTS, 0.5))
    names = {ColumnName.of(head).name: head for head in columns}
    for rule in format.lost_rules:
        lost = rule.value + {"<": -1.0, ">": 1.0}.get(rule.comparison, 0.0)
        sound = rule.value + (-1.0 if rule.comparison in (">", ">=") else 1.0)
        head = names.get(ColumnName.of(rule.column).name, rule.column)
        columns[head] = np.where(np.arange(POINTS) == LOST, lost, sound)
    return columns


def _written(format: CameraFormat, version: Mapping[str, tuple[str, ...]]) -> dict[str, bytes]:
    """{how: content} of a file."""
    columns = _columns(format, version)
    heads, table = list(columns)[::-1], np.stack(list(columns.values())[::-1], axis=1)
    lines = [";".join(heads), *(";".join(f"{value:.9g}" for value in row) for row in table)]
    semicolons = "\n".join([lines[0], *(line.replace(".", ",") for line in lines[1:])])
    commas = "\n".join([",".join(f'"{head}"' for head in heads), *(line.replace(";", ",") for line in lines[1:])])
    return {"commas": commas.encode(), "semicolons and decimal commas": semicolons.encode("utf-8-sig")}


def _difference(format: CameraFormat, version: Mapping[str, tuple[str, ...]], path: Path) -> str:
    """What is read otherwise than it was meant, as a sentence; "" where nothing is."""
    frame = read_frames(path, [format], format if is_for_matlab(format) else None)[0]
    meant = np.stack([*_PLANTED.values()], axis=1) * np.array([*format.axes, *format.axes])
    if format.deformed:
        meant[:, :3] -= meant[:, 3:]
    if "w" not in version:
        meant[:, [2, 5]] = 0.0
    sound = (np.arange(POINTS) != LOST) | (not format.lost_rules)
    if not np.array_equal(frame.valid, sound):
        lost, planted_lost = (np.flatnonzero(~marks).tolist() for marks in (frame.valid, sound))
        return f"points {lost} are lost in the place of {planted_lost}"
    read = np.concatenate([frame.points, frame.displacements], axis=1)
    if not np.allclose(read[sound], meant[sound], rtol=1e-8, atol=1e-10):
        return "points or displacements are not those of the table"
    return "" if "time" not in version or frame.time == 0.5 else "the time of the frame is not read"
