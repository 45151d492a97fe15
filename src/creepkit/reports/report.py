"""A page that a colleague can read, from results as they are: identifications, rankings, plates, forecasts, designs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from creepkit.checked_arguments import checked
from creepkit.discovery.discover import TemperatureStudy
from creepkit.discovery.temperature_law import TemperatureLaw
from creepkit.errors import CreepkitError, ReportError
from creepkit.experiments.planned_design import Design
from creepkit.exporters.exporting import export
from creepkit.extraction.extraction import Extraction
from creepkit.files.json_documents import json_text
from creepkit.files.reading import FileKind, sha256_of
from creepkit.files.writing import check_target, write_text
from creepkit.forecasts.forecast import Forecast
from creepkit.inverse.identification import Identification
from creepkit.inverse.identification_document import identification_to_json
from creepkit.inverse.selection import Ranking, rank
from creepkit.quality import check_data_quality
from creepkit.records import History
from creepkit.registry import default_registry, kinds
from creepkit.reports.contents import (
    Exclusion,
    ExportedFile,
    ReportContents,
    ReportGroup,
    ReportProvenance,
    ReportSource,
    identified_files,
    versions_of,
)
from creepkit.reports.html import report_html
from creepkit.rupture_assessment.assessment import RuptureAssessment
from creepkit.screening.results import AlloyResult, ScreeningResult

Reported: TypeAlias = (
    Identification
    | Ranking
    | AlloyResult
    | ScreeningResult
    | TemperatureStudy
    | TemperatureLaw
    | Forecast
    | Design
    | RuptureAssessment
    | Extraction
)

PARTS: dict[Any, str] = {
    TemperatureStudy: "temperature",
    TemperatureLaw: "temperature",
    Forecast: "forecasts",
    Design: "design",
    RuptureAssessment: "rupture",
    Extraction: "extractions",
}
"""{kind of result: the part of the contents where it stands by a title of its own}."""


EXPORT_TARGETS = ("json", "python", "latex", "abaqus")
"""Of the best law of each material, to download."""


MOST_EXPORTED_GROUPS = 6
"""Materials up to which each has its files; of more the results of one call are too many to be picked from a list."""


PACKAGES = ("creepkit", "numpy", "scipy", "sympy", "torch", "matplotlib")
"""Whose versions are stated."""


@checked
def report(
    source: Reported | ReportSource | ReportContents | Iterable[Reported],
    to: str | Path = "report.html",
    *,
    title: str = "",
    force: bool = False,
) -> Path:
    """Write results as one page of HTML that a colleague can read without creepkit, and return its path.

    source : a ranking, an identification, a plate, a study that was run, or several results: identifications of the
        same tests are ranked, others stand one below the other, and forecasts, designs, temperature laws, rupture
        assessments and extractions have sections of their own. Curves are drawn of identifications that have their
        histories.
    to : file of the page. title : of the page. force : whether a file that creepkit did not write is replaced.

    Raises ReportError for what cannot be reported, for nothing at all, and for a file that exists or cannot be written.
    The page loads nothing, and is complete without scripts. It holds figures, tables, laws to download, methods text
    and provenance, in MPa, hours, kelvin and the units of the parameters.
    """
    path = Path(to)
    check_target(path, ReportError, force=force)
    return write_text(report_html(report_contents(source, title=title)), path, ReportError, force=force)


def report_contents(
    source: Reported | ReportSource | ReportContents | Iterable[Reported], *, title: str = ""
) -> ReportContents:
    """What report() shows of results: groups by material, data quality, exclusions, exports and provenance."""
    if hasattr(source, "report_contents"):
        source = source.report_contents()
    if isinstance(source, ReportContents):
        return replace(source, title=title) if title else source
    several: Any = source if isinstance(source, Iterable) and not hasattr(source, "__dataclass_fields__") else [source]
    results: list[Any] = [*several]
    groups = _groups(results)
    others: dict[str, Any] = {part: {} for part in PARTS.values()}
    for one in results:
        for part in {part for kind, part in PARTS.items() if isinstance(one, kind)}:
            others[part][_title_of(one, others[part])] = one
    if not (groups or any(others.values())):
        raise ReportError("there is nothing to report: give identifications, rankings, a plate or what follows them")
    histories = [h for group in groups for h in group.histories]
    exports, notes = _exports(groups)
    return ReportContents(
        title=title or _title(groups),
        groups=groups,
        quality=_quality(histories),
        exclusions=tuple(_exclusions(histories)),
        exports=exports,
        provenance=_provenance(groups, histories),
        notes=notes,
        compositions=next((one.compositions for one in results if isinstance(one, ScreeningResult)), None),
        **others,
    )


def _groups(results: Sequence[Any]) -> tuple[ReportGroup, ...]:
    """Rankings and alloys, then identifications: those of the same tests as one ranking; ReportError for others."""
    ranked: list[ReportGroup] = []
    same_tests: dict[object, list[Identification]] = {}
    for one in results:
        if isinstance(one, Identification):
            same_tests.setdefault(one.provenance.get("data", id(one)), []).append(one)
        elif isinstance(one, Ranking):
            ranked.append(ReportGroup(_material(one.best), one, one.best.histories))
        elif isinstance(one, AlloyResult):
            ranked.append(ReportGroup(one.alloy, one, failure=one.failure))
        elif isinstance(one, ScreeningResult):
            ranked += [ReportGroup(r.alloy, r, tuple(one.histories[r.alloy]), r.failure) for r in one.results]
        elif not isinstance(one, tuple(PARTS)):
            raise ReportError(
                f"a report takes identifications, rankings, plates, forecasts, designs, temperature laws, rupture "
                f"assessments, extractions or a study, found {type(one).__name__}"
            )
    fits = [
        ReportGroup(_material(one[0]), one[0] if len(one) == 1 else rank(one), one[0].histories)
        for one in same_tests.values()
    ]
    return (*ranked, *fits)


def _title_of(one: Any, others: Mapping[str, Any]) -> str:
    """The name of a law with temperature, or of an extraction, told apart from those of others."""
    law = getattr(getattr(one, "temperature_law", one), "law", None)
    title = str(getattr(one if isinstance(one, Extraction) else law, "name", "") or "")
    while title in others:
        title = f"{title} ({len(others) + 1})" if title else f"No. {len(others) + 1}"
    return title


def _material(fit: Identification) -> str:
    """The alloy of the tests, where they are of one; else the test, where it is alone."""
    alloys = {h.alloy for h in fit.histories}
    if len(alloys) == 1 and (alloy := alloys.pop()):
        return alloy
    return fit.tests[0].name if len(fit.tests) == 1 else ""


def _title(groups: Sequence[ReportGroup]) -> str:
    names = [group.name for group in groups if group.name]
    if not groups or not names:
        return "Creep laws"
    return f"Creep law of {names[0]}" if len(groups) == 1 else f"Creep laws of {len(groups)} materials"


def _quality(histories: Sequence[History]) -> Any:
    try:
        return check_data_quality(histories) if histories else None
    except CreepkitError:  # of tests that only a fit can take, such as plans
        return None


def _exclusions(histories: Sequence[History]) -> Iterator[Exclusion]:
    """Frames that are marked as not used, with what is known of the reason."""
    for history in histories:
        frames = tuple(int(k) for k in np.flatnonzero(~np.asarray(history.used)))
        if frames:
            reason = history.labels.get("suspect", "marked as not used where the test was read")
            yield Exclusion(history.name, frames, reason)


def _exports(groups: Sequence[ReportGroup]) -> tuple[tuple[ExportedFile, ...], tuple[str, ...]]:
    """The best law of each material for some targets, identifications and rankings; and what cannot be written."""
    found = [one for one in groups if one.fits]
    if not 0 < len(found) <= MOST_EXPORTED_GROUPS:
        return (), ()
    files = identified_files({one.name: one.ranking for one in found if one.ranking is not None})
    notes: list[str] = []
    for one in found:
        stem = "_".join(part for part in (one.name if len(found) > 1 else "", one.fit.law.name) if part)
        if one.ranking is None:
            document = json_text(identification_to_json(one.fit))
            files.append(ExportedFile(f"{stem}_identification.json", "identification, read by ck.load", document))
        for target in EXPORT_TARGETS:
            exporter = default_registry().one(kinds.EXPORTERS, target)
            try:
                text = export(one.ranking or one.fit, target)
            except CreepkitError as error:
                notes.append(f"the law {one.fit.law.name} is not written as {target}: {error}")
            else:
                files.append(ExportedFile(f"{stem}_law{exporter.suffix}", exporter.title, text))
    return tuple(files), tuple(notes)


# ---- provenance ------------------------------------------------------------------------------------------------------


def _provenance(groups: Sequence[ReportGroup], histories: Sequence[History]) -> ReportProvenance:

    found = [one for one in groups if one.fits]
    if not found:
        return ReportProvenance(versions=versions_of(PACKAGES))
    fit = found[0].fit
    stated = {k: v for k, v in fit.provenance.items() if k in ("specimen", "origin", "when")}
    if len(found) == 1:
        stated |= {k: v for k, v in fit.provenance.items() if k in ("fingerprint", "data", "evaluations")}
    settings = {one.name: getattr(fit.settings, one.name) for one in fields(fit.settings) if one.name != "nuisances"}
    settings["nuisances"] = ", ".join(str(n.kind) for n in fit.settings.nuisances)
    return ReportProvenance(
        versions=versions_of(PACKAGES),
        seed=fit.settings.seed,
        settings={**{k: v for k, v in settings.items() if k != "seed"}, **stated},
        inputs=dict(_inputs(histories)),
    )


def _inputs(histories: Sequence[History]) -> Iterator[tuple[str, str]]:
    """(file, sha256) of the files of histories that are still there."""
    kind = FileKind("a test", ReportError, "write the test to several files", maximum_bytes=500_000_000)
    for source in dict.fromkeys(h.source for h in histories if h.source):
        with suppress(ReportError):
            yield Path(source).name, sha256_of(Path(source), kind)
