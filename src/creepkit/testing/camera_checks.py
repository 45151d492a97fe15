"""Checks of camera formats: a table in a format's own words comes back as it was meant, and to it alone."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.cameras.columns import OPTIONAL
from creepkit.cameras.reading import read_frames
from creepkit.cameras.recognition import is_for_matlab
from creepkit.errors import HistoryError
from creepkit.records.camera_format import COORDINATES, DISPLACEMENTS, CameraFormat, ColumnName, LostRule
from creepkit.registry import default_registry
from creepkit.testing.reader_checks import FOREIGN_FILES
from creepkit.testing.reports import finding

POINTS = 25


LOST = 4
"""The point that is lost in the tables of the checks."""


@finding("tables in its own words")
def check_own_tables(format: CameraFormat, _: Path | None) -> str:
    """Each version, with columns in another order, as a table with commas and with decimal commas, or as rows."""
    for number, version in enumerate(format.versions, start=1):
        with tempfile.TemporaryDirectory() as folder:
            for label, content in _written(format, version).items():
                path = (
                    Path(folder) / f"frame_{number}{format.patterns[0].removeprefix('*') if format.layout else '.csv'}"
                )
                path.write_bytes(content)
                gap = _difference(format, version, path)
                assert not gap, f"version {number}, {label}: {gap}".replace(f"{folder}/", "")
                if not format.layout and not is_for_matlab(format):  # else others are meant than tables of text
                    _require_alone(format, path)
    return f"{len(format.versions)} versions of {POINTS} points read as they were meant, 1 of them lost"


@finding("foreign files")
def check_foreign_files(format: CameraFormat, _: Path | None) -> str:
    """What holds no frame is refused in one sentence."""
    with tempfile.TemporaryDirectory() as folder:
        for name, content in FOREIGN_FILES.items():
            path = Path(folder) / name
            path.write_bytes(content)
            try:
                frame = read_frames(path, [format], format)[0]
            except HistoryError as error:
                assert "\n" not in str(error), f"{str(error)!r}; an error is one sentence"
            else:
                raise AssertionError(f"{name} is taken for {frame.valid.size} points")
    return f"{len(FOREIGN_FILES)} files refused in one sentence"


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
    for name, entry in default_registry().cameras().items():
        if name != format.name:
            try:
                read_frames(path, [entry.value])
            except HistoryError:
                continue
            raise AssertionError(f"the format '{name}' takes it as well; name a column that only one of them has")


def _planted() -> dict[str, Floats]:
    """{quantity: (points,)}, mm."""
    axis = np.linspace(-4.0, 4.0, 5)
    x, y = (grid.ravel() for grid in np.meshgrid(axis, axis))
    lengths = (x, y, 0.1 + 0.01 * x, 0.002 * y, -0.003 * x, 0.25 - 0.01 * x**2)
    return dict(zip((*COORDINATES, *DISPLACEMENTS), lengths, strict=True))


def _columns(format: CameraFormat, version: Mapping[str, tuple[str, ...]]) -> dict[str, Floats]:
    """{head: (points,)} of a table of one version, with units where its names state none."""
    planted = _planted()
    columns: dict[str, Floats] = {}
    for quantity, (word, *_) in version.items():
        values = planted.get(quantity, np.full(POINTS, 0.5))
        unit = "mm" if quantity in planted else "s" if quantity == "time" else ""
        stated = ColumnName.of(word).unit or not unit
        columns[word if stated else f"{word} [{unit}]"] = values
    names = {ColumnName.of(head).name: head for head in columns}
    for rule in format.lost_rules:
        head = names.get(ColumnName.of(rule.column).name, rule.column)
        columns[head] = np.where(np.arange(POINTS) == LOST, _lost_value(rule), _sound_value(rule))
    return columns


def _lost_value(rule: LostRule) -> float:
    return rule.value + {"<": -1.0, ">": 1.0}.get(rule.comparison, 0.0)


def _sound_value(rule: LostRule) -> float:
    return rule.value + (-1.0 if rule.comparison in (">", ">=") else 1.0)


def _written(format: CameraFormat, version: Mapping[str, tuple[str, ...]]) -> dict[str, bytes]:
    """{how: content} of a file."""
    columns = _columns(format, version)
    if format.layout:
        rows = np.zeros(POINTS, dtype=[(name, "u1" if kind == "?" else kind) for name, kind in format.layout])
        plain = {ColumnName.of(head).name: values for head, values in columns.items()}
        for name, _ in format.layout:
            parsed = ColumnName.of(name)
            if parsed.name in plain and parsed.unit != "px":
                rows[name] = plain[parsed.name]
        return {"packed rows": rows.tobytes()}
    heads, table = list(columns)[::-1], np.stack(list(columns.values())[::-1], axis=1)
    lines = [";".join(heads), *(";".join(f"{value:.9g}" for value in row) for row in table)]
    semicolons = "\n".join([lines[0], *(line.replace(".", ",") for line in lines[1:])])
    commas = "\n".join([",".join(f'"{head}"' for head in heads), *(line.replace(";", ",") for line in lines[1:])])
    return {"commas": commas.encode(), "semicolons and decimal commas": semicolons.encode("utf-8-sig")}


def _difference(format: CameraFormat, version: Mapping[str, tuple[str, ...]], path: Path) -> str:
    """What is read otherwise than it was meant, as a sentence; "" where nothing is."""
    frame = read_frames(path, [format], format if is_for_matlab(format) else None)[0]
    planted, flat = _planted(), "w" not in version
    turned = np.array([*format.axes, *format.axes])
    meant = np.stack([planted[q] for q in (*COORDINATES, *DISPLACEMENTS)], axis=1) * turned
    if format.deformed:
        meant[:, :3] -= meant[:, 3:]
    if flat:
        meant[:, [2, 5]] = 0.0
    sound: Bools = np.ones(POINTS, dtype=bool)
    if format.lost_rules:
        sound[LOST] = False
    if not np.array_equal(frame.valid, sound):
        lost, planted_lost = (np.flatnonzero(~marks).tolist() for marks in (frame.valid, sound))
        return f"points {lost} are lost in the place of {planted_lost}"
    read = np.concatenate([frame.points, frame.displacements], axis=1)
    if not np.allclose(read[sound], meant[sound], rtol=1e-8, atol=1e-10):
        return "points or displacements are not those of the table"
    needed = [quantity for quantity in OPTIONAL if quantity in version]
    if "confidence" in needed and not np.isfinite(frame.confidence).all():
        return "the confidence of points is not read"
    return "" if "time" not in needed or frame.time == 0.5 else "the time of the frame is not read"
