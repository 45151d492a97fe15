"""composition_map: creep rate, stress exponent and law of alloys over their compositions, and which alloy to make next.

The identified laws of a plate are compared at one stress, temperature and strain, each with its interval by its tests
alone, which enters the regression as the error of the value (see composition.regression and composition.forms). The
usual errors of tests are not in it: those of the furnace and of the load are common to a plate, and those of
thicknesses are found with the scatter between alloys.
"""

from __future__ import annotations

from collections.abc import Mapping
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
from creepkit.inverse.extrapolation import check_isothermal
from creepkit.inverse.identification import Identification
from creepkit.inverse.selection.ranking import ModelAverage, Ranking
from creepkit.inverse.uncertainty.laplace_approximation import NORMAL_QUANTILE
from creepkit.inverse.uncertainty.quantities import (
    STATE_LIMITS,
    PointQuantity,
    activation_energy,
    check_state,
    local_exponent,
    log_rate,
)
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


SEVERAL_TEMPERATURES = 10.0
"""K, between the coldest and the hottest test of an alloy, from which on they tell an activation energy."""


@dataclass(frozen=True)
class PredictedAlloy:
    """What the map says of a composition.

    composition : {element: at.%}. rate : 1/s, stress_exponent and activation_energy, J/mol : value and 95 % interval of
    an alloy of that composition; no energy where too few alloys were tested at several temperatures. laws : {name:
    probability}. improvement : of a proposal, the factor on the rate to be expected beyond the best alloy so far.
    notes : where it lies outside the alloys.
    """

    composition: Mapping[str, float]
    rate: tuple[float, float, float]
    stress_exponent: tuple[float, float, float]
    laws: Mapping[str, float]
    activation_energy: tuple[float, float, float] | None = None
    improvement: float = 1.0
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class CompositionMap(Presentable, Plotted, Tabulated):
    """Creep over compositions.

    alloys : their names. contents : (alloys, elements) atomic fractions. log_rate : of ln of the rate in 1/s.
    point : stress in MPa, temperature in K, strain and time in s at which rates are. activation_energy : in J/mol, of
    the alloys that were tested at several temperatures, None where they are too few. left_out : {alloy: why}.
    """

    alloys: tuple[str, ...]
    elements: tuple[str, ...]
    contents: Floats
    point: Mapping[str, float]
    log_rate: CompositionRegression
    stress_exponent: CompositionRegression
    activation_energy: CompositionRegression | None
    laws: LawsByComposition
    left_out: Mapping[str, str]

    @checked
    def predict(self, composition: Mapping[str, float], unit: Literal["at.%", "wt.%"] = "at.%") -> PredictedAlloy:
        """The rate, exponent and law of an alloy of a composition, {element: content}, by those that were tested."""
        self._check_elements(composition)
        total = sum(composition.values())
        if min(composition.values(), default=0.0) < 0.0 or not ALLOWED_TOTAL[0] <= total <= ALLOWED_TOTAL[1]:
            raise FitError(f"the contents add up to {total:g} %; give contents from zero on that make 100")
        atomic = atomic_percent(composition) if unit == "wt.%" else composition
        contents = np.array([atomic.get(element, 0.0) for element in self.elements])
        return self._predicted(contents[None] / contents.sum())[0]

    @property
    def regressions(self) -> dict[str, CompositionRegression]:
        """Of ln of the rate, the exponent and, where it is known, the activation energy."""
        named = zip(QUANTITIES, (self.log_rate, self.stress_exponent, self.activation_energy), strict=True)
        return {name: one for name, one in named if one is not None}

    @cached_property
    def proposals(self) -> tuple[PredictedAlloy, ...]:
        """The three compositions to make next for the lowest rate."""
        return self.propose()

    def _check_elements(self, contents: Mapping[str, Any]) -> None:
        for element in contents:
            refuse_unknown(element, self.elements, FitError, f"the alloys of the map hold no {element}")

    def _predicted(self, contents: Floats) -> list[PredictedAlloy]:
        """What the map says at contents (points, elements)."""
        intervals = {name: _intervals(one, contents) for name, one in self.regressions.items()}
        results = []
        for k, laws in enumerate(self.laws.at(contents)):
            at = {name: tuple(one[k].tolist()) for name, one in intervals.items()}
            results.append(
                PredictedAlloy(
                    dict(zip(self.elements, (100.0 * contents[k]).round(2).tolist(), strict=True)),
                    tuple(np.exp(at["ln_rate"]).tolist()),
                    at["stress_exponent"],
                    dict(zip(self.laws.laws, laws.tolist(), strict=True)),
                    at.get("activation_energy"),
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
        self._check_elements(within or {})
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
        balance = int(np.argmax(self.contents.mean(axis=0)))
        drawn = limits[:, 0] + np.random.default_rng(seed).random((DRAWN, len(limits))) * np.diff(limits).T
        drawn[:, balance] = 1.0 - np.delete(drawn, balance, axis=1).sum(axis=1)
        allowed = ((drawn >= limits[:, 0] - 1e-9) & (drawn <= limits[:, 1] + 1e-9)).all(axis=1)
        if not allowed.any():
            raise FitError("no composition adds up to 100 at.% within these contents; widen `within`")
        return drawn[allowed]

    def __repr__(self) -> str:
        return f"<CompositionMap of {len(self.alloys)} alloys of {', '.join(self.elements)}>"

    drawn_by = "screening.composition_figure", "screening.draw_map"

    shown_by = "screening.composition_text"


def _intervals(regression: CompositionRegression, contents: Floats) -> Floats:
    """(points, 3) value and 95 % interval of an alloy at contents (points, elements)."""
    value, sd = regression.predict(contents)
    return np.stack([value, value - NORMAL_QUANTILE * sd, value + NORMAL_QUANTILE * sd], axis=1)


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
    left_out = {name: "it has no composition" for name in sources if name not in table.atomic}
    rows = {}
    for name in [one for one in sources if one not in left_out]:
        try:
            rows[name] = _compared(sources[name], point)
        except FitError as error:
            left_out[name] = str(error)
    alloys = tuple(rows)
    elements = tuple(dict.fromkeys(e for name in alloys for e in table.atomic[name]))
    if len(alloys) < FEWEST_ALLOYS:
        raise FitError(f"{len(alloys)} alloys have a law and a composition; {FEWEST_ALLOYS} are needed at least")
    contents = np.array([[table.atomic[name].get(e, 0.0) for e in elements] for name in alloys])
    contents = contents / contents.sum(axis=1, keepdims=True)
    laws = LawsByComposition.of(contents, [rows[name][1] for name in alloys])

    def regression(quantity: str) -> CompositionRegression:
        known = np.array([quantity in rows[name][0] for name in alloys])
        names = [name for name, one in zip(alloys, known, strict=True) if one]
        values, sd = np.array([rows[name][0][quantity] for name in names]).reshape(-1, 2).T
        return CompositionRegression.of(elements, contents[known], values, sd, names)

    rate, exponent, energy = regression("ln_rate"), regression("stress_exponent"), None
    with suppress(FitError):  # of too few alloys
        energy = regression("activation_energy")
    return CompositionMap(alloys, elements, contents, point, rate, exponent, energy, laws, left_out)


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
    point = medians | {name: float(value) for name, value in given.items() if value is not None}
    check_state(point)
    return point


QUANTITIES = ("ln_rate", "stress_exponent", "activation_energy")
"""Of an alloy: ln of the rate in 1/s, the exponent, and J/mol."""


def _compared(source: Any, point: Mapping[str, float]) -> tuple[dict[str, tuple[float, float]], dict[str, float]]:
    """{quantity: (value, standard deviation)} of an alloy, the energy where tests tell it, and weights of its laws.

    FitError where its tests do not say the rate at that point.
    """
    average = ModelAverage.from_ranking(source)
    check_isothermal(average.stated_laws, average.ranges, point["temperature"])
    average = replace(average, fits=tuple(fit.by_tests_alone for fit in average.fits))
    asked: dict[str, PointQuantity] = {"ln_rate": log_rate, "stress_exponent": local_exponent}
    low, high = average.ranges["temperature"]
    if high - low >= SEVERAL_TEMPERATURES:
        asked["activation_energy"] = activation_energy
    weights = dict.fromkeys((fit.law.name for fit in average.fits), 0.0)
    for fit, weight in zip(average.fits, average.weights, strict=True):
        weights[fit.law.name] += weight
    with np.errstate(all="ignore"):
        intervals = {name: average.interval_at(quantity, point) for name, quantity in asked.items()}
    values = {
        name: (float(value), float(high - low) / (2.0 * NORMAL_QUANTILE))
        for name, (value, low, high) in intervals.items()
    }
    if not (0.0 < values["ln_rate"][1] < WIDEST and np.isfinite(values["stress_exponent"]).all()):
        raise FitError("its tests do not determine the rate")
    return {k: v for k, v in values.items() if k != "activation_energy" or v[1] > 0.0}, weights


def map_where_known(sources: Mapping[str, Any], compositions: Compositions | None = None) -> dict[str, CompositionMap]:
    """{"": the map} of rankings by alloy, where compositions of enough of them are known; else {}."""
    with suppress(FitError):
        return {"": composition_map(sources, compositions)}
    return {}
