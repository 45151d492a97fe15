"""The sections on the other stages of a study: extraction, records, temperature, rupture, forecasts, further tests."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from creepkit.inverse.uncertainty.laplace_approximation import bound_marks
from creepkit.records.units import celsius_text
from creepkit.reports.answer import asked_figures
from creepkit.reports.design import MACHINE_TIME, cells_text, cheapest_text, design_figure, direction_lines, order_text
from creepkit.reports.extraction_plot import extraction_figure
from creepkit.reports.extraction_text import extraction_text
from creepkit.reports.forecast import FORECAST_COLUMNS, forecast_rows, right_law
from creepkit.reports.forecast_plot import forecast_figure
from creepkit.reports.html.elements import (
    Block,
    Items,
    PageSection,
    Paragraph,
    Table,
    Verbatim,
    number,
    plural,
    printable,
    printable_lines,
    sentence,
    with_interval,
)
from creepkit.reports.html.findings import findings_of
from creepkit.reports.html.law_names import LawNames
from creepkit.reports.html.law_tables import LAW_REJECTED
from creepkit.reports.html.svg import PageFigures
from creepkit.reports.instrument_records import alignment_text, imposed_text
from creepkit.reports.rupture import rupture_text, strength_rows
from creepkit.reports.rupture_plot import rupture_figure
from creepkit.reports.temperature_law import plot_temperature_law, temperature_law_text, temperature_study_text

if TYPE_CHECKING:
    from creepkit.discovery.discover import TemperatureStudy
    from creepkit.discovery.temperature_law import TemperatureLaw
    from creepkit.experiments.planned_design import Design
    from creepkit.extraction.extraction import Extraction
    from creepkit.forecasts.forecast import Forecast
    from creepkit.instruments.imposed import Imposed
    from creepkit.inverse.adequacy import Adequacy
    from creepkit.reports.contents import ReportContents
    from creepkit.rupture_assessment.assessment import RuptureAssessment

MOST_DESIGNS = 8
"""Planned tests that are listed."""


def stage_sections(contents: ReportContents, figures: PageFigures, names: LawNames) -> Iterator[PageSection]:
    """Extraction, records, temperature, rupture, forecasts and further tests, where there are such results.

    Strengths stand among the findings where no law was identified, and are not repeated.
    """
    identified = any(findings_of(group) is not None for group in contents.groups)
    yield from _sections(
        ("extraction", "Extraction from camera frames"),
        contents.extractions,
        lambda name, one: _extraction_blocks(name, one, figures),
    )
    yield from _sections(
        ("imposed", "Loads and temperatures from instrument records"),
        contents.imposed,
        lambda name, one: _imposed_blocks(one),
    )
    yield from _sections(
        ("temperature", "Trends with temperature"),
        contents.temperature,
        lambda name, one: _temperature_blocks(name, one, figures),
    )
    yield from _sections(
        ("rupture", "Rupture"),
        contents.rupture,
        lambda name, one: _rupture_blocks(name, one, figures, strengths=identified),
    )
    yield from _sections(
        ("forecasts", "Forecasts"),
        contents.forecasts,
        lambda name, one: forecast_blocks(name, one, figures, names=names),
    )
    yield from _sections(
        ("design", "Further tests"), contents.design, lambda name, one: _design_blocks(name, one, figures, names=names)
    )


Result = TypeVar("Result")


def _sections(
    head: tuple[str, str], results: Mapping[str, Result], blocks_of: Callable[[str, Result], list[Block]]
) -> Iterator[PageSection]:
    """The section of a stage: of several results each has a section of its own. head : identifier and title."""
    identifier, title = head
    said = RESULTS[identifier]
    if len(results) == 1:
        (name, result), *_ = results.items()
        yield PageSection(identifier, title, blocks_of(name, result), result=said(result))
    elif results:
        inner = [
            PageSection(f"{identifier}-{k}", printable(name, 120) or "All tests", blocks_of(name, result))
            for k, (name, result) in enumerate(results.items(), start=1)
        ]
        yield PageSection(identifier, title, (), inner, result=f"{len(results)} results")


def _asked_text(forecast: Forecast) -> str:
    """What the first test of a forecast shows."""
    figures = asked_figures(forecast)
    more = f"; {len(forecast.tests) - 1} more" if len(forecast.tests) > 1 else ""
    return f"{figures[0].name} {figures[0].text(number)}, {figures[0].where}{more}" if figures else "nothing predicted"


RESULTS: dict[str, Callable[[Any], str]] = {
    "extraction": lambda one: f"{', '.join(one.outputs)} of {plural(int(one.used.sum()), 'frame')}".replace("_", " "),
    "imposed": lambda one: f"lag of the clocks {number(one.alignment.lag, 4)} s",
    "temperature": lambda one: "how the values change with temperature",
    "rupture": lambda one: f"{plural(len(one.ranked), 'method')} compared",
    "forecasts": _asked_text,
    "design": lambda one: f"{plural(len(one.tests), 'planned test')} compared",
}
"""{section: the line that says its result}."""


def _of(name: str) -> str:
    return f" of {printable(name, 80)}" if name else ""


def _extraction_blocks(name: str, extraction: Extraction, figures: PageFigures) -> list[Block]:
    used = int(extraction.used.sum())
    outputs = ", ".join(output.replace("_", " ") for output in extraction.outputs)
    picture = figures.picture(
        lambda: extraction_figure(extraction),
        f"Extraction{_of(name)}",
        f"Maps of height of some frames, and over time {outputs}, rigid motion and residuals; {used} of "
        f"{extraction.times.size} frames were used, {plural(len(extraction.flags), 'flag')}.",
        f"Extraction{_of(name)}: maps of height, outputs with 95 % bands, rigid motion and residuals; flagged frames "
        "in red.",
    )
    return [picture, Verbatim("What was extracted, and how well", printable_lines(extraction_text(extraction)))]


def _imposed_blocks(under: Imposed) -> list[Block]:
    """The alignment of the clocks with its interval, and how well programs follow the record."""
    alignment = under.alignment
    low, high = alignment.lag_interval
    lag = f"The clock of the record is ahead of that of the camera by {number(alignment.lag, 5)} s"
    found = (
        f"(95 % interval {number(low, 5)} to {number(high, 5)} s), found from the changes of load in "
        f"{alignment.frames} frames."
    )
    return [
        Paragraph(f"{lag} {found}" if alignment.lags.size else f"{lag}, as was stated."),
        Verbatim("Alignment of the clocks", printable_lines(alignment_text(alignment))),
        Verbatim("What was imposed", printable_lines(imposed_text(under))),
    ]


def _temperature_blocks(name: str, result: TemperatureStudy | TemperatureLaw, figures: PageFigures) -> list[Block]:
    from creepkit.discovery.discover import TemperatureStudy

    law = result.temperature_law if isinstance(result, TemperatureStudy) else result
    rejected = _rejection(result)
    blocks: list[Block] = []
    if rejected is not None:
        note = "what follows are values and trends of that law alone, and no properties of the material"
        blocks.append(Paragraph(sentence(f"the law of this section does not fit the tests: it {rejected}; {note}")))
    if law is not None:
        low, high = law.temperature_range
        forms = ", ".join(f"{parameter} {form}" for parameter, form in law.forms.items())
        blocks.append(
            Paragraph(
                f"From {celsius_text(low, high)} the parameters follow these forms best: {forms}. The values are "
                f"those at {celsius_text(law.T_ref)}."
            )
        )
        rows = [
            (
                e.name,
                *with_interval(e.value, e.low, e.high, bound_marks(law.law, e)),
                "" if e.unit == "1" else e.unit,
                e.verdict if rejected is None else LAW_REJECTED,
            )
            for e in law.estimates
        ]
        columns = ("parameter", "value", "95 % interval", "unit", "by these tests")
        blocks.append(Table("Values of the temperature law", columns, rows, numeric=(1, 2)))
        blocks.append(
            figures.picture(
                lambda: plot_temperature_law(law),
                f"Parameters over temperature{_of(name)}",
                f"Isothermal estimates with 95 % intervals at {law.isothermal_estimates.temperatures.size} "
                f"temperatures from {celsius_text(low, high)}, and the curves of the forms that remain. "
                f"Best forms: {forms}.",
                "Parameters at each temperature with 95 % intervals, and the forms that remain with their weights.",
            )
        )
    if isinstance(result, TemperatureStudy):
        blocks += [Paragraph(sentence(printable(note, 600))) for note in result.notes]
    text = temperature_study_text(result) if isinstance(result, TemperatureStudy) else temperature_law_text(result)
    return [*blocks, Verbatim("The temperature law in full", printable_lines(text))]


def _rejection(result: TemperatureStudy | TemperatureLaw) -> Adequacy | None:
    """What the law of a study of temperature leaves unexplained; None where it fits, or where nobody knows."""
    from creepkit.discovery.discover import TemperatureStudy

    law = result.temperature_law if isinstance(result, TemperatureStudy) else result
    adequacy = None if law is None else law.adequacy
    if adequacy is None and isinstance(result, TemperatureStudy) and result.joint_fit is not None:
        adequacy = result.joint_fit.adequacy
    return adequacy if adequacy is not None and adequacy.rejects else None


def strength_blocks(assessment: RuptureAssessment) -> list[Block]:
    """The verdict of a rupture assessment, and its strengths in a table."""
    heads, rows, note = strength_rows(assessment)
    columns = ("method", *heads[1:-1], "remarks")
    cells = [tuple(map(printable, row)) for row in rows]
    table = Table("Creep rupture strengths in MPa, with bounds in brackets", columns, cells, numeric=(2, 3))
    blocks: list[Block] = [Paragraph(sentence(assessment.verdict), "lead"), table]
    return [*blocks, Paragraph(sentence(note), "note")] if note else blocks


def _rupture_blocks(name: str, assessment: RuptureAssessment, figures: PageFigures, *, strengths: bool) -> list[Block]:
    picture = figures.picture(
        lambda: rupture_figure(assessment),
        f"Rupture assessment{_of(name)}",
        f"Isotherms of stress over rupture time with tests and bounds, the master curve, and predicted over measured "
        f"times of {plural(len(assessment.tests), 'test')}.",
        "Isotherms with tests and bounds; master curve; predicted against measured times. Broken lines lie beyond the "
        "stresses tested.",
    )
    text = Verbatim("Methods and checks", printable_lines(rupture_text(assessment, strengths=False)))
    return [*(strength_blocks(assessment) if strengths else []), picture, text]


def forecast_blocks(
    name: str, forecast: Forecast, figures: PageFigures, *, names: LawNames | None = None
) -> list[Block]:
    """A table and curves of forecasts. names : of laws in its sentences; by default as commands know them."""
    names = names or LawNames(())
    laws = ", ".join(f"{names.in_text(law)} ({weight:.2g})" for law, weight in forecast.laws.items())
    blocks: list[Block] = [
        Paragraph(
            f"By {laws}: if {right_law(forecast)}, bands and intervals hold a measured value of a single test with a "
            f"probability of {100 * forecast.level:g} %."
            + (
                " The tests contradict the law: what it misses of their rates is in the bands, and what it misses of "
                "the shape of their curves only as far as its estimated misfit goes."
                if forecast.rejected
                else ""
            )
        ),
        _forecast_table(forecast),
    ]
    if any(test.outputs for test in forecast.tests):
        ends = " ".join(sentence(f"{printable(row[0], 80)}: {row[2]}") for row in _forecast_cells(forecast)[:12])
        blocks.append(
            figures.picture(
                lambda: forecast_figure(forecast),
                f"Forecasts{_of(name)}",
                "Forecast curves over time with pointwise and simultaneous bands, and what the variance is made of. "
                f"{ends}",
                f"Forecast with bands of {100 * forecast.level:g} % (drawn), and below it shares of the variance, "
                "which are of first order.",
            )
        )
    remarks: dict[str, list[str]] = {}
    for test in forecast.tests:
        for note in test.notes:
            remarks.setdefault(note, []).append(printable(test.name, 80))
    listed = [sentence(f"{names.in_text(note)} ({', '.join(tests)})") for note, tests in remarks.items()]
    return [*blocks, Items(listed)] if listed else blocks


def _forecast_table(forecast: Forecast) -> Table:
    """A table of tests without the columns that are empty."""
    rows = _forecast_cells(forecast)
    kept = [k for k in range(len(FORECAST_COLUMNS)) if any(row[k] for row in rows)]
    columns = [FORECAST_COLUMNS[k] for k in kept]
    return Table("Forecasts of single tests", columns, [[row[k] for k in kept] for row in rows])


def _forecast_cells(forecast: Forecast) -> list[tuple[str, ...]]:
    """Rows of the table; what stands on lines of its own in a terminal is parted by semicolons."""
    rows = []
    for test, condition, end, *cells in forecast_rows(forecast):
        parted = ["; ".join(cell.splitlines()) for cell in cells]
        rows.append(tuple(map(printable, (test, condition, end, *parted))))
    return rows


def _design_blocks(name: str, design: Design, figures: PageFigures, *, names: LawNames) -> list[Block]:
    verdict = sentence(names.in_text(design.sentence))
    blocks: list[Block] = [Paragraph(verdict, "lead")]
    if design.tests:
        to_decide = design.goal == "law"
        rows = [
            (
                printable(test.description, 200),
                number(test.hours, 3),
                *((number(test.expectation.probability, 2),) if to_decide else ()),
                number(test.expectation.information, 2),
                number(test.information_per_hour, 2),
            )
            for test in design.tests[:MOST_DESIGNS]
        ]
        probability = ("probability, decisive and right",) if to_decide else ()
        columns = ("planned test", MACHINE_TIME, *probability, "expected information, nats", "nats per hour")
        caption = (
            f"The first of {plural(len(design.tests), 'planned test')} considered, {order_text(design)}; goal: "
            f"{design.goal}. A nat of information divides the volume of what is likely by 2.7"
        )
        blocks.append(Paragraph(sentence(names.in_text(cheapest_text(design)))))
        blocks.append(Table(caption, columns, rows, numeric=tuple(range(1, len(columns)))))
        blocks.append(
            figures.picture(
                lambda: design_figure(design),
                f"What further tests tell{_of(name)}",
                "Map of the expected information for an hour of machine time over first load and duration, left of "
                "constant loads, right of loads that change.",
                "Expected information for an hour of machine time over first load and duration; the plan is marked. "
                f"{cells_text(design)}.",
                shows_values=True,
            )
        )
    lines = [line.strip() for line in direction_lines(design) if line.strip()]
    remarks = [*lines[1:], *(design.notes if design.tests else ())]
    return [*blocks, Items([sentence(names.in_text(text)) for text in remarks])] if remarks else blocks
