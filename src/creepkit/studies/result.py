"""StudyResult: what a run of a study gave, as the ordinary records of every stage."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from creepkit.reports.contents import Exclusion, ExportedFile, StageFailure
from creepkit.studies.execution import StageRecord
from creepkit.studies.inputs import InputFile, TestGroup

if TYPE_CHECKING:
    from creepkit.discovery.discover import TemperatureStudy
    from creepkit.experiments.planned_design import Design
    from creepkit.forecasts.forecast import Forecast
    from creepkit.inverse.selection.ranking import Ranking
    from creepkit.quality import DataQuality
    from creepkit.records import History
    from creepkit.rupture_assessment.assessment import RuptureAssessment


@dataclass(frozen=True)
class StudyResult:
    """What a run of a study gave: ordinary records, by group of tests or by name.

    title : of the study. groups : of the tests that were used; "" names the only one. exclusions : what was left out.
    stages : how each ended. exports : laws as text. report : the page, where one was asked for.
    changes : what differs from the study.lock that was there, one sentence each. files : that were read.
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

    def _names(self, kind: str) -> list[tuple[str, str]]:
        return [(one.name, one.group) for one in self.stages if one.kind == kind and one.name in self.results]

    def _by_group(self, kind: str) -> dict[str, Any]:
        return {group: self.results[name] for name, group in self._names(kind)}
