"""report_html: the contents of a report as the text of one HTML page, its sections, and blocks as they stand in it."""

from __future__ import annotations

import base64
import dataclasses
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from importlib.metadata import version
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

from creepkit.discovery.temperature_law import TemperatureLaw
from creepkit.files.writing import file_stem
from creepkit.inverse.uncertainty.correlation import LOOSE
from creepkit.quality.flags import frame_ranges_text
from creepkit.reports.answer import KeyFigure, answer, asked_figures, codes_text, rupture_figures, table_of_groups
from creepkit.reports.attachments import embed
from creepkit.reports.blocks import (
    Answer,
    Block,
    Cell,
    Downloads,
    Items,
    PageSection,
    Paragraph,
    Picture,
    Table,
    Verbatim,
    first_of,
    plural,
    printable,
    printable_lines,
    sentence,
    typeset,
)
from creepkit.reports.compared_values import reading_counts, selection_sentence
from creepkit.reports.contents import covariance_file
from creepkit.reports.description import rejected, tested_range, tests_text
from creepkit.reports.design import design_blocks
from creepkit.reports.extraction import alignment_text, extraction_figure, extraction_text, imposed_text
from creepkit.reports.forecast import forecast_answer, forecast_blocks
from creepkit.reports.histories import history_blocks, quality_blocks
from creepkit.reports.identification import blocks_of_tests, noise_blocks, value_blocks, worst_tests
from creepkit.reports.identification_plot import WIDEST, summary_figures
from creepkit.reports.law_names import LawNames, definition_blocks
from creepkit.reports.methods import laws_of, methods_text
from creepkit.reports.ranking import equivalents_among_remaining, ranking_blocks
from creepkit.reports.rate_panels import plate_figure, rupture_rows
from creepkit.reports.rupture import assessment_blocks, rupture_blocks, strength_blocks
from creepkit.reports.screening import composition_blocks, map_sentence, plate_answer
from creepkit.reports.svg import PageFigures
from creepkit.reports.temperature_law import law_blocks, study_blocks
from creepkit.reports.verdicts import explanation_text, scatter_text
from creepkit.screening.results import AlloyResult

if TYPE_CHECKING:
    from jinja2 import Template

    from creepkit.extraction.extraction import Extraction
    from creepkit.instruments.imposed import Imposed
    from creepkit.reports.contents import ExportedFile, ReportContents, ReportGroup


MOST_TEST_FIGURES = 160
"""Figures of single tests in one page; of more tests those of largest misfit are drawn."""


MOST_RANKINGS_DRAWN = 12
"""Groups up to which the misfit of each law in each test is drawn as well, and their table stands open."""


def report_html(contents: ReportContents) -> str:
    """The page: the answer on one screen, and folded behind it values, tests, laws, data, other stages and methods.

    It holds everything itself, loads nothing, runs no scripts, and is the same text for the same contents.
    """
    figures, found = PageFigures(), contents.identified
    names = LawNames(fit for one in found for fit in one.fits)
    sections = [
        findings_section(contents, figures),
        *_group_sections(contents, figures),
        data_section(contents),
        *_stage_sections(contents, figures, identified=bool(found)),
        *closing_sections(contents),
    ]
    shown = [section_shown(one, names) for one in sections]
    return template("page.html").render(
        title=printable(contents.title, 200) or "Report",
        summary=_summary(contents),
        sections=[one for one in shown if one.blocks or one.sections],
        style=Markup(resource("style.css")),
        attachments=Markup(embed(contents.attachments)),
        version=version("creepkit"),
    )


def _summary(contents: ReportContents) -> str:
    """How many tests, unless the answer says that, and when they were identified."""
    tests = sum(len(one.histories) or len(one.fit.tests if one.fits else ()) for one in contents.groups)
    parts = [plural(tests, "test")] if tests and (len(contents.groups) > 1 or not contents.identified) else []
    if len(contents.groups) > 1:
        parts.append(plural(len(contents.groups), "material"))
    dates = sorted({str(one.fit.provenance.get("when", ""))[:10] for one in contents.identified} - {""})
    parts += [f"identified {dates[0]}" if len(dates) == 1 else f"identified {dates[0]} to {dates[-1]}"] if dates else []
    return ", ".join(parts)


# ---- blocks as they are shown ----------------------------------------------------------------------------------------


