"""A surrogate as a short table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from creepkit.surrogate.recipe import Told

COLUMNS = ("rse", "mse", "mae", "r2", "largest_median", "largest_p95")
HEADS = ("RSE (Eq. 4)", "MSE", "MAE", "R2", "largest error, median", "95 %")


def table(title: str, told: Told) -> str:
    """Title, errors on the validation rows for each output, and where it came from."""
    lines, metrics = [title], told.metrics
    if metrics:
        rows = {name: [_number(own[c]) for c in COLUMNS] for name, own in metrics["outputs"].items()}
        lines += _aligned(("output", *HEADS), rows)
        lines.append(f"validation loss (Eq. 4, outputs together): {_number(metrics['loss'])}")
    lines += _origin(told.provenance)
    return "\n".join([*lines, *(f"note: {note}" for note in told.notes)])


def _origin(known: Mapping[str, Any]) -> list[str]:
    if "training_rows" not in known:
        return []
    counts = f"{known['training_rows']} samples for training, {known['validation_rows']} for validation"
    return [f"{counts}; best epoch {known['best_epoch']} of {known['epochs']}, seed {known['seed']}"]


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"


def _aligned(heads: tuple[str, ...], rows: Mapping[str, list[str]]) -> list[str]:
    whole = [list(heads), *([name, *cells] for name, cells in rows.items())]
    widths = [max(len(row[k]) for row in whole) for k in range(len(heads))]
    return ["  ".join(c.rjust(w) if k else c.ljust(w) for k, (c, w) in enumerate(zip(row, widths, strict=True)))
            for row in whole]  # fmt: skip
