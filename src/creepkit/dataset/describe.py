"""A data set in words and numbers: counts, reasons, ranges, units, where it comes from."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.dataset.conditions import UNITS
from creepkit.records import Status

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset

OUTPUT_UNITS = {"amplitude": "mm", "width": "mm"}
"""Of outputs that have one."""


def summary(data: Dataset) -> dict[str, Any]:
    """What there is to know of a data set, as JSON-able data; ranges are those of its accepted samples."""
    good = data.reasons == 0
    return {
        "law": data.law.name,
        "law_fingerprint": data.law.fingerprint,
        "specimen": data.specimen.name,
        "design": design_name(data),
        "samples": len(data),
        "accepted": int(good.sum()),
        "failed": int((data.reasons < 0).sum()),
        "simulated": int((data.status >= 0).sum()),
        "burst_accepted": int((data.status[good] == Status.BURST).sum()),
        "reasons": reasons(data),
        "failures": dict(Counter(data.failures.values()).most_common(5)),
        "frames": data.grid.frames,
        "times": {
            "from": float(data.grid.values[0]),
            "to": float(data.grid.values[-1]),
            "relative": data.grid.relative,
        },
        "ranges": dict(ranges(data)),
        "units": units(data),
        "provenance": dict(data.provenance),
    }


def design_name(data: Dataset) -> str:
    """The design that drew the samples; of a joined set, all of them."""
    sources = data.provenance.get("joined", [data.provenance])
    return ", ".join(dict.fromkeys(str(source.get("design", "unknown")) for source in sources))


def reasons(data: Dataset) -> list[dict[str, Any]]:
    """How many samples each criterion rejected, those that others had not; and how many of them without simulation."""
    pairs = list(zip(data.reason_names, data.reason_texts or data.reason_names, strict=True))[1:]
    unseen = data.status < 0
    return [
        {
            "criterion": name,
            "text": text,
            "rejected": int((data.reasons == k).sum()),
            "not_simulated": int((unseen & (data.reasons == k)).sum()),
        }
        for k, (name, text) in enumerate(pairs, start=1)
    ]


def ranges(data: Dataset) -> Iterator[tuple[str, dict[str, float]]]:
    """Least, middle and largest value of every parameter, condition and last output of the accepted samples."""
    good = data.reasons == 0
    if not good.any():
        return
    for name, column in columns(data):
        own = column[good]
        own = own[np.isfinite(own)]
        if own.size:
            yield name, {"least": float(own.min()), "median": float(np.median(own)), "most": float(own.max())}


def columns(data: Dataset) -> Iterator[tuple[str, Floats]]:
    """What samples are drawn by and what they end with: {name: (n,)}."""
    for names, values in ((data.parameter_names, data.parameters), (data.condition_names, data.conditions)):
        yield from ((name, values[:, k]) for k, name in enumerate(names))
    yield "end of simulation", np.where(data.status >= 0, data.end_times, np.nan)
    for k, name in enumerate(data.outputs):
        yield f"last {name}", last(data.values[..., k])


def last(values: Any) -> Floats:
    """(n,) the last value of each row that is a number; NaN where there is none."""
    known = np.isfinite(values)
    frame = values.shape[1] - 1 - np.argmax(known[:, ::-1], axis=1)
    return np.where(known.any(axis=1), values[np.arange(len(values)), frame], np.nan).astype(float)


def units(data: Dataset) -> dict[str, str]:
    """{name: unit} of every column of `ranges`; "" of a pure number."""
    told = {name: param.unit for name, param in data.law.table.items()}
    told |= {name: UNITS.get(name, "") for name in data.condition_names}
    return told | {"end of simulation": "s"} | {f"last {name}": OUTPUT_UNITS.get(name, "") for name in data.outputs}


def text(data: Dataset) -> str:
    """The same as a page of text."""
    told = summary(data)
    return "\n".join([*_heading(told), *_counts(told), "", *_table(told), "", *_origin(told)])


def _heading(told: dict[str, Any]) -> Iterator[str]:
    share = 100 * told["accepted"] / max(told["samples"], 1)
    what = f"{told['samples']} samples of {told['law']} on {told['specimen']}"
    yield f"{what}: {told['accepted']} accepted ({share:.1f} %)"
    times = told["times"]
    until = "over the length of each test" if times["relative"] else f"to {times['to'] / 3600:g} h"
    yield f"{told['frames']} frames {until}; {told['burst_accepted']} of the accepted burst before their end"


def _counts(told: dict[str, Any]) -> Iterator[str]:
    for entry in told["reasons"]:
        unseen = entry["not_simulated"]
        some = "" if unseen == entry["rejected"] else f"{unseen} of them "
        how = f"; {some}not simulated" if unseen else ""
        yield f"{entry['rejected']:>9} rejected: criterion {entry['criterion']}, {entry['text']}{how}"
    if told["failed"]:
        yield f"{told['failed']:>9} failed"
    for words, times in told["failures"].items():
        yield f"{times:>18} x {words}"


def _table(told: dict[str, Any]) -> Iterator[str]:
    """Ranges, one row each."""
    if not told["ranges"]:
        return
    width = max(map(len, told["ranges"]))
    yield f"{'accepted samples':<{width}}  {'unit':<5}{'least':>12}{'median':>12}{'most':>12}"
    for name, ends in told["ranges"].items():
        numbers = "".join(f"{ends[key]:>12.4g}" for key in ("least", "median", "most"))
        yield f"{name:<{width}}  {told['units'][name]:<5}{numbers}"


def _origin(told: dict[str, Any]) -> Iterator[str]:
    for number, source in enumerate(told["provenance"].get("joined", [told["provenance"]]), start=1):
        known = {key: source[key] for key in ("design", "seed", "creepkit", "when", "fingerprint") if key in source}
        name = "from" if "joined" not in told["provenance"] else f"from {number}."
        yield f"{name} {', '.join(f'{key} {value}' for key, value in known.items())}"
