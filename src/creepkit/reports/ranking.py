"""What a ranking of laws says: the laws with misfits and weights, what separates them, and the values of each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.errors import CreepkitError
from creepkit.inverse.compared_tests import UNTESTABLE, rests_on_durations
from creepkit.inverse.selection.discrimination import DISTINGUISHABLE_CHI_SQUARE, chi_square_by_test
from creepkit.records import is_logarithmic
from creepkit.reports.answer import titled_law, unit_text, value_cells
from creepkit.reports.blocks import Block, Items, Paragraph, Table, as_text, number, plural
from creepkit.reports.identification import rejected, scatter_of_rates, verdict_given_law
from creepkit.reports.json_values import fields_to_json
from creepkit.reports.ranking_plot import misfit_name, ranking_figure
from creepkit.reports.terminal import print_table, tell, tell_written

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.selection.discrimination import EquivalentLaws
    from creepkit.inverse.selection.ranking import Ranking
    from creepkit.reports.svg import PageFigures

CRITERIA = {"bic": "BIC", "aicc": "AICc"}
"""Abbreviations of the criteria by which laws are ranked."""


CHI_SQUARE_NOTE = (
    "chi-square: of all values under one estimated covariance, by which laws are compared; the reduced chi-square of a "
    "verdict is that over the noise of the readings alone"
)


LAW_REJECTED = "the law does not fit"
"""What stands for what tests say of a parameter, where they reject the law."""


def ranking_text(ranking: Ranking) -> str:
    """How well the best law describes the tests, the verdict, then all laws."""
    equivalent = [] if ranking.decisive else [str(pair) for pair in equivalents_among_remaining(ranking)]
    head: list[Block] = [Paragraph(ranking.best.headline), Paragraph(ranking.verdict), Items(equivalent)]
    return as_text([*head, *ranking_blocks(ranking), *credible_values(ranking)])


def ranking_blocks(ranking: Ranking, figures: PageFigures | None = None, of: str = "") -> list[Block]:
    """The laws tried with misfits and weights, what separates them, and with `figures` the misfit of each law.

    of : the material, " of CMSX-4".
    """
    blocks: list[Block] = [_table(ranking)]
    blocks += [Paragraph(CHI_SQUARE_NOTE, "note")] if any(math.isfinite(one.chi_square) for one in ranking.laws) else []
    separation = separating_test(ranking)
    blocks += [Paragraph(text) for text in separation]
    if ranking.challenges:
        blocks += [Paragraph("what the tests allow beside the best law:"), Items([*map(str, ranking.challenges)])]
    if ranking.failed:
        blocks.append(Items([f"{name}: {reason}" for name, reason in ranking.failed.items()]))
    if figures is not None and ranking.best.tests:
        weights = ", ".join(f"{r.fit.law.name} {r.weight:.3f}" for r in ranking.laws)
        description = (
            f"{misfit_name(ranking)}: {plural(len(ranking.laws), 'law')} in {plural(len(ranking.best.tests), 'test')}, "
            f"the weights of the laws, and the curves of the credible ones. {' '.join(separation)} Weights: {weights}."
        )
        caption = f"Where the laws differ: {misfit_name(ranking)}, and weights."
        title = f"Misfit of each law in each test{of}"
        blocks.append(figures.picture(lambda: ranking_figure(ranking), title, description, caption))
    return blocks


def _table(ranking: Ranking) -> Table:
    rows = [
        (
            titled_law(one.fit.law),
            str(len(one.fit.law.params)),
            *_misfit(one.fit),
            number(one.excess, 3),
            f"{one.weight:.3f}",
            number(one.chi_square, 4),
            explanation(one.fit),
        )
        for one in ranking.laws
    ]
    columns = (
        *("law", "parameters", _misfit_name(ranking.best), "test to test", f"{criterion_name(ranking)} - best"),
        *("weight", "chi-square", "by the noise of the tests"),
    )
    return Table("laws tried, the best first", columns, rows, numeric=(1, 2, 3, 4, 5, 6))


def explanation(fit: Identification) -> str:
    """Whether the tests contradict a law at their noise, with the p-value, and what it leaves, in noises."""
    return "?" if fit.adequacy is None else fit.adequacy.verdict_text


def criterion_name(ranking: Ranking) -> str:
    """The abbreviation of the criterion by which laws are ranked."""
    return CRITERIA.get(ranking.criterion, ranking.criterion)


def _misfit_name(fit: Identification) -> str:
    """What _misfit says first: of the first output, else of minimum rates, else of rupture times."""
    if fit.errors:
        output = next(iter(fit.errors))
        return f"rms ln {output}" if is_logarithmic(output) else f"error of {output}"
    return f"rms ln {'minimum rate' if any(m.minimum_rate for m in fit.tests) else 'rupture time'}"


def _misfit(fit: Identification) -> tuple[str, str]:
    """The misfit of the first output, or of tests without frames, and the scatter of rates between tests."""
    if fit.errors:
        output = next(iter(fit.errors))
        return f"{fit.rms:.3f}" if is_logarithmic(output) else (
            f"{fit.errors[output].relative_squared_error:.3g}"
        ), scatter_of_rates(fit)
    rates = [m.minimum_rate.ratio for m in fit.tests if m.minimum_rate is not None]
    ratios = rates or [m.rupture.ratio for m in fit.tests if m.rupture is not None and not m.rupture.censored]
    logarithms = [math.log(ratio) for ratio in ratios if 0.0 < ratio < math.inf]
    rms = math.sqrt(sum(x * x for x in logarithms) / len(logarithms)) if logarithms else math.nan
    return f"{rms:.3f}", scatter_of_rates(fit)


def separating_test(ranking: Ranking) -> list[str]:
    """The test that speaks most for the best law against the second, and by how much the second is worse in all."""
    if len(ranking.laws) < 2 or ranking.criterion == "hold-out" or len(ranking.best.tests) < 2:
        return []
    fits, second = [one.fit for one in ranking.laws], ranking.laws[1]
    if any(fit.linearised is None for fit in fits):
        fits = fits[:2]  # others cost a prediction each
    if any(fit.linearised is None and (not fit.histories or fit.predictor is None) for fit in fits):
        return []
    try:
        chi_square = chi_square_by_test(fits)
    except CreepkitError:
        return []
    differences = chi_square[1] - chi_square[0]
    if not np.isfinite(differences).all():
        return []
    if min(float(differences.sum()), second.excess) < DISTINGUISHABLE_CHI_SQUARE:
        return []
    k, name = int(np.argmax(differences)), second.fit.law.name
    share = 100 * float(differences[k]) / float(np.maximum(differences, 0.0).sum())
    return [
        f"what separates {name} from {fits[0].law.name} most is test {fits[0].tests[k].name} "
        f"({fits[0].tests[k].condition}): {share:.0f} % of the chi-square that speaks against {name} is its own; "
        f"{criterion_name(ranking)} of {name} is {number(second.excess, 3)} larger in all"
    ]


def equivalents_among_remaining(ranking: Ranking) -> list[EquivalentLaws]:
    """Pairs of credible laws that the tests do not separate; none where the tests were not given."""
    names = {r.fit.law.name for r in ranking.credible}
    if any(r.fit.predictor is None or not r.fit.histories for r in ranking.laws):
        return []
    return [pair for pair in ranking.equivalents() if {pair.first, pair.second} <= names]


def credible_values(ranking: Ranking | None) -> list[Block]:
    """Values and intervals of every credible law, where the tests do not decide for one; each given its own law."""
    if ranking is None or ranking.decisive or len(ranking.credible) < 2:
        return []
    rows = [
        (
            titled_law(one.fit.law),
            f"{one.weight:.3f}",
            e.name,
            *value_cells(one.fit.law, e),
            unit_text(e.unit),
            LAW_REJECTED if rejected(one.fit) else verdict_given_law(one.fit, e),
        )
        for one in ranking.credible
        for e in one.fit.estimates
    ]
    columns = ("law", "weight", "parameter", "value", "95 % interval", "unit", "given this law")
    caption = "values of every credible law, of weight above 0.05: each interval holds only if its law is right"
    untested = [one.fit for one in ranking.credible if rests_on_durations(one.fit.law, one.fit.histories)]
    said = [Paragraph(f"{', '.join(fit.law.name for fit in untested)}: {UNTESTABLE}", "note")] if untested else []
    return [Table(caption, columns, rows, numeric=(1, 3, 4)), *said]


# ---- commands --------------------------------------------------------------------------------------------------------


def print_ranking(ranking: Ranking, written: Sequence[Path], test_count: int) -> None:
    """Print the table of laws, the answer, and what was written."""
    table = _table(ranking)
    print_table(f"{test_count} tests", table.columns, [[*map(str, row)] for row in table.rows])
    tell(f"{ranking}\n")
    for path in written:
        tell_written(path)


def ranking_to_json(ranking: Ranking, written: Sequence[Path]) -> dict[str, Any]:
    """The same as JSON-able data."""
    return {
        "headline": ranking.best.headline,
        **{
            name: getattr(ranking, name)
            for name in ("verdict", "decisive", "adequacy", "further", "failed", "challenges")
        },
        "laws": [{**_fit_to_json(one.fit), "bic_excess": one.excess, "weight": one.weight} for one in ranking.laws],
        "files": [str(path) for path in written],
    }


def _fit_to_json(fit: Identification) -> dict[str, Any]:
    return {
        "law": fit.law.name,
        **{f"rms_ln_{name}": fit.rms for name in fit.errors if is_logarithmic(name)},
        "parameters": {e.name: fields_to_json(e, "value low high unit verdict") for e in fit.estimates},
        **{name: getattr(fit, name) for name in ("errors", "adequacy", "numerical_error", "nuisances", "noise_model")},
        "notes": list(fit.notes),
    }
