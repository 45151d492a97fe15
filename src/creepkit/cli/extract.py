"""`creepkit extract`: from the frames of a camera to measured histories with their noise."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from creepkit.cli.command_options import OutputPath
from creepkit.cli.shared import PAPER_SPECIMEN
from creepkit.errors import HistoryError
from creepkit.extraction.options import ExtractionOptions, ImposedOptions
from creepkit.options import Option
from creepkit.reports.terminal import ProgressBar, tell, tell_written

if TYPE_CHECKING:
    from creepkit.extraction import Extraction
    from creepkit.records import History, InstrumentRecord


def command(
    frames: Annotated[str, typer.Argument(metavar="FOLDER", help="Folder, file or pattern of a camera's exports.")],
    *,
    specimen: Annotated[str, Option(help="What the camera watched.")] = PAPER_SPECIMEN,
    options: Annotated[dict[str, Any], ExtractionOptions],
    conditions: Annotated[dict[str, Any], ImposedOptions],
    to: Annotated[Path | None, typer.Option(help="Folder: a history of each."), OutputPath("folder")] = None,
    plot: Annotated[Path | None, typer.Option(help="Contact sheet, .png, .svg or .pdf."), OutputPath("picture")] = None,
) -> None:
    """What was imposed is in an instrument's record, or constant; without it, histories cannot be written."""
    import creepkit as ck
    from creepkit.api.extraction import extract_as_described, operator_of
    from creepkit.files.writing import check_folder_target, check_target, made_from

    said, under = ExtractionOptions().changed(options), ImposedOptions().changed(conditions)
    if to is not None and under.record is None and (under.load is None or under.temperature is None):
        raise HistoryError(
            "a history needs what was imposed: give --record FILE, or --load-mpa and --temperature-c, beside --to"
        )
    recorded = None
    if under.record is not None:  # before the frames, which take longer
        recorded = ck.read_record(
            under.record,
            time_zone=under.time_zone,
            date_order=under.date_order,
            pressure_reference=under.pressure_reference or "",
        )
    operator = operator_of(specimen, said)
    if said.names and (len(set(said.names)) != len(said.names) or any("/" in n or n[:1] == "." for n in said.names)):
        raise HistoryError(f"--names {','.join(said.names)}: give different names, without a folder in them")
    if said.names and said.centers and len(said.names) != len(said.centers):
        raise HistoryError(f"--names {','.join(said.names)}: give {len(said.centers)} names, one for each --center")
    if any(len(center) != 2 for center in said.centers):
        raise HistoryError(f"--center {','.join(map(str, said.centers[0]))}: write X,Y in mm, as in --center 12.5,-3")
    _ = said.frames_at_rest  # which says what is wrong with its text, before frames are read
    if said.columns is not None and said.format is not None:
        raise HistoryError("--columns and --format were given: named columns are of no known format; leave one out")
    if said.interval is not None and said.times is not None:
        raise HistoryError("--interval-s and --times were given; leave one of them out")
    read = ck.read_frames(frames, said.format if said.columns is None else dict(said.columns), said.times)
    with ProgressBar() as progress:
        found = extract_as_described(read, specimen, said, operator, progress.tick)
    for one in found:
        tell(one)
    sheets = [plot if len(found) == 1 else plot.with_stem(f"{plot.stem}_{one.name}") for one in found] if plot else []
    for path in sheets:
        check_target(path, HistoryError)
    files = [to / f"{one.name}.csv" for one in found] if to is not None else []
    with made_from(frames):  # names such as D1 are the same for many recordings
        if to is not None:
            check_folder_target(to, HistoryError, tuple(path.name for path in files))
        histories = [_history(one, recorded, under) for one in found] if to is not None else []
        for one, path in zip(found, sheets, strict=False):
            one.plot(path)
            tell_written(path)
        for history, path in zip(histories, files, strict=False):
            path.parent.mkdir(parents=True, exist_ok=True)
            ck.write_history(history, path)
            tell_written(path)


def _history(one: Extraction, recorded: InstrumentRecord | None, under: ImposedOptions) -> History:
    """The history under what an instrument recorded, after the clocks were aligned, or under constants."""
    import creepkit as ck
    from creepkit.api.extraction import history_of, imposed_on

    if recorded is None:
        assert under.load is not None
        assert under.temperature is not None
        history = one.history_under(under.load, under.temperature)
    else:
        if under.channels and len(under.channels) != 2:
            raise HistoryError(f"--channels {','.join(under.channels)}: name two channels of the record, P1,T1")
        imposed = imposed_on(one, recorded, under.channels or None)
        tell(f"  {one.name}: {imposed.alignment}")
        for note in imposed.notes:
            tell(f"  {note}")
        history = history_of(one, imposed)
    return history if under.modulus is None else history.replace(elastic=ck.Elastic(E=under.modulus))
