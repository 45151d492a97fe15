"""`creepkit read`: measured files as they are understood, and as files of creepkit's own."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from creepkit.report.terminal import print_json

if TYPE_CHECKING:
    from creepkit.records import History


def command(
    files: Annotated[
        list[Path], typer.Argument(metavar="FILE...", help="Tables as text or .xlsx, folders, or any file of a reader.")
    ],
    reader: Annotated[
        str | None, typer.Option(help="Reader of the files; by default the one that accepts them.")
    ] = None,
    ignore: Annotated[
        str | None, typer.Option(metavar="A,B", help="Columns that nobody needs, such as load_kN,date.")
    ] = None,
    to: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Write each test there as CSV, in s, MPa, mm and K.")
    ] = None,
    plot: Annotated[Path | None, typer.Option(metavar="FILE", help="Draw the outputs over time.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Show what measured files are understood to hold: tests, conditions, units, and what was assumed."""
    import creepkit as ck
    from creepkit.readers.table_summary import summarise_tables
    from creepkit.report import histories as report
    from creepkit.report.data_quality import data_quality_to_json
    from creepkit.report.figures import check_figure_target

    if plot is not None:
        check_figure_target(plot, ck.errors.HistoryError)
    ignored = [name.strip() for name in (ignore or "").split(",") if name.strip()]
    found = ck.read_histories(files, reader=reader, ignore=ignored)
    general = {str(path) for path in files if path.is_file() and reader in (None, "csv", "xlsx")}
    sources = {history.source.partition(" (")[0] for history in found}
    tables = [table for path in sorted(general & sources) for table in summarise_tables(Path(path), ignored)]
    framed = [history for history in found if history.outputs]
    quality = ck.check_data_quality(framed)
    if as_json:
        print_json({**report.histories_to_json(found, tables), "quality": data_quality_to_json(quality)})
    else:
        without = len(found) - len(framed)
        counted = f"{without} test{'' if without == 1 else 's'} without frames" if without else ""
        checked = str(quality) if framed else ""
        parts = (report.tables_text(tables), report.histories_text(found), counted, checked)
        typer.echo("\n".join(part for part in parts if part))
    if to is not None:
        for path in _write(found, to):
            typer.echo(f"wrote {path}", err=as_json)
    if plot is not None:
        report.histories_figure(found, plot)
        typer.echo(f"wrote {plot}", err=as_json)


def _write(histories: list[History], folder: Path) -> list[Path]:
    """Write each history; what cannot stand in the name of a file becomes a line."""
    import creepkit as ck
    from creepkit.readers.history_csv import history_text
    from creepkit.report.figures import make_folder

    names = [re.sub(r"[^\w.+-]+", "_", history.name).strip(".") or "test" for history in histories]
    if len(set(names)) < len(names):
        names = [f"{number}_{name}" for number, name in enumerate(names, 1)]
    for history in histories:
        history_text(history)  # an error of the last one must not leave the others written
    make_folder(folder, ck.errors.HistoryError)
    return [ck.write_history(h, folder / f"{name}.csv") for h, name in zip(histories, names, strict=True)]
