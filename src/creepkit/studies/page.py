"""The report of a study: its results as the contents of a page, with what is needed to repeat the study attached."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from creepkit.errors import CreepkitError, StudyError
from creepkit.files.reading import read_bytes
from creepkit.files.writing import write_bytes
from creepkit.reports.contents import Attachment, Provenance, ReportContents, ReportGroup
from creepkit.studies.documents import ResultFolder, key_of
from creepkit.studies.execution import StageRecord
from creepkit.studies.inputs import DATA_FILE, sha256_of
from creepkit.studies.lock import versions_of
from creepkit.studies.result import StudyResult
from creepkit.studies.study_file import StudyFile

if TYPE_CHECKING:
    from creepkit.jobs.shard_progress import ProgressCallback

CARRIED_FOLDER = "inputs"
"""Of the data files that a report carries."""


def write_page(
    file: StudyFile, result: StudyResult, folder: Path, kept: ResultFolder, progress: ProgressCallback | None
) -> StudyResult:
    """The result with its report written, unless the same one is there; one that cannot be is a stage that failed."""
    assert file.model.report is not None
    path, lock_path = folder / file.model.report.file, lock_path_of(file, folder)
    parts = [(one.name, one.state == "failed", one.key, one.sentence) for one in result.stages]
    exclusions = [(one.test, list(one.frames), one.reason) for one in result.exclusions]
    hashes = [[one.name, one.sha256] for one in result.files] + [["lock", sha256_of(lock_path)]]
    settings = [hashlib.sha256(file.text.encode()).hexdigest(), hashes, exclusions]
    key = key_of({"kind": "report", "settings": settings, "needs": parts, "versions": versions_of()})
    known = kept.load("report", key)
    if known is not None and path.is_file() and known == {"sha256": sha256_of(path)}:
        return replace(result, stages=(*result.stages, StageRecord("report", "report", "", "kept", key)), report=path)
    if progress is not None:
        progress("report", 0, 1, "")
    try:
        from creepkit.reports.html import report_html

        write_own(kept, path, report_html(contents_of(file, result, lock_path)))
    except CreepkitError as error:
        record = StageRecord("report", "report", "", "failed", key, " ".join(str(error).split()))
        return replace(result, stages=(*result.stages, record))
    kept.save("report", key, {"sha256": sha256_of(path)})
    if progress is not None:
        progress("report", 1, 1, str(path))
    return replace(result, stages=(*result.stages, StageRecord("report", "report", "", "made", key)), report=path)


def write_own(kept: ResultFolder, path: Path, text: str) -> None:
    """Write a file beside the study; StudyError for one that exists and that the study has not written.

    It is noted as the study's own before it is written, so that a process that dies in between leaves nothing foreign.
    """
    content = text.encode()
    foreign = path.exists() and path.name not in kept.outputs and not kept.overwrite
    if foreign and not (path.is_file() and sha256_of(path) == hashlib.sha256(content).hexdigest()):
        raise StudyError(
            f"{path}: exists, and this study has not written it; choose another name in the study file, or overwrite "
            "it by --force"
        )
    kept.add_output(path.name)
    write_bytes(content, path, StudyError)


def lock_path_of(file: StudyFile, folder: Path) -> Path:
    """The lock of a study: its name with another ending."""
    return folder / f"{file.path.stem}.lock"


def contents_of(file: StudyFile, result: StudyResult, lock_path: Path | None = None) -> ReportContents:
    """What the report of a study shows, and what it carries. lock_path : of the study.lock that it carries."""
    rankings: Mapping[str, Any] = result.rankings
    failed = {
        one.group: one.sentence for one in result.stages if one.kind == "identification" and one.state == "failed"
    }
    groups = tuple(
        ReportGroup(group.name, rankings.get(group.name), group.histories, failed.get(group.name, ""))
        for group in result.groups
    )
    attached, notes = attachments_of(file, result, lock_path)
    return ReportContents(
        title=result.title,
        groups=groups,
        quality=result.quality,
        exclusions=result.exclusions,
        temperature=_titled(result.temperature),
        forecasts=dict(result.forecasts),
        design=_titled(result.designs),
        rupture=_titled(result.rupture),
        exports=result.exports,
        failures=result.failures,
        provenance=Provenance(
            versions=versions_of(),
            seed=file.model.study.seed,
            settings=file.model.model_dump(exclude_none=True),
            inputs={one.name: one.sha256 for one in result.files},
            commands=(f"creepkit run {file.path.name}",),
        ),
        attachments=attached,
        notes=notes,
    )


def _titled(by_group: Mapping[str, Any]) -> dict[str, Any]:
    return {name or "all tests": value for name, value in by_group.items()}


def attachments_of(
    file: StudyFile, result: StudyResult, lock_path: Path | None
) -> tuple[tuple[Attachment, ...], tuple[str, ...]]:
    """Study, lock and data files; without the data, and a note, where they are larger than the study allows."""
    assert file.model.report is not None
    attached = [Attachment("study.toml", file.text.encode())]
    if lock_path is not None:
        attached.append(Attachment("study.lock", read_bytes(lock_path, DATA_FILE)))
    allowed = file.model.report.attach_MB * 1e6
    size = sum(one.path.stat().st_size for one in result.files)
    if size > allowed:
        note = (
            f"the data files have {size / 1e6:.3g} MB, more than the {allowed / 1e6:g} MB that the study lets the "
            "report carry; study.lock has their hashes"
        )
        return tuple(attached), (note,)
    for one in result.files:
        attached.append(Attachment(f"{CARRIED_FOLDER}/{one.name}", read_bytes(one.path, DATA_FILE)))
    return tuple(attached), ()
