"""Measured tests as they were understood, and what is suspect in them: text, data, and every output over time."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from creepkit.records import SECONDS_PER_HOUR, History, is_logarithmic, load_unit, output_named, output_unit
from creepkit.records.held_levels import held_temperatures
from creepkit.records.specimen_lookup import lengths_by_default
from creepkit.records.units import celsius_text, time_text
from creepkit.reports.blocks import Block, Items, Paragraph, Table, as_text, listed, plural
from creepkit.reports.figures import Course, Panels, draw_over_time, over_time
from creepkit.reports.load_programs import kind_of_test, load_text, program_text

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


def data_quality_text(quality: DataQuality) -> str:
    """One line for each flag; one line that says so when there are none."""
    return as_text(quality_blocks(quality))


def quality_blocks(quality: DataQuality, most: int | None = None) -> list[Block]:
    """How many flags there are, and each; most : that are listed."""
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
            percent = is_logarithmic(name)
            unit = "%" if percent else output_unit(name, history.specimen)
            course = Course(history.name, hours, 100.0 * values if percent else values, unused)
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
