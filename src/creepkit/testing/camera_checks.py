"""Checks of camera formats: a table in a format's own words comes back as it was meant, and to it alone."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
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
from creepkit.testing.reports import ConformanceCheck

POINTS = 25


LOST = 4
"""The point that is lost in the tables of the checks."""


@dataclass(frozen=True)
class CameraFormatCase:
    """A camera format, and an example file or folder of its author's, if there is one."""

    format: CameraFormat
    path: Path | None = None


def check_own_tables(case: CameraFormatCase) -> Iterator[ConformanceCheck]:
    """Each version, with columns in another order, as a table with commas and with decimal commas, or as rows."""
    for number, version in enumerate(case.format.versions, start=1):
        name = f"a table of version {number}"
        with tempfile.TemporaryDirectory() as folder:
            for label, content in _written(case.format, version).items():
                path = Path(folder) / f"frame_{number}{_suffix(case.format)}"
                path.write_bytes(content)
                if gap := _difference(case.format, version, path):
                    yield ConformanceCheck(name, False, f"{label}: {gap}".replace(f"{folder}/", ""))
                    return
                if not _without_head(case.format) and (others := _other_formats(case.format, path)):
                    detail = f"the format '{others[0]}' takes it as well; name a column that only one of them has"
                    yield ConformanceCheck("recognised by its head", False, detail)
                    return
        yield ConformanceCheck(name, True, f"{POINTS} points read as they were meant, 1 of them lost")


def check_foreign_files(case: CameraFormatCase) -> Iterator[ConformanceCheck]:
    """What holds no frame is refused in one sentence."""
    with tempfile.TemporaryDirectory() as folder:
        for name, content in FOREIGN_FILES.items():
            path = Path(folder) / name
            path.write_bytes(content)
            try:
                frame = read_frames(path, [case.format], case.format)[0]
            except HistoryError as error:
                if "\n" in str(error):
                    yield ConformanceCheck("foreign files", False, f"{str(error)!r}; an error is one sentence")
                    return
            else:
                yield ConformanceCheck("foreign files", False, f"{name} is taken for {frame.valid.size} points")
                return
    yield ConformanceCheck("foreign files", True, f"{len(FOREIGN_FILES)} files refused in one sentence")


def check_example(case: CameraFormatCase) -> Iterator[ConformanceCheck]:
    """An example of the author's has this format alone, and points in every frame."""
    if case.path is None:
        detail = "none given; check_camera_format(format, path) checks what is read of it"
        yield ConformanceCheck("example", True, detail)
        return
    if others := _other_formats(case.format, case.path):
        yield ConformanceCheck("example", False, f"the format '{others[0]}' takes it as well")
        return
    frames = read_frames(case.path, [case.format])
    found = [int(frame.valid.sum()) for frame in frames]
    passed = all(found)
    detail = f"{len(found)} frames of {min(found)} to {max(found)} valid points"
    yield ConformanceCheck("example", passed, detail if passed else f"frame {found.index(0)} has no valid point")


def _other_formats(format: CameraFormat, path: Path) -> list[str]:
    """The registered formats that take a file, this one excepted."""
    taking = []
    for name, entry in default_registry().cameras().items():
        if name != format.name:
            try:
                read_frames(path, [entry.value])
            except HistoryError:
                continue
            taking.append(name)
    return taking


def _without_head(format: CameraFormat) -> bool:
    """Whether other files than tables of text are meant, which the checks write in its place."""
    return bool(format.layout) or is_for_matlab(format)


def _suffix(format: CameraFormat) -> str:
    return format.patterns[0].removeprefix("*") if format.layout else ".csv"


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
