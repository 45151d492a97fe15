"""`creepkit read`: measured files as they are understood and what looks wrong in them, or what a data set holds."""

from __future__ import annotations

import sys
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import creepkit as ck
from creepkit.cli.command_options import OutputPath
from creepkit.cli.shared import Json
from creepkit.errors import CreepkitError, HistoryError
from creepkit.options import Option
from creepkit.reports.terminal import print_json, tell, tell_written

if TYPE_CHECKING:
    from creepkit.records import History, InstrumentRecord


def command(
    files: Annotated[
        list[Path],
        typer.Argument(metavar="FILE...", help="Tables as text or .xlsx, folders, files of readers, or a data set."),
    ],
    *,
    reader: Annotated[str | None, Option(help="Reader of the files, or format of records.")] = None,
    ignore: Annotated[tuple[str, ...], Option(help="Columns that nobody needs.", example="load_kN,date")] = (),
    to: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Each test as CSV, in s, MPa, mm and K."), OutputPath("folder")
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the outputs over time."), OutputPath("picture")
    ] = None,
    ask: Annotated[
        bool, typer.Option("--ask", help="Put what is not clear as questions; answers are written into tests.toml.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Tests, conditions, units, what was assumed, and what is suspect.

    A record of an instrument is shown with its channels, units, gaps and clock.
    """
    from creepkit.quality import remark_flags
    from creepkit.readers.questions import merged
    from creepkit.records import Histories
    from creepkit.reports import histories as report

    if len(files) == 1 and files[0].suffix.lower() in (".h5", ".hdf5") and reader is None:
        _describe_data_set(files[0], as_json)
        return
    records = _records(files, reader)
    if records:
        _show_records(records, to, plot, as_json)
        return
    ignored = list(ignore)
    if ask:
        from creepkit.cli.asking import put_questions

        is_terminal = sys.stdin.isatty() and sys.stdout.isatty()
        read = partial(ck.read_histories, files, reader=reader, ignore=ignored)
        for path in put_questions(read, input if is_terminal else None):
            tell_written(path)
    found, unread = _readable_tests(files, reader, ignored)
    framed = [history for history in found if history.outputs]
    quality = ck.check_data_quality(framed)
    remarked = tuple(remark_flags([history for history in found if not history.outputs]))
    quality = replace(quality, flags=(*quality.flags, *remarked), tests=len(found if remarked else framed))
    if as_json:
        errors = {"not read": [str(error) for error in unread]} if unread else {}
        print_json({"tests": found, "quality": quality, **errors})
    else:
        without = len(found) - len(framed)
        counted = f"{without} test{'' if without == 1 else 's'} without a curve to check" if without else ""
        flags = str(quality) if framed or remarked else ""
        tell("\n".join(filter(None, (report.histories_text(found), counted, flags))))
    if to is not None:
        for path in _write(found, to):
            tell_written(path, err=as_json)
    if plot is not None:
        Histories(found).plot(plot)
        tell_written(plot, err=as_json)
    for error in merged(unread):
        tell(f"not read: {error}", err=True)
    if unread:
        raise typer.Exit(1)


def _describe_data_set(file: Path, as_json: bool) -> None:
    from creepkit.dataset.dataset import summary

    data = ck.read_dataset(file)
    if as_json:
        print_json(summary(data))
    else:
        tell(data)


def _readable_tests(
    files: list[Path], reader: str | None, ignored: list[str]
) -> tuple[list[History], list[CreepkitError]]:
    """All tests; where some file cannot be read those of the others, and the errors of these."""
    from creepkit.registry.reading import read_those_that_can_be

    try:
        return ck.read_histories(files, reader=reader, ignore=ignored), []
    except ck.errors.CreepkitError:
        _, tests, unread = read_those_that_can_be(files, reader, ignored)
        if not tests or not unread:
            raise
        return tests, unread


def _write(histories: list[History], folder: Path) -> list[Path]:
    """Write each history; what cannot stand in the name of a file becomes a line."""
    from creepkit.files.writing import check_folder_target, file_stem, made_from
    from creepkit.readers.history_csv import history_text
    from creepkit.reports.figures import make_folder

    stems = [file_stem(history.name, "test", signs=r"\w.+-", gap="_") for history in histories]
    distinct = len({stem.casefold() for stem in stems}) == len(stems)
    paths = [folder / (f"{stem}.csv" if distinct else f"{k}_{stem}.csv") for k, stem in enumerate(stems, 1)]
    check_folder_target(folder, HistoryError)
    for write in (False, True):  # an error of the last one must not leave the others written
        for history, path in zip(histories, paths, strict=True):
            with made_from(_source_file(history.source)):  # whose names must not choose those of another measurement
                check_folder_target(folder, HistoryError, (path.name,))
                history_text(history)
                if write:
                    make_folder(folder)
                    ck.write_history(history, path)
    return paths


def _source_file(source: str) -> str:
    """The file of a test: its source without what is said of the place in the file."""
    path = source
    while path and not Path(path).exists():
        path = path.rpartition(" (")[0]
    return path or source


def _records(files: list[Path], reader: str | None) -> list[InstrumentRecord]:
    """The records, where all files are records of instruments: a format names their columns, or they have clock times.

    Where a reader takes a table with clock times for tests, it is none.
    """
    from creepkit.instruments.record_tables import find_head
    from creepkit.registry import default_registry, kinds

    formats = default_registry().values(kinds.INSTRUMENTS)
    if reader is not None and reader in [one.name for one in formats]:
        return [ck.read_record(path, reader) for path in files]
    if reader is not None or not all(path.is_file() for path in files):
        return []
    with suppress(HistoryError):
        heads = [find_head(path) for path in files]
        if all(any(one.required and one.accepts(head.names) for one in formats) for head in heads):
            return [ck.read_record(path) for path in files]
        strains = ("strain", "dehnung", "déformation", "extens", "elong", "allong", "ext a", "ext 1", "weg 1")
        if not all(h.has_clock for h in heads) or any(s in n.lower() for h in heads for n in h.names for s in strains):
            return []
        try:
            ck.read_histories(files)
        except ck.errors.CreepkitError:
            return [ck.read_record(path) for path in files]
    return []


def _show_records(records: list[InstrumentRecord], to: Path | None, plot: Path | None, as_json: bool) -> None:
    """Print records, and draw the one there is."""
    if to is not None:
        raise HistoryError(f"--to writes tests, and {records[0].origin} is an instrument's record; leave --to away")
    if plot is not None and len(records) > 1:
        raise HistoryError(f"--plot draws one record, found {len(records)}; name one file")
    if as_json:
        print_json({"records": records})
    else:
        tell("\n".join(str(record) for record in records))
    if plot is not None:
        records[0].plot(plot)
        tell_written(plot, err=as_json)
