"""Ranking of identified laws with weights: a set of laws, and a verdict no stronger than the evidence.

Weights are of the laws tried; a simpler law has those too of laws that are the same function as it over the tests (see
selection.discrimination). An answer is decisive where one of them has more than 95 % of the weight, explains the
tests to their noise (see inverse.adequacy), was among the laws asked for, and stands every challenge: no sum with a
share of another law explains the tests better, no threshold as well, and no unmodelled effect would change the answer
(see selection.challenges). What share of another law the tests allow is said beside it.

Laws are compared under a common covariance (see selection.discrimination), where each fits best under it whatever
weights its values were found with, by their evidence (see inverse.evidence), with nuisance parameters and usual errors
of tests integrated out. Weights are exp(-excess / 2) over their sum.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.checked_arguments import checked
from creepkit.errors import FitError
from creepkit.inverse.evidence import CREDIBLE_WEIGHT, DECISIVE_EXCESS, DECISIVE_WEIGHT, evidence_weights
from creepkit.inverse.identification import Identification
from creepkit.inverse.selection.discrimination import (
    EquivalentLaws,
    RatesOverTests,
    equivalent_laws,
    under_common_covariance,
    usual_errors,
)
from creepkit.inverse.uncertainty.laplace_approximation import NORMAL_QUANTILE, delta_method
from creepkit.inverse.uncertainty.mixture_distribution import NORMAL_FREEDOM, MixtureDistribution
from creepkit.inverse.uncertainty.quantities import (
    CoordinateFunction,
    Interval,
    PointQuantity,
    RateStatements,
    log_rate,
)
from creepkit.records.presentable import Plotted, Presentable, Tabulated

if TYPE_CHECKING:
    from creepkit.inverse.adequacy import Adequacy
    from creepkit.inverse.selection.challenges import Challenge
    from creepkit.language import CreepLaw
    from creepkit.records import History, LawWithValues


@dataclass(frozen=True)
class RankedLaw:
    """One law in a ranking: excess of -2 ln of its evidence, weight, and chi-square under the covariance of the best.

    same_as : name of the simpler law that is the same function over the tests, which has its weight; "" of most.
    """

    fit: Identification
    excess: float
    weight: float
    chi_square: float = float("nan")
    same_as: str = ""


@dataclass(frozen=True)
class Ranking(Presentable, Plotted, Tabulated):
    """Identified laws, best first.

    failed : {law: why it could not be identified}.
    further : names of laws that were tried because none of those asked for explains the tests.
    challenges : what the tests allow beside the best law; None where that was not examined, as for laws from files.
    """

    laws: tuple[RankedLaw, ...]
    failed: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    further: tuple[str, ...] = ()
    challenges: tuple[Challenge, ...] | None = None

    def __repr__(self) -> str:
        return f"<Ranking: {', '.join(f'{one.fit.law.name} {one.weight:.3f}' for one in self.laws)}>"

    @property
    def best(self) -> Identification:
        """The law of most evidence."""
        return self.laws[0].fit

    @property
    def valued(self) -> LawWithValues:
        """The best law with its numbers, intervals, range of validity and the verdict: what every exporter takes."""
        return self.best.valued.replace(notes=tuple(self.best.comments(self)))

    @property
    def unmet(self) -> tuple[str, ...]:
        """Conditions of a decisive answer that are not met, most telling first.

        "alternatives": two laws or more were fitted. "convergence": of the values of the best one. "adequacy": it
        explains the tests, with nuisances of plausible size. "weight": it has more than 95 %. "asked": it was asked
        for. "challenges": it stands every one.
        """
        refuted = self.challenges is None or any(challenge.refutes for challenge in self.challenges)
        conditions = {
            "alternatives": len(self.laws) > 1,
            "convergence": self.best.converged,
            "adequacy": self.adequacy is not None and self.adequacy.explains_plausibly,
            "weight": self.laws[0].weight > DECISIVE_WEIGHT,
            "asked": self.best.law.name not in self.further,
            "challenges": not refuted,
        }
        return tuple(name for name, is_met in conditions.items() if not is_met)

    @property
    def decisive(self) -> bool:
        """Whether a law that was asked for explains the tests, has 95 % of the weight, and stands every challenge."""
        return not self.unmet

    @property
    def singled_out(self) -> bool:
        """Whether one of the laws tried explains the tests and has more than 95 % of the weight."""
        return self.laws[0].weight > DECISIVE_WEIGHT and self.adequacy is not None and self.adequacy.explains

    @property
    def adequacy(self) -> Adequacy | None:
        """Whether the best law explains the tests to their noise."""
        return self.best.adequacy

    @property
    def credible(self) -> tuple[RankedLaw, ...]:
        """The laws that the tests cannot rule out: weight above 5 %."""
        return tuple(r for r in self.laws if r.weight > CREDIBLE_WEIGHT)

    @property
    def verdict(self) -> str:
        """One sentence: what is known of the law, of how many tried, and what keeps it from being decisive."""
        from creepkit.reports.verdicts import ranking_verdict

        return ranking_verdict(self)

    @property
    def model_average(self) -> ModelAverage:
        """All laws together, each with its weight: rate(), local_exponent(), with intervals that hold both doubts."""
        return ModelAverage.from_ranking(self)

    def equivalents(self) -> tuple[EquivalentLaws, ...]:
        """Pairs of laws that these tests cannot separate, be they good or bad."""
        return equivalent_laws([ranked.fit for ranked in self.laws])

    def forecast(self, tests: History | Sequence[History], *, level: float = 0.95, **options: Any) -> Any:
        """What tests will show, over all laws by their weights; as creepkit.forecast()."""
        from creepkit.forecasts.forecast import forecast

        return forecast(self, tests, level=level, **options)

    def further_tests(self) -> Any:
        """A Design: tests like those that were made, by how well they would separate the remaining laws."""
        from creepkit.experiments.design import design

        return design(self, goal="law")

    def with_histories(self, histories: Sequence[History]) -> Ranking:
        """The same with the histories of its tests (found by name) attached to each law, as after load()."""
        laws = tuple(replace(one, fit=one.fit.with_histories(histories)) for one in self.laws)
        return replace(self, laws=laws)

    def save(self, path: str | Path) -> Path:
        """Write the ranking as JSON, and each law's identification as LAW.json beside it; load() reads them."""
        from creepkit.inverse.ranking_document import write_ranking

        return write_ranking(self, Path(path))

    drawn_by = "ranking.ranking_figure", "ranking.draw_misfits"

    detailed_by = "ranking.ranking_text"

    def __str__(self) -> str:
        from creepkit.reports.answer import answer_text

        return answer_text(self.best, self)


