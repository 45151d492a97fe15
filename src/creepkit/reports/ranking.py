"""Text of rankings of laws, as a whole and as rows of a table."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from creepkit.reports.terminal import print_table, tell, tell_written

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.selection.discrimination import EquivalentLaws
    from creepkit.inverse.selection.ranking import Ranking


_CRITERION_NAMES = {"bic": "BIC", "aicc": "AICc", "hold-out": "hold-out"}


CHI_SQUARE_NOTE = (
    "chi-square: of all values under one estimated covariance, by which laws are compared; the reduced chi-square of a "
    "verdict is that over the noise of the readings alone"
)


def ranking_text(ranking: Ranking) -> str:
    """How well the best law describes the tests, the verdict, then a line for each law."""
    width = max(len(r.fit.law.name) for r in ranking.laws)
    header = (
        f"{'law':{width}}   weight  {_CRITERION_NAMES[ranking.criterion]} - best  chi-square  by the noise of the tests"
    )
    rows = [
        f"{r.fit.law.name:{width}}   {r.weight:6.3f}  {r.excess:10.1f}  {r.chi_square:10.1f}  {explanation(r.fit)}"
        for r in ranking.laws
    ]
    failed = [f"{name}: {reason}" for name, reason in ranking.failed.items()]
    equivalent = [] if ranking.decisive else [f"- {pair}" for pair in equivalents_among_remaining(ranking)]
    return "\n".join(
        [ranking.best.headline, ranking.verdict, *equivalent, "", header, *rows, *failed, "", CHI_SQUARE_NOTE]
    )


def explanation(fit: Identification) -> str:
    """Whether the tests contradict a law at their noise, with the p-value, and what it leaves, in noises."""
    return "?" if fit.adequacy is None else fit.adequacy.verdict_text


def equivalents_among_remaining(ranking: Ranking) -> list[EquivalentLaws]:
    """Pairs of credible laws that the tests do not separate; none where the tests were not given."""
    names = {r.fit.law.name for r in ranking.credible}
    if any(r.fit.predictor is None or not r.fit.histories for r in ranking.laws):
        return []
    return [pair for pair in ranking.equivalents() if {pair.first, pair.second} <= names]


def print_ranking(ranking: Ranking, written: Sequence[Path], test_count: int) -> None:
    """Print the table of laws, the verdict, the best law and what was written."""
    rows = [
        (
            entry.fit.law.name,
            str(len(entry.fit.law.params)),
            *misfit_cells(entry.fit),
            f"{entry.excess:.1f}",
            f"{entry.weight:.3f}",
            explanation(entry.fit),
        )
        for entry in ranking.laws
    ]
    columns = ("law", "parameters", *misfit_columns(ranking.best), "BIC - best", "weight", "by the noise of the tests")
    print_table(f"{test_count} tests", columns, rows)
    tell(f"{ranking}\n")
    for path in written:
        tell_written(path)


def _is_logarithmic(output: str) -> bool:
    from creepkit.records import is_logarithmic  # heavy, and the help of the command line needs none of it

    return is_logarithmic(output)


def misfit_columns(fit: Identification) -> tuple[str, ...]:
    """Heads of the columns of misfit_cells."""
    if not fit.errors:
        return _single_value_misfit(fit)[0], "test to test"
    output = next(iter(fit.errors))
    return (f"rms ln {output}" if _is_logarithmic(output) else f"error of {output}", "test to test")


def misfit_cells(fit: Identification) -> tuple[str, ...]:
    """The misfit of the first output, and the scatter of rates between tests."""
    from creepkit.reports.identification_text import scatter_of_rates  # heavy, as below

    if not fit.errors:
        return _single_value_misfit(fit)[1], scatter_of_rates(fit)
    output = next(iter(fit.errors))
    misfit = f"{fit.rms:.3f}" if _is_logarithmic(output) else f"{fit.errors[output].relative_squared_error:.3g}"
    return misfit, scatter_of_rates(fit)


def _single_value_misfit(fit: Identification) -> tuple[str, str]:
    """Name and size of the misfit of tests without frames: of their minimum rates, else of their rupture times."""
    rates = [m.minimum_rate.ratio for m in fit.tests if m.minimum_rate is not None]
    ratios = rates or [m.rupture.ratio for m in fit.tests if m.rupture is not None and not m.rupture.censored]
    logarithms = [math.log(ratio) for ratio in ratios if 0.0 < ratio < math.inf]
    rms = math.sqrt(sum(x * x for x in logarithms) / len(logarithms)) if logarithms else math.nan
    return f"rms ln {'minimum rate' if rates else 'rupture time'}", f"{rms:.3f}"


def ranking_to_json(ranking: Ranking, written: Sequence[Path]) -> dict[str, Any]:
    """The same as JSON-able data."""
    return {
        "headline": ranking.best.headline,
        "verdict": ranking.verdict,
        "decisive": ranking.decisive,
        "adequacy": ranking.adequacy,
        "further": list(ranking.further),
        "failed": dict(ranking.failed),
        "challenges": None if ranking.challenges is None else list(ranking.challenges),
        "laws": [
            {**_fit_to_json(ranked.fit), "bic_excess": ranked.excess, "weight": ranked.weight}
            for ranked in ranking.laws
        ],
        "files": [str(path) for path in written],
    }


def _fit_to_json(fit: Identification) -> dict[str, Any]:
    return {
        "law": fit.law.name,
        **{f"rms_ln_{name}": fit.rms for name in fit.errors if _is_logarithmic(name)},
        "errors": dict(fit.errors),
        "parameters": {
            e.name: {"value": e.value, "low": e.low, "high": e.high, "unit": e.unit, "verdict": e.verdict}
            for e in fit.estimates
        },
        "adequacy": fit.adequacy,
        "numerical_error": fit.numerical_error,
        "nuisances": list(fit.nuisances),
        "noise_model": fit.noise_model,
        "notes": list(fit.notes),
    }
