"""report_html: the contents of a report as the text of one HTML page."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Sequence
from importlib.metadata import version
from typing import TYPE_CHECKING

from markupsafe import Markup

from creepkit.inverse.perturbation import combined_change_text
from creepkit.reports.answer import asked_figures
from creepkit.reports.attachments import embed
from creepkit.reports.html.closing import closing_sections, files_to_download
from creepkit.reports.html.data_section import data_section
from creepkit.reports.html.elements import Block, PageSection, Paragraph, Table, number, plural, printable
from creepkit.reports.html.findings import GroupFindings, answer_block, findings_of, with_histories
from creepkit.reports.html.groups import group_sections
from creepkit.reports.html.law_names import LawNames, title_in_sentence
from creepkit.reports.html.law_tables import law_title
from creepkit.reports.html.stage_sections import stage_sections, strength_blocks
from creepkit.reports.html.svg import PageFigures
from creepkit.reports.html.templates import resource, template
from creepkit.reports.identification_text import rejected
from creepkit.reports.plate_figure import plate_figure
from creepkit.reports.ranking import explanation
from creepkit.reports.stress_exponents import interval_digits, rate_and_exponent

if TYPE_CHECKING:
    from creepkit.reports.contents import ReportContents

MOST_TEST_FIGURES = 160
"""Figures of single tests in one page; of more tests those of largest misfit are drawn."""


MOST_RANKINGS_DRAWN = 12
"""Groups up to which the misfit of each law in each test is drawn as well."""


def report_html(contents: ReportContents) -> str:
    """The page: the answer on one screen, and folded behind it values, tests, laws, data, other stages and methods.

    It holds everything itself, loads nothing, runs no scripts, and is the same text for the same contents.
    """
    contents = dataclasses.replace(contents, groups=tuple(map(with_histories, contents.groups)))
    figures = PageFigures()
    found = [one for one in map(findings_of, contents.groups) if one is not None]
    sections = [
        _findings_section(contents, found, figures),
        *_group_sections(found, figures),
        data_section(contents, found),
        *stage_sections(contents, figures, LawNames.of(fit for one in found for fit in one.fits)),
        *closing_sections(contents, found),
    ]
    shown = [section for section in map(_without_empty, sections) if not section.empty]
    return template("page.html").render(
        title=printable(contents.title, 200) or "Report",
        summary=_summary(contents, found),
        sections=shown,
        style=Markup(resource("style.css")),
        attachments=Markup(embed(contents.attachments)),
        version=version("creepkit"),
    )


def _without_empty(section: PageSection) -> PageSection:
    inner = [one for one in map(_without_empty, section.sections) if not one.empty]
    return dataclasses.replace(section, sections=inner)


def _summary(contents: ReportContents, found: Sequence[GroupFindings]) -> str:
    tests = sum(len(group.histories) for group in contents.groups) or sum(len(one.fit.tests) for one in found)
    parts = [plural(tests, "test")] if tests else []
    if len(contents.groups) > 1:
        parts.append(plural(len(contents.groups), "material"))
    days = [str(one.fit.provenance.get("when", ""))[:10] for one in found]
    dates = sorted({day for day in days if day})
    parts += [f"identified {dates[0]}" if len(dates) == 1 else f"identified {dates[0]} to {dates[-1]}"] if dates else []
    return ", ".join(parts)


# ---- findings --------------------------------------------------------------------------------------------------------


def _findings_section(contents: ReportContents, found: Sequence[GroupFindings], figures: PageFigures) -> PageSection:
    """The answer of one group; of several groups a map, and their answers in sections of their own."""
    missing = [printable(one.stage, 80) for one in contents.failures]
    missing += [f"identification of {printable(g.name, 80)}" for g in contents.groups if g.failure]
    warning: list[Block] = []
    if missing:
        listed = ", ".join(missing[:12]) + (f" and {len(missing) - 12} more" if len(missing) > 12 else "")
        reasons = Markup(
            'This report is not complete. Failed: {}. The reasons stand under <a href="#missing">What is missing</a>.'
        )
        warning.append(Paragraph(reasons.format(listed), "warning"))
    if len(found) == 1:
        questions = [figure for forecast in contents.forecasts.values() for figure in asked_figures(forecast)]
        files = files_to_download(contents, found)
        answer = answer_block(found[0], figures, asked=questions, quality=contents.quality, files=files)
        return PageSection("findings", "Findings", [*warning, answer])
    if not found:
        asked = any(group.failure or group.result is not None for group in contents.groups)
        alone = bool(contents.groups) and (asked or not contents.rupture)
        law = [Paragraph("No law was identified.", "lead")] if alone else []
        rupture = [
            block
            for name, assessment in contents.rupture.items()
            for block in (
                *([Paragraph(f"{printable(name, 120)}:")] if len(contents.rupture) > 1 else []),
                *strength_blocks(assessment),
            )
        ]
        return PageSection("findings", "Findings", [*warning, *law, *rupture])
    lead, by_law = Paragraph(_overview(contents, found), "lead"), _by_law(found)
    title = f"Creep rates of {plural(len(found), 'material')}"
    caption = f"{title}, by law, with 95 % intervals; open marks: the tests contradict the law."
    picture = figures.picture(
        lambda: plate_figure([(one.name, one.fit) for one in by_law]),
        title,
        f"{title}; the table holds the numbers.",
        caption,
    )
    return PageSection("findings", "Findings", [*warning, lead, picture])


def _by_law(found: Sequence[GroupFindings]) -> list[GroupFindings]:
    """Groups of one law together, the commonest law first, then by name."""
    counts = Counter(one.fit.law.name for one in found)
    return sorted(found, key=lambda one: (-counts[one.fit.law.name], one.fit.law.name, one.name))


def _overview(contents: ReportContents, found: Sequence[GroupFindings]) -> str:
    explained = sum(one.fit.adequacy is not None and one.fit.adequacy.explains for one in found)
    laws = [title_in_sentence(one.fit.law) for one in found]
    counts = sorted({name: laws.count(name) for name in laws}.items(), key=lambda pair: (-pair[1], pair[0]))
    named = ", ".join(f"{printable(name, 60)} in {count}" for name, count in counts[:8])
    compared = [one for one in found if one.decisive is not None]
    decisive = sum(one.decisive is True for one in compared)
    decided = f" The choice of the law is decisive in {decisive} of {len(compared)}." if compared else ""
    return (
        f"Laws were identified of {len(found)} of {plural(len(contents.groups), 'material')}. The best law is {named}. "
        f"The tests do not contradict it at their noise in {explained} of {len(found)}.{decided}"
    )


def _table_of_groups(found: Sequence[GroupFindings]) -> Table:
    rows = []
    for one in found:
        fit, r = one.fit, one.fit.reference
        rate, exponent = (_with_interval(values) for values in rate_and_exponent(fit))
        weight = "–" if one.ranking is None else f"{one.ranking.laws[0].weight:.2f}"
        rows.append(
            (
                printable(one.name, 120),
                law_title(fit.law),
                weight,
                explanation(fit),
                "–" if one.decisive is None else "yes" if one.decisive else "no",
                number(r.stress, 3),
                "–" if rejected(fit) else rate,
                "–" if rejected(fit) else combined_change_text(fit.unmodelled) or "–",
                "–" if rejected(fit) else exponent,
            )
        )
    columns = (
        "material",
        "best law",
        "weight",
        "by the noise of the tests",
        "decisive",
        "at MPa",
        "creep rate there, 1/s",
        "rate: not in the interval",
        "stress exponent",
    )
    caption = (
        "Materials, with 95 % intervals; rate and stress exponent at constant strain, amid the tests, of laws that fit "
        "the tests. Not in the interval: by how much the rate would move with what no nuisance parameter models, such "
        "as errors of temperature and load common to all tests, each of the size that the findings state (root sum of "
        "squares). Decisive: one law has more than 95 % of the weight, the tests do not contradict it, and no other "
        "law or effect that was tried does as well; the verdict of each material says what is missing"
    )
    return Table(caption, columns, rows, numeric=(2, 5, 6, 7, 8))


def _with_interval(values: tuple[float, ...]) -> str:
    value, low, high = values
    digits = interval_digits(value, low, high)
    return f"{number(value, digits)} ({number(low, digits)} to {number(high, digits)})"


def _group_sections(found: Sequence[GroupFindings], figures: PageFigures) -> list[PageSection]:
    drawn = len(found) <= MOST_RANKINGS_DRAWN
    most = _figures_of_tests(found)
    if len(found) == 1:
        return [*group_sections(found[0], figures, "", most_tests=most, ranking_drawn=drawn)]
    if not found:
        return []
    sections = [PageSection("materials", "Materials", [_table_of_groups(found)], result="rates and exponents, a table")]
    for k, one in enumerate(_by_law(found), start=1):
        inner = group_sections(one, figures, f"m{k}-", most_tests=most, ranking_drawn=drawn)
        title = printable(one.name, 120) or f"Material {k}"
        answer = answer_block(one, figures)
        sections.append(PageSection(f"m{k}", title, [answer], inner, answer.headline))
    return sections


def _figures_of_tests(found: Sequence[GroupFindings]) -> int:
    """How many tests of each group are drawn, so that the page has at most MOST_TEST_FIGURES of them."""
    counts = sorted(len(one.fit.tests) for one in found)
    left, most = MOST_TEST_FIGURES, 0
    for k, count in enumerate(counts):
        most = max(most, min(count, left // (len(counts) - k)))
        left -= min(count, most)
    return max(most, 1)
