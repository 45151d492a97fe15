"""TemperatureLaw: a law whose parameters depend on temperature, with the forms that remain and where it holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.discovery.combining import Combinations, Form
from creepkit.discovery.libraries import Library, curves, law_with
from creepkit.discovery.mixture import mixture_interval
from creepkit.discovery.points import ENDLESS, Points
from creepkit.errors import FitError, nearest
from creepkit.inverse.identification import Identification
from creepkit.inverse.uncertainty import Estimate
from creepkit.language import CreepLaw
from creepkit.records import ValuedLaw

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NOTABLE = 1.5
"""Inflation of covariances that is worth a word."""
WIDE = 0.8
"""Share of the bounds that an interval fills which says nothing."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """One combination of forms with its numbers.

    internal : {name: value} of all numbers, the logarithm where the scale is log; covariance in the same order.
    excess : of the criterion over the best's; weight : share of belief. fit : the identification, once refitted.
    """

    libraries: tuple[Library, ...]
    internal: Mapping[str, float]
    covariance: Floats
    freedom: float
    excess: float
    weight: float
    fit: Identification | None = None

    @property
    def forms(self) -> dict[str, str]:
        """{parameter: name of its form}."""
        return {one.parameter: one.name for one in self.libraries}

    def theta(self, T: Floats) -> Floats:
        """(temperatures, parameters) of internal parameters."""
        return curves(self.libraries, self.internal, T)

    def sd(self, name: str) -> float:
        """Standard deviation of one number."""
        k = list(self.internal).index(name)
        return float(np.sqrt(max(self.covariance[k, k], 0.0)))


@dataclass(frozen=True, eq=False)
class TemperatureLaw:
    """The answer of discover() and of refit().

    law : an ordinary law with temperature in it, printed and exported like any other; `valued` has its numbers.
    base : the law without. T_ref : K, where its parameters have the values stated.
    estimates : its numbers with 95 % intervals, over all candidates that share the form they belong to.
    range : K, the temperatures it was found from. judged_by : "points" when regression on estimates chose the forms,
        "histories" when the tests themselves did.
    sets : {parameter: forms that remain, best first}. candidates : combinations of forms, best first.
    odds : {parameter: {form: prior odds}}. fit : the identification of `law` from all tests, once refitted.
    """

    law: CreepLaw
    base: CreepLaw
    T_ref: float
    estimates: tuple[Estimate, ...]
    range: tuple[float, float]
    judged_by: Literal["points", "histories"]
    sets: Mapping[str, tuple[Form, ...]]
    candidates: tuple[Candidate, ...]
    odds: Mapping[str, Mapping[str, float]]
    points: Points
    combinations: Combinations
    fit: Identification | None = None
    notes: tuple[str, ...] = ()

    @property
    def values(self) -> dict[str, float]:
        """{parameter: value} of `law`, in the author's units."""
        return {e.name: e.value for e in self.estimates}

    @property
    def forms(self) -> dict[str, str]:
        """{parameter: name of its best form}."""
        return self.candidates[0].forms

    @property
    def valued(self) -> ValuedLaw:
        """The law with its numbers, intervals and range of validity: what every exporter takes."""
        from creepkit.discovery.printing import comments_of

        return ValuedLaw(self.law, self.values, tuple(comments_of(self)), ranges=self.points.ranges)

    def estimate(self, name: str) -> Estimate:
        """One number of the law, such as Q, with its interval."""
        for one in self.estimates:
            if one.name == name:
                return one
        raise FitError(f"law '{self.law.name}' has no parameter '{name}': {nearest(name, self.law.names)}")

    def at(self, T: ArrayLike) -> dict[str, Floats]:
        """{parameter of `base`: (temperatures,) its values} at temperatures in K; FitError outside the range."""
        kelvin = np.atleast_1d(np.asarray(T, float))
        low, high = self.range
        if ((kelvin < low - 1e-6) | (kelvin > high + 1e-6)).any():
            raise FitError(f"law '{self.law.name}' holds between {low:.0f} and {high:.0f} K; it was asked beyond")
        theta = self.candidates[0].theta(kelvin)
        scale = [p.scale for p in self.base.params.values()]
        found = np.where([s == "log" for s in scale], np.exp(np.minimum(theta, 700.0)), theta)
        return dict(zip(self.base.names, found.T, strict=True))

    def save(self, path: str | Path) -> Path:
        """Write the answer as JSON (to a temporary name, then renamed)."""
        from creepkit.discovery.files import save

        return save(self, Path(path))

    def plot(self, path: str | Path | None = None) -> Figure:
        """Parameters against temperature, with intervals and the curves of the forms that remain."""
        from creepkit.discovery.plotting import figure_of

        return figure_of(self, path)

    def __str__(self) -> str:
        from creepkit.discovery.printing import text_of

        return text_of(self)


def of_combinations(points: Points, found: Combinations, odds: Mapping[str, Mapping[str, float]]) -> TemperatureLaw:
    """The answer that the points alone give."""
    freedom = [ENDLESS if found.inflation == 1.0 else max(o.regression.rows - o.regression.size, 1)
               for o in found.tried]  # fmt: skip
    candidates = tuple(
        Candidate(
            one.regression.libraries,
            one.regression.values,
            one.regression.covariance * found.inflation,
            float(free),
            one.excess,
            one.weight,
        )
        for one, free in zip(found.tried, freedom, strict=True)
    )
    law = law_with(points.law, candidates[0].libraries)
    notes = []
    if found.inflation > NOTABLE:
        wider = np.sqrt(found.inflation)
        notes.append(f"no form follows the points within their errors, which were taken {wider:.2g} times wider")
    return TemperatureLaw(
        law=law,
        base=points.law,
        T_ref=points.reference.temperature,
        estimates=estimates_of(law, candidates),
        range=(float(points.temperatures.min()), float(points.temperatures.max())),
        judged_by="points",
        sets=found.sets,
        candidates=candidates,
        odds=odds,
        points=points,
        combinations=found,
        notes=tuple(notes),
    )


def estimates_of(law: CreepLaw, candidates: Sequence[Candidate]) -> tuple[Estimate, ...]:
    """The best candidate's numbers; intervals over all that have the same form of the parameter concerned."""
    best, found = candidates[0], {}
    for library in best.libraries:
        alike = [one for one in candidates if one.forms[library.parameter] == library.name]
        for name in library.names:
            found[name] = _estimate(name, library, alike)
    return tuple(found[name] for name in law.names)


def _estimate(name: str, library: Library, alike: Sequence[Candidate]) -> Estimate:
    param, value = library.table[name], alike[0].internal[name]
    weights = np.array([one.weight for one in alike])
    middle, sd = (np.array(v) for v in zip(*[(one.internal[name], one.sd(name)) for one in alike], strict=True))
    low, high = mixture_interval(middle, sd, weights / weights.sum(), [one.freedom for one in alike])
    bottom, top = (param.to_internal(b) for b in param.bounds)
    value, low, high = (float(np.clip(v, bottom, top)) for v in (value, low, high))
    verdict = "determined"
    if high - low >= WIDE * (top - bottom):
        verdict = "not determined"
    elif min(value - bottom, top - value) <= 1e-4 * (top - bottom):
        verdict = "at its bound"
    outside = param.from_internal
    return Estimate(name, outside(value), outside(low), outside(high), param.unit, verdict)
