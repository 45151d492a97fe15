"""Measured tests as they were understood: text, data, and a plot of every output over time."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.readers.reading import TableSummary
from creepkit.records import SECONDS_PER_HOUR, History, output_unit
from creepkit.reports.blocks import aligned
from creepkit.reports.figures import empty_figure, save_figure
from creepkit.reports.json_values import fields_to_json
from creepkit.reports.load_programs import program_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure


MOST_NAMED, MOST_VALUES = 12, 4
"""Tests that a plot names, and values of a label that are told."""


def tables_text(tables: Sequence[TableSummary]) -> str:
    """Where tables stand, how they are written, and which column means what; one line for those that are alike."""
    groups: dict[str, list[TableSummary]] = {}
    for table in tables:
        renamed = [f"{new} ('{old}')" if old != new else new for old, new in table.columns.items()]
        groups.setdefault(", ".join(renamed), []).append(table)
    lines = []
    for columns, group in groups.items():
        first, rows = group[0], sorted({table.rows for table in group})
        how = ", ".join(part for part in (first.test and f"test {first.test}", first.dialect) if part)
        count = f" and {len(group) - 1} more" if len(group) > 1 else ""
        span = f"{rows[0]}" if len(rows) == 1 else f"{rows[0]} to {rows[-1]}"
        lines.append(f"{first.place}{how and f' ({how})'}{count}: {columns}; rows {span}")
    return "\n".join(lines)


def histories_text(histories: Sequence[History]) -> str:
    """A paragraph for one test; for several a row each, then what was assumed of all, and their labels."""
    if len(histories) < 2:
        return "\n".join(line for history in histories for line in _lines(history))
    lines = aligned(("test: specimen, conditions", "end", "frames", "outputs"), [*map(_row, histories)])
    measures = Counter(_strain_text(history) for history in histories if "strain" in history.outputs)
    lines += [f"{text} ({_count_text(count, len(histories))})" for text, count in measures.items()]
    return "\n".join([*lines, *filter(None, (assumptions_text(histories), _labels_text(histories)))])


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
        frames if history.outputs else "none",
        "; ".join(outputs) or _rate_text(history),
    )


def _count_text(count: int, total: int) -> str:
    return f"all {total} tests" if count == total else f"{count} of {total} tests"


def _strain_text(history: History) -> str:
    return f"strain is {history.strain_measure}, {'with' if history.includes_elastic else 'without'} its elastic part"


def assumptions_text(histories: Sequence[History]) -> str:
    """One line for each thing that was assumed of tests, with the number of tests; numbers may differ among them."""
    groups: dict[str, list[str]] = {}
    for history in histories:
        for text in filter(None, history.labels.get("assumed", "").split(", ")):
            groups.setdefault(re.sub(r"\d[\w.:+-]*", "0", text), []).append(text)
    return "\n".join(
        f"assumed: {texts[0]}{' or the like' * (len(set(texts)) > 1)} ({_count_text(len(texts), len(histories))})"
        for texts in groups.values()
    )


def _labels_text(histories: Sequence[History]) -> str:
    """One line for each label, with its values and how many tests have each."""
    labels: dict[str, Counter[str]] = {}
    for history in histories:
        for key, value in history.labels.items():
            if key != "assumed":
                labels.setdefault(key, Counter())[value] += 1
    lines = []
    for key, values in labels.items():
        shown = [f"{value} ({_count_text(count, len(histories))})" for value, count in values.most_common(MOST_VALUES)]
        more = f" and {len(values) - MOST_VALUES} more" if len(values) > MOST_VALUES else ""
        lines.append(f"label {key}: {'; '.join(shown)}{more}")
    return "\n".join(lines)


def _lines(history: History) -> list[str]:
    lines = [f"{history.name}: {history.specimen}{history.alloy and f', {history.alloy}'}, {program_text(history)}"]
    lines += [f"  {_output_text(history, name)}" for name in history.outputs]
    lines += [f"  {text}" for text in (_frames_text(history), _end_text(history)) if text]
    if "strain" in history.outputs:
        lines.append(f"  {_strain_text(history)}")
    for name, length in history.geometry.items():
        lines.append(f"  {name} {length:g}")
    if assumed := history.labels.get("assumed"):
        lines.append(f"  assumed: {assumed}")
    if labels := [f"{key}: {value}" for key, value in history.labels.items() if key != "assumed"]:
        lines.append(f"  labels: {'; '.join(labels)}")
    return lines


def _output_text(history: History, name: str) -> str:
    values, unit = history.outputs[name], output_unit(name, history.specimen)
    first, last = f"{values[0]:.4g}", f"{values[-1]:.4g}"
    deviation = history.standard_deviation.get(name)
    noise = "" if deviation is None else f", standard deviation {float(np.median(deviation)):.2g}"
    return f"{name} {first} to {last}{unit and f' {unit}'}{noise}"


def _frames_text(history: History) -> str:
    if not history.outputs:
        return _rate_text(history)
    count, unused = history.times.size, int((~np.asarray(history.used)).sum())
    span = f"{history.times[0] / SECONDS_PER_HOUR:.4g} to {history.times[-1] / SECONDS_PER_HOUR:.4g} h"
    return f"{count} frame{'s' if count > 1 else ''} from {span}{f', {unused} not used' if unused else ''}"


def _rate_text(history: History) -> str:
    """What is known of a test without frames, beside its end."""
    if history.minimum_rate is None:
        return "no frames"
    sd = "" if history.minimum_rate_sd is None else f" +- {history.minimum_rate_sd:.2g}"
    return f"minimum creep rate {history.minimum_rate:.4g}{sd} 1/s, no frames"


def _end_text(history: History) -> str:
    if history.unruptured and not history.outputs:
        return f"stopped before rupture at {history.times[-1] / SECONDS_PER_HOUR:.4g} h"
    if history.rupture_time is not None:
        return f"ruptured at {history.rupture_time / SECONDS_PER_HOUR:.4g} h"
    return "stopped before rupture" if history.unruptured else ""


def histories_to_json(histories: Sequence[History], tables: Sequence[TableSummary]) -> dict[str, Any]:
    """The tests without their frames, for JSON: times in s, temperatures in K, outputs in creepkit's units."""
    return {
        "tables": [fields_to_json(table, "place dialect test columns rows") for table in tables],
        "tests": [
            {
                **fields_to_json(history, "name source specimen alloy strain_measure includes_elastic"),
                **fields_to_json(history, "minimum_rate rupture_time unruptured geometry labels"),
                "condition": program_text(history),
                "frames": int(history.times.size),
                "used_frames": int(np.asarray(history.used).sum()),
                "times": [float(history.times[0]), float(history.times[-1])],
                "outputs": {
                    name: {
                        "unit": output_unit(name, history.specimen),
                        "first": float(values[0]),
                        "last": float(values[-1]),
                    }
                    for name, values in history.outputs.items()
                },
            }
            for history in histories
        ],
    }


def histories_figure(histories: Sequence[History], path: str | Path | None = None) -> Figure:
    """A panel for each output, over time; frames that are not used are drawn hollow."""
    names = list(dict.fromkeys(name for history in histories for name in history.outputs)) or [""]
    figure = empty_figure(7.0, 1.0 + 2.8 * len(names))
    for axes, name in zip(figure.subplots(len(names), 1, squeeze=False)[:, 0], names, strict=True):
        for number, history in enumerate(history for history in histories if name in history.outputs):
            hours, used = history.times / SECONDS_PER_HOUR, np.asarray(history.used)
            (line,) = axes.plot(
                hours,
                history.outputs[name],
                lw=1.0,
                marker=".",
                ms=3,
                label=history.name if number < MOST_NAMED else None,
            )
            axes.plot(hours[~used], history.outputs[name][~used], "o", mfc="none", color=line.get_color())
            axes.set_ylabel(", ".join(part for part in (name, output_unit(name, history.specimen)) if part))
        axes.set_xlabel("time, h")
        if axes.lines:
            axes.legend(fontsize="small")
    if path is not None:
        save_figure(figure, path)
    return figure
