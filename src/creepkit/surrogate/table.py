"""A surrogate as a short table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from creepkit.surrogate.recipe import SurrogateMetadata

ERROR_COLUMNS = ("rse", "mse", "mae", "r2", "largest_median", "largest_p95")
ERROR_HEADS = ("RSE (Eq. 4)", "MSE", "MAE", "R2", "largest error, median", "95 %")


def surrogate_text(title: str, metadata: SurrogateMetadata) -> str:
    """Title, errors on the validation rows for each output, and where it came from."""
    lines, metrics = [title], metadata.metrics
    if metrics:
        rows = {name: [_number_text(errors_of_output[c]) for c in ERROR_COLUMNS] for name, errors_of_output in metrics["outputs"].items()}
        lines += _aligned_rows(("output", *ERROR_HEADS), rows)
        lines.append(f"validation loss (Eq. 4, outputs together): {_number_text(metrics['loss'])}")
    lines += _training_lines(metadata.provenance)
    return "\n".join([*lines, *(f"note: {note}" for note in metadata.notes)])


def _training_lines(provenance: Mapping[str, Any]) -> list[str]:
    if "training_rows" not in provenance:
        return []
    counts = f"{provenance['training_rows']} samples for training, {provenance['validation_rows']} for validation"
    return [f"{counts}; best epoch {provenance['best_epoch']} of {provenance['epochs']}, seed {provenance['seed']}"]


def _number_text(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"


def _aligned_rows(heads: tuple[str, ...], rows: Mapping[str, list[str]]) -> list[str]:
    table_rows = [list(heads), *([name, *cells] for name, cells in rows.items())]
    widths = [max(len(row[k]) for row in table_rows) for k in range(len(heads))]
    return ["  ".join(c.rjust(w) if k else c.ljust(w) for k, (c, w) in enumerate(zip(row, widths, strict=True)))
            for row in table_rows]  # fmt: skip
