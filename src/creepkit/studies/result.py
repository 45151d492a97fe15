"""StudyResult: what a run of a study gave, as the ordinary records of every stage, and what its report shows of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from creepkit.checked_arguments import checked
from creepkit.files.json_documents import json_text
from creepkit.files.reading import read_bytes
from creepkit.files.writing import hashed_stem
from creepkit.reports.attachments import problem_of_names
from creepkit.reports.contents import (
    Attachment,
    Exclusion,
    ExportedFile,
    ReportContents,
    ReportGroup,
    ReportProvenance,
    StageFailure,
    identified_files,
    versions_of,
)
from creepkit.studies.execution import StageRecord
from creepkit.studies.inputs import DATA_FILE, InputFile, StudyInputs, TestGroup
from creepkit.studies.study_file import StudyFile
from creepkit.studies.tables import ReportTable

CARRIED_FOLDER = "inputs"
"""Of the data files that a report carries."""


PACKAGES = ("creepkit", "numpy", "scipy", "sympy", "torch", "llvmlite", "pydantic")
"""Whose versions a report states."""


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

    file : the study. inputs : its tests. files : that were read. exclusions : what was left out. stages : how each
    ended, and results : {stage: its result}. report : the page, where one was asked for. folder : of `identified`.
    extractions, imposed : {test of a camera: what its frames gave, and what its instrument recorded}.
    documents : {stage: its result as JSON-able data, which other commands read}.
    """

    file: StudyFile
    inputs: StudyInputs
    files: tuple[InputFile, ...]
    exclusions: tuple[Exclusion, ...]
    stages: tuple[StageRecord, ...]
    report: Path | None = None
    folder: Path | None = None
    results: Any = field(default_factory=dict, repr=False)
    extractions: Mapping[str, Extraction] = field(default_factory=dict, repr=False)
    imposed: Mapping[str, Imposed] = field(default_factory=dict, repr=False)
    documents: Mapping[str, Any] = field(default_factory=dict, repr=False)

    def __repr__(self) -> str:
        """Title, how many tests, how stages ended, and where the report is; `creepkit run` prints what was found."""
        states = ", ".join(f"{count} {state}" for state, count in Counter(one.state for one in self.stages).items())
        tests = f"{len(self.histories)} tests; stages: {states or 'none'}"
        return f"StudyResult '{self.title}': {tests}; report: {self.report or 'none'}"

    def _repr_html_(self) -> str:
        """For notebooks: the answers, as its report has them."""
        from creepkit.reports.html.notebook import notebook_html

        return notebook_html(self.report_contents())

    @property
    def title(self) -> str:
        """Of the study."""
        return self.file.model.study.title

    @property
    def groups(self) -> tuple[TestGroup, ...]:
        """The tests that were used; "" names the only group."""
        return self.inputs.groups

    @property
    def measured(self) -> tuple[History, ...]:
        """All tests as the files hold them."""
        return self.inputs.measured

    @property
    def histories(self) -> tuple[History, ...]:
        """The tests that were used."""
        return self.inputs.histories

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
        return {one.name.removeprefix("forecast of "): self.results[one.name] for one in self._with_result("forecast")}

    @property
    def forecast_groups(self) -> dict[str, str]:
        """{name of a forecast: group whose law forecasts}."""
        return {one.name.removeprefix("forecast of "): one.group for one in self._with_result("forecast")}

    @property
    def exports(self) -> tuple[ExportedFile, ...]:
        """Laws as text."""
        return tuple(self.results[one.name] for one in self._with_result("export"))

    @property
    def identified(self) -> tuple[ExportedFile, ...]:
        """Identifications, rankings and temperature laws as the files that other commands read."""
        documents = ((hashed_stem(stage), data) for stage, data in self.documents.items() if data is not None)
        laws = [ExportedFile(f"{name}.json", "temperature law", json_text(data)) for name, data in documents]
        return (*identified_files(self.rankings), *laws)

    def _with_result(self, kind: str) -> list[StageRecord]:
        return [one for one in self.stages if one.kind == kind and one.name in self.results]

    def _by_group(self, kind: str) -> dict[str, Any]:
        return {one.group: self.results[one.name] for one in self._with_result(kind)}

    def report_contents(self) -> ReportContents:
        """What the report of the study shows, and what it carries."""
        model, failed = self.file.model, [one for one in self.stages if one.state == "failed"]
        failures = {one.group: one.sentence for one in failed if one.kind == "identification"}
        rankings: Mapping[str, Any] = self.rankings
        attached, notes = self._attachments()
        notes += [f"{one.name} {one.sentence}" for one in self.stages if one.state == "left out"]
        carried = self.identified
        if sum(len(one.text) for one in carried) > MOST_IDENTIFIED:
            folder, carried = f"{self.file.path.stem}.results/identified", ()
            notes.append(f"the identifications are too large for this page; 'creepkit run' writes them to {folder}")
        return ReportContents(
            title=self.title,
            groups=tuple(
                ReportGroup(one.name, rankings.get(one.name), one.histories, failures.get(one.name, ""))
                for one in self.groups
            ),
            quality=self.quality,
            exclusions=self.exclusions,
            temperature=_titled(self.temperature),
            forecasts=dict(self.forecasts),
            forecast_groups=self.forecast_groups,
            design=_titled(self.designs),
            rupture=_titled(self.rupture),
            extractions=self.extractions,
            imposed=self.imposed,
            exports=(*self.exports, *carried),
            failures=self.failures,
            provenance=ReportProvenance(
                versions=versions_of(PACKAGES),
                seed=model.study.seed,
                settings=model.model_dump(exclude_none=True),
                inputs={one.name: one.sha256 for one in self.files},
                commands=(f"creepkit run {self.file.path.name}",),
            ),
            attachments=tuple(attached),
            notes=tuple(notes),
            data_citations=tuple(model.data.citation),
        )

    def _attachments(self) -> tuple[list[Attachment], list[str]]:
        """Study and data files; without the data, and a note, where they are larger than the study allows."""
        attached = [Attachment("study.toml", self.file.text.encode())]
        allowed = (self.file.model.report or ReportTable()).attach_MB
        names = [f"{CARRIED_FOLDER}/{one.name}" for one in self.files]
        size = sum(one.path.stat().st_size for one in self.files) / 1e6
        problem = problem_of_names(names)
        if not problem and size > allowed:
            problem = f"they have {size:.3g} MB, more than the {allowed:g} MB that the study lets it carry"
        if problem:
            return attached, [f"the report does not carry the data files: {problem}; it lists their hashes"]
        contents = [read_bytes(one.path, DATA_FILE) for one in self.files]
        return [*attached, *(Attachment(*pair) for pair in zip(names, contents, strict=True))], []


def _titled(by_group: Mapping[str, Any]) -> dict[str, Any]:
    return {name or "all tests": value for name, value in by_group.items()}