@dataclass(frozen=True, eq=False)
class ModelAverage(RateStatements, Presentable):
    """Laws with weights that add up to one, each with its own posterior.

    A quantity (ln of a rate, a local exponent) is normal, or Student's t, under each law; over all laws it has the
    distribution sum_i w_i F_i, whose quantiles are found by bisection (Hoeting et al. (1999), Stat. Sci. 14, 382).
    """

    fits: tuple[Identification, ...]
    weights: tuple[float, ...]

    def __post_init__(self) -> None:
        if not self.fits or len(self.fits) != len(self.weights):
            raise FitError(f"a mixture needs as many laws as weights, found {len(self.fits)} and {len(self.weights)}")
        total = float(sum(self.weights))
        if min(self.weights) < 0 or not (np.isfinite(total) and total > 0):
            raise FitError(f"the weights of a mixture must not be negative, nor all zero; found {self.weights}")
        object.__setattr__(self, "weights", tuple(float(w) / total for w in self.weights))

    @classmethod
    def from_ranking(cls, source: Ranking | Identification) -> ModelAverage:
        """The laws of a ranking; a single identification is a mixture of one.

        Each has its own weight: laws that are one function over the tests may differ beyond them.
        """
        if isinstance(source, Identification):
            return cls((source,), (1.0,))
        weights = evidence_weights([r.excess for r in source.laws])[1]
        weighted = [(r.fit, float(weight)) for r, weight in zip(source.laws, weights, strict=True) if weight > 0]
        return cls(*zip(*weighted, strict=True))

    @property
    def ranges(self) -> Mapping[str, tuple[float, float]]:  # type: ignore[override]
        """That the tests cover, as of an Identification."""
        return self.fits[0].ranges

    @property
    def stated_laws(self) -> tuple[CreepLaw, ...]:
        """The laws of the mixture."""
        return tuple(fit.law for fit in self.fits)

    def forecast(self, tests: History | Sequence[History], *, level: float = 0.95, **options: Any) -> Any:
        """What tests will show, over the laws, so that bands hold the doubt about the law; as creepkit.forecast()."""
        from creepkit.forecasts.forecast import forecast

        return forecast(self, tests, level=level, **options)

    def interval_at(self, quantity: PointQuantity, point: Mapping[str, ArrayLike | None]) -> Interval:
        """Median and 95 % interval over the laws; point : {name: (...,) or None for the best law's reference}."""
        reference = self.fits[0].reference
        point = {name: getattr(reference, name) if value is None else value for name, value in point.items()}
        functions = [quantity(fit.coordinates, **point) for fit in self.fits]
        normals = [_normal_under_law(fit, function) for fit, function in zip(self.fits, functions, strict=True)]
        location, scale = (np.stack([each[k] for each in normals]) for k in (0, 1))
        if quantity is log_rate:
            at = np.asarray(point["stress"], float), np.asarray(point["temperature"], float)
            misses = [f.misfit_half_widths(g, *at) / NORMAL_QUANTILE for f, g in zip(self.fits, functions, strict=True)]
            scale = np.stack([np.hypot(own, more) for own, more in zip(scale, misses, strict=True)])
        freedom = np.full(len(self.fits), NORMAL_FREEDOM)
        return MixtureDistribution(np.array(self.weights), freedom, location, scale).interval()

    shown_by = "identification.model_average_text"


