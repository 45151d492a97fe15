"""StudyResult: what a run of a study gave, as the ordinary records of every stage."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from creepkit.checked_arguments import checked
from creepkit.files.reading import read_bytes
from creepkit.reports.attachments import problem_of_names
from creepkit.reports.contents import (
    Attachment,
    Exclusion,
    ExportedFile,
    ReportContents,
    ReportGroup,
    ReportProvenance,
    StageFailure,
)
from creepkit.reports.identified_files import identified_files
from creepkit.studies.execution import StageRecord
from creepkit.studies.inputs import DATA_FILE, InputFile, TestGroup
from creepkit.studies.lock import versions_of
from creepkit.studies.model import ReportPart
from creepkit.studies.study_file import StudyFile

CARRIED_FOLDER = "inputs"
"""Of the data files that a report carries."""


MOST_VERDICTS, LONGEST_LINE = 5, 300
"""Verdicts, and characters of a line, of a result that is printed."""


MOST_IDENTIFIED = 1_000_000
"""Characters of identifications that a report carries."""


if TYPE_CHECKING:
    from creepkit.discovery.discover import TemperatureStudy
    from creepkit.experiments.planned_design import Design
    from creepkit.extraction.extraction import Extraction
    from creepkit.forecasts.forecast import Forecast
    from creepkit.instruments.imposed import Imposed
    from creepkit.inverse.selection.ranking import Ranking
    from creepkit.quality import DataQuality
    from creepkit.records import History
    from creepkit.rupture_assessment.assessment import RuptureAssessment


@checked
@dataclass(frozen=True, repr=False)
class StudyResult:
    """What a run of a study gave: ordinary records, by group of tests or by name.

    title : of the study. groups : of the tests that were used; "" names the only one. exclusions : what was left out.
    stages : how each ended. exports : laws as text. report : the page, where one was asked for.
    changes : what differs from the study.lock that was there, one sentence each. files : that were read.
    measured : all tests as the files hold them. file, lock_path : the study, and the lock of this run.
    asked : keys of the identifications that the stages rest on. pruned : how many others were removed.
    extractions, imposed : {test of a camera: what its frames gave, and what its instrument recorded}.
    documents : {stage: its result as JSON-able data, which other commands read}.
    """

    title: str
    groups: tuple[TestGroup, ...]
    exclusions: tuple[Exclusion, ...]
    stages: tuple[StageRecord, ...]
    files: tuple[InputFile, ...]
    changes: tuple[str, ...] = ()
    report: Path | None = None
    measured: tuple[History, ...] = ()
    results: Any = field(default_factory=dict, repr=False)
    file: StudyFile | None = field(default=None, repr=False)
    lock_path: Path | None = None
    asked: frozenset[str] = field(default=frozenset(), repr=False)
    pruned: int = 0
    extractions: Mapping[str, Extraction] = field(default_factory=dict, repr=False)
    imposed: Mapping[str, Imposed] = field(default_factory=dict, repr=False)
    documents: Mapping[str, Any] = field(default_factory=dict, repr=False)

    def __repr__(self) -> str:
        """Stages by their states, the verdict on each group, and where the report is."""
        states = Counter(one.state for one in self.stages)
        counted = ", ".join(f"{count} {state}" for state, count in states.items()) or "none"
        lines = [f"StudyResult '{self.title}': {len(self.histories)} tests; stages: {counted}"]
        verdicts = [f"{name}: {one.verdict}" if name else one.verdict for name, one in self.rankings.items()]
        lines += [
            *verdicts[:MOST_VERDICTS],
            *([f"and {len(verdicts) - MOST_VERDICTS} more groups"] if len(verdicts) > MOST_VERDICTS else []),
        ]
        lines += [f"failed: {one.stage}: {one.sentence}" for one in self.failures]
        lines.append(f"report: {self.report or 'none'}")
        return "\n  ".join(line if len(line) <= LONGEST_LINE else f"{line[: LONGEST_LINE - 1]}…" for line in lines)

    @property
    def histories(self) -> tuple[History, ...]:
        """The tests that were used."""
        return tuple(history for group in self.groups for history in group.histories)

    @property
    def failures(self) -> tuple[StageFailure, ...]:
        """Stages that failed, each with a sentence."""
        return tuple(StageFailure(one.name, one.sentence) for one in self.stages if one.state == "failed")

    @property
    def quality(self) -> DataQuality | None:
        """What is suspect in the tests; None where it was not checked."""
        return next(iter(self._by_group("quality").values()), None)

    @property
    def rankings(self) -> Mapping[str, Ranking]:
        """{group: its laws}."""
        return self._by_group("identification")

    @property
    def temperature(self) -> Mapping[str, TemperatureStudy]:
        """{group: forms of temperature of its law}."""
        return self._by_group("temperature")

    @property
    def rupture(self) -> Mapping[str, RuptureAssessment]:
        """{group: assessment of its rupture tests}."""
        return self._by_group("rupture")

    @property
    def designs(self) -> Mapping[str, Design]:
        """{group: further tests}."""
        return self._by_group("design")

    @property
    def forecasts(self) -> Mapping[str, Forecast]:
        """{name of a forecast: what its tests will show}."""
        names = self._names("forecast")
        return {name.removeprefix("forecast of "): self.results[name] for name, _ in names}

    @property
    def exports(self) -> tuple[ExportedFile, ...]:
        """Laws as text."""
        return tuple(self.results[name] for name, _ in self._names("export"))

    @cached_property
    def identified(self) -> tuple[ExportedFile, ...]:
        """Identifications, rankings and temperature laws as the files that other commands read."""
        from creepkit.files.file_names import hashed_stem
        from creepkit.files.json_documents import json_text

        documents = ((hashed_stem(stage), data) for stage, data in self.documents.items() if data is not None)
        laws = [ExportedFile(f"{name}.json", "temperature law", json_text(data)) for name, data in documents]
        return (*identified_files(self.rankings), *laws)

    def _names(self, kind: str) -> list[tuple[str, str]]:
        return [(one.name, one.group) for one in self.stages if one.kind == kind and one.name in self.results]

    def _by_group(self, kind: str) -> dict[str, Any]:
        return {group: self.results[name] for name, group in self._names(kind)}

    def report_contents(self) -> ReportContents:
        """What the report of the study shows, and what it carries."""
        return contents_of(self)


def contents_of(result: StudyResult) -> ReportContents:
    """What the report of a study shows, and what it carries."""
    file = result.file
    assert file is not None
    rankings: Mapping[str, Any] = result.rankings
    failed = {
        one.group: one.sentence for one in result.stages if one.kind == "identification" and one.state == "failed"
    }
    groups = tuple(
        ReportGroup(group.name, rankings.get(group.name), group.histories, failed.get(group.name, ""))
        for group in result.groups
    )
    attached, notes = attachments_of(result)
    notes = (*notes, *(f"{one.name} {one.sentence}" for one in result.stages if one.state == "left out"))
    carried = result.identified
    if sum(len(one.text) for one in carried) > MOST_IDENTIFIED:
        carried, folder = (), f"{file.path.stem}.results/identified"
        notes = (*notes, f"the identifications are too large for this page; 'creepkit run' writes them to {folder}")
    return ReportContents(
        title=result.title,
        groups=groups,
        quality=result.quality,
        exclusions=result.exclusions,
        temperature=_titled(result.temperature),
        forecasts=dict(result.forecasts),
        design=_titled(result.designs),
        rupture=_titled(result.rupture),
        extractions=result.extractions,
        imposed=result.imposed,
        exports=(*result.exports, *carried),
        failures=result.failures,
        provenance=ReportProvenance(
            versions=versions_of(),
            seed=file.model.study.seed,
            settings=file.model.model_dump(exclude_none=True),
            inputs={one.name: one.sha256 for one in result.files},
            commands=(f"creepkit run {file.path.name}",),
        ),
        attachments=attached,
        notes=notes,
        data_citations=tuple(file.model.data.citation),
    )


def _titled(by_group: Mapping[str, Any]) -> dict[str, Any]:
    return {name or "all tests": value for name, value in by_group.items()}


def attachments_of(result: StudyResult) -> tuple[tuple[Attachment, ...], tuple[str, ...]]:
    """Study, lock and data files; without the data, and a note, where they are larger than the study allows."""
    file = result.file
    assert file is not None
    attached = [Attachment("study.toml", file.text.encode())]
    if result.lock_path is not None:
        attached.append(Attachment("study.lock", read_bytes(result.lock_path, DATA_FILE)))
    allowed = (file.model.report or ReportPart()).attach_MB * 1e6
    names = [f"{CARRIED_FOLDER}/{one.name}" for one in result.files]
    odd = problem_of_names(names)
    if odd:
        note = f"the report does not carry the data files, for {odd}; study.lock has their hashes"
        return tuple(attached), (note,)
    size = sum(one.path.stat().st_size for one in result.files)
    if size > allowed:
        note = (
            f"the data files have {size / 1e6:.3g} MB, more than the {allowed / 1e6:g} MB that the study lets the "
            "report carry; study.lock has their hashes"
        )
        return tuple(attached), (note,)
    for name, one in zip(names, result.files, strict=True):
        attached.append(Attachment(name, read_bytes(one.path, DATA_FILE)))
    return tuple(attached), ()
