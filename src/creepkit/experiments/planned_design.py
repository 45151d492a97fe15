"""Design: planned tests with what they are expected to tell, the plan, and the advice in a sentence."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from creepkit.errors import FitError
from creepkit.experiments.expectations import Expectation
from creepkit.experiments.rig import CandidateTest
from creepkit.records.presentable import Plotted, Presentable

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
    def machine_time(self) -> str:
        """Its machine time in words: the longest test of a rig does not hold the time to set it up."""
        return machine_time_text(self.hours)

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
    obstacle : why no test is proposed, in a sentence.
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
        """The advice."""
        return design_sentence(self)

    def to_json(self) -> dict[str, object]:
        """Laws, advice, plan and every test considered, as JSON-able data."""
        from creepkit.reports.design import design_to_json

        return design_to_json(self)

    drawn_by = "design.design_figure", "design.draw_design"

    shown_by = "design.design_text"


def machine_time_text(hours: float) -> str:
    """Machine time in words; hours : h, those to set up each run included."""
    return f"{hours:.3g} h of machine time with setting up"


def design_sentence(design: Design) -> str:
    """The advice: what to make, what it is expected to tell, and the next best."""
    if design.obstacle:
        return design.obstacle
    if not design.tests:
        reasons = dict.fromkeys(f"that {kind_of_reason(reason)}" for _, reason in design.left_out)
        return f"no test can be made: there are only candidates {' or '.join(reasons)}" if reasons else "no candidates"
    best, *others = design.tests
    if design.goal == "law" and _is_hopeless(design):
        return (
            f"none of the {len(design.tests)} tests considered is likely to tell {_question(design)}; the best is "
            f"{best.description}, with probability {_short(design, best.expectation)}"
        )
    if design.budget is not None and len(design.plan) > 1 and design.expected is not None:
        runs = "; then ".join(_repeated(design.plan))
        total = sum(test.hours for test in design.plan)
        return f"{runs} ({machine_time_text(total)}): together {_told(design, design.expected)}"
    first = design.plan[0] if design.plan else best
    others = [test for test in design.tests if test is not first]
    further = f"; next best {others[0].description} ({_short(design, others[0].expectation)})" if others else ""
    return f"{first.description} ({first.machine_time}): {_told(design, first.expectation)}{further}"


def _is_hopeless(design: Design) -> bool:
    """Whether neither a test nor the plan is likely to decide."""
    expected = [test.expectation for test in design.tests] + ([design.expected] if design.expected is not None else [])
    return max(e.probability for e in expected) < USEFUL_PROBABILITY


def _and(names: tuple[str, ...]) -> str:
    return " and ".join(names) if len(names) < 3 else f"{', '.join(names[:-1])} and {names[-1]}"


def _separated(design: Design) -> str:
    """What planned tests do that exclude all but one law."""
    if len(design.laws) == 1:
        return f"tells {design.laws[0]} from {_and(design.altered)}"
    against = ", and from what the tests allow beside each," if design.altered else ""
    return f"separates {_and(design.laws)}{against}"


def _question(design: Design) -> str:
    if len(design.laws) == 1:
        return f"{design.laws[0]} from {_and(design.altered)}"
    return f"{_and(design.laws)} apart"


def _repeated(plan: tuple[PlannedTest, ...]) -> list[str]:
    """The runs of a plan in words; the same ones are counted."""
    counts = Counter(test.description for test in plan)
    return [text if count == 1 else f"{count} times {text}" for text, count in counts.items()]


def _told(design: Design, expected: Expectation) -> str:
    """What a test is expected to tell, as the end of a sentence."""
    if design.goal == "law":
        return f"{_separated(design)} with probability {expected.probability:.2f}"
    if np.isfinite(expected.sd):
        before, after = (precision_text(sd, design.unit) for sd in (expected.current_sd, expected.sd))
        return f"brings the standard deviation of the {design.goal} from {before} to {after}"
    shrinkage = np.exp(-expected.information / max(len(expected.parameter_sd), 1))
    return (
        f"tells {expected.information:.2g} nats of the parameters: their intervals become {shrinkage:.2g} times as "
        "wide in the geometric mean"
    )


def precision_text(value: float, unit: str | None = None) -> str:
    """A standard deviation, of ln where it has no unit, as people say it."""
    if unit is not None:
        return f"{value:.3g} {unit}".removesuffix(" 1")
    return f"{100 * value:.3g} %" if value < 1 else f"a factor of {np.exp(min(value, 50.0)):.2g}"


def _short(design: Design, expected: Expectation) -> str:
    if design.goal == "law":
        return f"{expected.probability:.2f}"
    return precision_text(expected.sd, design.unit) if np.isfinite(expected.sd) else f"{expected.information:.2g} nats"


def kind_of_reason(reason: str) -> str:
    """A reason without its numbers, so that alike ones are counted together."""
    kinds = {"rupture": "would rupture", "noises": "would hardly grow", "beyond": "would grow too far"}
    return next((kind for word, kind in kinds.items() if word in reason), reason)
