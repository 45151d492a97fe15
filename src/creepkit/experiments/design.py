"""design: the next tests, by what they are expected to tell for each hour of machine time.

Candidates are what a rig can make. Each is predicted with every law that remains, with exact sensitivities, and what it
tells follows from Gaussian algebra about the estimates; the best ones are evaluated again at draws of the posteriors,
and for the law with refits in full. Goals are the parameters (D-optimal), a quantity such as the rate at the stress of
service (c-optimal), and the law.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from creepkit import limits
from creepkit.arrays import single_threaded_blas
from creepkit.checked_arguments import checked
from creepkit.errors import FitError
from creepkit.experiments.candidate_tests import CandidateTest, candidates_given, grid_of_rig
from creepkit.experiments.design_task import DesignTask, Goal, RemainingLaws, task_of
from creepkit.experiments.expectations import Expectation, PrecisionCriterion
from creepkit.experiments.known_laws import KnownLaw
from creepkit.experiments.law_discrimination import Alteration, LawCriterion
from creepkit.experiments.planned_design import ALIKE, Design, PlannedTest
from creepkit.experiments.planned_outcomes import PlannedOutcomes
from creepkit.experiments.rig import Rig, rigs_for
from creepkit.inverse.identification import Identification
from creepkit.inverse.information_criteria import DECISIVE_WEIGHT
from creepkit.inverse.noise_model import MINIMUM_TESTS
from creepkit.inverse.selection.ranking import Ranking
from creepkit.inverse.uncertainty.model_averaging import ModelAverage
from creepkit.inverse.uncertainty.quantities import DerivedQuantity
from creepkit.language import temperature
from creepkit.records import History
from creepkit.records.units import time_text

Progress = Callable[[str, int, int], None]


EVALUATED_AT_DRAWS = 8
"""Candidates that are evaluated again at draws of the posteriors."""


MOST_ALIKE = 2
"""Of these, those of one load and duration."""


MOST_REFITS = 10
"""Refits in full, each of one candidate in one direction."""


LARGEST_RUPTURE_PROBABILITY = 0.1
"""Of a planned test, from which on it is left out."""


SMALLEST_GROWTH = 5.0
"""Of the leading output over a planned test, in noises of a frame."""


GREEDY_POOL, MOST_RUNS, LEAST_GAIN = 30, 6, 0.02
"""Candidates from which runs are chosen one after the other for a budget, how many, and the gain that ends it, nats."""


@checked
def design(
    source: Ranking | ModelAverage | Identification | Sequence[Identification],
    *,
    rig: Rig | Sequence[Rig] | None = None,
    goal: Goal | None = None,
    budget: float | None = None,
    candidates: Sequence[History | CandidateTest] | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> Design:
    """The next tests of an identification or of a ranking of laws, also of one that was loaded from its file.

    rig : what the equipment can do; by default a little more than what it did. goal : "law", "parameters" or a
        quantity; by default the law where more than one remains. budget : h of machine time for one run or several.
    candidates : planned histories (without outputs) in the place of what the rig can make.
    Stopped by Ctrl-C it gives the best so far.
    """
    if budget is not None and budget <= 0:
        raise FitError(f"the budget is {budget:g} h; it must be above zero")
    limits.check_number("seed", seed, limits.SEED, FitError)
    remaining = RemainingLaws.of(source)
    rigs = rigs_for(remaining.fits[0], rig)
    if candidates is not None and not len(candidates):
        raise FitError("candidates= takes a list of planned histories, found none")
    search = _Search(task_of(remaining, goal, budget), rigs, seed, progress)
    if search.nothing_to_do is not None:
        return search.nothing_to_do
    planned = _grids(remaining.fits, rigs, budget) if candidates is None else candidates_given(candidates, rigs)
    if budget is not None:
        planned = [c for c in planned if c.hours <= 1.0001 * budget]
        if not planned:
            raise FitError(f"none of the planned tests fits into a budget of {budget:g} h of machine time")
    return search.run(planned, refuse=candidates is not None)


def _grids(laws: Sequence[Identification], rigs: Sequence[Rig], budget: float | None) -> list[CandidateTest]:
    by_temperature, most = all(fit.law.uses(temperature) for fit in laws), np.inf if budget is None else budget
    candidates: list[CandidateTest] = []
    for rig in rigs:
        tests = [h for h in laws[0].histories if h.specimen == rig.specimen]
        longest = max(tests, key=lambda h: float(h.times[-1]))
        candidates += grid_of_rig(rig, longest, budget=most, by_temperature=by_temperature)
    return candidates


class _Search:
    """The evaluation of candidates: all to first order, the best at draws, and for the law with refits in full."""

    def __init__(self, task: DesignTask, rigs: Sequence[Rig], seed: int, progress: Progress | None) -> None:
        self.task, self.rigs = task, {rig.specimen: rig for rig in rigs}
        self.progress: Progress = progress or (lambda *_: None)
        with single_threaded_blas():
            noise_model = task.laws[0].noise_model
            known = [KnownLaw.from_identification(fit, noise_model) for fit in task.laws]
            known += [KnownLaw.from_altered(task.laws[k], altered, noise_model) for k, altered in task.altered]
        self.outcomes = PlannedOutcomes(known, progress, len(task.laws))
        self.criterion: PrecisionCriterion | LawCriterion
        if task.goal == "law":
            self.criterion = _law_criterion(task, self.outcomes, seed)
        else:
            quantity = task.goal if isinstance(task.goal, DerivedQuantity) else None
            self.criterion = PrecisionCriterion(self.outcomes, task.remaining.weights, quantity, seed)
        self.tests: list[PlannedTest] = []
        self.left_out: dict[str, str] = {}

    @property
    def nothing_to_do(self) -> Design | None:
        """The answer where no test can help."""
        task = self.task
        if not task.obstacle:
            return None
        names = tuple(fit.law.name for fit in task.laws)
        return Design(task.goal_name, names, task.weights, (), budget=task.budget, obstacle=task.obstacle)

    def run(self, planned: Sequence[CandidateTest], *, refuse: bool = False) -> Design:
        """The design; refuse : whether it is an error that no test can be made, as where a user names them."""
        interrupted = False
        plan: tuple[PlannedTest, ...] = ()
        expected: Expectation | None = None
        with single_threaded_blas():
            try:
                self._evaluate_all(planned, refuse)
                if self.criterion.differs_at_draws:
                    self._evaluate_best()
                plan, expected = self._plan()
            except KeyboardInterrupt:
                if not self.tests:
                    raise
                interrupted = True
                self.tests.sort(key=self._order)
        if not plan and self.tests:
            plan, expected = (self.tests[0],), self.tests[0].expectation
        task = self.task
        return Design(
            goal=task.goal_name,
            laws=tuple(fit.law.name for fit in task.laws),
            weights=task.weights,
            tests=tuple(self.tests),
            left_out=tuple(self.left_out.items()),
            plan=plan,
            expected=expected,
            budget=task.budget,
            interrupted=interrupted,
            unit=task.goal.unit if isinstance(task.goal, DerivedQuantity) and task.goal.scale == "linear" else None,
            altered=tuple(altered.problem.law.name for _, altered in task.altered),
            notes=(*task.extrapolation, *notes_of(task.laws, tuple(self.rigs.values())), *self._notes_of_plan(plan)),
        )

    def _evaluate_all(self, planned: Sequence[CandidateTest], refuse: bool) -> None:
        try:
            self.outcomes.add([h for candidate in planned for h in candidate.histories])
            stopped = False
        except KeyboardInterrupt:
            stopped = True
        for candidate in planned:
            if not all(self.outcomes.is_known(h) for h in candidate.histories):
                continue
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
        if stopped:
            raise KeyboardInterrupt

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

    def _evaluate_best(self) -> None:
        """The best candidates at draws of the posteriors, and then the very best with refits in full."""
        promising = self._promising()
        for done, test in enumerate(promising):
            if self._ruptures(test):
                self.tests.remove(test)
            else:
                self._evaluate_at_draws(test)
            self.progress("best tests at draws of the posteriors", done + 1, len(promising))
        if isinstance(self.criterion, LawCriterion):
            self._refit(self.criterion)

    def _promising(self) -> list[PlannedTest]:
        """The first candidates, no more than two of one load and duration."""
        chosen, places = list[PlannedTest](), Counter[tuple[float, float]]()
        for test in self.tests:
            places[place := (test.first_level, test.duration)] += 1
            if places[place] <= MOST_ALIKE and len(chosen) < EVALUATED_AT_DRAWS:
                chosen.append(test)
        return chosen

    def _ruptures(self, candidate: CandidateTest) -> bool:
        if not isinstance(self.criterion, LawCriterion):
            return False
        probability = self.criterion.probability_of_rupture(candidate.histories)
        if probability > LARGEST_RUPTURE_PROBABILITY:
            self.left_out[candidate.description] = f"it would rupture with a probability of {probability:.2f}"
        return probability > LARGEST_RUPTURE_PROBABILITY

    def _evaluate_at_draws(self, test: PlannedTest) -> None:
        expectation = self.criterion.expectation(test.histories, at_draws=True)
        position = next(k for k, t in enumerate(self.tests) if t.histories is test.histories)
        self.tests[position] = replace(test, expectation=expectation, at_draws=True)
        self.tests.sort(key=self._order)

    def _refit(self, criterion: LawCriterion) -> None:
        """Refits of the first candidate in every direction, until it stays the first or there were enough of them."""
        refits, refitted = 0, set()
        while refits < MOST_REFITS and self.tests and id(self.tests[0].histories) not in refitted:
            first = self.tests[0]
            refitted.add(id(first.histories))
            for a, b in criterion.directions():
                refits += int(refits < MOST_REFITS and criterion.refit(first.histories, a, b))
                self.progress("refits in full", min(refits, MOST_REFITS), MOST_REFITS)
            self._evaluate_at_draws(first)
        self.progress("refits in full", MOST_REFITS, MOST_REFITS)

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

    def _notes_of_plan(self, plan: Sequence[PlannedTest]) -> list[str]:
        """Where the plan is at an edge of what was considered, or was cut short."""
        notes = []
        if len(plan) >= MOST_RUNS and self.task.budget is not None:
            left = self.task.budget - sum(test.hours for test in plan)
            notes.append(f"a plan has at most {MOST_RUNS} runs; {left:.3g} h of the budget are left")
        if plan and self.rigs:
            notes += edges_of(plan[0], self.tests, self.rigs)
        return notes

    def _together(self, plan: Sequence[PlannedTest]) -> Expectation:
        if len(plan) == 1 and (plan[0].at_draws or not self.criterion.differs_at_draws):
            return plan[0].expectation
        return self.criterion.expectation(_histories(plan), at_draws=True)

    def _merit(self, plan: Sequence[PlannedTest], expectation: Expectation) -> tuple[float, float]:
        """Largest for the best: of plans that decide the one of fewest hours."""
        probability = float(np.nan_to_num(expectation.probability))
        if probability >= DECISIVE_WEIGHT:
            return (np.inf, -sum(test.hours for test in plan))
        return (float(round(probability / ALIKE)), expectation.information)


def _histories(plan: Sequence[PlannedTest]) -> list[History]:
    return [history for test in plan for history in test.histories]


def _law_criterion(task: DesignTask, outcomes: PlannedOutcomes, seed: int) -> LawCriterion:
    ranking = task.remaining.ranking
    assert ranking is not None
    ranked = [next(r for r in ranking.laws if r.fit is fit) for fit in task.laws]
    chi_squares = np.array([r.chi_square for r in ranked])
    if not np.isfinite(chi_squares).all():
        chi_squares = np.array([law.chi_square for law in outcomes.laws[: len(task.laws)]])
    excess = np.array([r.excess for r in ranked])
    known = {fit.law.name: law for fit, law in zip(task.laws, outcomes.laws, strict=False)}
    tried = {r.fit.law.name: r.fit for r in ranking.laws}
    altered = []
    for k, one in task.altered:
        if one.other and one.other not in known:
            known[one.other] = KnownLaw.from_identification(tried[one.other], task.laws[0].noise_model)
        altered.append(Alteration(k, one.excess, one.penalty, known[one.other] if one.other else None))
    return LawCriterion(
        outcomes, task.remaining.weights, excess, chi_squares, ranking.independent_frames, altered, seed
    )


def edges_of(chosen: CandidateTest, considered: Sequence[CandidateTest], rigs: Mapping[str, Rig]) -> list[str]:
    """Where the first run of a plan lies at an edge of what was considered, one sentence each."""
    rig = rigs.get(chosen.histories[0].specimen)
    durations = [c.duration for c in considered]
    if rig is None or len(durations) < 3:
        return []
    notes = []
    if chosen.duration <= 1.001 * min(durations) and min(durations) < 0.999 * max(durations):
        notes.append(
            f"it is as short as any test that was considered ({time_text(min(durations))}, for frames each "
            f"{time_text(rig.frame_interval)}): more frequent frames may make a shorter one better"
        )
    levels = chosen.histories[0].loading.program().values
    levels = levels[levels > 0]
    if levels.max() >= 0.999 * rig.levels[1] > rig.levels[0]:
        notes.append(f"it takes the rig to the greatest load that it was said to reach ({rig.levels[1]:.3g})")
    return notes


def notes_of(laws: Sequence[Identification], rigs: Sequence[Rig]) -> tuple[str, ...]:
    """What an expectation takes for granted."""
    notes = []
    if any(len(rig.temperatures) > 1 for rig in rigs) and not all(fit.law.uses(temperature) for fit in laws):
        names = ", ".join(fit.law.name for fit in laws if not fit.law.uses(temperature))
        notes.append(f"the temperatures of the rig were not varied: {names} says nothing of temperature")
    scatters = any(n.kind == "rate" and n.sd is None for n in laws[0].settings.nuisances)
    if scatters and len(laws[0].histories) < MINIMUM_TESTS and laws[0].noise_model.rate == 0.0:
        notes.append(
            f"fewer than {MINIMUM_TESTS} tests do not show by how much the rate scatters from test to test; it is "
            'taken as none: give Nuisance("rate", sd=...) where it is known'
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
