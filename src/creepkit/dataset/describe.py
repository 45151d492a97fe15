"""A data set in words and numbers: counts, reasons, ranges, units, where it comes from."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.dataset.conditions import CONDITION_UNITS
from creepkit.records import Status

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset

OUTPUT_UNITS = {"amplitude": "mm", "width": "mm"}
"""Of outputs that have one."""


def summary(data: Dataset) -> dict[str, Any]:
    """What there is to know of a data set, as JSON-able data; ranges are those of its accepted samples."""
    accepted = data.reasons == 0
    return {
        "law": data.law.name,
        "law_fingerprint": data.law.fingerprint,
        "specimen": data.specimen.name,
        "design": design_name(data),
        "samples": len(data),
        "accepted": int(accepted.sum()),
        "failed": int((data.reasons < 0).sum()),
        "simulated": int((data.status >= 0).sum()),
        "burst_accepted": int((data.status[accepted] == Status.RUPTURED).sum()),
        "reasons": rejection_counts(data),
        "failures": dict(Counter(data.failures.values()).most_common(5)),
        "frames": data.grid.frames,
        "times": {
            "from": float(data.grid.values[0]),
            "to": float(data.grid.values[-1]),
            "relative": data.grid.relative,
        },
        "ranges": dict(accepted_ranges(data)),
        "units": column_units(data),
        "provenance": dict(data.provenance),
    }


def design_name(data: Dataset) -> str:
    """The design that drew the samples; of a joined set, all of them."""
    sources = data.provenance.get("joined", [data.provenance])
    return ", ".join(dict.fromkeys(str(source.get("design", "unknown")) for source in sources))


def rejection_counts(data: Dataset) -> list[dict[str, Any]]:
    """How many samples each criterion rejected, those that others had not; and how many of them without simulation."""
    pairs = list(zip(data.reason_names, data.reason_texts or data.reason_names, strict=True))[1:]
    not_simulated = data.status < 0
    return [
        {
            "criterion": name,
            "text": text,
            "rejected": int((data.reasons == k).sum()),
            "not_simulated": int((not_simulated & (data.reasons == k)).sum()),
        }
        for k, (name, text) in enumerate(pairs, start=1)
    ]


def accepted_ranges(data: Dataset) -> Iterator[tuple[str, dict[str, float]]]:
    """Least, middle and largest value of every parameter, condition and last output of the accepted samples."""
    accepted = data.reasons == 0
    if not accepted.any():
        return
    for name, column in summary_columns(data):
        finite_values = column[accepted]
        finite_values = finite_values[np.isfinite(finite_values)]
        if finite_values.size:
            yield name, {"least": float(finite_values.min()), "median": float(np.median(finite_values)), "most": float(finite_values.max())}


def summary_columns(data: Dataset) -> Iterator[tuple[str, Floats]]:
    """What samples are drawn by and what they end with: {name: (n,)}."""
    for names, values in ((data.parameter_names, data.parameters), (data.condition_names, data.conditions)):
        yield from ((name, values[:, k]) for k, name in enumerate(names))
    yield "end of simulation", np.where(data.status >= 0, data.end_times, np.nan)
    for k, name in enumerate(data.outputs):
        yield f"last {name}", last_values(data.values[..., k])


def last_values(values: Any) -> Floats:
    """(n,) the last value of each row that is a number; NaN where there is none."""
    finite = np.isfinite(values)
    frame = values.shape[1] - 1 - np.argmax(finite[:, ::-1], axis=1)
    return np.where(finite.any(axis=1), values[np.arange(len(values)), frame], np.nan).astype(float)


def column_units(data: Dataset) -> dict[str, str]:
    """{name: unit} of every column of `ranges`; "" of a pure number."""
    units = {name: param.unit for name, param in data.law.table.items()}
    units |= {name: CONDITION_UNITS.get(name, "") for name in data.condition_names}
    return units | {"end of simulation": "s"} | {f"last {name}": OUTPUT_UNITS.get(name, "") for name in data.outputs}


def dataset_text(data: Dataset) -> str:
    """The same as a page of text."""
    summary_data = summary(data)
    return "\n".join([*_dataset_heading(summary_data), *_rejection_lines(summary_data), "", *_range_table(summary_data), "", *_origin_lines(summary_data)])


def _dataset_heading(summary_data: dict[str, Any]) -> Iterator[str]:
    percent = 100 * summary_data["accepted"] / max(summary_data["samples"], 1)
    description = f"{summary_data['samples']} samples of {summary_data['law']} on {summary_data['specimen']}"
    yield f"{description}: {summary_data['accepted']} accepted ({percent:.1f} %)"
    times = summary_data["times"]
    until = "over the length of each test" if times["relative"] else f"to {times['to'] / 3600:g} h"
    yield f"{summary_data['frames']} frames {until}; {summary_data['burst_accepted']} of the accepted burst before their end"


def _rejection_lines(summary_data: dict[str, Any]) -> Iterator[str]:
    for entry in summary_data["reasons"]:
        not_simulated = entry["not_simulated"]
        part_text = "" if not_simulated == entry["rejected"] else f"{not_simulated} of them "
        suffix = f"; {part_text}not simulated" if not_simulated else ""
        yield f"{entry['rejected']:>9} rejected: criterion {entry['criterion']}, {entry['text']}{suffix}"
    if summary_data["failed"]:
        yield f"{summary_data['failed']:>9} failed"
    for error_message, occurrences in summary_data["failures"].items():
        yield f"{occurrences:>18} x {error_message}"


def _range_table(summary_data: dict[str, Any]) -> Iterator[str]:
    """Ranges, one row each."""
    if not summary_data["ranges"]:
        return
    width = max(map(len, summary_data["ranges"]))
    yield f"{'accepted samples':<{width}}  {'unit':<5}{'least':>12}{'median':>12}{'most':>12}"
    for name, statistics in summary_data["ranges"].items():
        numbers = "".join(f"{statistics[key]:>12.4g}" for key in ("least", "median", "most"))
        yield f"{name:<{width}}  {summary_data['units'][name]:<5}{numbers}"


def _origin_lines(summary_data: dict[str, Any]) -> Iterator[str]:
    for number, source in enumerate(summary_data["provenance"].get("joined", [summary_data["provenance"]]), start=1):
        items = {key: source[key] for key in ("design", "seed", "creepkit", "when", "fingerprint") if key in source}
        name = "from" if "joined" not in summary_data["provenance"] else f"from {number}."
        yield f"{name} {', '.join(f'{key} {value}' for key, value in items.items())}"
