"""Text, JSON and plot of a design: the advice, a table of planned tests, and a map of what they tell for each hour."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.experiments.planned_design import ALIKE, kind_of_reason, precision_text
from creepkit.inverse.information_criteria import DECISIVE_WEIGHT
from creepkit.records import SECONDS_PER_HOUR, load_unit
from creepkit.reports.blocks import Block, Items, Paragraph, Table, as_text, plural
from creepkit.reports.figures import panel_grid, wrapped
from creepkit.reports.json_values import fields_to_json

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.experiments.expectations import Expectation
    from creepkit.experiments.planned_design import Design, PlannedTest
    from creepkit.reports.svg import PageFigures


ROWS, MOST_TICKS = 8, 8
"""Tests in a table, and labels along an axis of the map."""


def design_text(design: Design) -> str:
    """The advice, the best tests in a table, and what else is to be said."""
    return as_text(design_blocks(design))


def design_blocks(design: Design, figures: PageFigures | None = None, of: str = "") -> list[Block]:
    """The advice, a table of the best tests, with `figures` the map, and what else is to be said."""
    blocks: list[Block] = [Paragraph(design.sentence, "lead")]
    if design.tests:
        blocks.append(_table(design))
        if figures is not None:
            caption = (
                "Expected information for an hour of machine time over first load and duration; the plan is marked. "
            )
            picture = figures.picture(
                lambda: design_figure(design),
                f"What further tests tell{of}",
                "Map of the expected information for an hour of machine time over first load and duration, left of "
                "constant loads, right of loads that change.",
                f"{caption}{cells_text(design)}.",
                shows_values=True,
            )
            blocks.append(picture)
    reasons: dict[str, list[str]] = {}
    for description, reason in design.left_out:
        reasons.setdefault(kind_of_reason(reason), []).append(description)
    lines = [f"left out: {len(names)} that {reason} ({names[0]})" for reason, names in reasons.items()]
    lines += design.notes if design.tests else ()
    return [*blocks, Items(lines)] if lines else blocks


def _table(design: Design) -> Table:
    last = {"law": "probability, decisive and right", "parameters": "standard deviations, before > after"}.get(
        design.goal, "sd after"
    )
    rows = []
    for test in design.tests[:ROWS]:
        e = test.expectation
        sds = [f"{name} {e.current_parameter_sd[name]:.3g} > {sd:.3g}" for name, sd in e.parameter_sd.items()]
        cell = ", ".join(sds) if design.goal == "parameters" else precision_text(e.sd, design.unit)
        cell = f"{e.probability:.2f}" if design.goal == "law" else cell
        numbers = (f"{test.hours:.3g}", f"{e.information:.2g}", f"{test.information_per_hour:.2g}")
        rows.append((test.description, *numbers, cell))
    caption = (
        f"the first of {plural(len(design.tests), 'planned test')} considered, {order_text(design)}; goal: "
        f"{design.goal}. A nat of information divides the volume of what is likely by 2.7"
    )
    columns = ("planned test", "machine time with setting up, h", "nats", "nats / h", last)
    return Table(caption, columns, rows, numeric=(1, 2, 3))


def order_text(design: Design) -> str:
    """By what the planned tests are ordered, as a sentence."""
    if design.goal != "law":
        return "in the order of the expected information for each hour of machine time"
    return (
        f"in the order: tests with a probability of {DECISIVE_WEIGHT:g} or more of a decisive and right verdict, the "
        f"shortest first; then the others by that probability in steps of {ALIKE:g}, and within a step by the expected "
        "information; tests that were judged over the uncertainty of the parameters stand before all that were judged "
        "at their estimates alone, which flatters them"
    )


def design_to_json(design: Design) -> dict[str, object]:
    """Laws, advice, plan and every test considered, as JSON-able data."""

    def row(test: PlannedTest) -> dict[str, Any]:
        return {
            "description": test.description,
            "oven_hours": test.hours,
            "information_per_hour": test.information_per_hour,
            "at_draws": test.at_draws,
            "tests": [
                {
                    "specimen": h.specimen,
                    "loading": {
                        "quantity": h.loading.quantity,
                        "times": h.loading.program().times.tolist(),
                        "values": h.loading.program().values.tolist(),
                    },
                    "temperature": h.mean_temperature,
                    "geometry": dict(h.geometry),
                    "duration": float(h.times[-1]),
                }
                for h in test.histories
            ],
            **_expectation_to_json(test.expectation),
        }

    return {
        "goal": design.goal,
        "laws": dict(zip(design.laws, design.weights, strict=True)),
        "to_exclude": list(design.altered),
        "advice": design.sentence,
        "budget": design.budget,
        "plan": [row(test) for test in design.plan],
        "plan_oven_hours": sum(test.hours for test in design.plan),
        "expected": None if design.expected is None else _expectation_to_json(design.expected),
        "tests": [row(test) for test in design.tests],
        "left_out": dict(design.left_out),
        "notes": list(design.notes),
    }


def _expectation_to_json(e: Expectation) -> dict[str, Any]:
    numbers = {name: float(getattr(e, name)) for name in ("sd", "current_sd", "probability", "wrong")}
    known: dict[str, Any] = {"information": float(e.information)}
    known |= {name: value for name, value in numbers.items() if np.isfinite(value)}
    if e.parameter_sd:
        known |= fields_to_json(e, "parameter_sd current_parameter_sd")
    if e.chi_squares:
        known["chi_squares"] = [
            {"true": c.reference_law, "alternative": c.alternative_law, **fields_to_json(c, "current expected")}
            for c in e.chi_squares
        ]
    return known


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
