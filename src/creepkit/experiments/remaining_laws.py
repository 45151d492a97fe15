"""The laws that tests cannot rule out, with their weights, and what a verdict for each would still have to exclude."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.identification import Identification
from creepkit.inverse.selection.challenges import NOT_EXCLUDED, AlteredLaw, altered_laws
from creepkit.inverse.selection.ranking import Ranking, rank, ranking_from_scores
from creepkit.inverse.uncertainty.model_averaging import ModelAverage

CHALLENGED_LAWS = 2
"""Of the laws that remain, the first ones, whose alterations a design seeks to exclude."""


NEARLY_EXCLUDED = 3.0 * NOT_EXCLUDED
"""Chi-square above the law's own, up to which the noise of a further test may make an alteration allowed."""


@dataclass(frozen=True, eq=False)
class RemainingLaws:
    """Identifications of the laws that the tests cannot rule out, best first.

    weights : (laws,) -. ranking : of all laws that were tried, None for a single identification.
    """

    fits: tuple[Identification, ...]
    weights: Floats
    ranking: Ranking | None

    @classmethod
    def of(cls, source: Ranking | ModelAverage | Identification | Sequence[Identification]) -> RemainingLaws:
        """Those of an identification, of several or of a ranking; FitError for what no design can be made from."""
        if isinstance(source, Identification):
            return cls((_usable(source),), np.ones(1), None)
        if isinstance(source, Ranking):
            ranking = source
        else:
            fits = source.fits if isinstance(source, ModelAverage) else source
            if not fits:
                raise FitError("a design is made from identifications or a ranking, found none")
            _refuse_repeated(fits)
            ranking = _with_weights(source) if isinstance(source, ModelAverage) else rank(list(fits), challenge=False)
        remaining = ranking.credible or ranking.laws[:1]
        return cls(tuple(_usable(r.fit) for r in remaining), np.array([r.weight for r in remaining]), ranking)

    def altered(self) -> list[tuple[int, AlteredLaw]]:
        """What the tests allow, or nearly exclude, beside the first laws: position of the law, and the law altered.

        Nothing where one law remains and all that was tried beside it is excluded.
        """
        if self.ranking is None or len(self.ranking.laws) < 2:
            return []
        tried = [ranked.fit for ranked in self.ranking.laws]
        found = [
            (k, altered)
            for k, fit in enumerate(self.fits[:CHALLENGED_LAWS])
            for altered in altered_laws([fit, *(other for other in tried if other is not fit)], NEARLY_EXCLUDED)
        ]
        is_settled = len(self.fits) == 1 and not any(altered.excess <= NOT_EXCLUDED for _, altered in found)
        return [] if is_settled else found

    def unmodelled_effects(self) -> tuple[str, ...]:
        """Challenges of the ranking that no test piece can answer, as sentences."""
        challenges = (self.ranking.challenges or ()) if self.ranking is not None else ()
        return tuple(str(c) for c in challenges if c.kind == "unmodelled effect")


def _with_weights(laws: ModelAverage) -> Ranking:
    """The ranking of laws whose weights are known, such as those of a file."""
    scores = -2.0 * np.log(np.maximum(laws.weights, SMALLEST_WEIGHT))
    frames = max(fit.effective_frames for fit in laws.fits)
    return ranking_from_scores(laws.fits, scores, "bic", independent_frames=frames)


SMALLEST_WEIGHT = 1e-300


def _usable(fit: Identification) -> Identification:
    if fit.predictor is None or not fit.histories:
        raise FitError(
            f"the identification of {fit.law.name} was loaded from a file: attach its histories and specimen with "
            "fit.with_histories()"
        )
    if fit.covariance.shape != (fit.u.size, fit.u.size) or not np.isfinite(fit.covariance).all():
        raise FitError(f"the identification of {fit.law.name} has no intervals; identify it again from its tests")
    return fit


def _refuse_repeated(fits: Sequence[Identification]) -> None:
    seen: set[str] = set()
    for fit in fits:
        if fit.law.fingerprint in seen:
            raise FitError(f"the law {fit.law.name} is given twice; give each law once")
        seen.add(fit.law.fingerprint)
