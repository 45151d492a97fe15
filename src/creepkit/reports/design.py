"""What a design says: the next test and what it tells, a table of planned tests, a map of what they tell each hour."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.experiments.planned_design import ALIKE, USEFUL_PROBABILITY, kind_of_reason, precision_text
from creepkit.inverse.evidence import DECISIVE_WEIGHT
from creepkit.records import SECONDS_PER_HOUR, load_unit
from creepkit.reports.answer import MOST_CAUTIONS
from creepkit.reports.blocks import Answer, Block, Items, Table, listed, plural
from creepkit.reports.figures import panel_grid, wrapped
from creepkit.reports.words import DESIGN

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.experiments.expectations import Expectation
    from creepkit.experiments.planned_design import Design, PlannedTest
    from creepkit.reports.svg import PageFigures


ROWS, MOST_NEXT, MOST_TICKS = 8, 3, 8
"""Tests in a table, those named after the first, and labels along an axis of the map."""


def design_sentence(design: Design) -> str:
    """The advice: what to make, and what it is expected to tell."""
    first = {"law": design.laws[0]}
    if design.obstacle:
        return DESIGN[design.obstacle].format(**first)
    if not design.tests:
        said = listed([f"{count} {reason}" for reason, count in _refusals(design).most_common()])
        return DESIGN["none" if design.left_out else "nothing"].format(count=len(design.left_out), reasons=said)
    best = design.tests[0]
    if _is_hopeless(design):
        return DESIGN["hopeless"].format(test=best.description, probability=f"{best.expectation.probability:.2f}")
    if len(design.plan) > 1 and design.expected is not None:
        return DESIGN["plan"].format(count=len(design.plan), told=_told(design, design.expected))
    run = design.plan[0] if design.plan else best
    return DESIGN["test"].format(test=run.description, told=_told(design, run.expectation))


def _is_hopeless(design: Design) -> bool:
    """Whether no test is likely to decide between the laws."""
    expected = [test.expectation for test in design.tests] + [one for one in [design.expected] if one is not None]
    return design.goal == "law" and bool(max((e.probability for e in expected), default=1.0) < USEFUL_PROBABILITY)


def _refusals(design: Design) -> Counter[str]:
    """Why candidates were left out, and how many each."""
    return Counter(kind_of_reason(reason) for _, reason in design.left_out)


def _told(design: Design, expected: Expectation) -> str:
    """What a test is expected to tell, as the end of a sentence."""
    if design.goal == "law":
        return DESIGN["decides"].format(probability=f"{expected.probability:.2f}")
    if np.isfinite(expected.sd):
        before, after = (precision_text(sd, design.unit) for sd in (expected.current_sd, expected.sd))
        return DESIGN["narrows"].format(quantity=design.goal, before=before, after=after)
    factor = np.exp(-expected.information / max(len(expected.parameter_sd), 1))
    return DESIGN["shrinks"].format(factor=f"{factor:.2g}")


def _question(design: Design) -> str:
    """Between which laws planned tests decide."""
    if len(design.laws) == 1:
        return DESIGN["from"].format(law=design.laws[0], others=listed(design.altered))
    return DESIGN["apart"].format(laws=listed(design.laws)) + DESIGN["and beside"] * bool(design.altered)


def design_answer(design: Design, picture: Block | None = None) -> Answer:
    """The next test or the runs of the plan, what they tell, the next best, what to mind and what to do."""
    runs = design.plan or design.tests[:1]
    hours = f"{_hours(sum(run.hours for run in runs))} h of machine time with setting up"
    alike = {run.description: [one for one in runs if one.description == run.description] for run in runs}
    shown = [(plural(len(same), "run"), same[0]) for same in alike.values() if len(runs) > 1]
    shown += [("next best", test) for test in design.tests if test.description not in alike][:MOST_NEXT]
    told = [(_precision(design, run.expectation), f"{_hours(run.hours)} h of machine time") for _, run in shown]
    figures = [(f"{name}, {run.description}", "", *said) for (name, run), said in zip(shown, told, strict=True)]
    obstacle = design.obstacle or "one law" * _is_hopeless(design)
    limit = next((reason for reason, _ in _refusals(design).most_common(1)), "none")
    return Answer(
        design.sentence,
        f"{hours}; {plural(len(design.tests), 'test')} considered" if runs else "",
        figures=figures,
        cautions=design.notes[:MOST_CAUTIONS],
        next_step=DESIGN[f"next {obstacle or ('make' if runs else limit)}"],
        remarks=[_question(design)] if design.goal == "law" and runs else [],
        picture=picture,
        more=".details(), or creepkit design --json",
    )


def _hours(hours: float) -> str:
    return f"{float(f'{hours:.3g}'):g}"


def _precision(design: Design, expected: Expectation) -> str:
    """What a test tells, in few words."""
    if design.goal == "law":
        return f"probability {expected.probability:.2f}"
    sd = precision_text(expected.sd, design.unit)
    return f"standard deviation {sd}" if np.isfinite(expected.sd) else f"{expected.information:.2g} nats"


def design_blocks(design: Design, figures: PageFigures | None = None, of: str = "") -> list[Block]:
    """The answer, with `figures` with the map, a table of the best tests, and what else is to be said."""
    drawn = None
    if figures is not None and design.tests:
        caption = "Expected information for an hour of machine time over first load and duration; the plan is marked. "
        drawn = figures.picture(
            lambda: design_figure(design),
            f"What further tests tell{of}",
            "Map of the expected information for an hour of machine time over first load and duration, left of "
            "constant loads, right of loads that change.",
            f"{caption}{cells_text(design)}.",
            shows_values=True,
        )
    blocks: list[Block] = [design_answer(design, drawn), *([_table(design)] if design.tests else [])]
    reasons: dict[str, list[str]] = {}
    for description, reason in design.left_out:
        reasons.setdefault(kind_of_reason(reason), []).append(description)
    lines = [f"left out: {len(names)} that {reason} ({names[0]})" for reason, names in reasons.items()]
    lines += design.notes[MOST_CAUTIONS:] if design.tests else ()
    return [*blocks, Items(lines)]


def _table(design: Design) -> Table:
    """The best tests, with the standard deviations that they leave or the probability that they decide."""
    head = {"law": "probability, decisive and right"}.get(design.goal, "standard deviation")
    heads, rows = [head], list[tuple[str, ...]]()
    if design.goal == "parameters":
        now = design.tests[0].expectation.current_parameter_sd
        heads = [f"sd of {name}" for name in now]
        rows.append(("without a further test", *["–"] * 3, *(f"{sd:.3g}" for sd in now.values())))
    for test in design.tests[:ROWS]:
        e = test.expectation
        told = [f"{sd:.3g}" for sd in e.parameter_sd.values()]
        if design.goal != "parameters":
            told = [f"{e.probability:.2f}" if design.goal == "law" else precision_text(e.sd, design.unit)]
        nats = (f"{one:.2g}" if one else "–" for one in (e.information, test.information_per_hour))
        rows.append((test.description, _hours(test.hours), *nats, *told))
    caption = ORDER_BY_LAW if design.goal == "law" else ORDER
    columns = ("planned test", "machine time, h", "nats", "nats / h", *heads)
    return Table(caption, columns, rows)


ORDER = "the best tests, by the expected information for each hour of machine time; by a nat 2.7 times as much is known"


ORDER_BY_LAW = (
    f"the best tests: of those that decide with a probability of {DECISIVE_WEIGHT:g} the shortest first, then by that "
    f"probability in steps of {ALIKE:g}, within a step by information"
)
"""By what planned tests are ordered."""


# ---- map -------------------------------------------------------------------------------------------------------------


def design_figure(design: Design) -> Figure:
    """What candidates tell for each hour of machine time, over the first load and the duration; the best of each place.

    Each cell stands for one test: of those of its first load and duration the first in the order of the design,
    whatever its second load, temperature and dimensions. Left: constant loads; right: the load changes during the test.
    The colour is to first order about the estimates, which is what is known of all candidates alike; the number is
    the probability of a decisive and right verdict that tables give. The runs of the plan are marked. Of several
    specimens that of the best test is drawn.
    """
    figure, panels = panel_grid(2, 2, 5.25, 5.0)
    images = [*_draw_map(panels[0], design, constant=True), *_draw_map(panels[1], design, constant=False)]
    if images:
        figure.colorbar(images[0], ax=panels, label="information to first order, nats per hour of machine time")
    figure.suptitle(wrapped(f"{design.sentence}. {cells_text(design)}", 10.0, 9.0), fontsize=9)
    return figure


def draw_design(axes: Axes, design: Design) -> None:
    """The map of the tests of constant load, or, where the best test is none of them, of those whose load changes."""
    _draw_map(axes, design, constant=not design.tests or _is_constant(design.best))


def cells_text(design: Design) -> str:
    """What a cell of the map stands for and what its number says, in sentences."""
    told = "A cell: of the tests of that first load and duration the first in the order of the table, whatever its "
    told += "second load and temperature"
    if design.goal != "law":
        return told
    return f"{told}; its number: the probability of a decisive and right verdict, as in the table"


def _place(test: PlannedTest) -> tuple[float, float]:
    """First load, and duration in h."""
    return round(test.first_level, 6), round(test.duration / SECONDS_PER_HOUR, 6)


def _draw_map(panel: Axes, design: Design, *, constant: bool) -> list[Any]:
    """One cell for each load and duration, of the first of the tests there (ordered); its probability as a number."""
    specimen = design.best.histories[0].specimen if design.tests else ""
    drawn = [test for test in design.tests if test.histories[0].specimen == specimen]
    largest = max([1e-9, *(test.first_order_per_hour for test in drawn)])
    tests, plan = ([t for t in group if _is_constant(t) == constant] for group in (drawn, design.plan))
    plan = [t for t in plan if _place(t) in map(_place, tests)]
    title = "constant load" if constant else "the load changes during the test"
    panel.set(title=title, xlabel=_load_label(design), ylabel="duration, h")
    if not tests:
        panel.text(0.5, 0.5, "none considered", transform=panel.transAxes, ha="center")
        return []
    best = {_place(test): test for test in reversed(tests)}
    loads, durations = (sorted({place[k] for place in best}) for k in (0, 1))
    values = np.full((len(durations), len(loads)), np.nan)
    for (load, duration), test in best.items():
        row, column = durations.index(duration), loads.index(load)
        values[row, column] = test.first_order_per_hour
        colour = "k" if test.first_order_per_hour > 0.6 * largest else "w"
        if np.isfinite(test.expectation.probability):
            text = f"{test.expectation.probability:.2f}"
            panel.text(column, row, text, ha="center", va="center", fontsize=7, color=colour)
    image = panel.imshow(values, vmin=0.0, vmax=largest, aspect="auto", origin="lower")
    for set_ticks, ticks in ((panel.set_xticks, loads), (panel.set_yticks, durations)):
        step = -(-len(ticks) // MOST_TICKS)
        set_ticks(range(0, len(ticks), step), [f"{tick:.3g}" for tick in ticks[::step]])
    for k, (load, duration) in enumerate(map(_place, plan)):
        place = (loads.index(load), durations.index(duration))
        panel.plot(*place, "s", ms=24, mfc="none", mec="r", mew=2, label=None if k else "plan")
    if plan:
        panel.legend(loc="best", frameon=True, markerscale=0.4)
    return [image]


def _is_constant(test: PlannedTest) -> bool:
    values = test.histories[0].loading.program().values
    values = values[values > 0]
    return bool(np.ptp(values) <= 1e-6 * values.max())


def _load_label(design: Design) -> str:
    if not design.tests:
        return "load"
    first = design.tests[0].histories[0]
    unit = load_unit(first)
    return f"first {first.loading.quantity}, {unit}" if unit else first.loading.quantity