def section_shown(section: PageSection, names: LawNames) -> PageSection:
    """A section with its blocks as they are shown, without empty ones below it."""
    inner = [section_shown(one, names) for one in section.sections]
    return dataclasses.replace(
        section,
        title=printable(section.title, 120),
        blocks=[block_shown(one, names) for one in section.blocks if not isinstance(one, Items) or one.items],
        sections=[one for one in inner if one.blocks or one.sections],
        result=typeset(sentence(names.in_text(section.result)).removesuffix(".")) if section.result else "",
    )


def block_shown(block: Block, names: LawNames) -> Block:
    """A block with capitals, full stops and printed numbers, laws in its sentences by their titles."""

    def said(text: str) -> str:
        return text if isinstance(text, Markup) else typeset(sentence(names.in_text(text)))

    def cells(row: Sequence[Cell]) -> list[Any]:
        return [typeset(printable(one)) if isinstance(one, str) else one for one in row]

    if isinstance(block, Paragraph):
        return dataclasses.replace(block, text=said(block.text))
    if isinstance(block, Items):
        return Items([said(one) for one in block.items], said(block.title) if block.title else "")
    if isinstance(block, Picture):
        return dataclasses.replace(block, caption=typeset(block.caption))
    if isinstance(block, Table):
        table = block.filled
        rows = [cells(row) for row in table.rows]
        return Table(said(table.caption).removesuffix("."), cells(table.columns), rows)
    if isinstance(block, Answer):
        return dataclasses.replace(
            block,
            headline=said(block.headline),
            tests=said(block.tests) if block.tests else "",
            picture=None if block.picture is None else block_shown(block.picture, names),
            values=[cells((name, _value_shown(value, ends), unit)) for name, value, ends, unit in block.values],
            figures=[cells(one) for one in block.figures],
            cautions=[said(one) for one in block.cautions],
            next_step=said(block.next_step),
            brackets=said(block.brackets) if block.brackets else "",
            codes=said(block.codes) if block.codes else "",
        )
    return block


AT_BOUND = " (search bound)"
"""Behind an end of an interval, where a page has room for no more than a sign before it."""


def _value_shown(value: str, ends: Sequence[str]) -> str:
    """A value, with its interval where that is all that is known, or that it lies at a bound of its search."""
    if not value.startswith("="):
        known = [end.removesuffix(AT_BOUND) for end in ends]
        marks = ["≤ " * (ends[0] != known[0]), "≥ " * (ends[1] != known[1])]
        return f"{value} [{', '.join(map(''.join, zip(marks, known, strict=True)))}]"
    return f"{value}{' (at the bound of its search)' * (f'{value[2:]}{AT_BOUND}' in ends)}"


# ---- findings --------------------------------------------------------------------------------------------------------


def findings_section(contents: ReportContents, figures: PageFigures) -> PageSection:
    """The answer of one group; of several groups a map, and their answers in sections of their own."""
    found = contents.identified
    missing = [printable(one.stage, 80) for one in contents.failures]
    missing += [f"identification of {printable(g.name, 80)}" for g in contents.groups if g.failure]
    blocks: list[Block] = []
    if missing:
        reasons = Markup(
            'This report is not complete. Failed: {}. The reasons stand under <a href="#missing">What is missing</a>.'
        )
        blocks.append(Paragraph(reasons.format(first_of(missing, 12)), "warning"))
    if len(found) == 1:
        asked = [figure for forecast in contents.forecasts.values() for figure in asked_figures(forecast)]
        asked += [figure for one in contents.rupture.values() for figure in rupture_figures(one)]
        files = files_to_download(contents)[:MOST_FILES]
        page: dict[str, Any] = {"quality": contents.quality, "design": next(iter(contents.design.values()), None)}
        page |= {"files": files, "codes": codes_text(found[0].fit)}
        blocks.append(group_answer(found[0], figures, asked=asked, **page))
    elif not found:
        failed = any(group.failure or group.result is not None for group in contents.groups)
        if contents.groups and (failed or not contents.rupture):
            blocks.append(Paragraph("No law was identified.", "lead"))
        for name, assessment in contents.rupture.items():
            blocks += [Paragraph(f"{name}:")] if len(contents.rupture) > 1 else []
            blocks += strength_blocks(assessment, figures)
    else:
        title = f"Creep rates of {plural(len(found), 'material')}"
        caption = f"{title}, by law, with 95 % intervals; open marks: the tests reject the law."
        drawn = [(one.name, one.fit) for one in _by_law(found)]
        said = [(contents.forecast_groups.get(name, name), one) for name, one in contents.forecasts.items()]
        blocks.append(Items([f"{group}: {figure.line}" for group, one in said for figure in asked_figures(one)]))
        picture = figures.picture(lambda: plate_figure(drawn), title, f"{title}; the table holds the numbers.", caption)
        choices = [one.decisive for one in found if one.decisive is not None]
        blocks.insert(0, plate_answer(drawn, choices, failed=len(contents.groups) - len(found), picture=picture))
    return PageSection("findings", "Findings", blocks)


