"""design: the next tests, by what they are expected to tell for each hour of the oven.

Candidates are what a rig can make. Each is predicted with every law that remains, with exact sensitivities, and what it
tells follows from Gaussian algebra about the estimates; the best ones are evaluated again at draws of the posteriors,
and for the law with refits in full. Goals are the parameters (D-optimal), a quantity such as the rate at the stress of
service (c-optimal), and the law.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from creepkit.arrays import single_threaded_blas
from creepkit.errors import FitError
from creepkit.experiments.candidate_tests import CandidateTest, candidates_given, grid_of_rig, variations_of_tests
from creepkit.experiments.design_checks import check_arguments, notes_of
from creepkit.experiments.expectations import Criterion, Expectation, PrecisionCriterion
from creepkit.experiments.known_laws import KnownLaw
from creepkit.experiments.law_discrimination import LawCriterion
from creepkit.experiments.planned_design import Design, PlannedTest
from creepkit.experiments.planned_outcomes import PlannedOutcomes
from creepkit.experiments.rig import Rig, rigs_of
from creepkit.inverse.identification import Identification
from creepkit.inverse.information_criteria import DECISIVE_WEIGHT
from creepkit.inverse.selection.ranking import Ranking, rank
from creepkit.inverse.uncertainty.quantities import DerivedQuantity
from creepkit.language import temperature
from creepkit.records import History

Goal = Literal["parameters", "law"] | DerivedQuantity


Progress = Callable[[str, int, int], None]


EVALUATED_AT_DRAWS = 8
"""Candidates that are evaluated again at draws of the posteriors."""


MOST_ALIKE = 2
"""Of these, those of one load and duration."""


MOST_REFITS = 6
"""Refits in full, each of one candidate in one direction."""


LARGEST_RUPTURE_PROBABILITY = 0.1
"""Of a planned test, from which on it is left out."""


SMALLEST_GROWTH = 5.0
"""Of the leading output over a planned test, in noises of a frame."""


GREEDY_POOL, MOST_RUNS, LEAST_GAIN = 30, 6, 0.02
"""Candidates from which runs are chosen one after the other for a budget, how many, and the gain that ends it, nats."""


def design(
    source: Ranking | Identification | Sequence[Identification],
    *,
    rig: Rig | Sequence[Rig] | None = None,
    goal: Goal | None = None,
    budget: float | None = None,
    candidates: Sequence[History | CandidateTest] | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> Design:
    """The next tests of an identification or of a ranking of laws.

    rig : what the equipment can do; by default a little more than what it did. goal : "law", "parameters" or a
        quantity; by default the law where more than one remains. budget : h of the oven for one run or several.
    candidates : planned histories (without outputs) in the place of what the rig can make.
    Stopped by Ctrl-C it gives the best so far.
    """
    check_arguments(goal, budget, seed)
    laws, weights, ranking = _remaining(source)
    rigs = _rigs(laws[0], rig)
    chosen: Goal = goal if goal is not None else "law" if len(laws) > 1 else "parameters"
    if isinstance(chosen, str) and chosen not in ("law", "parameters"):
        raise FitError(f"goal '{chosen}' is not known: 'law', 'parameters', or a quantity such as ck.rate_at(60.0)")
    if chosen == "law" and len(laws) < 2:
        return Design("law", (laws[0].law.name,), (1.0,), (), budget=budget, notes=_challenges(ranking))
    if candidates is not None and not (isinstance(candidates, Sequence) and len(candidates) > 0):
        raise FitError(f"candidates= takes a list of planned histories, found {candidates!r:.60}")
    if candidates is not None:
        planned, given = candidates_given(candidates, rigs), True
    else:
        planned, given = _grids(laws, rigs, budget), False
    if budget is not None:
        planned = [c for c in planned if c.hours <= 1.0001 * budget]
        if not planned:
            raise FitError(f"none of the planned tests fits into a budget of {budget:g} h of the oven")
    search = _Search(_Task(laws, weights, ranking, chosen, budget), rigs, seed, progress)
    return search.run(planned, refuse=given)


def further_tests(ranking: Ranking, *, progress: Progress | None = None) -> Design:
    """Variations of the tests that were made, by how well they would separate the remaining laws in every direction."""
    laws, weights, _ = _remaining(ranking)
    if len(laws) < 2:
        return Design("law", (laws[0].law.name,), (1.0,), (), notes=_challenges(ranking))
    rigs = _rigs(laws[0], None)
    fit = laws[0]
    exponent = float(fit.local_exponent(fit.reference.stress, warn=False)[0])
    planned = list(variations_of_tests(fit.histories, rigs, exponent))
    return _Search(_Task(laws, weights, ranking, "law", None), rigs, 0, progress).run(planned)


def _remaining(
    source: Ranking | Identification | Sequence[Identification],
) -> tuple[list[Identification], np.ndarray, Ranking | None]:
    """The laws that the tests cannot rule out, with their weights, best first."""
    is_list = (
        isinstance(source, Sequence) and all(isinstance(fit, Identification) for fit in source) and len(source) > 0
    )
    if not (isinstance(source, Identification | Ranking) or is_list):
        raise FitError(f"a design is made from an identification, a list of them or a ranking; found {source!r:.60}")
    if isinstance(source, Identification):
        ranking, fits, weights = None, [source], [1.0]
    else:
        ranking = source if isinstance(source, Ranking) else rank(list(source), challenge=False)
        remaining = ranking.credible or ranking.laws[:1]
        fits, weights = [r.fit for r in remaining], [r.weight for r in remaining]
    for fit in fits:
        if fit.predictor is None or not fit.histories:
            raise FitError(
                f"the identification of {fit.law.name} was loaded from a file: attach its histories and specimen with "
                "fit.with_histories()"
            )
        if fit.covariance.shape != (fit.u.size, fit.u.size) or not np.isfinite(fit.covariance).all():
            raise FitError(f"the identification of {fit.law.name} has no intervals; identify it again from its tests")
    return fits, np.array(weights), ranking


def _rigs(fit: Identification, rig: Rig | Sequence[Rig] | None) -> tuple[Rig, ...]:
    """The rigs given, or those that the tests suggest; FitError for one of another specimen."""
    assert fit.predictor is not None
    if rig is None:
        return rigs_of(fit.histories, fit.predictor)
    rigs = (rig,) if isinstance(rig, Rig) else tuple(rig) if isinstance(rig, Sequence) else ()
    if not rigs or not all(isinstance(one, Rig) for one in rigs):
        raise FitError(f"rig= takes a ck.Rig, or several in a list; found {rig!r:.60}")
    known = dict.fromkeys(h.specimen for h in fit.histories)
    for one in rigs:
        if one.specimen not in known:
            raise FitError(
                f"the rig tests specimen '{one.specimen}', but the law was identified from tests of "
                f"{' and '.join(repr(name) for name in known)}"
            )
    return rigs


def _grids(laws: Sequence[Identification], rigs: Sequence[Rig], budget: float | None) -> list[CandidateTest]:
    by_temperature = all(fit.law.uses(temperature) for fit in laws)
    candidates: list[CandidateTest] = []
    for rig in rigs:
        tests = [h for h in laws[0].histories if h.specimen == rig.specimen]
        base = max(tests, key=lambda h: float(h.times[-1]))
        candidates += grid_of_rig(rig, base, budget=np.inf if budget is None else budget, by_temperature=by_temperature)
    return candidates


@dataclass(frozen=True, eq=False)
class _Task:
    """What is asked: the laws that remain, with weights, the goal and the budget."""

    laws: Sequence[Identification]
    weights: np.ndarray
    ranking: Ranking | None
    goal: Goal
    budget: float | None


class _Search:
    """The evaluation of candidates: all to first order, the best at draws, and for the law with refits in full."""

    def __init__(self, task: _Task, rigs: Sequence[Rig], seed: int, progress: Progress | None) -> None:
        self.task, self.rigs, self.progress = task, {rig.specimen: rig for rig in rigs}, progress
        with single_threaded_blas():
            noise_model = task.laws[0].noise_model
            known = [KnownLaw.from_identification(fit, noise_model) for fit in task.laws]
        self.outcomes = PlannedOutcomes(known, progress)
        self.criterion: Criterion
        if task.goal == "law":
            self.criterion = _law_criterion(task, self.outcomes, seed)
        else:
            quantity = task.goal if isinstance(task.goal, DerivedQuantity) else None
            self.criterion = PrecisionCriterion(self.outcomes, task.weights, quantity, seed)
        self.tests: list[PlannedTest] = []
        self.left_out: dict[str, str] = {}

    def run(self, planned: Sequence[CandidateTest], *, refuse: bool = False) -> Design:
        """The design; refuse : whether a test that cannot be made is an error, as one that a user names is."""
        interrupted = False
        plan: tuple[PlannedTest, ...] = ()
        expected: Expectation | None = None
        with single_threaded_blas():
            try:
                self._evaluate_all(planned, refuse)
                self._evaluate_best()
                plan, expected = self._plan()
            except KeyboardInterrupt:
                if not self.tests:
                    raise
                interrupted = True
                self.tests.sort(key=self._order)
        if not plan and self.tests:
            plan, expected = (self.tests[0],), self.tests[0].expectation
        task, weight = self.task, self.task.weights / self.task.weights.sum()
        return Design(
            goal=task.goal if isinstance(task.goal, str) else task.goal.name,
            laws=tuple(fit.law.name for fit in task.laws),
            weights=tuple(float(w) for w in weight),
            tests=tuple(self.tests),
            left_out=tuple(self.left_out.items()),
            plan=plan,
            expected=expected,
            budget=task.budget,
            interrupted=interrupted,
            notes=notes_of(task.laws),
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
            if refusal and refuse:
                raise FitError(f"the planned test '{candidate.description}' is of no use: {refusal}")
            if refusal:
                self.left_out[candidate.description] = refusal
            else:
                self.tests.append(PlannedTest(candidate, self.criterion.expectation(candidate.histories)))
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
            if self._ruptures(test.candidate):
                self.tests.remove(test)
            else:
                self._evaluate_at_draws(test)
            if self.progress is not None:
                self.progress("best tests at draws of the posteriors", done + 1, len(promising))
        if isinstance(self.criterion, LawCriterion):
            self._refit(self.criterion)

    def _promising(self) -> list[PlannedTest]:
        """The first candidates, no more than two of one load and duration."""
        chosen: list[PlannedTest] = []
        places: dict[tuple[float, float], int] = {}
        for test in self.tests:
            place = test.first_level, test.candidate.duration
            places[place] = places.get(place, 0) + 1
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
        position = next(k for k, t in enumerate(self.tests) if t.candidate is test.candidate)
        self.tests[position] = PlannedTest(test.candidate, expectation, True)
        self.tests.sort(key=self._order)

    def _refit(self, criterion: LawCriterion) -> None:
        """Refits of the first candidate in every direction, until it stays the first or there were enough of them."""
        refits, refitted = 0, set()
        while refits < MOST_REFITS and self.tests and id(self.tests[0].candidate) not in refitted:
            first = self.tests[0]
            refitted.add(id(first.candidate))
            for a, b in criterion.directions():
                refits += int(refits < MOST_REFITS and criterion.refit(first.histories, a, b))
                if self.progress is not None:
                    self.progress("refits in full", min(refits, MOST_REFITS), MOST_REFITS)
            self._evaluate_at_draws(first)
        if self.progress is not None:
            self.progress("refits in full", MOST_REFITS, MOST_REFITS)

    def _order(self, test: PlannedTest) -> tuple[bool, float, float]:
        """Least for the best: the cheapest that decides between laws, else the most informative; for values by hour.

        Those that were evaluated at draws come first: the others are known to first order alone, which flatters them.
        """
        if self.task.goal != "law":
            return (not test.at_draws, 0.0, -test.information_per_hour)
        if test.expectation.probability >= DECISIVE_WEIGHT:
            return (not test.at_draws, 0.0, test.hours)
        return (not test.at_draws, 1.0, -test.expectation.information)

    def _plan(self) -> tuple[tuple[PlannedTest, ...], Expectation | None]:
        """The runs for the budget: chosen one after the other by what each adds for an hour, or the best single one."""
        if self.task.budget is None or not self.tests:
            return (), None
        by_hour = sorted(self.tests, key=lambda t: -t.information_per_hour)
        by_total = sorted(self.tests, key=lambda t: -t.expectation.information)
        pool = list({id(t): t for t in (*by_hour[:GREEDY_POOL], *by_total[: GREEDY_POOL // 3])}.values())
        plans = [self._greedy(pool), (by_total[0],), (self.tests[0],)]
        judged = [(plan, self._together(plan)) for plan in plans if plan]
        return max(judged, key=lambda pair: self._merit(pair[1]))

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
            if self.progress is not None:
                self.progress("runs for the budget", len(chosen), MOST_RUNS)
        return tuple(chosen)

    def _together(self, plan: Sequence[PlannedTest]) -> Expectation:
        if len(plan) == 1 and plan[0].at_draws:
            return plan[0].expectation
        return self.criterion.expectation(_histories(plan), at_draws=True)

    def _merit(self, expectation: Expectation) -> tuple[float, float]:
        probability = min(round(np.nan_to_num(expectation.probability), 2), DECISIVE_WEIGHT)
        return (float(probability), expectation.information)


def _histories(plan: Sequence[PlannedTest]) -> list[History]:
    return [history for test in plan for history in test.histories]


def _law_criterion(task: _Task, outcomes: PlannedOutcomes, seed: int) -> LawCriterion:
    assert task.ranking is not None
    ranked = [next(r for r in task.ranking.laws if r.fit is fit) for fit in task.laws]
    chi_squares = np.array([r.chi_square for r in ranked])
    if not np.isfinite(chi_squares).all():
        chi_squares = np.array([law.chi_square for law in outcomes.laws])
    excess = np.array([r.excess for r in ranked])
    return LawCriterion(outcomes, task.weights, excess, chi_squares, task.ranking.independent_frames, seed)


def _challenges(ranking: Ranking | None) -> tuple[str, ...]:
    """What the tests allow beside the one law that remains."""
    allowed = (ranking.challenges or ()) if ranking is not None else ()
    return tuple(f"{challenge}: ask for goal='parameters'" for challenge in allowed)
