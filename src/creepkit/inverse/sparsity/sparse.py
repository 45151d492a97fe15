"""sparse: a sum of terms fitted with a penalty, terms dropped, the rest refitted and confirmed against the sum."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from creepkit.errors import FitError
from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import identify
from creepkit.inverse.search.landscape import Search
from creepkit.inverse.search.refining import Progress
from creepkit.inverse.settings import Settings
from creepkit.inverse.sparsity.choosing import Choice, chosen
from creepkit.inverse.sparsity.path import STRENGTHS, Path, path_of
from creepkit.inverse.sparsity.penalties import Penalty, Subsets, check_penalty
from creepkit.inverse.sparsity.record import Misfit, Sparsity
from creepkit.inverse.sparsity.reduction import Reduced, Reductions
from creepkit.inverse.sparsity.resampling import Frequencies, frequencies
from creepkit.inverse.sparsity.stage import Stage
from creepkit.language import CreepLaw
from creepkit.records import History, Predictor

Using = Predictor | Mapping[str, Predictor]


def sparse(
    law: CreepLaw, histories: Sequence[History], using: Using, *, penalty: Penalty | Subsets,
    search: Search | None = None, through: Predictor | None = None, settings: Settings | None = None,
    progress: Progress | None = None,
) -> Identification:  # fmt: skip
    """Identify the law of those terms of a sum that the histories need; what was dropped stands in `sparsity`.

    The whole sum is identified without penalty first: it gives the covariance on which everything is compared. Then
    misfit and penalty together are minimised from its optimum, from each term's own, and where `search` finds minima;
    terms that contribute less than 5 % are dropped; what is left is identified without penalty.

    through : a surrogate by which terms are chosen; values and intervals are those of `using`.
    """
    check_penalty(penalty)
    dense, reductions = opened(law, histories, using, through, settings, progress)
    return reduced_by(penalty, dense, reductions, search, progress)


def reduced_by(
    penalty: Penalty | Subsets, dense: Identification, reductions: Reductions, search: Search | None = None,
    progress: Progress | None = None,
) -> Identification:  # fmt: skip
    """The same from the whole sum, identified and opened before."""
    choice = chosen(reductions, penalty, search, progress)
    reduced = confirmed(reductions, choice)
    size = len(reduced.law.params)
    known = [replace(n, value=float(v)) for n, v in zip(dense.nuisances, reduced.x[size:], strict=True)]
    assert dense.using is not None
    fit = identify(
        reduced.law, dense.histories, dense.using, settings=dense.settings, start=reduced.x[:size], known=known,
        reference=dense.reference, progress=progress,
    )  # fmt: skip
    record = _record(dense, fit, reductions, reduced, choice, penalty)
    return replace(fit, trace=choice.trace or dense.trace, sparsity=record)


def path(
    law: CreepLaw, histories: Sequence[History], using: Using, penalty: Penalty, *,
    strengths: Sequence[float] = STRENGTHS, settings: Settings | None = None, progress: Progress | None = None,
) -> Path:  # fmt: skip
    """The path of a penalty over its strength, from none to all, with the automatic choice."""
    _, reductions = opened(law, histories, using, None, settings, progress)
    return path_of(reductions, penalty, strengths, progress)


def resampled(
    law: CreepLaw, histories: Sequence[History], using: Using, penalty: Penalty | Subsets, *, repeats: int = 20,
    seed: int = 0, settings: Settings | None = None, progress: Progress | None = None,
) -> Frequencies:  # fmt: skip
    """How often each term is kept when the tests (or the frames of the only one) are drawn again."""
    _, reductions = opened(law, histories, using, None, settings, progress)
    choice = chosen(reductions, penalty, None, progress)
    return frequencies(reductions, penalty, choice.strength, choice.x, repeats=repeats, seed=seed, progress=progress)


def opened(
    law: CreepLaw, histories: Sequence[History], using: Using, through: Predictor | None, settings: Settings | None,
    progress: Progress | None,
) -> tuple[Identification, Reductions]:  # fmt: skip
    """The whole sum identified without penalty, and its terms ready to be dropped."""
    if len(law.terms) < 2:
        raise FitError(
            f"law '{law.name}' has one term, '{next(iter(law.terms))}', and a penalty chooses among terms: "
            "identify it without penalty, or a sum of laws with it"
        )
    dense = identify(law, histories, using, settings=settings, through=through, progress=progress)
    return dense, Reductions(Stage.of(dense, through))


def confirmed(reductions: Reductions, choice: Choice) -> Reduced:
    """The reduced law, to which dropped terms come back, the largest first, until its BIC is not above the sum's."""
    kept = list(choice.kept)
    while True:
        reduced = reductions.of(kept)
        if reduced.criterion <= reductions.whole(reduced).criterion or len(kept) == len(reductions.labels):
            return reduced
        rest = [label for label in reductions.labels if label not in kept]
        kept.append(max(rest, key=lambda label: choice.shares[label]))


def _record(
    dense: Identification, fit: Identification, reductions: Reductions, reduced: Reduced, choice: Choice,
    penalty: Penalty | Subsets,
) -> Sparsity:  # fmt: skip
    stage, whole = reductions.stage, reductions.whole(reduced)
    return Sparsity(
        law=stage.law.name,
        penalty=type(penalty).__name__,
        strength=choice.strength,
        kept=reduced.kept,
        dropped=tuple(label for label in reductions.labels if label not in reduced.kept),
        off=reduced.off,
        proposed=choice.kept,
        shares_without=stage.shares(whole.x),
        shares_with=choice.shares,
        shares_after=reduced.stage.shares(reduced.x),
        whole=Misfit(whole.chi_square, whole.parameters, whole.criterion, dense.errors),
        reduced=Misfit(reduced.chi_square, reduced.parameters, reduced.criterion, fit.errors),
        frames=stage.frames,
        path=choice.path,
    )