def group_answer(found: ReportGroup, figures: PageFigures, *, asked: Sequence[KeyFigure] = (), **page: Any) -> Answer:
    """The first screen of one material. asked : what forecasts say; page : quality of its data, files to download."""
    fit, picture = found.fit, None
    if fit.histories and fit.predictor is not None:
        rupture = ", and times to rupture, predicted over measured" if rupture_rows(fit) else ""
        title = f"The law over the tests{found.of}"
        description = f"Curves of {plural(len(fit.tests), 'test')} over time, creep rate over stress{rupture}."
        curves = any(one.outputs for one in fit.tests)
        caption = f"{title}.{f' Bands wider than a factor of {WIDEST:g} to either side are not drawn.' * curves}"
        picture = figures.picture(lambda: summary_figures(fit), title, description, caption)
    return answer(fit, found.ranking, asked=asked, picture=picture, **page)


def _by_law(found: Sequence[ReportGroup]) -> list[ReportGroup]:
    """Groups of one law together, the commonest law first, then by name, numbers in it by their size."""
    laws = [one.fit.law.name for one in found]
    parts = {one.name: [int(p) if p.isdecimal() else p for p in re.split(r"(\d+)", one.name)] for one in found}
    return sorted(found, key=lambda one: (-laws.count(one.fit.law.name), one.fit.law.name, parts[one.name]))


# ---- materials -------------------------------------------------------------------------------------------------------


