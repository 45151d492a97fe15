"""Which forms of all parameters together: Akaike weights of combinations, and what the points cannot tell apart.

A combination has one form for each parameter. Its score is the quasi AICc (Burnham and Anderson (2002), Model
Selection and Multimodel Inference, sec. 2.5),

    chi^2 / c + 2 k + 2 k (k + 1)/(N - k - 1) - 2 ln(prior odds),

with k numbers, N rows and c = max(1, least chi^2/(N - k)), which widens covariances that are too small for every form.
Few combinations are all tried; many are searched greedily, one parameter at a time, the others as they are.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from creepkit.arrays import Floats
from creepkit.discovery.libraries import ARRHENIUS, Library
from creepkit.discovery.points import Points
from creepkit.discovery.regression import Regression, regress
from creepkit.errors import FitError

ALL = 150
"""Up to so many combinations are all tried."""
SWEEPS = 4
CREDIBLE = 0.95
APART = 3.84
"""chi^2 of one degree of freedom at 95 %: curves closer than that, by the points' own covariances, are equivalent."""


@dataclass(frozen=True, eq=False)
class Weighted:
    """One combination of forms, its quasi AICc less the best, and its Akaike weight."""

    regression: Regression
    excess: float
    weight: float

    @property
    def forms(self) -> dict[str, str]:
        """{parameter: name of its form}."""
        return self.regression.forms


@dataclass(frozen=True)
class Form:
    """A form of one parameter: its share of belief, and whether the points can tell it from the best one."""

    name: str
    weight: float
    equivalent: bool


@dataclass(frozen=True, eq=False)
class Combinations:
    """All combinations that were tried, best first.

    inflation : c, by which the covariances of the points fell short. sets : {parameter: forms that remain, best
        first}: those that hold 95 % of the belief, and those equivalent to the best that have no more numbers.
    """

    tried: tuple[Weighted, ...]
    inflation: float
    sets: Mapping[str, tuple[Form, ...]]

    @property
    def best(self) -> Regression:
        """The combination of the highest weight."""
        return self.tried[0].regression

    def with_form(self, parameter: str, form: str) -> Regression:
        """The best combination that has this form of a parameter."""
        return next(one.regression for one in self.tried if one.forms[parameter] == form)


def combine(
    points: Points,
    libraries: Mapping[str, Sequence[Library]],
    progress: Callable[[str, int, int], None] | None = None,
) -> Combinations:
    """Fit combinations of one library for each parameter, and weigh them."""
    names, every = list(libraries), int(np.prod([len(own) for own in libraries.values()]))
    tried = _Tried(points, min(every, SWEEPS * sum(len(own) for own in libraries.values())), progress)
    if every <= ALL:
        tried.total = every
        for chosen in product(*libraries.values()):
            tried(chosen)
    else:
        _greedy(tried, libraries)
    found = [one for one in tried.all if one.size < one.rows - 1 and one.admissible()]
    if not found:
        raise FitError(f"no form of {', '.join(names)} within its bounds has fewer numbers than these points allow")
    inflation = max(1.0, min(one.chi_square / (one.rows - one.size) for one in found))
    scores = np.array([_score(one, inflation) for one in found])
    weights = np.exp(-0.5 * (scores - scores.min()))
    weights /= weights.sum()
    order = np.argsort(scores, kind="stable")
    ordered = [Weighted(found[k], float(scores[k] - scores.min()), float(weights[k])) for k in order]
    sets = {name: _set(name, ordered, points, inflation) for name in names}
    return Combinations(tuple(ordered), inflation, sets)


class _Tried:
    """Regressions of combinations, each made once; total : how many there may be."""

    def __init__(self, points: Points, total: int, progress: Callable[[str, int, int], None] | None) -> None:
        self.points, self.total, self.progress = points, total, progress
        self._known: dict[tuple[str, ...], Regression] = {}

    def __call__(self, chosen: Sequence[Library]) -> Regression:
        key = tuple(one.name for one in chosen)
        if key not in self._known:
            self._known[key] = regress(self.points, chosen)
            if self.progress is not None:
                self.progress("combination of forms", len(self._known), self.total)
        return self._known[key]

    @property
    def all(self) -> list[Regression]:
        return list(self._known.values())


def _greedy(tried: _Tried, libraries: Mapping[str, Sequence[Library]]) -> None:
    """From Arrhenius and constants, change one parameter's form at a time for the better until none is."""
    now = [next((one for one in own if one.name == ARRHENIUS), own[0]) for own in libraries.values()]
    for _ in range(SWEEPS):
        before = [one.name for one in now]
        for k, own in enumerate(libraries.values()):
            trials = [[*now[:k], one, *now[k + 1 :]] for one in own]
            now = min(trials, key=lambda chosen: _score(tried(chosen), 1.0))
        if [one.name for one in now] == before:
            return


def _score(one: Regression, inflation: float) -> float:
    k, rows = one.size, one.rows
    if rows - k - 1 <= 0:
        return np.inf
    small = 2.0 * k * (k + 1) / (rows - k - 1)
    return float(one.chi_square / inflation + 2.0 * k + small - 2.0 * np.log(one.odds))


def distance(one: Regression, other: Regression, points: Points, inflation: float) -> float:
    """chi^2 between the curves of two combinations, by the covariances of the points.

    It is by how much chi^2 would rise on average if one were true and the other fitted.
    """
    white: Floats = np.einsum("kij,kj->ki", points.whiteners, one.curves - other.curves)
    return float((white**2).sum() / inflation)


def _set(name: str, ordered: Sequence[Weighted], points: Points, inflation: float) -> tuple[Form, ...]:
    weights: dict[str, float] = {}
    first: dict[str, Regression] = {}
    for one in ordered:
        form = one.forms[name]
        weights[form] = weights.get(form, 0.0) + one.weight
        first.setdefault(form, one.regression)
    ranked = sorted(weights, key=lambda form: -weights[form])
    before = np.cumsum([0.0, *(weights[form] for form in ranked)])
    near = {form: distance(first[form], first[ranked[0]], points, inflation) < APART for form in ranked}
    sizes = {form: _numbers(first[form], name) for form in ranked}
    simple = {form: near[form] and sizes[form] <= sizes[ranked[0]] for form in ranked}
    kept = [form for form, held in zip(ranked, before, strict=False) if held < CREDIBLE or simple[form]]
    return tuple(Form(form, weights[form], near[form]) for form in kept)


def _numbers(one: Regression, parameter: str) -> int:
    return next(library.size for library in one.libraries if library.parameter == parameter)
