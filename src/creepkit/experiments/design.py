"""design: the next tests, by what they are expected to tell for each hour of machine time.

Candidates are what a rig can make. Each is predicted with every law that remains, with exact sensitivities, and what it
tells follows from Gaussian algebra about the estimates, with the errors that tests usually have; to tell laws apart the
best ones are evaluated again at draws of the posteriors.
Goals are the parameters (D-optimal), a quantity such as the rate at the stress of service (c-optimal), and the law.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Annotated

import numpy as np

from creepkit import limits
from creepkit.arrays import single_threaded_blas
from creepkit.checked_arguments import checked
from creepkit.errors import FitError
from creepkit.experiments.design_task import DesignTask, Goal
from creepkit.experiments.expectations import Expectation, LawCriterion, PrecisionCriterion
from creepkit.experiments.planned_design import ALIKE, Design, PlannedTest
from creepkit.experiments.planned_outcomes import KnownLaw, PlannedOutcomes
from creepkit.experiments.rig import CandidateTest, Rig, candidates_given, grid_of_rig, rigs_for
from creepkit.inverse.evidence import DECISIVE_WEIGHT
from creepkit.inverse.identification import Identification
from creepkit.inverse.perturbations import with_expected_scatter
from creepkit.inverse.selection.ranking import Ranking
from creepkit.inverse.uncertainty.quantities import DerivedQuantity
from creepkit.language import temperature
from creepkit.records import History
from creepkit.records.conditions import stated_condition

Progress = Callable[[str, int, int], None]


EVALUATED_AT_DRAWS = 8
"""Candidates that are evaluated again at draws of the posteriors."""


MOST_ALIKE = 2
"""Of these, those of one load and duration."""


LARGEST_RUPTURE_PROBABILITY = 0.1
"""Of a planned test, from which on it is left out."""


SMALLEST_GROWTH = 5.0
"""Of the leading output over a planned test, in noises of a frame."""


GREEDY_POOL, MOST_RUNS, LEAST_GAIN = 30, 6, 0.02
"""Candidates from which runs are chosen one after the other for a budget, how many, and the gain that ends it, nats."""


@checked
def design(
    source: Ranking | Identification | Sequence[Identification],
    *,
    rig: Rig | Sequence[Rig] | None = None,
    goal: Goal | None = None,
    budget: float | None = None,
    candidates: Sequence[History] | None = None,
    seed: Annotated[int, limits.SEED] = 0,
    progress: Progress | None = None,
) -> Design:
    """The next tests of an identification or of a ranking of laws, also of one that was loaded from its file.

    rig : what the equipment can do; by default a little more than what it did. goal : "law", "parameters" or a
        quantity; by default the law where more than one remains. budget : h of machine time for one run or several.
    candidates : planned histories (without outputs) in the place of what the rig can make.
    """
    if budget is not None and budget <= 0:
        raise FitError(f"the budget is {budget:g} h; it must be above zero")
    task = DesignTask.of(source, goal, budget)
    rigs = rigs_for(task.laws[0], rig)
    if candidates is not None and not len(candidates):
        raise FitError("candidates= takes a list of planned histories, found none")
    if task.obstacle:
        names, weights = tuple(fit.law.name for fit in task.laws), tuple(task.weights.tolist())
        return Design(task.goal_name, names, weights, (), budget=budget, obstacle=task.obstacle)
    search = _Search(task, rigs, seed, progress)
    planned = _grids(task.laws, rigs, budget) if candidates is None else candidates_given(candidates, rigs)
    if budget is not None:
        planned = [c for c in planned if c.hours <= 1.0001 * budget]
        if not planned:
            raise FitError(f"none of the planned tests fits into a budget of {budget:g} h of machine time")
    return search.run(planned, refuse=candidates is not None)


MOST_MATERIALS = 5
"""Of those that tests were made of, by their conditions, of which tests are planned: the ends, and some between."""


def _grids(laws: Sequence[Identification], rigs: Sequence[Rig], budget: float | None) -> list[CandidateTest]:
    by_temperature, most = all(fit.law.uses(temperature) for fit in laws), np.inf if budget is None else budget
    conditions = tuple(dict.fromkeys(one for fit in laws for one in fit.law.conditions))
    candidates: list[CandidateTest] = []
    for rig in rigs:
        tests = sorted((h for h in laws[0].histories if h.specimen == rig.specimen), key=lambda h: float(h.times[-1]))
        longest = {tuple(stated_condition(h, one)[0] for one in conditions): h for h in tests}
        materials = sorted(longest)
        for k in np.unique(np.linspace(0, len(materials) - 1, min(len(materials), MOST_MATERIALS)).round().astype(int)):
            stated = zip(conditions, materials[k], strict=True)
            text = "".join(f", {one.name.replace('_', ' ')} {value:.3g} {one.unit}" for one, value in stated)
            candidates += grid_of_rig(
                rig, longest[materials[k]], budget=most, by_temperature=by_temperature, of=text * (len(materials) > 1)
            )
    return candidates


class _Search:
    """The evaluation of candidates: all to first order, the best at draws."""

    def __init__(self, task: DesignTask, rigs: Sequence[Rig], seed: int, progress: Progress | None) -> None:
        self.task, self.rigs = task, {rig.specimen: rig for rig in rigs}
        self.progress: Progress = progress or (lambda *_: None)
        with single_threaded_blas():
            fit, of_ranking = task.laws[0], task.goal == "law"
            noise_model = fit.noise_model  # of values with the scatter of rates as their intervals have it
            if not of_ranking:
                noise_model = with_expected_scatter(fit.least_squares_problem, fit.linear_problem, noise_model)
            known = [KnownLaw.from_identification(fit, noise_model, of_ranking=of_ranking) for fit in task.laws]
            known += [KnownLaw.from_altered(task.laws[k], altered, noise_model) for k, altered in task.altered]
        self.outcomes = PlannedOutcomes(known, progress, len(task.laws))
        self.criterion: PrecisionCriterion | LawCriterion
        if task.goal == "law":
            self.criterion = _law_criterion(task, self.outcomes, seed)
        else:
            quantity = task.goal if isinstance(task.goal, DerivedQuantity) else None
            self.criterion = PrecisionCriterion(self.outcomes, task.weights, quantity)
        self.tests: list[PlannedTest] = []
        self.left_out: dict[str, str] = {}

    def run(self, planned: Sequence[CandidateTest], *, refuse: bool = False) -> Design:
        """The design; refuse : whether it is an error that no test can be made, as where a user names them."""
        with single_threaded_blas():
            self._evaluate_all(planned, refuse)
            if isinstance(self.criterion, LawCriterion):
                self._evaluate_best(self.criterion)
            plan, expected = self._plan()
        if not plan and self.tests:
            plan, expected = (self.tests[0],), self.tests[0].expectation
        task = self.task
        return Design(
            goal=task.goal_name,
            laws=tuple(fit.law.name for fit in task.laws),
            weights=tuple(task.weights.tolist()),
            tests=tuple(self.tests),
            left_out=tuple(self.left_out.items()),
            plan=plan,
            expected=expected,
            budget=task.budget,
            unit=task.goal.unit if isinstance(task.goal, DerivedQuantity) and task.goal.scale == "linear" else None,
            altered=tuple(altered.problem.law.name for _, altered in task.altered),
            notes=(*task.extrapolation, *notes_of(task.laws, tuple(self.rigs.values()))),
        )

    def _evaluate_all(self, planned: Sequence[CandidateTest], refuse: bool) -> None:
        self.outcomes.add([h for candidate in planned for h in candidate.histories])
        for candidate in planned:
            refusal = self._refusal(candidate)
            if refusal:
                self.left_out[candidate.description] = refusal
            else:
                expectation = self.criterion.expectation(candidate.histories)
                what = candidate.description, candidate.histories, candidate.hours
                self.tests.append(PlannedTest(*what, expectation, expectation))
        if refuse and not self.tests and self.left_out:
            name, refusal = next(iter(self.left_out.items()))
            raise FitError(f"the planned test '{name}' is of no use: {refusal}")
        self.tests.sort(key=self._order)

    def _refusal(self, candidate: CandidateTest) -> str:
        """Why a planned test is left out, in a sentence; "" where it is not."""
        rig = self.rigs.get(candidate.histories[0].specimen)
        for history in candidate.histories:
            for k, fit in enumerate(self.task.laws):
                outcome = self.outcomes.outcome(history, k)
                if outcome.ruptures:
                    return f"by {fit.law.name} it would rupture before its end"
                if rig is not None and outcome.largest > rig.largest_output:
                    return (
                        f"it would grow to {outcome.largest:.3g}, beyond the {rig.largest_output:.3g} that is allowed"
                    )
            growth = self.outcomes.outcome(history, 0).growth
            if growth < SMALLEST_GROWTH:
                return f"it would grow by {growth:.2g} noises of a frame only"
        return ""

    def _evaluate_best(self, criterion: LawCriterion) -> None:
        """The best candidates at draws of the posteriors."""
        promising = self._promising()
        for done, test in enumerate(promising):
            probability = criterion.probability_of_rupture(test.histories)
            if probability > LARGEST_RUPTURE_PROBABILITY:
                self.left_out[test.description] = f"it would rupture with a probability of {probability:.2f}"
                self.tests.remove(test)
            else:
                expectation = criterion.expectation(test.histories, at_draws=True)
                position = next(k for k, t in enumerate(self.tests) if t.histories is test.histories)
                self.tests[position] = replace(test, expectation=expectation, at_draws=True)
                self.tests.sort(key=self._order)
            self.progress("best tests at draws of the posteriors", done + 1, len(promising))

    def _promising(self) -> list[PlannedTest]:
        """The first candidates, no more than two of one load and duration."""
        chosen, places = list[PlannedTest](), Counter[tuple[float, float]]()
        for test in self.tests:
            places[place := (test.first_level, test.duration)] += 1
            if places[place] <= MOST_ALIKE and len(chosen) < EVALUATED_AT_DRAWS:
                chosen.append(test)
        return chosen

    def _order(self, test: PlannedTest) -> tuple[float, ...]:
        """Least for the best: the cheapest that decides between laws, else the likeliest to; for values by the hour.

        Those that were evaluated at draws come first: the others are known to first order alone, which flatters them.
        """
        if self.task.goal != "law":
            return (not test.at_draws, -test.information_per_hour)
        probability, information = test.expectation.probability, test.expectation.information
        if probability >= DECISIVE_WEIGHT:
            return (not test.at_draws, 0.0, test.hours)
        return (not test.at_draws, 1.0, -round(probability / ALIKE), -information)

    def _plan(self) -> tuple[tuple[PlannedTest, ...], Expectation | None]:
        """The runs for the budget: chosen one after the other by what each adds for an hour, or the best single one."""
        if self.task.budget is None or not self.tests:
            return (), None
        by_hour = sorted(self.tests, key=lambda t: -t.information_per_hour)
        by_total = sorted(
            self.tests, key=lambda t: (-np.nan_to_num(t.expectation.probability), -t.expectation.information)
        )
        pool = list({id(t): t for t in (*by_hour[:GREEDY_POOL], *by_total[: GREEDY_POOL // 3])}.values())
        plans = [self._greedy(pool), (by_total[0],), (self.tests[0],)]
        judged = [(plan, self._together(plan)) for plan in plans if plan]
        return max(judged, key=lambda pair: self._merit(*pair))

    def _greedy(self, pool: Sequence[PlannedTest]) -> tuple[PlannedTest, ...]:
        assert self.task.budget is not None
        chosen: list[PlannedTest] = []
        left, known = self.task.budget, 0.0
        while len(chosen) < MOST_RUNS:
            fitting = [t for t in pool if t.hours <= 1.0001 * left]
            gains = [self.criterion.expectation(_histories([*chosen, t])).information - known for t in fitting]
            if not fitting or max(gains) < LEAST_GAIN:
                break
            k = int(np.argmax([gain / t.hours for gain, t in zip(gains, fitting, strict=True)]))
            if gains[k] < LEAST_GAIN:
                k = int(np.argmax(gains))
            chosen.append(fitting[k])
            left, known = left - fitting[k].hours, known + gains[k]
            self.progress("runs for the budget", len(chosen), MOST_RUNS)
        return tuple(chosen)

    def _together(self, plan: Sequence[PlannedTest]) -> Expectation:
        if len(plan) == 1 and (plan[0].at_draws or not isinstance(self.criterion, LawCriterion)):
            return plan[0].expectation
        if isinstance(self.criterion, LawCriterion):
            return self.criterion.expectation(_histories(plan), at_draws=True)
        return self.criterion.expectation(_histories(plan))

    def _merit(self, plan: Sequence[PlannedTest], expectation: Expectation) -> tuple[float, float]:
        """Largest for the best: of plans that decide the one of fewest hours."""
        probability = float(np.nan_to_num(expectation.probability))
        if probability >= DECISIVE_WEIGHT:
            return (np.inf, -sum(test.hours for test in plan))
        return (float(round(probability / ALIKE)), expectation.information)


def _histories(plan: Sequence[PlannedTest]) -> list[History]:
    return [history for test in plan for history in test.histories]


def _law_criterion(task: DesignTask, outcomes: PlannedOutcomes, seed: int) -> LawCriterion:
    ranking = task.ranking
    assert ranking is not None
    ranked = [next(r for r in ranking.laws if r.fit is fit) for fit in task.laws]
    chi_squares = np.array([r.chi_square for r in ranked])
    if not np.isfinite(chi_squares).all():
        chi_squares = np.array([law.chi_square for law in outcomes.laws[: len(task.laws)]])
    excess = np.array([r.excess for r in ranked])
    altered = [(k, one.excess, one.refuting_excess) for k, one in task.altered]
    return LawCriterion(outcomes, task.weights, excess, chi_squares, altered, seed)


def notes_of(laws: Sequence[Identification], rigs: Sequence[Rig]) -> tuple[str, ...]:
    """What an expectation takes for granted."""
    notes = []
    if any(len(rig.temperatures) > 1 for rig in rigs) and not all(fit.law.uses(temperature) for fit in laws):
        names = ", ".join(fit.law.name for fit in laws if not fit.law.uses(temperature))
        notes.append(f"the temperatures of the rig were not varied: {names} says nothing of temperature")
    scatters = any(n.kind == "rate" and n.sd is None for n in laws[0].settings.nuisances)
    if scatters and len(laws[0].histories) == 1:
        notes.append(
            "one test does not show by how much the rate scatters from test to test; it is taken as none: give "
            'Nuisance("rate", sd=...) where it is known'
        )
    if laws[0].noise_model.rate > 0 and any(rig.tests_per_run > 1 for rig in rigs):
        notes.append(
            "the rates of test pieces in one run are taken to scatter like those of tests one by one: where the oven "
            "scatters, several of them tell less"
        )
    if any(fit.settings.weights != "likelihood" for fit in laws):
        notes.append(
            'values were found with other weights than weights="likelihood", by which expectations are worked out: '
            "intervals after further tests may differ from what is expected here by a factor of two"
        )
    for fit in laws:
        if fit.adequacy is not None and fit.adequacy.rejects:
            notes.append(
                f"{fit.law.name} does not explain the tests that were made: what a test is expected to tell holds for "
                "laws that do; find one first"
            )
    return tuple(notes)
