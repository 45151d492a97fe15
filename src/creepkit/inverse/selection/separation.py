"""What further test would separate two laws: the chi-square by which one must be expected to fail if the other is true.

Let law a be true at its fitted values, without noise. Law b is refitted to what a predicts of the tests that were made
and of one more; the chi-square that then remains, under the covariance of a's fit, is what b is expected to be worse
by. With g the white difference of the predictions on all these tests, priors of unknowns below, and J its derivatives
to b's unknowns, a Gauss-Newton step leaves min |g + J d|^2; the most promising tests are refitted in full. Predictions
are those of the cheap stand-in where the predictor has one: differences between laws are what matters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from creepkit.errors import FitError
from creepkit.inverse.identification import Identification
from creepkit.inverse.intervals.mixture import Laws
from creepkit.inverse.selection.contest import Contest
from creepkit.inverse.selection.designs import Design
from creepkit.inverse.selection.designs import designs as variations
from creepkit.inverse.selection.equivalence import SEPARATED
from creepkit.inverse.selection.ranking import CREDIBLE
from creepkit.inverse.threads import single_threaded_algebra
from creepkit.records import History

PROMISING = 3
"""Designs that are refitted in full."""


@dataclass(frozen=True)
class Separating:
    """One further test: what it is, and the chi-square by which the wrong law is expected to be worse with it."""

    description: str
    history: History
    chi_square: float


@dataclass(frozen=True)
class Separation:
    """Further tests, the most telling first, if law `true` holds and law `other` is fitted.

    now : expected chi-square by the tests that were made. left_out : designs that burst at once.
    """

    true: str
    other: str
    now: float
    tests: tuple[Separating, ...]
    left_out: tuple[str, ...] = ()

    @property
    def sentence(self) -> str:
        """The most telling test, or that none is."""
        told = f"if {self.true} holds, {self.other} is worse by an expected chi-square of {self.now:.2g} in these tests"
        if not self.tests or self.tests[0].chi_square < SEPARATED:
            return f"{told}; none of the {len(self.tests)} further tests considered brings it above {SEPARATED:.2g}"
        best = self.tests[0]
        return f"{told}; one more test, {best.description}, would bring it to {best.chi_square:.2g}"

    def __str__(self) -> str:
        rows = [f"  {t.chi_square:9.3g}  {t.description}" for t in self.tests]
        return "\n".join([self.sentence, *rows, *(f"      burst  {name}" for name in self.left_out)])


def what_separates(
    fit_a: Identification, fit_b: Identification, designs: Sequence[Design | History] | None = None
) -> Separation:
    """Further tests by how well they would separate law b from law a, if a is true.

    designs : planned tests (histories need no outputs); by default variations of the tests that were made.
    """
    if fit_a.using is None or not fit_a.histories:
        raise FitError("this identification was loaded from a file: attach its histories and specimen with fit.on()")
    if fit_a.provenance.get("data") != fit_b.provenance.get("data"):
        raise FitError(
            "the two identifications were made from different histories, frames or nuisances; make them alike"
        )
    plans = _planned(fit_a, designs)
    with single_threaded_algebra():
        contest = Contest.of(fit_a, fit_b, plans)
        now = contest.refitted([])
        found = _expected(contest, now)
    left_out = tuple(d.description for d in plans if d not in contest.plans)
    return Separation(fit_a.law.name, fit_b.law.name, now, found, left_out)


def further_tests(ranking: Laws) -> tuple[Separation, ...]:
    """What would separate the best law of a ranking, if it is true, from each other one of more than 5 % of weight."""
    best, *others = ranking.laws
    return tuple(what_separates(best.fit, other.fit) for other in others if other.weight > CREDIBLE)


def _planned(fit: Identification, designs: Sequence[Design | History] | None) -> tuple[Design, ...]:
    """The designs given, named so that they are no test that was made; else variations of those."""
    if designs is None:
        return variations(fit.histories, float(fit.local_exponent(fit.reference.stress)[0]), fit.using)
    given = (d if isinstance(d, Design) else Design(d.name, d) for d in designs)
    return tuple(Design(d.description, replace(d.history, name=f"plan: {d.description}")) for d in given)


def _expected(contest: Contest, now: float) -> tuple[Separating, ...]:
    """Every plan with its chi-square, by one step or, of the most promising, in full; never below that of now."""
    found = [contest.linear([k]) for k in range(len(contest.plans))]
    for k in np.argsort(found)[::-1][:PROMISING]:
        found[k] = contest.refitted([int(k)])
    tests = [
        Separating(d.description, d.history, max(value, now)) for d, value in zip(contest.plans, found, strict=True)
    ]
    return tuple(sorted(tests, key=lambda test: -test.chi_square))
