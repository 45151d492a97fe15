"""Laws of some terms of a sum, fitted on its stage; exponents that can be off are, where BIC does not rise by it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.search.refining import Minimum
from creepkit.inverse.sparsity.penalised import exponents_of
from creepkit.inverse.sparsity.stage import Stage
from creepkit.language import CreepLaw

SHARE = 0.05
"""A term that contributes less than this is dropped."""
MINOR = 0.05
"""Share of the rate with which a second term begins beside a fitted one."""

Terms = tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Reduced:
    """A law of some of the terms, and its fit without penalty.

    kept : its terms, in the order of the sum; off : its exponents that were switched off; criterion : BIC.
    """

    stage: Stage
    minimum: Minimum
    kept: Terms
    off: tuple[str, ...]
    criterion: float

    @property
    def law(self) -> CreepLaw:
        """The reduced law."""
        return self.stage.law

    @property
    def x(self) -> Floats:
        """Where it fits best."""
        return self.minimum.u

    @property
    def chi_square(self) -> float:
        """Sum of squared white residuals, priors included."""
        return 2.0 * self.minimum.cost

    @property
    def parameters(self) -> int:
        """Number of parameters of the law that were fitted."""
        return self.stage.fitted(self.x)


class Reductions:
    """The laws of some of the terms of a stage's law, each fitted once.

    before : the same laws fitted on another stage of the same law, whose optima are then the only starts.
    """

    def __init__(self, stage: Stage, before: Reductions | None = None) -> None:
        self.stage, self.labels, self.before = stage, tuple(stage.law.terms), before
        self._found: dict[Terms, Reduced] = {}
        self._whole: Reduced | None = None

    def of(self, kept: Sequence[str]) -> Reduced:
        """The law of these terms."""
        terms = tuple(label for label in self.labels if label in kept)
        if terms not in self._found:
            self._found[terms] = simplified(self._fitted(terms), terms)
        return self._found[terms]

    def whole(self, below: Reduced | None = None) -> Reduced:
        """The whole sum with all its exponents; it starts from a reduced law too, below which it must not end."""
        starts = [] if self._whole else [self.stage.start]
        if below is not None and (self._whole is None or below.minimum.cost < self._whole.minimum.cost):
            starts.append(_beside(self.stage, below))
        if starts:
            ends = [self.stage.best(starts), *([self._whole.minimum] if self._whole else [])]
            minimum = min(ends, key=lambda end: end.cost)
            self._whole = Reduced(self.stage, minimum, self.labels, (), self.stage.criterion(minimum))
        assert self._whole is not None
        return self._whole

    def singles(self) -> list[Reduced]:
        """Each term alone."""
        return [self.of((label,)) for label in self.labels]

    def lowest(self, every: int) -> Reduced:
        """The set of terms of lowest BIC: of all sets for up to `every` terms, by forward selection for longer sums."""
        best = min(self.singles(), key=lambda one: one.criterion)
        floor = self.whole(best).chi_square
        while True:
            wider = self._wider(best, every)
            found = [self.of(terms) for terms in wider if self._least(terms, floor) < best.criterion]
            lowest = min(found, key=lambda one: one.criterion, default=best)
            if lowest.criterion >= best.criterion:
                return best
            best = lowest

    def _wider(self, best: Reduced, every: int) -> list[Terms]:
        if len(self.labels) <= every:
            return [s for k in range(2, len(self.labels) + 1) for s in combinations(self.labels, k)]
        return [(*best.kept, label) for label in self.labels if label not in best.kept]

    def _least(self, terms: Terms, floor: float) -> float:
        """What BIC a set of terms has at least: no part of a sum fits better than the sum."""
        law = self.stage.law.only(*terms)
        return floor + (len(law.params) - len(exponents_of(law))) * float(np.log(self.stage.frames))

    def _fitted(self, terms: Terms) -> Stage:
        """The stage of these terms, which starts at their optimum."""
        law = self.stage.law if terms == self.labels else self.stage.law.only(*terms)
        stage = self.stage.with_law(law)
        return stage.moved(stage.best(self._starts(stage, terms)).u)

    def _starts(self, stage: Stage, terms: Terms) -> list[Floats]:
        """What the whole law says of these terms; for one term the middle of its bounds, for more their own optima."""
        if self.before is not None:
            one = self.before.of(terms)
            return [stage.placed(one.law, one.x)]
        if len(terms) > 1:
            return [stage.start, *(_beside(stage, self.of((label,))) for label in terms)]
        middle = stage.box.middle
        middle[stage.size :] = stage.start[stage.size :]
        return [stage.start, stage.at_level(middle, self.stage.total(self.stage.start))]


def _beside(stage: Stage, reduced: Reduced) -> Floats:
    """x of a wider law at a reduced one, its other terms with a small share."""
    x = stage.placed(reduced.law, reduced.x)
    for k in stage.objective.coordinates.rates:
        if stage.law.names[k] not in reduced.law.names:
            x[k] = stage.total(x) + np.log(MINOR)
    return stage.box.clip(x)


def simplified(stage: Stage, terms: Terms) -> Reduced:
    """The law with as many exponents off as BIC allows, one after the other."""
    minimum = stage.minimise(stage.start)
    best = Reduced(stage, minimum, terms, (), stage.criterion(minimum))
    while True:
        trials = [_without(best, best.law.names[k], off) for k, off in exponents_of(best.law)]
        lowest = min(trials, key=lambda one: one.criterion, default=best)
        if lowest is best or lowest.criterion > best.criterion:
            return best
        best = lowest


def _without(reduced: Reduced, exponent: str, off: float) -> Reduced:
    stage = reduced.stage.moved(reduced.x).with_law(reduced.law.fix(**{exponent: off}))
    minimum = stage.minimise(stage.start)
    return Reduced(stage, minimum, reduced.kept, (*reduced.off, exponent), stage.criterion(minimum))


def kept_of(shares: Mapping[str, float], least: float = SHARE) -> Terms:
    """The terms whose share is not below `least`; the largest anyhow."""
    found = tuple(label for label, share in shares.items() if share >= least)
    return found or (max(shares, key=lambda label: shares[label]),)
