"""From a report back to its study: the files that it carries are written to a folder, in which the study runs again."""

from __future__ import annotations

from pathlib import Path

from creepkit.errors import StudyError
from creepkit.files.reading import read_bytes
from creepkit.files.writing import write_bytes
from creepkit.reports.attachments import read_attachments
from creepkit.studies.inputs import DATA_FILE
from creepkit.studies.result import CARRIED_FOLDER
from creepkit.studies.study import Study

STUDY_NAME, LOCK_NAME, INPUTS = "study.toml", "study.lock", f"{CARRIED_FOLDER}/"


def study_of_report(report: Path, folder: Path) -> Study:
    """Write what a report carries to a folder, and read its study; files that are there already must be the same.

    The lock of the report is written where none is there, so that a run says what differs from the report's.
    """
    files = read_attachments(report)
    if STUDY_NAME not in files:
        raise StudyError(f"{report}: carries no {STUDY_NAME}; give a report that 'creepkit run study.toml' wrote")
    for name in files:
        if name not in (STUDY_NAME, LOCK_NAME) and not name.startswith(INPUTS):
            raise StudyError(
                f"{report}: carries '{name}', and a report carries {STUDY_NAME}, {LOCK_NAME} and data below {INPUTS} "
                "alone; use the report as creepkit wrote it"
            )
    for name, content in files.items():
        path = folder / name
        if path.exists() and name != LOCK_NAME and read_bytes(path, DATA_FILE) != content:
            raise StudyError(f"{path}: is there already, and differs from what {report} carries; give --to FOLDER")
        if not path.exists():
            try:
                path.parent.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                what = f"cannot be made ({error.strerror}); name another folder by --to"
                raise StudyError(f"{path.parent}: {what}") from None
            write_bytes(content, path, StudyError)
    inputs = folder / CARRIED_FOLDER
    if not inputs.is_dir():
        raise StudyError(
            f"{report}: carries hashes of its data alone; the study is in {folder / STUDY_NAME}: "
            f"put the files that {folder / LOCK_NAME} names into {inputs}, and run the report again"
        )
    return Study.load(folder / STUDY_NAME, root=inputs)
