"""What a design is asked for: the laws that tests cannot rule out, goal, budget, and what a verdict has to exclude."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from creepkit.arrays import Floats
from creepkit.checked_arguments import checked
from creepkit.errors import FitError
from creepkit.inverse.extrapolation import check_isothermal, check_kelvin, extrapolation_text
from creepkit.inverse.identification import Identification
from creepkit.inverse.selection.challenges import NOT_EXCLUDED, AlteredLaw, altered_laws
from creepkit.inverse.selection.ranking import Ranking, rank
from creepkit.inverse.uncertainty.quantities import DerivedQuantity, exponent_at, rate_at
from creepkit.limits import HOTTEST, numbers
from creepkit.options import CELSIUS, Options, option

CHALLENGED_LAWS = 2
"""Of the laws that remain, the first ones, whose alterations a design seeks to exclude."""


NEARLY_EXCLUDED = 3.0 * NOT_EXCLUDED
"""Chi-square above the law's own, up to which the noise of a further test may make an alteration allowed."""


Goal = Literal["parameters", "law"] | DerivedQuantity


@dataclass(frozen=True, eq=False)
class DesignTask:
    """What is asked: laws that the tests cannot rule out, the goal, the budget, and what a verdict has to exclude.

    laws : their identifications, the best first. weights : (laws,) -. ranking : of all laws that were tried, None for a
    single identification. altered : what the tests allow, or nearly exclude, beside the first laws: position of the
    law, and the law altered.
    """

    laws: tuple[Identification, ...]
    weights: Floats
    ranking: Ranking | None
    goal: Goal
    budget: float | None
    altered: Sequence[tuple[int, AlteredLaw]]

    @classmethod
    def of(
        cls, source: Ranking | Identification | Sequence[Identification], goal: Goal | None, budget: float | None
    ) -> DesignTask:
        """By default the law is asked for where more than one remains, or where the tests allow more than the one.

        FitError for what no design can be made from.
        """
        ranking = None if isinstance(source, Identification) else _ranking_of(source)
        ranked = [] if ranking is None else ranking.credible or ranking.laws[:1]
        laws = (source,) if isinstance(source, Identification) else tuple(one.fit for one in ranked)
        for fit in laws:
            _check_usable(fit)
        if isinstance(goal, str) and goal not in ("law", "parameters"):
            raise FitError(f"goal '{goal}' is not known: 'law', 'parameters', or a quantity such as ck.rate_at(60.0)")
        if goal == "law" and ranking is None:
            raise FitError(
                f"there is one law, {laws[0].law.name}, and nothing to tell it apart from: give the ranking of "
                "several laws, or take the goal 'parameters'"
            )
        if isinstance(goal, DerivedQuantity):
            check_kelvin(laws[0].ranges, goal.point.get("temperature"))
            check_isothermal([fit.law for fit in laws], laws[0].ranges, goal.point.get("temperature"))
        altered = [] if ranking is None or goal not in (None, "law") else _altered(laws, ranking)
        chosen: Goal = goal if goal is not None else "law" if len(laws) > 1 or altered else "parameters"
        weights = np.array([one.weight for one in ranked]) if ranked else np.ones(1)
        return cls(laws, weights / weights.sum(), ranking, chosen, budget, altered)

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
        """Why no test can help to tell laws apart, as a Design has it; "" where one may, or it is not asked for."""
        if self.goal != "law":
            return ""
        if self.laws[0].adequacy is not None and self.laws[0].adequacy.rejects:
            return "contradicted"
        return "" if len(self.laws) > 1 or self.altered else "one law"


def _ranking_of(source: Ranking | Sequence[Identification]) -> Ranking:
    """The ranking of several laws."""
    if isinstance(source, Ranking):
        return source
    if not source:
        raise FitError("a design is made from identifications or a ranking, found none")
    (fingerprint, count), *_ = Counter(fit.law.fingerprint for fit in source).most_common(1)
    if count > 1:
        name = next(fit.law.name for fit in source if fit.law.fingerprint == fingerprint)
        raise FitError(f"the law {name} is given twice; give each law once")
    return rank(list(source), challenge=False)


def _altered(laws: Sequence[Identification], ranking: Ranking) -> list[tuple[int, AlteredLaw]]:
    """What the tests allow, or nearly exclude, beside the first laws.

    Nothing where one law remains and all that was tried beside it is excluded.
    """
    if len(ranking.laws) < 2:
        return []
    found = [
        (k, altered)
        for k, fit in enumerate(laws[:CHALLENGED_LAWS])
        for altered in altered_laws([fit, *(r.fit for r in ranking.laws if r.fit is not fit)], NEARLY_EXCLUDED)
    ]
    is_settled = len(laws) == 1 and not any(one.excess <= NOT_EXCLUDED for _, one in found)
    return [] if is_settled else found


def _check_usable(fit: Identification) -> None:
    if fit.predictor is None or not fit.histories:
        raise FitError(
            f"the identification of {fit.law.name} was loaded from a file: attach its histories and specimen with "
            "fit.with_histories()"
        )
    if fit.covariance.shape != (fit.u.size, fit.u.size) or not np.isfinite(fit.covariance).all():
        raise FitError(f"the identification of {fit.law.name} has no intervals; identify it again from its tests")


@checked
@dataclass(frozen=True)
class GoalOptions(Options, title="options of a goal"):
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
