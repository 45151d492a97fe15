"""The path of a penalty: shares of the terms and misfit as its strength grows from none to all.

The strength is chosen by BIC along the path: at each strength the terms that contribute 5 % or more are kept, these
are refitted without penalty, exponents off where BIC does not rise by it, and the set of lowest BIC wins, at the
lowest strength that leaves it. The penalty proposes sets, BIC chooses among them; a penalty that never drops a term
proposes the whole sum alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path as File
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.search.refining import Minimum, IterationCallback
from creepkit.inverse.sparsity.fitting import penalised_fit, penalised_starts
from creepkit.inverse.sparsity.penalised import PenalisedTerms
from creepkit.inverse.sparsity.penalties import ContributionPenalty
from creepkit.inverse.sparsity.reduction import ReducedLaws, TermNames, terms_above

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PATH_STRENGTHS = (0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0)
"""Two a decade, in units of half a chi-square: from nothing to more than a dimple's whole test is worth."""


@dataclass(frozen=True, eq=False)
class PenaltyPath:
    """One row for each strength, the first of which is 0.

    penalty : its formula in a word; labels : the terms.
    shares : (strengths, terms) contributions; chi_square : (strengths,) of the data, penalty apart.
    kept : the terms that are left; criterion : (strengths,) BIC of these refitted, less the least of all.
    x : (strengths, unknowns) where the penalised fits ended; chosen : the row of choice.
    """

    penalty: str
    terms: TermNames
    strengths: Floats
    contributions: Floats
    chi_square: Floats
    kept_terms: tuple[TermNames, ...]
    bic_excess: Floats
    x: Floats
    chosen: int

    def contributions_by_term(self, row: int | None = None) -> dict[str, float]:
        """{term: contribution} of one row, by default the chosen one."""
        return dict(zip(self.terms, map(float, self.contributions[self.chosen if row is None else row]), strict=True))

    def plot(self, file: str | File | None = None) -> Figure:
        """Shares and misfit against the strength; written to `path` when given."""
        from creepkit.inverse.sparsity.plotting import penalty_path_figure

        return penalty_path_figure(self, file)

    def __str__(self) -> str:
        rows = [["strength", "chi-square", "BIC - least", *self.terms, "kept"]]
        for k, strength in enumerate(self.strengths):
            numbers = [f"{strength:g}", f"{self.chi_square[k]:.1f}", f"{self.bic_excess[k]:.1f}"]
            rows.append([*numbers, *(f"{c:.3f}" for c in self.contributions[k]), ", ".join(self.kept_terms[k])])
        rows[1 + self.chosen][-1] += "   <- chosen"
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        return "\n".join("  ".join(map(str.ljust, row, widths)).rstrip() for row in rows)


def trace_path(
    reductions: ReducedLaws, penalty: ContributionPenalty, strengths: Sequence[float] = PATH_STRENGTHS, progress: IterationCallback | None = None
) -> PenaltyPath:
    """The path over `strengths`, from the sum without penalty; each fit starts where the last ended, and in corners.

    It ends when one term is left.
    """
    stage, labels = reductions.problem, reductions.terms
    penalised, full = PenalisedTerms.from_objective(stage.objective, penalty, 0.0), reductions.full()
    corners = penalised_starts(reductions)[-len(labels) :]
    optima = [full.x]
    for k, strength in enumerate(sorted(strengths)):
        optima.append(_next_fit(reductions, penalised.with_strength(strength), optima[-1], corners).u)
        if progress is not None:
            progress("strength", k + 1, len(strengths))
        if len(terms_above(stage.contributions_at(optima[-1]))) == 1:
            break
    contributions = np.array([list(stage.contributions_at(x).values()) for x in optima])
    kept_terms = tuple(terms_above(dict(zip(labels, row, strict=True))) for row in contributions)
    bic = np.array([reductions.with_terms(terms).bic for terms in kept_terms])
    chi_square = np.array([2.0 * stage.half_chi_square(x) for x in optima])
    path_strengths = np.array([0.0, *sorted(strengths)])[: len(optima)]
    excess = bic - bic.min()
    return PenaltyPath(
        type(penalty).__name__, labels, path_strengths, contributions, chi_square, kept_terms, excess, np.array(optima), int(excess.argmin())
    )


def _next_fit(reductions: ReducedLaws, penalised: PenalisedTerms, previous: Floats, corners: Sequence[Floats]) -> Minimum:
    """The penalised fit from the last one, and from the corners that cost less there."""
    stage = reductions.problem

    def cost(x: Floats) -> float:
        return stage.half_chi_square(x) + float(penalised.values(x[None])[0])

    previous_cost = cost(previous)
    return penalised_fit(stage, penalised, [previous, *(x for x in corners if cost(x) < previous_cost)])
