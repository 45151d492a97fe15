"""GoalOptions: what a design is to tell, as commands and study files say it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from creepkit.errors import FitError
from creepkit.experiments.design_task import Goal
from creepkit.inverse.uncertainty.quantities import exponent_at, rate_at
from creepkit.limits import HOTTEST, numbers
from creepkit.options import CELSIUS, Options, option


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
