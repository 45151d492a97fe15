"""Methods as text for a paper: what was done, from the records alone, with numbered citations, versions and seeds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from creepkit.reports.blocks import plural, printable, sentence, typeset
from creepkit.reports.citations import CITATIONS, References, listed
from creepkit.reports.design import order_text
from creepkit.reports.methods_identification import identification_methods

if TYPE_CHECKING:
    from creepkit.reports.contents import ReportContents
    from creepkit.reports.findings import GroupFindings


def methods_text(contents: ReportContents, found: Sequence[GroupFindings]) -> str:
    """Paragraphs on identification, ranking and the other stages, then the references."""
    references = References()
    paragraphs = [
        _source_of_data(contents, references),
        *identification_methods(contents, found, references),
        *_stages(contents, references),
        _software(contents, found, references),
    ]
    text, cited = references.numbered(typeset("\n\n".join(" ".join(p) for p in paragraphs if p)))
    numbered = "\n".join(f"[{k}] {citation}" for k, citation in enumerate(cited, start=1))
    return f"{text}\n\n{numbered}".strip() + "\n"


def _source_of_data(contents: ReportContents, references: References) -> list[str]:
    """Where the data were published, if the study says so."""
    if not contents.data_citations:
        return []
    return [f"The measured data are those of{references.cite(*contents.data_citations)}."]


def _stages(contents: ReportContents, references: References) -> list[list[str]]:
    paragraphs: list[list[str]] = []
    if contents.exclusions:
        tests = {one.test for one in contents.exclusions}
        paragraphs.append(
            [
                f"Readings of {plural(len(tests), 'test')}, or whole tests, were left out for the reasons that the "
                "report lists."
            ]
        )
    if contents.temperature:
        paragraphs.append(
            [
                "Forms of temperature of the parameters were chosen by regression on isothermal estimates with their "
                f"covariances{references.cite('pysindy')}, over all combinations of forms."
            ]
        )
    for assessment in contents.rupture.values():
        methods = dict.fromkeys(one.fit.method for one in assessment.ranked)
        cited = [f"{name}{references.cite(name) if name in CITATIONS else ''}" for name in methods]
        ruptures = assessment.tests
        run_outs = int(ruptures.censored.sum())
        scattering = [label for label, names in ruptures.groups.items() if len(set(names)) > 1]
        how = [f"{plural(run_outs, 'run-out')} as censored times"] if run_outs else []
        how += [f"{listed([_plural_of(label) for label in scattering])} as random effects"] if scattering else []
        with_them = f", {listed(how)}," if how else ""
        were = "was" if len(ruptures) == 1 else "were"
        paragraphs.append([f"{plural(len(ruptures), 'rupture test')}{with_them} {were} assessed by {listed(cited)}."])
    if contents.forecasts:
        forecasts = contents.forecasts.values()
        level, draws = next(iter(forecasts)).level, max(one.draws for one in forecasts)
        drawn = f"; they come from {draws} draws in each test" if draws else ""
        paragraphs.append(
            [
                f"Forecasts have bands of {100 * level:g} % that contain the uncertainty of the parameters and of the "
                f"choice of the law, the scatter between tests, dimensions, noise and numerical error{drawn}."
            ]
        )
    if contents.design:
        by = order_text(next(iter(contents.design.values())))
        information = f"Expected information of further tests was computed{references.cite('lindley')}"
        paragraphs.append([f"{information}; they are listed {by}."])
    return paragraphs


def _plural_of(label: str) -> str:
    """Several of what a label names: heats, laboratories."""
    label = printable(label, 60)
    return f"{label[:-1]}ies" if label.endswith("y") else f"{label}s"


def _software(contents: ReportContents, found: Sequence[GroupFindings], references: References) -> list[str]:
    versions = dict(contents.provenance.versions)
    if not versions and found:
        versions = {"creepkit": str(found[0].fit.provenance.get("creepkit", ""))}
    named = listed(
        [
            f"{printable(name, 60)} {printable(version, 60)}{references.cite(name) if name == 'creepkit' else ''}"
            for name, version in versions.items()
            if version
        ]
    )
    seed = "" if contents.provenance.seed is None else f", seed {contents.provenance.seed}"
    return [sentence(f"The work was done with {named}{seed}")] if named else []
