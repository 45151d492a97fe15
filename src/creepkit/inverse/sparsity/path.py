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
from creepkit.inverse.search.refining import Minimum, Progress
from creepkit.inverse.sparsity.fitting import penalised_fit, usual_starts
from creepkit.inverse.sparsity.penalised import Penalised
from creepkit.inverse.sparsity.penalties import Penalty
from creepkit.inverse.sparsity.reduction import Reductions, Terms, kept_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STRENGTHS = (0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0)
"""Two a decade, in units of half a chi-square: from nothing to more than a dimple's whole test is worth."""


@dataclass(frozen=True, eq=False)
class Path:
    """One row for each strength, the first of which is 0.

    penalty : its formula in a word; labels : the terms.
    shares : (strengths, terms) contributions; chi_square : (strengths,) of the data, penalty apart.
    kept : the terms that are left; criterion : (strengths,) BIC of these refitted, less the least of all.
    x : (strengths, unknowns) where the penalised fits ended; chosen : the row of choice.
    """

    penalty: str
    labels: Terms
    strengths: Floats
    shares: Floats
    chi_square: Floats
    kept: tuple[Terms, ...]
    criterion: Floats
    x: Floats
    chosen: int

    def named(self, row: int | None = None) -> dict[str, float]:
        """{term: contribution} of one row, by default the chosen one."""
        return dict(zip(self.labels, map(float, self.shares[self.chosen if row is None else row]), strict=True))

    def plot(self, path: str | File | None = None) -> Figure:
        """Shares and misfit against the strength; written to `path` when given."""
        from creepkit.inverse.sparsity.plotting import figure_of

        return figure_of(self, path)

    def __str__(self) -> str:
        rows = [["strength", "chi-square", "BIC - least", *self.labels, "kept"]]
        for k, strength in enumerate(self.strengths):
            numbers = [f"{strength:g}", f"{self.chi_square[k]:.1f}", f"{self.criterion[k]:.1f}"]
            rows.append([*numbers, *(f"{c:.3f}" for c in self.shares[k]), ", ".join(self.kept[k])])
        rows[1 + self.chosen][-1] += "   <- chosen"
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        return "\n".join("  ".join(map(str.ljust, row, widths)).rstrip() for row in rows)


def path_of(
    reductions: Reductions, penalty: Penalty, strengths: Sequence[float] = STRENGTHS, progress: Progress | None = None
) -> Path:
    """The path over `strengths`, from the sum without penalty; each fit starts where the last ended, and in corners.

    It ends when one term is left.
    """
    stage, labels = reductions.stage, reductions.labels
    penalised, whole = Penalised.of(stage.objective, penalty, 0.0), reductions.whole()
    corners = usual_starts(reductions)[-len(labels) :]
    xs = [whole.x]
    for k, strength in enumerate(sorted(strengths)):
        xs.append(_next(reductions, penalised.stronger(strength), xs[-1], corners).u)
        if progress is not None:
            progress("strength", k + 1, len(strengths))
        if len(kept_of(stage.shares(xs[-1]))) == 1:
            break
    shares = np.array([list(stage.shares(x).values()) for x in xs])
    kept = tuple(kept_of(dict(zip(labels, own, strict=True))) for own in shares)
    criterion = np.array([reductions.of(terms).criterion for terms in kept])
    chi_square = np.array([2.0 * stage.misfit(x) for x in xs])
    used = np.array([0.0, *sorted(strengths)])[: len(xs)]
    excess = criterion - criterion.min()
    return Path(
        type(penalty).__name__, labels, used, shares, chi_square, kept, excess, np.array(xs), int(excess.argmin())
    )


def _next(reductions: Reductions, penalised: Penalised, last: Floats, corners: Sequence[Floats]) -> Minimum:
    """The penalised fit from the last one, and from the corners that cost less there."""
    stage = reductions.stage

    def cost(x: Floats) -> float:
        return stage.misfit(x) + float(penalised.values(x[None])[0])

    here = cost(last)
    return penalised_fit(stage, penalised, [last, *(x for x in corners if cost(x) < here)])
