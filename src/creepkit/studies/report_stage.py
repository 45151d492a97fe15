"""The report of a study: its results as the contents of a page, with what is needed to repeat the study attached."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from creepkit.errors import CreepkitError, StudyError
from creepkit.files.writing import check_target, is_listed, write_text
from creepkit.reports.attachments import read_attachments
from creepkit.studies.documents import ResultFolder, key_of
from creepkit.studies.execution import StageRecord
from creepkit.studies.inputs import sha256_of
from creepkit.studies.lock import versions_of
from creepkit.studies.result import StudyResult
from creepkit.studies.study_file import StudyFile

if TYPE_CHECKING:
    from creepkit.jobs.shard_progress import ProgressCallback


def write_page(
    file: StudyFile, result: StudyResult, folder: Path, kept: ResultFolder, progress: ProgressCallback | None
) -> StudyResult:
    """The result with its report written, unless the same one is there; one that cannot be is a stage that failed."""
    assert file.model.report is not None
    path, lock_path = folder / file.model.report.file, lock_path_of(file, folder)
    parts = [(one.name, one.state == "failed", one.key, one.sha256, _shown_sentence(one)) for one in result.stages]
    exclusions = [(one.test, list(one.frames), one.reason) for one in result.exclusions]
    hashes = [[one.name, one.sha256] for one in result.files] + [["lock", sha256_of(lock_path)]]
    settings = [hashlib.sha256(file.text.encode()).hexdigest(), hashes, exclusions]
    key = key_of({"kind": "report", "settings": settings, "needs": parts, "versions": versions_of()})
    known = kept.load("report", key)
    if known is not None and _is_known(path, known):
        return replace(result, stages=(*result.stages, StageRecord("report", "report", "", "kept", key)), report=path)
    if progress is not None:
        progress("report", 0, 1, "")
    try:
        from creepkit.reports.html import report_html

        write_own(kept, path, report_html(result.report_contents()), own=_is_report_of(path, file.text))
    except Exception as error:  # what was found is there without a page
        what = str(error) if isinstance(error, CreepkitError) else f"{type(error).__name__}: {error}"
        record = StageRecord("report", "report", "", "failed", key, " ".join(what.split()))
        return replace(result, stages=(*result.stages, record))
    kept.save("report", key, {"sha256": sha256_of(path)})
    if progress is not None:
        progress("report", 1, 1, str(path))
    return replace(result, stages=(*result.stages, StageRecord("report", "report", "", "made", key)), report=path)


def _is_known(path: Path, known: object) -> bool:
    """Whether a file is the report that was written; not one that cannot be read or is larger than any."""
    try:
        return path.is_file() and known == {"sha256": sha256_of(path)}
    except StudyError:
        return False


def _shown_sentence(record: StageRecord) -> str:
    """What a page says of a stage; how a sound result came about it does not."""
    return record.sentence if record.state in ("failed", "left out") else ""


def write_own(kept: ResultFolder, path: Path, text: str, *, own: bool = False) -> None:
    """Write a file beside the study; StudyError for one that creepkit has not written as it is.

    own : what is there is known to be the study's, whatever the list of written files says.
    """
    force = own or kept.overwrite
    check_target(path, StudyError, force=force)
    kept.add_output(path.name)  # before it is written: the next run must not take it for data
    write_text(text, path, StudyError, force=force)


def _is_report_of(path: Path, text: str) -> bool:
    """Whether a file is a report that carries this study file, where the list of what was written is lost."""
    try:
        return path.is_file() and not is_listed(path) and read_attachments(path).get("study.toml") == text.encode()
    except CreepkitError:
        return False


def lock_path_of(file: StudyFile, folder: Path) -> Path:
    """The lock of a study: its name with another ending."""
    return folder / f"{file.path.stem}.lock"
