"""`creepkit init`: a commented study file for the data of a folder."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from creepkit.cli.command_options import OutputPath
from creepkit.reports.terminal import tell, tell_written


def command(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder of measured files.")],
    to: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The study file; by default study.toml in the folder."),
        OutputPath(),
    ] = None,
    reader: Annotated[str | None, typer.Option(help="Reader of the files; by default what accepts them.")] = None,
) -> None:
    """The files are read as 'creepkit read' reads them; candidate laws and stages follow from what the tests hold."""
    from creepkit.errors import StudyError
    from creepkit.files.writing import check_target, write_text
    from creepkit.studies.camera_proposal import ALLOYS_FILE
    from creepkit.studies.proposal import propose_study

    if not folder.is_dir():
        what = f"{folder} is a file" if folder.is_file() else f"there is no folder {folder}"
        raise StudyError(f"{what}; name the folder of your measured files")
    path = folder / "study.toml" if to is None else to
    check_target(path, StudyError)
    proposal = propose_study(folder, path, reader)
    table = path.parent / ALLOYS_FILE
    if proposal.alloys:
        write_text(proposal.alloys, table, StudyError)
    write_text(proposal.text, path, StudyError)
    for line in proposal.summary:
        tell(line)
    if proposal.alloys:
        tell_written(table, "; fill in alloy and modulus of each test piece")
    tell_written(path, f"; look through it, then: creepkit run {path}")