def _group_sections(contents: ReportContents, figures: PageFigures) -> Iterator[PageSection]:
    """The sections of one material; of several a table of all, and one for each."""
    found = contents.identified
    drawn, most = len(found) <= MOST_RANKINGS_DRAWN, max(MOST_TEST_FIGURES // max(len(found), 1), 1)
    if len(found) == 1:
        yield from _sections_of(found[0], figures, "", most, drawn=drawn)
    elif found:
        table = table_of_groups({one.name: (one.fit, one.decisive) for one in _by_law(found)})
        folded = "rates and exponents, a table" if len(found) > MOST_RANKINGS_DRAWN else ""
        yield PageSection("materials", "Materials", [table], result=folded)
        for k, one in enumerate(_by_law(found), start=1):
            own = [contents.forecasts[name] for name, group in contents.forecast_groups.items() if group == one.name]
            first = group_answer(one, figures, asked=[figure for forecast in own for figure in asked_figures(forecast)])
            inner = [*_sections_of(one, figures, f"m{k}-", most, drawn=drawn)]
            yield PageSection(f"m{k}", one.name or f"Material {k}", [first], inner, first.headline)


def _sections_of(
    found: ReportGroup, figures: PageFigures, prefix: str, most: int, *, drawn: bool
) -> Iterator[PageSection]:
    """What was found of one material behind its answer; most : tests that are drawn, drawn : whether its ranking is."""
    fit, ranking = found.fit, found.ranking
    loose = sum(e.verdict in LOOSE for e in fit.estimates)
    known = plural(len(fit.estimates), "value")
    said = f"{loose} of {known} hardly determined by these tests" if loose else f"{known} determined by these tests"
    if isinstance(found.result, AlloyResult):
        values = [*value_blocks(fit, found.result.verdict, found.result.equivalents), Items(found.result.notes)]
    elif ranking is None:
        values = value_blocks(fit)
    else:
        values = value_blocks(fit, ranking.verdict, equivalents_among_remaining(ranking))
    yield PageSection(f"{prefix}values", "Values and verdict", values, result=said)
    worst = worst_tests(fit)[:1]
    far = (
        f"; farthest from the law: {printable(fit.tests[worst[0]].name, 60)}"
        if rejected(fit) and len(fit.tests) > 1 and worst
        else ""
    )
    tests = blocks_of_tests(fit, figures, of=found.of, most=most)
    yield PageSection(f"{prefix}tests", "Tests", tests, result=f"{tests_text(fit)}, {tested_range(fit)}{far}")
    if ranking is not None:
        none = ", none of which explains the tests" if rejected(fit) else f": weight {ranking.laws[0].weight:.2f}"
        blocks = ranking_blocks(ranking, figures if drawn else None, found.of)
        said = f"best of {plural(len(ranking.laws), 'law')}{none}"
        yield PageSection(f"{prefix}ranking", "Laws compared", blocks, result=said)
    scatter = f"rates of tests scatter by {scatter_text(fit.noise_model.rate)}"
    said = scatter if len(fit.tests) > 1 else "of the readings of one test"
    yield PageSection(f"{prefix}nuisances", "Noise and nuisance parameters", noise_blocks(fit), result=said)


# ---- other stages ----------------------------------------------------------------------------------------------------


def _stage_sections(contents: ReportContents, figures: PageFigures, *, identified: bool) -> Iterator[PageSection]:
    """Extraction, records, temperature, rupture, forecasts and further tests, where there are such results.

    Strengths stand among the findings where no law was identified, and are not repeated.
    """
    rupture = assessment_blocks if identified else rupture_blocks

    def trends(one: Any, *how: Any) -> list[Block]:
        return (law_blocks if isinstance(one, TemperatureLaw) else study_blocks)(one, *how)

    records, imposed = "Loads and temperatures from instrument records", contents.imposed
    stages: dict[str, tuple[str, Mapping[str, Any], Callable[..., list[Block]], Callable[[Any], str]]] = {
        "extraction": ("Extraction from camera frames", contents.extractions, _extraction_blocks, _outputs_text),
        "imposed": (records, imposed, _imposed_blocks, lambda one: f"lag of the clocks {one.alignment.lag:.4g} s"),
        "composition": ("Creep over compositions", contents.composition, composition_blocks, map_sentence),
        "temperature": ("Trends with temperature", contents.temperature, trends, lambda one: "values over temperature"),
        "rupture": ("Rupture", contents.rupture, rupture, lambda one: f"{plural(len(one.ranked), 'method')} compared"),
        "forecasts": ("Forecasts", contents.forecasts, forecast_blocks, lambda one: forecast_answer(one).headline),
        "design": ("Further tests", contents.design, design_blocks, lambda one: one.sentence),
    }
    for identifier, (title, results, blocks_of, said) in stages.items():
        of = [f" of {printable(name, 80)}" if name else "" for name in results]
        blocks = [blocks_of(one, figures, name) for one, name in zip(results.values(), of, strict=True)]
        if len(results) == 1:
            yield PageSection(identifier, title, blocks[0], result=said(*results.values()))
        elif results:
            inner = [
                PageSection(f"{identifier}-{k}", name or "All tests", one)
                for k, (name, one) in enumerate(zip(results, blocks, strict=True), start=1)
            ]
            yield PageSection(identifier, title, (), inner, result=f"{len(results)} results")


def _outputs_text(extraction: Extraction) -> str:
    return f"{', '.join(extraction.outputs)} of {plural(int(extraction.used.sum()), 'frame')}".replace("_", " ")


def _extraction_blocks(extraction: Extraction, figures: PageFigures, of: str) -> list[Block]:
    outputs, frames = ", ".join(extraction.outputs).replace("_", " "), extraction.times.size
    description = (
        f"Maps of height of some frames, and over time {outputs}, rigid motion and residuals; "
        f"{int(extraction.used.sum())} of {plural(frames, 'frame')} were used, {plural(len(extraction.flags), 'flag')}."
    )
    caption = "Maps of height, outputs with 95 % bands, rigid motion and residuals; flagged frames in red."
    picture = figures.picture(lambda: extraction_figure(extraction), f"Extraction{of}", description, caption)
    return [picture, Verbatim("What was extracted, and how well", printable_lines(extraction_text(extraction)))]


def _imposed_blocks(under: Imposed, figures: PageFigures, of: str) -> list[Block]:
    """The alignment of the clocks with its interval, and how well programs follow the record."""
    return [
        Verbatim("Alignment of the clocks", printable_lines(alignment_text(under.alignment))),
        Verbatim("What was imposed", printable_lines(imposed_text(under))),
    ]


MOST_FILES = 4
"""On the first screen."""


def closing_sections(contents: ReportContents) -> list[PageSection]:
    """Exports, methods, provenance, and what is missing."""
    return [
        _exports_section(contents),
        PageSection(
            "methods",
            "Methods text",
            _methods_blocks(contents) if contents.identified or contents.rupture else [],
            result="for a paper, with equations and references",
        ),
        PageSection(
            "provenance", "How to repeat", _provenance_blocks(contents), result="commands, settings, versions, inputs"
        ),
        PageSection("missing", "What is missing", _missing_blocks(contents)),
    ]


# ---- methods ---------------------------------------------------------------------------------------------------------


def _methods_blocks(contents: ReportContents) -> list[Block]:
    """The text to be copied, and the equations that it numbers: set, with their symbols, and as text."""
    text = Verbatim("To be copied into a paper and shortened", printable_lines(methods_text(contents)), prose=True)
    return [text, *definition_blocks(laws_of(contents.identified).values())]


# ---- files -----------------------------------------------------------------------------------------------------------


def _covariances(found: Sequence[ReportGroup]) -> list[ExportedFile]:
    """The covariance of the best law of each material."""
    files = [(one, covariance_file(one.fit)) for one in found if one.fit.estimates]
    if len(found) == 1:
        return [file for _, file in files]
    return [
        replace(file, name=f"covariance_{file_stem(one.name, str(k))}.csv", target=f"{file.target}, {one.name}")
        for k, (one, file) in enumerate(files, start=1)
    ]


def files_to_download(contents: ReportContents) -> list[tuple[str, str, str]]:
    """(name, address, what it is) of exports and covariances; the address holds the content.

    Laws as text come first, then what is kept of single identifications.
    """
    files = [*contents.exports, *_covariances(contents.identified)]
    return [
        (file_name(one.name), _address(one.text), f"{one.target}, {_size(one.text)}")
        for one in sorted(files, key=lambda one: one.name.endswith(".json"))
    ]


def _exports_section(contents: ReportContents) -> PageSection:
    """The files that do not stand on the first screen."""
    files = files_to_download(contents)
    files = files[MOST_FILES:] if len(contents.identified) == 1 else files
    blocks = [Downloads(files)] if files else []
    return PageSection("exports", "Files to download", blocks, result=plural(len(files), "further file"))


def file_name(name: str) -> str:
    """A name under which any system can save a file: letters, digits, dots, hyphens and underscores."""
    stem, dot, suffix = name.rpartition(".")
    plain = file_stem(stem or suffix, signs="A-Za-z0-9._-", gap="_")
    return f"{plain}.{file_stem(suffix, 'txt', signs='A-Za-z0-9', gap='')}" if dot and stem else plain


def _address(text: str) -> str:
    encoded = base64.b64encode(text.encode("utf-8", "replace")).decode("ascii")
    return f"data:text/plain;charset=utf-8;base64,{encoded}"


def _size(text: str) -> str:
    size = len(text.encode("utf-8", "replace"))
    return f"{size} bytes" if size < 1000 else f"{size / 1000:.3g} kB"


# ---- provenance ------------------------------------------------------------------------------------------------------


def _provenance_blocks(contents: ReportContents) -> list[Block]:
    provenance, blocks = contents.provenance, list[Block]()
    if contents.attachments:
        total = sum(len(one.content) for one in contents.attachments)
        blocks.append(
            Paragraph(
                f"This page carries {plural(len(contents.attachments), 'file')} of the study ({total / 1e6:.3g} MB): "
                "'creepkit run' with the name of this page repeats the study from them."
            )
        )
    if provenance.commands:
        blocks.append(Verbatim("Commands that repeat the work", printable_lines("\n".join(provenance.commands))))
    settings = {"seed": provenance.seed} if provenance.seed is not None else {}
    rows = [(k, printable(v, 400)) for k, v in _flat({**settings, **provenance.settings}) if v not in ("", None)]
    if rows:
        blocks.append(Table("Settings", ("setting", "value"), rows))
    if provenance.versions:
        rows = [(k, v) for k, v in provenance.versions.items()]
        blocks.append(Table("Versions", ("package", "version"), rows))
    inputs = dict(provenance.inputs)
    files = {one.name: inputs.pop(one.name.rpartition("/")[2], "") for one in contents.attachments} | inputs
    if files:
        blocks.append(Table("Files of the study", ("file", "sha256 of its content"), [*files.items()]))
    return blocks


def _flat(settings: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Nested settings under names with dots; lists of numbers and words on one line."""
    for name, value in settings.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{name}.")
        elif isinstance(value, list | tuple) and any(isinstance(one, Mapping) for one in value):
            yield from _flat({f"{name}[{k}]": one for k, one in enumerate(value, start=1)}, prefix)
        else:
            yield f"{prefix}{name}", ", ".join(map(str, value)) if isinstance(value, list | tuple) else value


def _missing_blocks(contents: ReportContents) -> list[Block]:
    groups = [group for group in contents.groups if group.failure]
    rows = [
        *((one.stage, sentence(one.sentence)) for one in contents.failures),
        *((f"identification of {group.name}", sentence(group.failure)) for group in groups),
    ]
    table = [Table("Stages that failed, and why", ("stage", "reason"), rows)] if rows else []
    return [*table, *([Items(contents.notes)] if contents.notes else [])]


# ---- data ------------------------------------------------------------------------------------------------------------


MOST_LISTED = 400
"""Rows of a table of tests."""


def data_section(contents: ReportContents) -> PageSection:
    """The tests as measured, what is suspect in them, and what was left out and why."""
    histories = [h for group in contents.groups for h in group.histories]
    blocks: list[Block] = []
    if histories:
        more = f"; {len(histories) - MOST_LISTED} more are not listed" if len(histories) > MOST_LISTED else ""
        blocks += history_blocks(histories[:MOST_LISTED], more)
    blocks += [Paragraph(f"Source of the data: {text}") for text in contents.data_citations]
    if contents.quality is not None:
        blocks += quality_blocks(contents.quality, MOST_LISTED)
    in_tests = [(one.name, one.fit.adequacy) for one in contents.identified if one.fit.adequacy is not None]
    texts = [(name, explanation_text(adequacy)) for name, adequacy in in_tests if adequacy.lies_in_tests]
    blocks += [Paragraph(f"{name}: {text}" if name else text, "warning") for name, text in texts]
    left_out = _exclusion_blocks(contents) if histories or contents.exclusions else []
    flags = 0 if contents.quality is None else len(contents.quality.flags)
    result = f"{plural(len(histories), 'test')} as measured; {plural(flags, 'flag') if flags else 'nothing suspect'}"
    result += f"; {len(contents.exclusions)} left out" if contents.exclusions else ""
    return PageSection("data", "Data", blocks, [PageSection("exclusions", "Left out", left_out)], result)


def _exclusion_blocks(contents: ReportContents) -> list[Block]:
    selected = [Paragraph(text) for text in _selections(contents)]
    if not contents.exclusions:
        return [Paragraph("No reading was excluded by hand or by the check of data quality."), *selected]
    rows = []
    for one in contents.exclusions[:MOST_LISTED]:  # of a bar that has no camera as of what has one
        readings = frame_ranges_text(one.frames).replace("frame", "reading", 1)
        rows.append((one.test, readings if one.frames else "the whole test", one.reason))
    return [Table("Left out of the identification", ("test", "what", "reason"), rows), *selected]


def _selections(contents: ReportContents) -> Iterator[str]:
    """How many frames of the tests of each group were selected for the fit."""
    for group in contents.identified:
        if not any(h.outputs for h in group.fit.histories):
            continue
        most = group.fit.settings.frames
        text = selection_sentence(reading_counts(group.fit.histories, most), most)
        yield f"{group.name}: {text}" if len(contents.groups) > 1 else text


# ---- templates -------------------------------------------------------------------------------------------------------


@cache
def template(name: str) -> Template:
    """A template by the name of its file."""
    from jinja2 import Environment, FunctionLoader, StrictUndefined

    loader = FunctionLoader(resource)
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=False, loader=loader)
    environment.filters["lines"] = printable_lines
    return environment.get_template(name)


@cache
def resource(name: str) -> str:
    """The text of a file beside this module."""
    return files(__package__).joinpath("templates", name).read_text("utf-8")
