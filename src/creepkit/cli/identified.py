"""What `creepkit identify` leaves behind: files of every law, a table of them all, and the same as JSON."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from creepkit.cli.printing import print_table

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.selection import Ranking
    from creepkit.records import History


def write_ranking(ranking: Ranking, folder: Path) -> list[Path]:
    """Write every law's JSON and plot, and the best law as LaTeX and Python; returns the paths."""
    from creepkit import study

    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for entry in ranking.laws:
        name = file_stem(entry.fit.law.name)
        written.append(entry.fit.save(folder / f"{name}.json"))
        entry.fit.plot(folder / f"{name}.png")
        written.append(folder / f"{name}.png")
    best = ranking.best
    for language, suffix in (("latex", ".tex"), ("python", ".py")):
        path = folder / f"{file_stem(best.law.name)}{suffix}"
        study.export(best, language, to=path, force=True)
        written.append(path)
    return written


def file_stem(name: str) -> str:
    """A law's name as a file name."""
    return re.sub(r"[^A-Za-z0-9.=-]+", "-", name).strip("-") or "law"


def print_ranking(ranking: Ranking, written: list[Path], histories: list[History]) -> None:
    """Print the table of laws, the verdict, the best law and what was written."""
    rows = [
        (
            entry.fit.law.name,
            str(len(entry.fit.law.params)),
            *_misfit_cells(entry.fit),
            f"{entry.excess:.1f}",
            f"{entry.weight:.3f}",
        )
        for entry in ranking.laws
    ]
    columns = ("law", "parameters", *_misfit_columns(ranking.best), "BIC - best", "weight")
    print_table(f"{len(histories)} tests", columns, rows)
    typer.echo(f"{ranking.verdict}\n\n{ranking.best}\n")
    for path in written:
        typer.echo(f"wrote {path}")


def _misfit_columns(fit: Identification) -> tuple[str, ...]:
    output = next(iter(fit.errors))
    return ("rms ln strain" if output == "strain" else f"error of {output}", "test to test", "not followed")


def _misfit_cells(fit: Identification) -> tuple[str, ...]:
    output = next(iter(fit.errors))
    misfit = f"{fit.rms:.3f}" if output == "strain" else f"{fit.errors[output].relative_squared_error:.3g}"
    return misfit, f"{100 * fit.noise_model.rate:.0f} %", f"{100 * fit.noise_model[output].drift:.0f} %"


def ranking_to_json(ranking: Ranking, written: list[Path]) -> dict[str, Any]:
    """The same for JSON."""
    return {
        "verdict": ranking.verdict,
        "laws": [{**_fit_to_json(ranked.fit), "bic_excess": ranked.excess, "weight": ranked.weight} for ranked in ranking.laws],
        "files": [str(path) for path in written],
    }


def _fit_to_json(fit: Identification) -> dict[str, Any]:
    return {
        "law": fit.law.name,
        **({"rms_ln_strain": fit.rms} if "strain" in fit.errors else {}),
        "errors": {name: _json_numbers(vars(e)) for name, e in fit.errors.items()},
        "parameters": {e.name: {"value": e.value, "low": e.low, "high": e.high, "unit": e.unit, "verdict": e.verdict}
                       for e in fit.estimates},
        "nuisances": [_json_numbers(vars(n)) for n in fit.nuisances],
        "scatter": fit.noise_model.to_dict(),
        "notes": list(fit.notes),
    }  # fmt: skip


def _json_numbers(record: dict[str, Any]) -> dict[str, Any]:
    """The same with null for what JSON cannot hold."""
    import math

    return {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in record.items()}
