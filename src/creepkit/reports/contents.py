"""What a report shows: one frozen record, of which every part is optional, with the records and files that it holds."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from creepkit.composition.mapping import CompositionMap, map_where_known
from creepkit.files.writing import LAW_SIGNS, numbered_stems
from creepkit.inverse.identification import Identification
from creepkit.inverse.selection.ranking import Ranking
from creepkit.reports.blocks import printable
from creepkit.screening.alloys import Compositions
from creepkit.screening.results import AlloyResult

if TYPE_CHECKING:
    from creepkit.discovery.discover import TemperatureStudy
    from creepkit.discovery.temperature_law import TemperatureLaw
    from creepkit.experiments.planned_design import Design
    from creepkit.extraction.extraction import Extraction
    from creepkit.forecasts.forecast import Forecast
    from creepkit.instruments.imposed import Imposed
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.selection.ranking import Ranking
    from creepkit.quality.flags import DataQuality
    from creepkit.records import History
    from creepkit.rupture_assessment.assessment import RuptureAssessment


@dataclass(frozen=True)
class ReportGroup:
    """Tests of one material, and what was identified from them.

    name : of the alloy or heat; "" where there is only one. result : a ranking of laws, one identification, an alloy of
    a plate, or None where nothing was identified. histories : the tests as measured; by default those that `result`
    holds. failure : why nothing was identified, in a sentence.
    """

    name: str
    result: Ranking | Identification | AlloyResult | None = None
    histories: tuple[History, ...] = ()
    failure: str = ""

    def __post_init__(self) -> None:
        if self.fits and not self.histories:
            object.__setattr__(self, "histories", self.fit.histories)

    @property
    def fits(self) -> list[Identification]:
        """Of all laws, the best first; none where nothing was identified."""
        if self.result is None or isinstance(self.result, Identification):
            return [] if self.result is None else [self.result]
        return [one.fit for one in self.result.laws]

    @property
    def fit(self) -> Identification:
        """The best law."""
        return self.fits[0]

    @property
    def ranking(self) -> Ranking | None:
        """Of all laws, None where one law alone was identified."""
        if isinstance(self.result, AlloyResult):
            return Ranking(self.result.laws, failed=self.result.failed_laws) if len(self.result.laws) > 1 else None
        return self.result if isinstance(self.result, Ranking) else None

    @property
    def decisive(self) -> bool | None:
        """Whether the verdict is that the best law is the one, None where no laws were compared."""
        compared = self.result if self.ranking is not None else None
        return compared.decisive if isinstance(compared, Ranking | AlloyResult) else None

    @property
    def of(self) -> str:
        """The material in a caption."""
        return f" of {self.name}" if self.name else ""


@dataclass(frozen=True)
class Exclusion:
    """What was left out of the identification, and why.

    test : name of the history. frames : numbers of its frames as measured, counted from 0; empty for the whole test.
    """

    test: str
    frames: tuple[int, ...]
    reason: str


@dataclass(frozen=True)
class StageFailure:
    """A stage of a study that failed: what the report therefore lacks. sentence : the error message."""

    stage: str
    sentence: str


@dataclass(frozen=True)
class ExportedFile:
    """A law as text for a target, to download from the report.

    name : of the file. target : name of the exporter. text : its content.
    """

    name: str
    target: str
    text: str


@dataclass(frozen=True)
class ReportProvenance:
    """What is needed to repeat the work.

    versions : {package: version}. seed : of all draws, None where nothing was drawn. settings : {name: value}, values
    that JSON can hold. inputs : {file: sha256 of its content}. commands : lines, of a shell or of Python, that repeat
    it.
    """

    versions: Mapping[str, str] = field(default_factory=dict)
    seed: int | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)
    inputs: Mapping[str, str] = field(default_factory=dict)
    commands: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        _freeze(self, "versions", "settings", "inputs")


@dataclass(frozen=True)
class Attachment:
    """A file that the report carries, so that the study can be run from the report alone.

    name : a relative POSIX path below the folder of the study, such as study.toml or data/test_1.csv.
    """

    name: str
    content: bytes = field(repr=False)


@dataclass(frozen=True)
class ReportContents:
    """Everything that a report shows; what is empty is left out of the page.

    title : of the page. groups : one for each material. quality : what is suspect in the tests. exclusions : what was
    left out. temperature, forecasts, design, rupture, extractions : results of the other stages by a title of their
    own, which is the name of their group or of their file. compositions : of the materials, where a table states them.
    imposed : {test: what its
    instrument recorded}. exports : laws to download. failures : of stages.
    attachments : study, lock and data. notes : further remarks, one sentence each. data_citations : where the data
    were published, as a list of references has them. forecast_groups : {name of a forecast: name of its group}.
    """

    title: str
    groups: tuple[ReportGroup, ...] = ()
    quality: DataQuality | None = None
    exclusions: tuple[Exclusion, ...] = ()
    temperature: Mapping[str, TemperatureStudy | TemperatureLaw] = field(default_factory=dict)
    forecasts: Mapping[str, Forecast] = field(default_factory=dict)
    design: Mapping[str, Design] = field(default_factory=dict)
    rupture: Mapping[str, RuptureAssessment] = field(default_factory=dict)
    extractions: Mapping[str, Extraction] = field(default_factory=dict)
    compositions: Compositions | None = None
    imposed: Mapping[str, Imposed] = field(default_factory=dict)
    exports: tuple[ExportedFile, ...] = ()
    failures: tuple[StageFailure, ...] = ()
    provenance: ReportProvenance = field(default_factory=ReportProvenance)
    attachments: tuple[Attachment, ...] = ()
    notes: tuple[str, ...] = ()
    data_citations: tuple[str, ...] = ()
    forecast_groups: Mapping[str, str] = field(default_factory=dict)

    @property
    def identified(self) -> list[ReportGroup]:
        """The groups of which a law was identified."""
        return [group for group in self.groups if group.fits]

    @property
    def composition(self) -> dict[str, CompositionMap]:
        """{"": creep over compositions}, where those of enough materials are known; else {}."""
        return map_where_known({one.name: one.result for one in self.identified}, self.compositions)

    def __post_init__(self) -> None:
        _freeze(self, "temperature", "forecasts", "design", "rupture", "extractions", "imposed", "forecast_groups")


def versions_of(packages: Iterable[str]) -> dict[str, str]:
    """Versions of Python and of those of the packages that are installed."""
    found = {"python": platform.python_version()}
    for name in packages:
        with suppress(PackageNotFoundError):
            found[name] = version(name)
    return found


class ReportSource(Protocol):
    """What has a report of its own, such as a study that was run."""

    def report_contents(self) -> ReportContents:
        """Everything that its report shows."""
        ...


def _freeze(record: object, *names: str) -> None:
    """Mappings of a frozen record that cannot be changed either."""
    for name in names:
        object.__setattr__(record, name, MappingProxyType(dict(getattr(record, name))))


# ---- identifications as files ----------------------------------------------------------------------------------------


def identified_files(rankings: Mapping[str, Ranking]) -> list[ExportedFile]:
    """Each law's identification, and ranking.json with their weights, which names them beside itself.

    rankings : {group of tests: its laws}; of several groups the names begin with the group.
    """
    from creepkit.files.json_documents import json_text
    from creepkit.inverse.identification_document import identification_to_json
    from creepkit.inverse.ranking_document import ranking_to_document

    files: list[ExportedFile] = []
    prefixes = {group: f"{group}_" if len(rankings) > 1 else "" for group in rankings}
    texts = [
        prefixes[group] + name
        for group, ranking in rankings.items()
        for name in (*(one.fit.law.name for one in ranking.laws), "ranking")
    ]
    names = (f"{stem}.json" for stem in numbered_stems(texts, "law", LAW_SIGNS))
    for ranking in rankings.values():
        beside: list[tuple[str, str]] = []
        for one in ranking.laws:
            name, text = next(names), json_text(identification_to_json(one.fit))
            beside.append((name, hashlib.sha256(text.encode()).hexdigest()))
            files.append(ExportedFile(name, f"identification of {one.fit.law.name}, read by ck.load", text))
        name, text = next(names), json_text(ranking_to_document(ranking, beside))
        files.append(ExportedFile(name, "ranking, with the identifications in the same folder", text))
    return files


def covariance_file(fit: Identification) -> ExportedFile:
    """The covariance of the estimates as a table: in ln of parameters of logarithmic scale, else in their units."""
    correlation = fit.correlation()
    covariance = correlation.matrix * np.outer(correlation.sd, correlation.sd)
    units = ["1" if p.scale == "log" else p.unit for p in fit.law.table.values()]
    values = [p.to_internal(fit.values[name]) for name, p in fit.law.table.items()]
    lines = [
        f"# covariance of the estimates of law {printable(fit.law.name, 160)}; ln A: of the natural logarithm of A, in",
        "# its unit; given the law, in the Gaussian approximation at the optimum",
        ",".join(["parameter", "unit", "estimate", *correlation.names]),
    ]
    for name, unit, value, row in zip(correlation.names, units, values, covariance, strict=True):
        lines.append(",".join([name, unit, f"{value:.12g}", *(f"{v:.12g}" for v in row)]))
    return ExportedFile(
        "covariance.csv", f"covariance of the estimates, {fit.law.title or fit.law.name}", "\n".join(lines) + "\n"
    )
