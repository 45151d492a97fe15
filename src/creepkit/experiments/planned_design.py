"""Design: planned tests with what they are expected to tell, and the plan."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from creepkit.errors import FitError
from creepkit.experiments.expectations import Expectation
from creepkit.experiments.rig import CandidateTest
from creepkit.records.presentable import Plotted, Presentable, function_of_reports

USEFUL_PROBABILITY = 0.2
"""Of a decisive verdict, below which a test is not advised for it."""


ALIKE = 0.05
"""Steps of the probability of a decisive verdict, within which the more informative test is better."""


@dataclass(frozen=True)
class PlannedTest(CandidateTest):
    """A run that could be made next, and what it is expected to tell.

    first_order : the same worked out to first order about the estimates, as it is of all tests; of the best ones the
    expectation is at draws of the posteriors (at_draws).
    """

    expectation: Expectation
    first_order: Expectation
    at_draws: bool = False

    @property
    def information_per_hour(self) -> float:
        """Nats an hour of machine time."""
        return self.expectation.information / self.hours

    @property
    def first_order_per_hour(self) -> float:
        """Nats an hour of machine time, to first order: like for like over all tests."""
        return self.first_order.information / self.hours


@dataclass(frozen=True)
class Design(Presentable, Plotted):
    """The next tests, the best first.

    goal : "parameters", "law", or the name of a quantity. laws, weights : that remain, the best first.
    altered : names of what the tests allow beside them, which planned tests have to exclude (goal "law").
    tests : all that were considered; without those that were left out, {description: why}.
    plan : the run to make, or the runs that fit the budget (h of machine time) together, and expected : what they tell.
    notes : what the expectation does not include.
    unit : of a quantity whose standard deviation is its own, None where it is that of its logarithm.
    obstacle : why none is proposed: "contradicted" (the best law), or "one law" (nothing to tell it apart from).
    """

    goal: str
    laws: tuple[str, ...]
    weights: tuple[float, ...]
    tests: tuple[PlannedTest, ...]
    left_out: tuple[tuple[str, str], ...] = ()
    plan: tuple[PlannedTest, ...] = ()
    expected: Expectation | None = None
    budget: float | None = None
    notes: tuple[str, ...] = ()
    obstacle: str = ""
    altered: tuple[str, ...] = ()
    unit: str | None = None

    @property
    def best(self) -> PlannedTest:
        """The best single run; FitError where none can be made."""
        if not self.tests:
            raise FitError(self.sentence)
        return self.tests[0]

    @property
    def sentence(self) -> str:
        """The advice: what to make, and what it is expected to tell."""
        return str(function_of_reports("design.design_sentence")(self))

    drawn_by = "design.design_figure", "design.draw_design"

    shown_by, detailed_by = "design.design_answer", "design.design_blocks"


def precision_text(value: float, unit: str | None = None) -> str:
    """A standard deviation, of ln where it has no unit, as people say it."""
    if unit is not None:
        return f"{value:.3g} {unit}".removesuffix(" 1")
    return f"{100 * value:.3g} %" if value < 1 else f"a factor of {np.exp(min(value, 50.0)):.2g}"


def kind_of_reason(reason: str) -> str:
    """A reason without its numbers, so that alike ones are counted together."""
    kinds = {"rupture": "would rupture", "noises": "would hardly grow", "beyond": "would grow too far"}
    return next((kind for word, kind in kinds.items() if word in reason), reason)
