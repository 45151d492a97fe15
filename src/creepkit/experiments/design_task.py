"""What a design is asked for: the laws that tests cannot rule out, goal, budget, and what a verdict has to exclude."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.extrapolation import check_kelvin, extrapolation_text
from creepkit.inverse.identification import Identification
from creepkit.inverse.selection.challenges import NOT_EXCLUDED, AlteredLaw, altered_laws
from creepkit.inverse.selection.ranking import Ranking, rank, ranking_from_scores
from creepkit.inverse.uncertainty.model_averaging import ModelAverage
from creepkit.inverse.uncertainty.quantities import DerivedQuantity, exponent_at, rate_at
from creepkit.limits import HOTTEST, numbers
from creepkit.options import CELSIUS, Options, option

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
        is_settled = len(self.fits) == 1 and not any(one.excess + one.penalty <= NOT_EXCLUDED for _, one in found)
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


Goal = Literal["parameters", "law"] | DerivedQuantity


@dataclass(frozen=True, eq=False)
class DesignTask:
    """What is asked: the laws that remain, the goal, the budget, and altered laws that a verdict has to exclude."""

    remaining: RemainingLaws
    goal: Goal
    budget: float | None
    altered: Sequence[tuple[int, AlteredLaw]]

    @property
    def laws(self) -> tuple[Identification, ...]:
        """Identifications, best first."""
        return self.remaining.fits

    @property
    def goal_name(self) -> str:
        """The goal in words."""
        return self.goal if isinstance(self.goal, str) else self.goal.name

    @property
    def extrapolation(self) -> tuple[str, ...]:
        """What of the point of a quantity lies beyond the tests, in a sentence; none where nothing does."""
        point = self.goal.point if isinstance(self.goal, DerivedQuantity) else {}
        text = extrapolation_text(self.laws[0].ranges, point)
        return (f"the {self.goal_name} is {text}",) if text else ()

    @property
    def obstacle(self) -> str:
        """Why no test can help to tell laws apart, in a sentence; "" where one may, or where it is not asked for."""
        best = self.laws[0]
        if self.goal != "law":
            return ""
        if best.adequacy is not None and best.adequacy.rejects:
            return (
                f"no test is proposed: {best.law.name}, the best law, does not explain the tests that were made; find "
                "a law that does, or take the goal 'parameters'"
            )
        if len(self.laws) > 1 or self.altered:
            return ""
        doubt = "".join(f"; but {effect}" for effect in self.remaining.unmodelled_effects())
        return (
            f"one law remains, {best.law.name}, and nothing is to be told apart from it{doubt}; tests are proposed for "
            "the goal 'parameters', or for a quantity such as the rate at a stress"
        )

    @property
    def weights(self) -> tuple[float, ...]:
        """Of the laws, one together."""
        return tuple(float(w) for w in self.remaining.weights / self.remaining.weights.sum())


def task_of(remaining: RemainingLaws, goal: Goal | None, budget: float | None) -> DesignTask:
    """What is asked: by default the law where more than one remains, or where the tests allow more than the one."""
    several = len(remaining.fits) > 1
    if isinstance(goal, str) and goal not in ("law", "parameters"):
        raise FitError(f"goal '{goal}' is not known: 'law', 'parameters', or a quantity such as ck.rate_at(60.0)")
    if goal == "law" and remaining.ranking is None:
        raise FitError(
            f"there is one law, {remaining.fits[0].law.name}, and nothing to tell it apart from: give the ranking of "
            "several laws, or take the goal 'parameters'"
        )
    altered = remaining.altered() if goal == "law" or (goal is None and remaining.ranking is not None) else []
    if isinstance(goal, DerivedQuantity):
        check_kelvin(remaining.fits[0].ranges, goal.point.get("temperature"))
    chosen: Goal = goal if goal is not None else "law" if several or altered else "parameters"
    return DesignTask(remaining, chosen, budget, altered if chosen == "law" else [])


@dataclass(frozen=True)
class GoalOptions(Options, title="options of a goal", error=FitError):
    """goal : by default the law where the tests allow more than one. at_stress : MPa, at_temperature : K, of a rate or
    an exponent that is asked for. budget : h of machine time for one run or several.
    """

    goal: Literal["law", "parameters", "rate", "exponent"] | None = option(
        None, "By default the law where the tests allow more than one."
    )
    at_stress: float | None = option(None, "Of the rate or exponent.", numbers(0, 1e6, above=True), unit="MPa")
    at_temperature: float | None = option(
        None, "Of the rate or exponent.", numbers(-273.15, HOTTEST - 273.15, above=True), **CELSIUS
    )
    budget: float | None = option(None, "Machine time for one run or several.", numbers(1e-9, 1e9), unit="h")

    @property
    def quantity(self) -> Goal | None:
        """The goal as design() takes it."""
        place = [] if self.at_stress is None else [self.at_stress]
        place += [] if self.at_temperature is None else [self.at_temperature]
        if self.goal in (None, "law", "parameters"):
            if place:
                raise FitError('at_stress and at_temperature belong to the goals "rate" and "exponent"; leave them out')
            return self.goal
        if self.at_stress is None:
            raise FitError(f"{self.goal} is asked for at a stress: give at_stress, such as 60 MPa")
        return {"rate": rate_at, "exponent": exponent_at}[str(self.goal)](*place)
