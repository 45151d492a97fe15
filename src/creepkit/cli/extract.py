"""`creepkit extract`: from the frames of a camera to measured histories with their noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from creepkit import limits
from creepkit.cli.declared_options import OutputPath
from creepkit.cli.generated_options import parsed_number
from creepkit.cli.options import PAPER_SPECIMEN
from creepkit.reports.terminal import tell, tell_written

if TYPE_CHECKING:
    from creepkit.extraction import Extraction
    from creepkit.records import Frames, History, InstrumentRecord


def command(
    frames: Annotated[str, typer.Argument(metavar="FOLDER", help="Folder, file or pattern of a camera's exports.")],
    specimen: Annotated[str, typer.Option(metavar="NAME", help="What the camera watched.")] = PAPER_SPECIMEN,
    format: Annotated[str | None, typer.Option(metavar="NAME", help="Camera format; by default by the head.")] = None,
    columns: Annotated[
        str | None, typer.Option(metavar="x=X_mm,...", help="Columns x, y, z, u, v, w of files of no known format.")
    ] = None,
    interval: Annotated[
        float | None,
        typer.Option("--interval-s", metavar="S", help="Time between frames whose files hold none."),
        limits.SECONDS,
    ] = None,
    times: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Times of frames, a column in s, or in ms since 1970.")
    ] = None,
    record: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Instrument record of loads, temperatures.")
    ] = None,
    time_zone: Annotated[
        str | None, typer.Option("--time-zone", metavar="ZONE", help="Of the record's times, as America/Chicago.")
    ] = None,
    date_order: Annotated[
        str | None, typer.Option("--date-order", metavar="ORDER", help="Of its dates: 'month first' or 'day first'.")
    ] = None,
    reference: Annotated[
        str | None, typer.Option("--pressure-reference", metavar="KIND", help="Of its pressures: gauge or absolute.")
    ] = None,
    channels: Annotated[
        str | None, typer.Option(metavar="LOAD,TEMPERATURE", help="Its channels, where its format does not name them.")
    ] = None,
    names: Annotated[
        str | None, typer.Option(metavar="D1,E1", help="Names of what is found, as the record has them.")
    ] = None,
    load: Annotated[
        float | None, typer.Option("--load-mpa", metavar="MPA", help="Constant load, for no record."), limits.MEGAPASCAL
    ] = None,
    temperature: Annotated[
        float | None,
        typer.Option("--temperature-c", metavar="C", help="Constant temperature, for no record."),
        limits.CELSIUS,
    ] = None,
    modulus: Annotated[
        float | None,
        typer.Option("--modulus-gpa", metavar="GPA", help="Young's modulus, for the history."),
        limits.GIGAPASCAL,
    ] = None,
    center: Annotated[
        list[str] | None, typer.Option(metavar="X,Y", help="Centre in mm, in the frames' axes; for several, repeat it.")
    ] = None,
    window: Annotated[
        float | None, typer.Option(metavar="MM", help="Radius of the fitted window."), limits.MILLIMETRE
    ] = None,
    rings: Annotated[
        str | None, typer.Option(metavar="0,2,4", help="Radii, mm: means on rings in place of a fit.")
    ] = None,
    rest: Annotated[
        str | None, typer.Option(metavar="A-B", help="Frames at rest, where they are not to be found.")
    ] = None,
    subset: Annotated[
        float, typer.Option("--subset", metavar="MM", help="Side of a subset, taken out."), limits.MILLIMETRE
    ] = 0.0,
    to: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Write a history of each here."), OutputPath("folder")
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write a contact sheet, .png, .svg or .pdf."),
        OutputPath("picture"),
    ] = None,
) -> None:
    """Extract measured histories from camera frames."""
    import creepkit as ck
    from creepkit.api.extraction import operator_of
    from creepkit.errors import HistoryError
    from creepkit.files.writing import check_folder_target, check_target, made_from
    from creepkit.records import ZERO_CELSIUS
    from creepkit.reports.terminal import ProgressBar

    if to is not None and record is None and (load is None or temperature is None):
        raise HistoryError(
            "a history needs what was imposed: give --record FILE, or --load-mpa and --temperature-c, beside --to"
        )
    recorded = None
    if record is not None:  # before the frames, which take longer
        recorded = ck.read_record(
            record, time_zone=time_zone or "", date_order=date_order or "", pressure_reference=reference or ""
        )
    operator = operator_of(specimen, window, _numbers(rings, "--rings", "0,2,4") if rings else ())
    centers = _named_centers(center, names) if center else None
    sequence = _frames(frames, format, columns, _Times(interval, times))
    with ProgressBar() as progress:
        found = ck.extract(
            _reporting(sequence, progress.tick), specimen, operator=operator, centers=centers, rest=_frame_range(rest),
            subset=subset,
        )  # fmt: skip
    if names and not center:
        found = [one.replace(name=name) for one, name in zip(found, _names(names, len(found)), strict=True)]
    for one in found:
        tell(one)
    sheets = [plot if len(found) == 1 else plot.with_stem(f"{plot.stem}_{one.name}") for one in found] if plot else []
    files = [to / f"{one.name}.csv" for one in found] if to is not None else []
    for path in sheets:
        check_target(path, HistoryError)
    if to is not None:
        with made_from(frames):
            check_folder_target(to, HistoryError, tuple(path.name for path in files))
    histories = []
    for one in found if to is not None else ():  # all of them, before any is written
        if recorded is not None:
            histories.append(_under_record(one, recorded, channels))
        else:
            assert load is not None
            assert temperature is not None
            histories.append(one.history_under(load, temperature + ZERO_CELSIUS))
    for one, path in zip(found, sheets, strict=False):
        one.plot(path)
        tell_written(path)
    if modulus is not None:
        histories = [history.replace(elastic=ck.Elastic(E=1e3 * modulus)) for history in histories]
    for history, path in zip(histories, files, strict=False):
        path.parent.mkdir(parents=True, exist_ok=True)
        with made_from(frames):  # names such as D1 are the same for many recordings
            ck.write_history(history, path)
        tell_written(path)


def _under_record(one: Extraction, recorded: InstrumentRecord, channels: str | None) -> History:
    """The history under what an instrument record says of a test piece, after the clocks were aligned."""
    from creepkit.api.extraction import history_of, imposed_on
    from creepkit.errors import HistoryError

    named = tuple(name.strip() for name in channels.split(",")) if channels is not None else None
    if named is not None and len(named) != 2:
        raise HistoryError(f"--channels is '{channels}'; name two channels of the record: --channels P1,T1")
    under = imposed_on(one, recorded, named)
    tell(f"  {one.name}: {under.alignment}")
    for note in under.notes:
        tell(f"  {note}")
    return history_of(one, under)


class _Times(NamedTuple):
    """What was said of the times of frames: the interval between two, s, or a file."""

    interval: float | None
    file: Path | None


def _frames(path: str, format: str | None, columns: str | None, times: _Times) -> Frames:
    import numpy as np

    import creepkit as ck
    from creepkit.errors import HistoryError

    if columns is not None and format is not None:
        raise HistoryError("--columns and --format were given: named columns are of no known format; leave one out")
    if times.interval is not None and times.file is not None:
        raise HistoryError("--interval-s and --times were given; leave one of them out")
    if times.interval is not None and not 0.0 < times.interval < 1e9:
        raise HistoryError(f"--interval-s {times.interval:g}: give the time between frames, s, above zero")
    frames = ck.read_frames(path, format if columns is None else _columns(columns), times.file)
    if times.interval is not None:
        return replace(frames, times=times.interval * np.arange(len(frames), dtype=float))
    return frames


def _columns(text: str) -> dict[str, str]:
    from creepkit.errors import HistoryError

    pairs = [part.partition("=") for part in text.split(",")]
    if not all(sign and name.strip() and column.strip() for name, sign, column in pairs):
        raise HistoryError(
            f"--columns {text}: write quantity=column with commas between them, as in "
            "--columns x=X_mm,y=Y_mm,z=Z_mm,u=U_mm,v=V_mm,w=W_mm"
        )
    return {name.strip(): column.strip() for name, _, column in pairs}


def _reporting(frames: Frames, tick: Any) -> Frames:
    """The same frames; each that is read is told to a progress bar."""
    done: set[int] = set()

    def read(index: int) -> Any:
        done.add(index)
        tick("read", len(done), len(frames), "")
        return frames.read_frame(index)

    return replace(frames, read_frame=read)


def _numbers(text: str, option: str, example: str) -> tuple[float, ...]:
    from creepkit.errors import HistoryError

    try:
        return tuple(parsed_number(word) for word in text.split(","))
    except ValueError:
        raise HistoryError(
            f"{option} {text}: write numbers with commas between them, as in {option} {example}"
        ) from None


def _names(text: str, count: int) -> list[str]:
    from creepkit.errors import HistoryError

    names = [word.strip() for word in text.split(",") if word.strip()]
    if len(names) != count or len(set(names)) != count or any("/" in name or name.startswith(".") for name in names):
        raise HistoryError(
            f"--names {text}: give {count} different names with commas between them, one for each that is found"
        )
    return names


def _named_centers(texts: Sequence[str], names: str | None) -> dict[str, tuple[float, float]]:
    from creepkit.errors import HistoryError

    pairs = [_numbers(text, "--center", "12.5,-3") for text in texts]
    for pair, text in zip(pairs, texts, strict=True):
        if len(pair) != 2:
            raise HistoryError(f"--center {text}: write X,Y in mm, as in --center 12.5,-3")
    known = _names(names, len(pairs)) if names else [f"D{k + 1}" for k in range(len(pairs))]
    return {name: (pair[0], pair[1]) for name, pair in zip(known, pairs, strict=True)}


def _frame_range(text: str | None) -> slice | None:
    from creepkit.errors import HistoryError

    if text is None:
        return None
    first, _, last = text.partition("-")
    if not ((first + last).isascii() and first.isdecimal() and last.isdecimal() and int(first) <= int(last) < 10**9):
        raise HistoryError(
            f"--rest {text}: write the first and the last frame at rest, counted from 0, as in --rest 0-39"
        )
    return slice(int(first), int(last) + 1)
