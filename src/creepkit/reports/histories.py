"""Measured tests as they were understood, by their programs, what is suspect in them, and every output over time."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from creepkit.inverse.reference_conditions import HELD_LOAD
from creepkit.records import (
    SECONDS_PER_HOUR,
    ZERO_CELSIUS,
    History,
    PointLoading,
    Program,
    load_unit,
    output_named,
    output_unit,
)
from creepkit.records.held_levels import held_temperatures, holds, is_isothermal, last_data_time, temperature_holds
from creepkit.records.loading import held_of
from creepkit.records.specimen_lookup import lengths_by_default
from creepkit.records.units import celsius_text, time_text
from creepkit.reports.blocks import Block, Items, Paragraph, Table, as_text, listed, plural
from creepkit.reports.figures import Course, Panels, draw_over_time, over_time
from creepkit.reports.wording import shown_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.quality.flags import DataQuality
    from creepkit.specimens.run import Run


MOST_VALUES = 4
"""Of a label that are told."""


def histories_text(histories: Sequence[History]) -> str:
    """How many tests of what, a row for each, then what holds for all or some of them."""
    head = [Paragraph(_headline(histories))] if len(histories) > 1 else []
    return as_text([*head, _table(histories), Items(_remarks(histories))]).strip("\n")


def _headline(histories: Sequence[History]) -> str:
    """How many tests of which kind, under which loads and temperatures, until when, and how many broke."""
    kinds = [kind for kind, _ in Counter(map(kind_of_test, histories)).most_common(MOST_VALUES)]
    kelvin = [T for one in histories for T in held_temperatures(one)]
    loads = [load_text(one) for one in sorted(histories, key=lambda one: float(np.abs(one.load_levels).max()))]
    temperatures = celsius_text(min(kelvin), max(kelvin), digits=0)
    broken = sum(one.rupture_time is not None for one in histories)
    span = " to ".join(dict.fromkeys([loads[0], loads[-1]]))
    until = time_text(max(float(one.times[-1]) for one in histories))
    found = f"{plural(len(histories), 'test')}: {listed(kinds)}, {span}, {temperatures}, to {until}"
    return f"{found}; {broken} to rupture" if broken else found


def history_blocks(histories: Sequence[History], more: str = "") -> list[Block]:
    """The same for pages; more : what the caption says of tests that are not listed."""
    caption = f"{plural(len(histories), 'test')} as measured{more}"
    return [replace(_table(histories), caption=caption), Items(_remarks(histories))]


def _table(histories: Sequence[History]) -> Table:
    return Table("", ("test: specimen, conditions", "end", "readings", "outputs"), [*map(_row, histories)])


def _remarks(histories: Sequence[History]) -> list[str]:
    """What is prescribed, what strains are, lengths, what was assumed, and labels, with the number of tests each."""
    values: dict[str, Counter[str]] = {}
    for history in histories:
        lengths = {name.replace("_", " "): f"{length:g} mm" for name, length in history.geometry.items()}
        labels = {f"label {key}": value for key, value in history.labels.items() if key != "assumed"}
        for key, value in {**lengths, **labels}.items():
            values.setdefault(key, Counter())[value] += 1
    remarks = [_output_text(one, name) for one in histories if len(histories) == 1 for name in one.outputs]
    remarks += _counted(Counter(map(kind_of_test, histories)), len(histories))
    remarks += _counted(Counter(_strain_text(h) for h in histories if "strain" in h.outputs), len(histories))
    assumed = [line.removeprefix("assumed: ") for line in assumptions_text(histories).splitlines()]
    remarks += [f"assumed: {'; '.join(assumed)}"] * bool(assumed)
    for key, counts in values.items():
        more = f" and {len(counts) - MOST_VALUES} more" if len(counts) > MOST_VALUES else ""
        remarks.append(f"{key}: {'; '.join(_counted(counts, len(histories))[:MOST_VALUES])}{more}")
    return remarks


def _counted(texts: Counter[str], total: int) -> list[str]:
    """Texts, the commonest first, with the number of tests of which each is true."""
    return [f"{text}{_count_text(count, total)}" for text, count in texts.most_common()]


def _row(history: History) -> tuple[str, ...]:
    """Name, specimen and conditions; end; frames; outputs of a test."""
    count, unused = history.times.size, int((~np.asarray(history.used)).sum())
    frames = f"{count} to {history.times[-1] / SECONDS_PER_HOUR:.4g} h{f', {unused} not used' if unused else ''}"
    outputs = [_output_text(history, name) for name in history.outputs]
    if "strain" in history.outputs:
        outputs[0] = f"largest strain {100 * float(np.nanmax(np.abs(history.outputs['strain']))):.4g} %"
    return (
        f"{history.name}: {history.specimen}{history.alloy and f', {history.alloy}'}, {program_text(history)}",
        _end_text(history) or "end not stated",
        frames if history.outputs else "–",
        "; ".join(outputs) or _rate_text(history),
    )


def _count_text(count: int, total: int) -> str:
    return "" if count == total else f" ({count} of {total} tests)"


def _strain_text(history: History) -> str:
    return f"strain is {history.strain_measure}, {'with' if history.includes_elastic else 'without'} its elastic part"


def assumptions_text(histories: Sequence[History]) -> str:
    """One line for each thing that was assumed of tests, with the number of tests; numbers may differ among them."""
    groups: dict[str, dict[int, str]] = {}
    for k, history in enumerate(histories):
        assumed, lengths = history.labels.get("assumed", ""), lengths_by_default(history.specimen, history.geometry)
        listed = "; ".join(f"{name.replace('_', ' ')} {length:g}" for name, length in lengths.items())
        unsaid = [f"lengths by default: {listed} mm"] if lengths and "lengths by default" not in assumed else []
        for text in filter(None, [*assumed.split(", "), *unsaid]):
            groups.setdefault(re.sub(r"\d[\w.:+-]*", "0", text), {}).setdefault(k, text)
    return "\n".join(
        f"assumed: {texts[0]}{' or the like' * (len(set(texts)) > 1)}{_count_text(len(texts), len(histories))}"
        for texts in ([*said.values()] for said in groups.values())
    )


def _output_text(history: History, name: str) -> str:
    values, unit = history.outputs[name], output_unit(name, history.specimen)
    first, last = f"{values[0]:.4g}", f"{values[-1]:.4g}"
    deviation = history.standard_deviation.get(name)
    noise = "" if deviation is None else f", standard deviation {float(np.median(deviation)):.2g}"
    return f"{name} {first} to {last}{unit and f' {unit}'}{noise}"


def _rate_text(history: History) -> str:
    """What is known of a test without frames, beside its end."""
    if history.minimum_rate is None:
        return "no frames"
    sd = "" if history.minimum_rate_sd is None else f" +- {history.minimum_rate_sd:.2g}"
    return f"minimum rate {history.minimum_rate:.4g}{sd} 1/s"


def _end_text(history: History) -> str:
    if history.unruptured and not history.outputs:
        return f"stopped before rupture at {time_text(float(history.times[-1]))}"
    if history.rupture_time is not None:
        return f"ruptured at {time_text(history.rupture_time)}"
    return "stopped before rupture" if history.unruptured else ""


# ---- data quality ----------------------------------------------------------------------------------------------------


def quality_blocks(quality: DataQuality, most: int | None = None) -> list[Block]:
    """How many flags there are, and each; most : that are listed."""
    if not quality.tests:
        return [Paragraph("no test has readings to be checked")]
    if not quality.flags:
        return [Paragraph(f"nothing suspect in {plural(quality.tests, 'test')}")]
    head = f"{plural(len(quality.flags), 'flag')} in {plural(quality.tests, 'test')}; nothing was dropped"
    return [Paragraph(head), Items([str(flag) for flag in quality.flags[:most]])]


# ---- over time -------------------------------------------------------------------------------------------------------


def tests_figure(histories: History | Sequence[History]) -> Figure:
    """A panel for each output of one or several tests, over time; frames that are not used are drawn hollow."""
    return over_time(_outputs(histories))


def draw_tests(axes: Axes, histories: History | Sequence[History]) -> None:
    """The first output of tests over time."""
    draw_over_time(axes, _outputs(histories))


def _outputs(tests: History | Sequence[History]) -> Panels:
    panels: dict[str, list[Course]] = {}
    for history in [tests] if isinstance(tests, History) else tests:
        hours, unused = history.times / SECONDS_PER_HOUR, ~np.asarray(history.used)
        for name, values in history.outputs.items():
            factor, unit = shown_unit(name, history.specimen)
            course = Course(history.name, hours, factor * values, unused)
            panels.setdefault(", ".join(filter(None, (name, unit))), []).append(course)
    return panels or {"": []}


def run_figure(run: Run) -> Figure:
    """Outputs and load of a simulated test over time; outputs of one quantity that grow with creep as one."""
    hours, panels = run.times / SECONDS_PER_HOUR, dict[str, list[Course]]()
    for name, values in run.outputs.items():
        output = output_named(name, run.specimen)
        panels.setdefault(f"{output.quantity if output.grows else name}, {output.unit}".rstrip(", "), []).append(
            Course(output.long_name, hours, values)
        )
    program = run.loading.program()
    knots = np.unique([*program.times[program.times < run.end_time], 0.0, run.end_time])
    label = ", ".join(filter(None, (run.loading.quantity, load_unit(run))))
    panels[label] = [Course(run.reason and f"ended: {run.reason}", knots / SECONDS_PER_HOUR, program.at(knots))]
    return over_time(panels)


# ---- load and temperature programs, "8 → 10 MPa at 4 h, 793 °C" ------------------------------------------------------


MOST_HOLDS = 3
"""Holds that are written one by one; of more, the first, the last and their number."""


EVEN, EVEN_POINTS = 0.02, 41
"""Of the final strain: how far a strain that rises evenly departs from a line; and at how many times that is asked."""


SHORT_RAMP = 0.025
"""Of the time at its end: a longer ramp has both its ends written, such as a step that lies between two readings."""


def program_text(history: History) -> str:
    """Load and temperature over the frames of a test, such as "8 → 10 MPa at 4 h, 793 °C"."""
    return f"{load_text(history)}, {temperature_text(history)}"


def load_text(history: History) -> str:
    """The load program over the frames of a test, such as "8 → 10 MPa at 4 h"."""
    loading = history.loading
    last = last_data_time(history)
    if isinstance(loading, PointLoading):
        parts = [f"stress {name} {_level_text(p, last, ' MPa')}" for name, p in loading.stress.items()]
        return ", ".join(parts + [f"strain {name} {_level_text(p, last, '')}" for name, p in loading.strain.items()])
    if loading.quantity == "strain":
        return _level_text(loading.program(), last, " % strain", 100.0)
    return _level_text(loading.program(), last, f" {load_unit(history)}")


def kind_of_test(history: History) -> str:
    """What is prescribed in a test: "creep under constant load", "constant strain, at which the stress relaxes".

    A strain that rises evenly is "tension at a constant strain rate".
    """
    loading = history.loading
    if isinstance(loading, PointLoading):
        prescribed = [name for name, one in (("stress", loading.stress), ("strain", loading.strain)) if one]
        return f"prescribed components of {' and '.join(prescribed)}"
    program, last = loading.program(), last_data_time(history)
    pieces = holds(program, last, HELD_LOAD * float(np.abs(program.values).max()))
    levels = "constant" if len(pieces) == 1 else "stepwise" if pieces else "changing"
    if strain_rate(history) is not None:
        return "tension at a constant strain rate"
    if loading.quantity == "strain":
        return f"{levels} strain{', at which the stress relaxes' if pieces else ''}"
    if loading.quantity == "stress":
        held = "true stress" if held_of(loading) == "stress" else "load"
        return f"creep under {levels} {held}"
    return f"creep under {levels} {loading.quantity}"


def strain_rate(history: History) -> float | None:
    """1/s, of a strain that is prescribed and rises evenly over the frames; None of other tests."""
    if isinstance(history.loading, PointLoading) or history.loading.quantity != "strain":
        return None
    program, last = history.loading.program(), last_data_time(history)
    times = np.linspace(0.0, last, EVEN_POINTS)
    values = np.interp(times, program.times, program.values)
    rate = float(values[-1] - values[0]) / last if last > 0 else 0.0
    even = np.abs(values - values[0] - rate * times).max() <= EVEN * abs(values[-1] - values[0])
    return rate if rate > 0 and even else None


def _level_text(program: Program, last: float, unit: str, factor: float = 1.0) -> str:
    tolerance = HELD_LOAD * float(np.abs(program.values).max())
    return _holds_text(holds(program, last, tolerance), unit, lambda v: f"{factor * v:.4g}")


def temperature_text(history: History) -> str:
    """The temperature over the frames of a test, such as "793 → 800 °C at 4 h"."""
    program = history.temperature_program()
    if is_isothermal(history):
        return f"{float(np.mean(program.values)) - ZERO_CELSIUS:.0f} °C"
    return _holds_text(temperature_holds(history), " °C", lambda v: f"{v - ZERO_CELSIUS:.0f}")


def _holds_text(pieces: list[tuple[float, float, float]], unit: str, number: Callable[[float], str]) -> str:
    """The values of holds, and when each but the first begins, or between which times."""
    if not pieces:
        return f"ramps{unit}"
    first = number(pieces[0][2])
    if len(pieces) == 1:
        return first + unit
    if len(pieces) > MOST_HOLDS:
        return f"{first} → … → {number(pieces[-1][2])}{unit}, {len(pieces)} steps"
    text = first
    for before, after in pairwise(pieces):
        known = after[0] - before[1] <= SHORT_RAMP * after[0]
        when = time_text(before[1]) if known else f"{time_text(before[1])} to {time_text(after[0])}"
        text += f" → {number(after[2])}{unit} at {when}"
    return text
