"""composition_map: creep rate, stress exponent and law of alloys over their compositions, and which alloy to make next.

The identified laws of a plate are compared at one stress, temperature and strain, each with its interval by its tests
alone, which enters the regression as the error of the value (see composition.regression and composition.forms). The
usual errors of tests are not in it: those of the furnace and of the load are common to a plate, and those of
thicknesses are found with the scatter between alloys.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from scipy.stats import norm

from creepkit.arrays import Floats
from creepkit.checked_arguments import checked
from creepkit.composition.forms import LawsByComposition
from creepkit.composition.regression import FEWEST_ALLOYS, CompositionRegression
from creepkit.errors import FitError, refuse_unknown
from creepkit.inverse.identification import Identification
from creepkit.inverse.selection.ranking import Ranking
from creepkit.inverse.uncertainty.laplace_approximation import NORMAL_QUANTILE
from creepkit.inverse.uncertainty.model_averaging import ModelAverage
from creepkit.inverse.uncertainty.quantities import STATE_LIMITS
from creepkit.limits import Limits
from creepkit.records import History
from creepkit.records.presentable import Plotted, Presentable, Tabulated
from creepkit.screening.alloys import (
    ALLOWED_TOTAL,
    Compositions,
    atomic_percent,
    compositions_of_labels,
    resolve_compositions,
)
from creepkit.screening.results import AlloyResult, ScreeningResult

WIDEST = 5.0
"""Of the standard deviation of ln of a rate, beyond which tests say nothing of it."""


@dataclass(frozen=True)
class PredictedAlloy:
    """What the map says of a composition.

    composition : {element: at.%}. rate : 1/s, and stress_exponent : value and 95 % interval of an alloy of that
    composition. laws : {name: probability}. improvement : of a proposal, the factor on the rate to be expected beyond
    the best alloy so far. notes : where it lies outside the alloys.
    """

    composition: Mapping[str, float]
    rate: tuple[float, float, float]
    stress_exponent: tuple[float, float, float]
    laws: Mapping[str, float]
    improvement: float = 1.0
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class CompositionMap(Presentable, Plotted, Tabulated):
    """Creep over compositions.

    alloys : their names. contents : (alloys, elements) atomic fractions. log_rate : of ln of the rate in 1/s.
    point : stress in MPa, temperature in K, strain and time in s at which rates are. left_out : {alloy: why}.
    """

    alloys: tuple[str, ...]
    elements: tuple[str, ...]
    contents: Floats
    point: Mapping[str, float]
    log_rate: CompositionRegression
    stress_exponent: CompositionRegression
    laws: LawsByComposition
    left_out: Mapping[str, str]

    @checked
    def predict(self, composition: Mapping[str, float], unit: Literal["at.%", "wt.%"] = "at.%") -> PredictedAlloy:
        """The rate, exponent and law of an alloy of a composition, {element: content}, by those that were tested."""
        for element in composition:
            refuse_unknown(element, self.elements, FitError, f"the alloys of the map hold no {element}")
        total = sum(composition.values())
        if min(composition.values(), default=0.0) < 0.0 or not ALLOWED_TOTAL[0] <= total <= ALLOWED_TOTAL[1]:
            raise FitError(f"the contents add up to {total:g} %; give contents from zero on that make 100")
        atomic = atomic_percent(composition) if unit == "wt.%" else composition
        contents = np.array([atomic.get(element, 0.0) for element in self.elements])
        return self._predicted(contents[None] / contents.sum())[0]

    def _predicted(self, contents: Floats) -> list[PredictedAlloy]:
        """What the map says at contents (points, elements)."""
        (rate, rate_sd), (exponent, exponent_sd) = (
            regression.predict(contents) for regression in (self.log_rate, self.stress_exponent)
        )
        results = []
        for k, laws in enumerate(self.laws.at(contents)):
            reach = NORMAL_QUANTILE * rate_sd[k], NORMAL_QUANTILE * exponent_sd[k]
            results.append(
                PredictedAlloy(
                    dict(zip(self.elements, (100.0 * contents[k]).round(2).tolist(), strict=True)),
                    tuple(float(np.exp(rate[k] + side * reach[0])) for side in (0, -1, 1)),  # type: ignore[arg-type]
                    tuple(float(exponent[k] + side * reach[1]) for side in (0, -1, 1)),  # type: ignore[arg-type]
                    dict(zip(self.laws.laws, laws.tolist(), strict=True)),
                    notes=self._outside(contents[k]),
                )
            )
        return results

    def _outside(self, contents: Floats) -> tuple[str, ...]:
        """Which contents (elements,) no alloy had."""
        low, high = 100.0 * self.contents.min(axis=0), 100.0 * self.contents.max(axis=0)
        return tuple(
            f"{element} {100 * x:.3g} at.% is outside the alloys, {a:.3g} to {b:.3g}"
            for element, x, a, b in zip(self.elements, contents, low, high, strict=True)
            if not a - 0.1 <= 100 * x <= b + 0.1
        )

    @cached_property
    def proposals(self) -> tuple[PredictedAlloy, ...]:
        """Those of propose() for the lowest rate, as answers show them."""
        return self.propose()

    @checked
    def propose(
        self,
        count: Annotated[int, Limits(1, 100)] = 3,
        goal: Literal["lowest rate", "highest rate", "information"] = "lowest rate",
        *,
        within: Mapping[str, tuple[float, float]] | None = None,
        seed: int = 0,
    ) -> tuple[PredictedAlloy, ...]:
        """The compositions to make next, best first, inside the contents that the alloys span.

        goal : by the expected improvement of the rate over the best alloy so far (Jones et al. (1998), J. Global Optim.
            13, 455), or by what is known least. Each supposes that those before it come out as predicted.
        within : {element: (least, most) at.%}, narrower or wider than the alloys.
        """
        for element in within or {}:
            refuse_unknown(element, self.elements, FitError, f"the alloys of the map hold no {element}")
        limits = self._limits(within or {})
        candidates = self._candidates(limits, seed)
        sign, regression, chosen = (-1.0 if goal == "highest rate" else 1.0), self.log_rate, list[PredictedAlloy]()
        for _ in range(count):
            value, sd = regression.predict(candidates, of_alloy=False)
            sd = np.maximum(sd, 1e-9)
            made = regression.contents
            inside = ((made >= limits[:, 0] - 1e-9) & (made <= limits[:, 1] + 1e-9)).all(axis=1)
            known = made[inside] if inside.any() else made
            best = float(np.min(sign * regression.predict(known, of_alloy=False)[0]))
            gain = best - sign * value
            expected = gain * norm.cdf(gain / sd) + sd * norm.pdf(gain / sd)
            far = np.abs(candidates[:, None] - made).max(axis=2).min(axis=1) > APART
            k = int(np.argmax(np.where(far, sd if goal == "information" else expected, -np.inf)))
            found = self._predicted(candidates[k][None])[0]
            chosen.append(replace(found, improvement=float(np.exp(expected[k]))))
            regression = replace(
                regression,
                contents=np.vstack([regression.contents, candidates[k]]),
                values=np.append(regression.values, value[k]),
                sd=np.append(regression.sd, np.median(self.log_rate.sd)),
            )
        return tuple(chosen)

    def _limits(self, within: Mapping[str, tuple[float, float]]) -> Floats:
        """(elements, 2) least and most atomic fraction: what was given in at.%, else what the alloys span."""
        return np.array([
            np.array(within[e]) / 100.0 if e in within else (c.min(), c.max())
            for e, c in zip(self.elements, self.contents.T, strict=True)
        ])  # fmt: skip

    def _candidates(self, limits: Floats, seed: int) -> Floats:
        """(points, elements) compositions inside limits (elements, 2)."""
        drawn = limits[:, 0] + np.random.default_rng(seed).random((DRAWN, len(limits))) * np.diff(limits).T
        balance = int(np.argmax(self.contents.mean(axis=0)))
        drawn = limits[:, 0] + np.random.default_rng(seed).random((DRAWN, len(limits))) * np.diff(limits).T
        drawn[:, balance] = 1.0 - np.delete(drawn, balance, axis=1).sum(axis=1)
        allowed = ((drawn >= limits[:, 0] - 1e-9) & (drawn <= limits[:, 1] + 1e-9)).all(axis=1)
        if not allowed.any():
            raise FitError("no composition adds up to 100 at.% within these contents; widen `within`")
        return drawn[allowed]

    def __repr__(self) -> str:
        return f"<CompositionMap of {len(self.alloys)} alloys of {', '.join(self.elements)}>"

    drawn_by = "composition.composition_figure", "composition.draw_map"

    shown_by = "composition.composition_text"


DRAWN = 4096
"""Compositions among which the next ones are chosen."""


APART = 0.01
"""Atomic fraction of some element by which a proposal differs from every alloy and from those before it."""


@checked
def composition_map(
    plate: ScreeningResult | Mapping[str, Identification | Ranking | AlloyResult],
    compositions: Compositions | str | Path | None = None,
    *,
    stress: float | None = None,
    temperature: float | None = None,
    strain: float | None = None,
) -> CompositionMap:
    """Creep rate, stress exponent and law of alloys as functions of their composition.

    plate : a screened plate, or {alloy: ranking or identification}, such as `study.rankings`.
    compositions : of the alloys, or their file; by default those of the plate, or those that tests carry as labels
        ("Ni [at.%]", as columns of a table of alloys become; wt.% where no unit stands).
    stress, temperature, strain : MPa, K, -, at which rates are compared; by default the medians of the tests.
    """
    sources = {one.alloy: one for one in plate.identified} if isinstance(plate, ScreeningResult) else dict(plate)
    stated = plate.compositions if isinstance(plate, ScreeningResult) else None
    table = resolve_compositions(compositions) or stated or compositions_of_labels(_tests_of(sources))
    if table is None:
        raise FitError("compositions of the alloys are not known; give compositions=, a table or its file")
    point = _point_of(sources, {"stress": stress, "temperature": temperature, "strain": strain})
    left_out, rows = {name: "it has no composition" for name in sources if name not in table.atomic}, {}
    for name, source in sources.items():
        if name not in left_out:
            rows[name] = _compared(source, point)
            if not (0.0 < rows[name][0][1] < WIDEST and np.isfinite(rows[name][1]).all()):
                left_out[name] = "its tests do not determine the rate"
    alloys = tuple(name for name in rows if name not in left_out)
    elements = tuple(dict.fromkeys(e for name in alloys for e in table.atomic[name]))
    if len(alloys) < FEWEST_ALLOYS:
        raise FitError(f"{len(alloys)} alloys have a law and a composition; {FEWEST_ALLOYS} are needed at least")
    contents = np.array([[table.atomic[name].get(e, 0.0) for e in elements] for name in alloys])
    contents = contents / contents.sum(axis=1, keepdims=True)
    log_rate, exponent = (
        CompositionRegression.of(elements, contents, *np.array([rows[name][k] for name in alloys]).T) for k in (0, 1)
    )
    laws = LawsByComposition.of(contents, [rows[name][2] for name in alloys])
    return CompositionMap(alloys, elements, contents, point, log_rate, exponent, laws, left_out)


def _fit_of(source: Any) -> Identification:
    return source if isinstance(source, Identification) else source.laws[0].fit


def _tests_of(sources: Mapping[str, Any]) -> dict[str, tuple[History, ...]]:
    return {name: tuple(_fit_of(source).histories) for name, source in sources.items()}


def _point_of(sources: Mapping[str, Any], given: Mapping[str, float | None]) -> dict[str, float]:
    """Where rates are compared: what was given, and the medians of the points that the alloys were tested at."""
    fits = [*map(_fit_of, sources.values())]
    if not fits:
        raise FitError("no alloy has an identified law")
    medians = {name: float(np.median([getattr(fit.tested_point, name) for fit in fits])) for name in STATE_LIMITS}
    return {name: medians[name] if given.get(name) is None else float(given[name] or 0.0) for name in STATE_LIMITS}


def _compared(source: Any, point: Mapping[str, float]) -> tuple[Sequence[float], Sequence[float], dict[str, float]]:
    """ln of the rate and the exponent of an alloy, each with its standard deviation, and the weights of its laws."""
    average, where = ModelAverage.from_ranking(source), dict(point)
    average = replace(average, fits=tuple(fit.by_tests_alone for fit in average.fits))
    stress, temperature = where.pop("stress"), where.pop("temperature")
    rate, exponent = (
        np.array(quantity(stress, temperature, **where, warn=False), float).ravel()
        for quantity in (average.rate, average.local_exponent)
    )
    with np.errstate(all="ignore"):
        log_rate = np.log(rate)
    weights = dict.fromkeys((fit.law.name for fit in average.fits), 0.0)
    for fit, weight in zip(average.fits, average.weights, strict=True):
        weights[fit.law.name] += weight
    values = [(v[0], (v[2] - v[1]) / (2.0 * NORMAL_QUANTILE)) for v in (log_rate, exponent)]
    return values[0], values[1], weights


def map_where_known(sources: Mapping[str, Any], compositions: Compositions | None = None) -> dict[str, CompositionMap]:
    """{"": the map} of rankings by alloy, where compositions of enough of them are known; else {}."""
    with suppress(FitError):
        return {"": composition_map(sources, compositions)}
    return {}
