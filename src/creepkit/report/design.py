"""Text, JSON and plot of a design: the advice, a table of planned tests, and a map of what they tell for each hour."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats
from creepkit.report.figures import empty_figure, save_figure, wrapped
from creepkit.report.terminal import print_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh
    from matplotlib.figure import Figure

    from creepkit.experiments.design import Design, PlannedTest
    from creepkit.experiments.expectations import Expectation


ROWS = 8
"""Tests in a table."""


USEFUL_INFORMATION = 0.05
"""Nats below which a test tells next to nothing."""


def design_sentence(design: Design) -> str:
    """The advice: what to make, what it is expected to tell, and the next best."""
    if design.goal == "law" and len(design.laws) < 2:
        return f"one law remains, {design.laws[0]}: no further test is needed to tell laws apart"
    if not design.tests:
        reasons = dict.fromkeys(f"that {_kind_of(reason)}" for _, reason in design.left_out)
        return f"no test can be made: there are only candidates {' or '.join(reasons)}" if reasons else "no candidates"
    best, *others = design.tests
    if design.goal == "law" and _largest_information(design) < USEFUL_INFORMATION:
        return (
            f"none of the {len(design.tests)} tests considered tells {_and(design.laws)} apart; the most informative "
            f"is {best.description} ({_short(design, best.expectation)})"
        )
    if design.budget is not None and len(design.plan) > 1 and design.expected is not None:
        runs = "; then ".join(test.description for test in design.plan)
        total = sum(test.hours for test in design.plan)
        return f"{runs} ({total:.3g} h of the oven): together {_told(design, design.expected)}"
    first = design.plan[0] if design.plan else best
    others = [test for test in design.tests if test is not first]
    further = f"; next best {others[0].description} ({_short(design, others[0].expectation)})" if others else ""
    return f"{first.description} ({first.hours:.3g} h of the oven): {_told(design, first.expectation)}{further}"


def _largest_information(design: Design) -> float:
    best = max(test.expectation.information for test in design.tests)
    return best if design.expected is None else max(best, design.expected.information)


def _and(names: tuple[str, ...]) -> str:
    return " and ".join(names) if len(names) < 3 else f"{', '.join(names[:-1])} and {names[-1]}"


def _told(design: Design, expected: Expectation) -> str:
    """What a test is expected to tell, as the end of a sentence."""
    if design.goal == "law":
        return f"separates {_and(design.laws)} with probability {expected.probability:.2f}"
    if np.isfinite(expected.sd):
        return (
            f"brings the standard deviation of the {design.goal} from {_sd(expected.current_sd)} to {_sd(expected.sd)}"
        )
    shrinkage = np.exp(-expected.information / max(len(expected.parameter_sd), 1))
    return (
        f"tells {expected.information:.2g} nats of the parameters: their intervals become {shrinkage:.2g} times as "
        "wide in the geometric mean"
    )


def _sd(value: float) -> str:
    return f"{100 * value:.2g} %" if value < 1 else f"a factor of {np.exp(min(value, 50.0)):.2g}"


def _short(design: Design, expected: Expectation) -> str:
    if design.goal == "law":
        return f"{expected.probability:.2f}"
    return _sd(expected.sd) if np.isfinite(expected.sd) else f"{expected.information:.2g} nats"


def _columns(design: Design) -> tuple[str, ...]:
    last = {"law": "probability of a right verdict", "parameters": "standard deviations"}.get(design.goal, "sd after")
    return ("planned test", "oven, h", "nats", "nats / h", last)


def _cells(design: Design, test: PlannedTest) -> tuple[str, ...]:
    e = test.expectation
    if design.goal == "law":
        last = f"{e.probability:.2f}"
    elif design.goal == "parameters":
        last = ", ".join(f"{name} {sd:.2g}" for name, sd in e.parameter_sd.items())
    else:
        last = _sd(e.sd)
    return (test.description, f"{test.hours:.3g}", f"{e.information:.2g}", f"{test.information_per_hour:.2g}", last)


def design_text(design: Design) -> str:
    """The advice, the best tests in a table, and of the law the chi-squares of the first in every direction."""
    lines = [design.sentence]
    if design.tests:
        rows = [_columns(design), *(_cells(design, test) for test in design.tests[:ROWS])]
        widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
        lines += ["", *("  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip() for row in rows)]
    lines += direction_lines(design)
    return "\n".join(lines + _ending(design))


def direction_lines(design: Design) -> list[str]:
    """The expected chi-squares of the first planned test, a line for each direction."""
    first = design.plan[0] if design.plan else design.tests[0] if design.tests else None
    if first is None or not first.expectation.chi_squares:
        return []
    lines = ["", f"expected chi-squares with {first.description}:"]
    for each in first.expectation.chi_squares:
        lines.append(
            f"  if {each.reference_law} holds, {each.alternative_law} is worse by {each.expected:.3g} "
            f"(now {each.current:.3g})"
        )
    return lines


def _ending(design: Design) -> list[str]:
    reasons: dict[str, list[str]] = {}
    for description, reason in design.left_out:
        reasons.setdefault(_kind_of(reason), []).append(description)
    lines = [f"left out: {len(names)} that {reason} ({names[0]})" for reason, names in reasons.items()]
    if design.interrupted:
        lines.append("stopped before the end: the best so far")
    return ["", *lines, *design.notes] if lines or design.notes else []


def _kind_of(reason: str) -> str:
    """A reason without its numbers, so that alike ones are counted together."""
    kinds = {"rupture": "would rupture", "noises": "would hardly grow", "beyond": "would grow too far"}
    return next((kind for word, kind in kinds.items() if word in reason), reason)


def print_design(design: Design) -> None:
    """Print the table, the advice and what was left out, as wide as the terminal."""
    if design.tests:
        rows = [_cells(design, test) for test in design.tests[:ROWS]]
        print_table(f"{len(design.tests)} planned tests, goal: {design.goal}", _columns(design), rows)
    print("\n".join([design.sentence, *direction_lines(design), *_ending(design)]))


def design_to_json(design: Design) -> dict[str, object]:
    """Laws, advice, plan and every test considered, as JSON-able data."""

    def row(test: PlannedTest) -> dict[str, object]:
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
        "advice": design.sentence,
        "budget": design.budget,
        "plan": [test.description for test in design.plan],
        "plan_oven_hours": sum(test.hours for test in design.plan),
        "expected": None if design.expected is None else _expectation_to_json(design.expected),
        "interrupted": design.interrupted,
        "tests": [row(test) for test in design.tests],
        "left_out": dict(design.left_out),
        "notes": list(design.notes),
    }


def _expectation_to_json(e: Expectation) -> dict[str, object]:
    known: dict[str, object] = {"information": float(e.information)}
    for name in ("sd", "current_sd", "probability", "wrong"):
        value = float(getattr(e, name))
        if np.isfinite(value):
            known[name] = value
    if e.parameter_sd:
        known["parameter_sd"] = dict(e.parameter_sd)
    if e.chi_squares:
        known["chi_squares"] = [
            {
                "true": c.reference_law,
                "alternative": c.alternative_law,
                "current": c.current,
                "expected": c.expected,
                "refitted": c.refitted,
            }
            for c in e.chi_squares
        ]
    return known


# ---- map -------------------------------------------------------------------------------------------------------------


def design_figure(design: Design, path: str | Path | None = None) -> Figure:
    """What candidates tell for each hour of the oven, over the first load and the duration; the best of each place.

    Left: constant loads; right: the load changes during the test. The runs of the plan are marked.
    """
    figure = empty_figure(10.5, 5.0)
    axes = figure.subplots(1, 2, sharex=True, sharey=True)
    rates = [test.information_per_hour for test in design.tests] or [1.0]
    largest = max(*rates, 1e-9)
    groups = [[t for t in design.tests if _is_constant(t)], [t for t in design.tests if not _is_constant(t)]]
    drawn = None
    for panel, tests, title in zip(axes, groups, ("constant load", "the load changes during the test"), strict=True):
        drawn = _draw_map(panel, tests, largest) or drawn
        panel.set_title(title)
        for k, test in enumerate(t for t in design.plan if _is_constant(t) == (title == "constant load")):
            label = "plan" if k == 0 else None
            panel.plot(test.first_level, test.candidate.duration / 3600.0, "*", ms=16, mfc="w", mec="k", label=label)
        if any(_is_constant(t) == (title == "constant load") for t in design.plan):
            panel.legend(loc="best", frameon=True)
        panel.set_xlabel(_load_label(design))
    axes[0].set_ylabel("duration, h")
    if drawn is not None:
        figure.colorbar(drawn, ax=list(axes), label="expected information, nats per oven hour")
    figure.suptitle(wrapped(design.sentence, 10.0, 9.0), fontsize=9)
    return save_figure(figure, path)


def _draw_map(panel: Axes, tests: list[PlannedTest], largest: float) -> QuadMesh | None:
    """One cell for each load and duration, coloured by the best candidate there; its largest probability beside."""
    if not tests:
        panel.text(0.5, 0.5, "none considered", transform=panel.transAxes, ha="center")
        return None
    best: dict[tuple[float, float], PlannedTest] = {}
    for test in tests:
        place = round(test.first_level, 6), round(test.candidate.duration / 3600.0, 6)
        if place not in best or test.information_per_hour > best[place].information_per_hour:
            best[place] = test
    loads, durations = (sorted({place[k] for place in best}) for k in (0, 1))
    values = np.full((len(durations), len(loads)), np.nan)
    for (load, duration), test in best.items():
        values[durations.index(duration), loads.index(load)] = test.information_per_hour
    mesh = panel.pcolormesh(
        _edges(loads), _edges(durations), values, cmap="viridis", vmin=0.0, vmax=largest, edgecolors="w", linewidth=0.5
    )
    panel.set_xscale("log")
    panel.set_yscale("log")
    for axis, ticks in ((panel.xaxis, loads), (panel.yaxis, durations)):
        shown = ticks if len(ticks) <= 8 else ticks[:: -(-len(ticks) // 8)]
        axis.set_ticks(shown, labels=[f"{tick:.3g}" for tick in shown])
        axis.set_ticks([], minor=True)
    for (load, duration), test in best.items():
        if np.isfinite(test.expectation.probability):
            light = test.information_per_hour > 0.6 * largest
            panel.text(load, duration, f"{test.expectation.probability:.2f}", ha="center", va="center", fontsize=7,
                       color="k" if light else "w")  # fmt: skip
    return mesh


def _edges(centres: list[float]) -> Floats:
    """Edges of cells about centres, geometric."""
    logs = np.log(centres)
    if len(logs) == 1:
        return np.asarray(np.exp(logs[0] + np.array([-0.2, 0.2])))
    middle = 0.5 * (logs[1:] + logs[:-1])
    return np.asarray(
        np.exp(np.concatenate([[1.5 * logs[0] - 0.5 * logs[1]], middle, [1.5 * logs[-1] - 0.5 * logs[-2]]]))
    )


def _is_constant(test: PlannedTest) -> bool:
    values = test.histories[0].loading.program().values
    values = values[values > 0]
    return bool(np.ptp(values) <= 1e-6 * values.max())


def _load_label(design: Design) -> str:
    if not design.tests:
        return "load"
    quantity = design.tests[0].histories[0].loading.quantity
    return "strain" if quantity == "strain" else f"first {quantity}, MPa"
