"""What a design is asked for: the laws that remain, the goal, the budget, and what a verdict would have to exclude."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from creepkit.errors import FitError
from creepkit.experiments.remaining_laws import RemainingLaws
from creepkit.inverse.extrapolation import check_kelvin, extrapolation_text
from creepkit.inverse.identification import Identification
from creepkit.inverse.selection.challenges import AlteredLaw
from creepkit.inverse.uncertainty.quantities import DerivedQuantity

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