def _normal_under_law(fit: Identification, function: CoordinateFunction) -> tuple[Floats, Floats]:
    """Value and standard deviation under one law; never quite zero, so that a mixture of certainties has quantiles."""
    if fit.samples is not None:
        _, low, high = fit.interval_of(function)
        middle, sd = 0.5 * (low + high), 0.5 * (high - low) / NORMAL_QUANTILE
    else:
        middle, sd = delta_method(function, fit.u, fit.covariance)
    return middle, np.maximum(sd, 1e-12 * np.maximum(np.abs(middle), 1.0))


@checked
def rank(
    fits: Sequence[Identification],
    failed: Mapping[str, str] | None = None,
    *,
    further: Collection[str] = (),
    further_parts: Sequence[int] = (),
    challenge: bool = True,
) -> Ranking:
    """Rank identifications made from the same histories, with weights and a verdict.

    further : names of laws that nobody asked for. One that the tests contradict, too, comes last where it predicts
        tests worse, each left out, than a law that was asked for: it only bends further to the curves at hand.
    further_parts : of each law, how many terms and factors a search gave it: before the tests the odds are 19 to 1
        against each, for the evidence is indifferent to one that changes nothing.
    challenge : whether a law that is singled out is challenged (some runs of the predictor), without which no answer
        is decisive.
    """
    if not fits:
        raise FitError("there are no identifications to rank")
    if len({fit.provenance.get("data") for fit in fits}) > 1:
        raise FitError(
            "the identifications were made from different histories, frames, nuisances or rupture times and "
            "cannot be ranked; make them alike (rupture_times='use' or 'ignore' for all laws)"
        )
    common = under_common_covariance(fits, [usual_errors(fit) for fit in fits])
    score = np.where(_are_outdone(fits, further), np.inf, common.scores)
    score += DECISIVE_EXCESS * np.array(further_parts or [0] * len(fits))
    ranking = ranking_from_scores(
        fits, score, chi_square=common.chi_square,
        failed=failed, rates=RatesOverTests(fits),
    )  # fmt: skip
    return challenged(ranking) if challenge else ranking


def _are_outdone(fits: Sequence[Identification], further: Collection[str]) -> list[bool]:
    """(laws,) Whether it was not asked for, is contradicted, and one that was asked for predicts tests better."""
    least = min((fit.prediction_error for fit in fits if fit.law.name not in further), default=np.nan)
    return [
        fit.law.name in further and fit.adequacy is not None and fit.adequacy.rejects and fit.prediction_error > least
        for fit in fits
    ]


def challenged(ranking: Ranking) -> Ranking:
    """The ranking with its best law challenged, where its tests and predictor are at hand.

    Where no law is singled out, what nobody modelled is tried alone (see selection.challenges).
    """
    from creepkit.inverse.selection.challenges import challenges_of, explaining_effects

    fits = [ranked.fit for ranked in ranking.laws]
    if len(fits) < 2 or any(f.predictor is None or not f.histories for f in fits):
        return ranking
    if ranking.singled_out:
        found = challenges_of([r.fit for r in ranking.laws if r.same_as != ranking.best.law.name])
    else:
        found = explaining_effects(fits, evidence_weights([ranked.excess for ranked in ranking.laws])[1])
    return replace(ranking, challenges=found)


def ranking_from_scores(
    fits: Sequence[Identification],
    scores: Floats,
    *,
    chi_square: Floats | None = None,
    failed: Mapping[str, str] | None = None,
    rates: RatesOverTests | None = None,
) -> Ranking:
    """The ranking of identifications; rates : theirs, by which a simpler law may stand for others.

    scores : (laws,) -2 ln of their evidence. chi_square : (laws,) of their residuals. Laws whose score is no number, or
    that do not predict every test, come after the others and have no weight beside them.
    """
    predicted = np.isfinite(scores) & [fit.adequacy is None or not fit.adequacy.unpredicted for fit in fits]
    scores = np.where(predicted, scores, np.inf) if predicted.any() else scores
    excess, weight = evidence_weights(scores)
    standing = [*range(len(fits))] if rates is None else rates.standing([fit.u for fit in fits], scores)
    weight = np.minimum(np.bincount(standing, weight, len(fits)), 1.0)
    chi_squares = np.full(len(fits), np.nan) if chi_square is None else chi_square
    order = np.argsort(excess, kind="stable")
    names = [fits[law].law.name if law != k else "" for k, law in enumerate(standing)]
    laws = tuple(RankedLaw(fits[k], float(excess[k]), float(weight[k]), float(chi_squares[k]), names[k]) for k in order)
    return Ranking(laws, MappingProxyType(dict(failed or {})))
