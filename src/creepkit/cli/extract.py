"""`creepkit extract`: from the frames of a camera to measured histories with their noise."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import creepkit as ck
from creepkit.cli.command_options import OutputPath
from creepkit.cli.shared import PAPER_SPECIMEN
from creepkit.errors import HistoryError
from creepkit.extraction.options import ClockOptions, ExtractionOptions, ImposedOptions
from creepkit.instruments.reading_options import RecordOptions
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
    recording: Annotated[dict[str, Any], RecordOptions],
    clocks: Annotated[dict[str, Any], ClockOptions],
    to: Annotated[Path | None, typer.Option(help="Folder: a history of each."), OutputPath("folder")] = None,
    plot: Annotated[Path | None, typer.Option(help="Contact sheet, .png, .svg or .pdf."), OutputPath("picture")] = None,
) -> None:
    """What was imposed is in an instrument's record, or constant; without it, histories cannot be written."""
    from creepkit.api.extraction import extract_as_described, operator_of
    from creepkit.files.writing import check_folder_target, check_target, made_from

    said, under = ExtractionOptions().changed(options), ImposedOptions().changed(conditions)
    known = ClockOptions().changed(clocks)
    if under.record is None and (clocks or recording):
        name = next(iter({**clocks, **recording})).replace("_", "-")
        raise HistoryError(f"--{name} says something of a record; give --record FILE")
    _ = known.bounds, known.start  # which say what is wrong with them, before frames are read
    if to is not None and under.record is None and (under.load is None or under.temperature is None):
        raise HistoryError(
            "a history needs what was imposed: give --record FILE, or --load-mpa and --temperature-c, beside --to"
        )
    recorded = None
    if under.record is not None:  # before the frames, which take longer
        recorded = ck.read_record(under.record, **recording)
    said.check()
    operator = operator_of(specimen, said)
    read = ck.read_frames(frames, said.format if said.columns is None else dict(said.columns), said.times)
    failed: dict[str, str] = {}
    with ProgressBar() as progress:
        found = extract_as_described(read, specimen, said, operator, progress.tick, failed)
    for one in found:
        tell(one)
    sheets = [plot if len(found) == 1 else plot.with_stem(f"{plot.stem}_{one.name}") for one in found] if plot else []
    for path in sheets:
        check_target(path, HistoryError)
    with made_from(frames):  # names such as D1 are the same for many recordings
        if to is not None:
            check_folder_target(to, HistoryError, tuple(f"{one.name}.csv" for one in found))
        for one, path in zip(found, sheets, strict=False):
            one.plot(path)
            tell_written(path)
        histories = _histories(found, recorded, under, known, failed, numbered=not said.names) if to is not None else {}
        for name, history in histories.items():
            assert to is not None
            to.mkdir(parents=True, exist_ok=True)
            ck.write_history(history, to / f"{name}.csv")
            tell_written(to / f"{name}.csv")
    if failed:
        raise HistoryError("; ".join(f"{name}: {reason}" for name, reason in failed.items()))


def _histories(
    found: Sequence[Extraction],
    recorded: InstrumentRecord | None,
    under: ImposedOptions,
    clock: ClockOptions,
    failed: dict[str, str],
    *,
    numbered: bool,
) -> dict[str, History]:
    """Histories under what an instrument recorded, after the clocks were aligned, or under constants."""
    from creepkit.api.extraction import ImposedChannels, history_of, imposed_on

    if recorded is None:
        assert under.load is not None
        assert under.temperature is not None
        histories = {one.name: one.history_under(under.load, under.temperature) for one in found}
    else:
        known = ImposedChannels({"": under.channels} if under.channels else {}, numbered=numbered)
        imposed = imposed_on(found, recorded, known, clock, failed)
        by_name = {one.name: one for one in found}
        histories = {one.specimen: history_of(by_name[one.specimen], one) for one in imposed}
        for under_record in imposed[:1]:
            tell(f"  {under_record.alignment}")
        for text in [f"{one.specimen}: {note}" for one in imposed for note in one.notes]:
            tell(f"  {text}")
    elastic = None if under.modulus is None else ck.Elastic(E=under.modulus)
    return {name: one if elastic is None else one.replace(elastic=elastic) for name, one in histories.items()}
