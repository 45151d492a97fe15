"""Data sets as text and JSON."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from creepkit.dataset.dataset import summary
from creepkit.reports.blocks import aligned
from creepkit.reports.terminal import print_json, tell, tell_written

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset


def dataset_text(data: Dataset) -> str:
    """A page of text: counts, reasons of rejection, ranges and origin."""
    known = summary(data)
    percent, times, source = 100 * known["accepted"] / max(known["samples"], 1), known["times"], known["provenance"]
    until = "over the length of each test" if times["relative"] else f"to {times['to'] / 3600:g} h"
    lines = [
        f"{known['samples']} samples of {known['law']} on {known['specimen']}: {known['accepted']} accepted "
        f"({percent:.1f} %)",
        f"{known['frames']} frames {until}; {known['burst_accepted']} of the accepted burst before their end",
    ]
    for entry in known["reasons"]:
        left_out, rejected = entry["not_simulated"], entry["rejected"]
        suffix = f"; {'' if left_out == rejected else f'{left_out} of them '}not simulated" if left_out else ""
        lines.append(f"{rejected:>9} rejected: criterion {entry['criterion']}, {entry['text']}{suffix}")
    lines += [f"{known['failed']:>9} failed"] if known["failed"] else []
    lines += [f"{occurrences:>18} x {message}" for message, occurrences in known["failures"].items()]
    rows = [
        (name, known["units"][name], *(f"{numbers[key]:.4g}" for key in ("least", "median", "most")))
        for name, numbers in known["ranges"].items()
    ]
    ranges = aligned(("accepted samples", "unit", "least", "median", "most"), rows, numeric=(2, 3, 4)) if rows else []
    origin = ", ".join(f"{k} {source[k]}" for k in ("design", "seed", "creepkit", "when", "fingerprint") if k in source)
    return "\n".join([*lines, "", *ranges, "", f"from {origin}"])


def print_dataset(data: Dataset, to: Path, part: str | None, as_json: bool) -> None:
    """Print what was made, and where it lies."""
    if as_json:
        print_json({**summary(data), "file": str(to), "part": part})
        return
    tell(f"{data}\n")
    if part is None:
        tell_written(to, f": {to.stat().st_size / 1e6:.1f} MB; remove {to}.parts when no more samples are wanted")
    else:
        tell(f"part {part} is done in {to}.parts; the same command without --part merges all parts into {to}")
