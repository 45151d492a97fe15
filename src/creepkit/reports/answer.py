"""The answer to an identification in few words: what the law is, how far to trust it, and what to do next.

Terminal, notebook and page take their first lines from here. A sentence has 25 words at most, and two numbers.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from creepkit.exporters.documents import expression_mathml, law_equations
from creepkit.exporters.exporting import input_of_programs
from creepkit.inverse.compared_tests import has_tertiary_creep
from creepkit.inverse.identified_values import StateAtStrain, depends_on_history, state_at_strain
from creepkit.inverse.reference_conditions import ISOTHERMAL_RANGE
from creepkit.inverse.uncertainty.laplace_approximation import NOT_DETERMINED, POORLY_DETERMINED, interval_ends
from creepkit.language import strain, temperature, time
from creepkit.language.printing import expression_text, state_equations
from creepkit.records import SECONDS_PER_HOUR, is_logarithmic
from creepkit.records.loading import held_of
from creepkit.records.units import celsius_text, hours_number, time_text
from creepkit.reports import words
from creepkit.reports.advice import cautions, next_step
from creepkit.reports.blocks import MOST_NAMED, Answer, Cell, Rich, Table, as_text, listed, number, plural, printable
from creepkit.reports.description import headline_role, mean_misfit_text, tested_range, tests_text
from creepkit.reports.rate_panels import PERCENT_PER_HOUR, compared_minimum_rates, exponents
from creepkit.reports.verdicts import same_functions, verdict_text
from creepkit.reports.wording import shown_unit

if TYPE_CHECKING:
    from creepkit.experiments.planned_design import Design
    from creepkit.forecasts.forecast import Forecast
    from creepkit.forecasts.forecast_of_test import TestForecast, TimeForecast
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.selection.ranking import Ranking
    from creepkit.inverse.uncertainty.laplace_approximation import Estimate
    from creepkit.language import CreepLaw
    from creepkit.quality.flags import DataQuality
    from creepkit.rupture_assessment.assessment import RuptureAssessment
    from creepkit.rupture_assessment.strength import StrengthEstimate


MOST_CAUTIONS = 3
"""On the first screen and in a terminal; the others stand in the details."""


MOST_ASKED = 4
"""Numbers of forecasts on the first screen."""


OTHER_EXPONENT = 0.1
"""Of the stress exponent, by which a value called n differs from it where this is said."""


OTHER_MEDIAN = 0.05
"""Of a time, by which that of the law's values differs from it where this is said."""


LEAST_WEIGHT = 0.01
"""Of a law that is named beside the best."""


BEYOND = {"h": "later", "%": "ruptured"}
"""{unit: what an interval without an upper end says}, of times and of strains."""


SLOPES = "stress exponent", "activation energy"
"""Names of slopes, which are positive, whatever a linear approximation says of the ends of their intervals."""


@dataclass(frozen=True)
class KeyFigure:
    """One number that a laboratory asks for.

    name : such as "stress exponent". where : the condition that it holds at. value, low, high : with a 95 % interval,
    whose ends are NaN where there is none. unit : "" for none. remark : what to compare it with.
    """

    name: str
    where: str
    value: float
    low: float = float("nan")
    high: float = float("nan")
    unit: str = ""
    remark: str = ""

    @property
    def line(self) -> str:
        """All of it in one line."""
        remark = f" ({self.remark})" if self.remark else ""
        return f"{self.name}, {self.where}: {self.text}{remark}"

    @property
    def text(self) -> str:
        """Value, interval and unit; of an exponent or energy whose interval is wider than itself the interval alone."""
        said = interval_text((self.value, self.low, self.high), self.unit)
        if not (self.name in SLOPES and self.high - self.low > self.value):
            return said
        return (
            f"{NOT_DETERMINED} [{number(max(self.low, 0.0), 2)}, {number(self.high, 2)}]{self.unit and ' '}{self.unit}"
        )


def _written_out(value: float, digits: int) -> str:
    """A number without a power of ten where it has a usual size, such as 2930 h."""
    if not 10.0**digits <= abs(value) < 1e6:
        return number(value, digits)
    return f"{float(f'{value:.{digits}g}'):.0f}"


# ---- key figures -----------------------------------------------------------------------------------------------------


def key_figures(fit: Identification) -> list[KeyFigure]:
    """Stress exponent, activation energy and creep rate at the tests; of a rejected law what was measured."""
    rates = compared_minimum_rates(fit)
    slopes = ([math.nan] * 3 if not rates else exponents(rates, energy=energy) for energy in (False, True))
    (measured, half, predicted), (heat, error, _) = slopes
    of_heat = (heat, heat - error, heat + error)
    where = f"{words.OVER_ALL_TESTS}, {tested_range(fit)}"
    by_rates = _with_interval("activation energy", where, of_heat, 1e-3, "kJ/mol")
    misfit = fit.adequacy is not None and fit.adequacy.rejects and not fit.adequacy.lies_in_tests
    if misfit and math.isfinite(measured):
        by_law = f"{predicted:.2g} by the law" if math.isfinite(predicted) else ""
        interval = (measured, measured - half, measured + half)
        found = [KeyFigure("stress exponent", where, *interval, remark=by_law), *_lives(fit)]
        return [one for one in (*found, by_rates) if math.isfinite(one.value)]
    r = fit.tested_point
    state, of_state = _state(fit), ""
    if depends_on_history(fit.law):
        of_strain = f", {100 * r.strain:.2g} % strain"
        if states_minimum(fit):
            of_strain = ", minimum rate" if state is not None else ", initial rate"
        of_state = f", after {time_text(r.time)}" if rate_of_time(fit.law) else of_strain
    at = f"{r.stress:.4g} MPa, {celsius_text(r.temperature, digits=0)}{of_state}{r.conditions_text(fit.law)}"
    rate, exponent, energy = rate_exponent_and_energy(fit, state)
    by_tests = words.MEAN_SLOPE.format(value=f"{measured:.2g}") if math.isfinite(measured) else ""
    figures = [_with_interval("stress exponent", at, exponent, remark=by_tests)]
    if fit.law.uses(temperature) and float(np.ptp(fit.ranges["temperature"])) > ISOTHERMAL_RANGE:
        by_tests = words.MEAN_SLOPE.format(value=by_rates.text) if math.isfinite(heat) else ""
        figures.append(_with_interval("activation energy", at, energy, 1e-3, "kJ/mol", by_tests))
    included = "with errors of tests" if any(one.included for one in fit.unmodelled) else ""
    rate_figure = _with_interval("creep rate", at, rate, PERCENT_PER_HOUR, "%/h", included)
    figures = [figures[0], *_lives(fit), *figures[1:], rate_figure]
    return [replace(one, remark=words.BY_REJECTED) if misfit and not one.remark else one for one in figures]


def _lives(fit: Identification) -> list[KeyFigure]:
    """The life of the test that broke last, by the law, with the interval of a single test; none where none broke."""
    broken = [(one.rupture, one) for one in fit.tests if one.rupture is not None and one.rupture.used]
    broken = [(end, one) for end, one in broken if not end.censored and math.isfinite(end.predicted)]
    if not broken:
        return []
    end, test = max(broken, key=lambda pair: pair[0].measured)
    said = f"measured {_written_out(end.measured / SECONDS_PER_HOUR, 3)} h"
    hours = [time / SECONDS_PER_HOUR for time in (end.predicted, end.low, end.high)]
    where = words.NEW_TEST.format(condition=test.condition)
    return [_with_interval("time to rupture", where, hours, unit="h", remark=said)]


def _with_interval(
    name: str, where: str, values: Sequence[float], factor: float = 1.0, unit: str = "", remark: str = ""
) -> KeyFigure:
    """Of (value, low, high), each times a factor."""
    value, low, high = (factor * float(v) for v in values)
    return KeyFigure(name, where, value, low, high, unit, remark)


def asked_figures(forecast: Forecast) -> list[KeyFigure]:
    """What a forecast was asked for of each test, with the interval of a single test: times to values, and a life.

    Where no values were asked for, or none is reached, what a test shows at its end, or its life where it ends before.
    """
    level = "" if forecast.level == 0.95 else f"{100 * forecast.level:g} % interval"
    shown = (figure for test in forecast.tests for figure in _shown(test, times=forecast.asked))
    return [replace(one, remark=", ".join(filter(None, (level, one.remark)))) for one in shown]


def event_text(one: TimeForecast) -> str:
    """What comes at a time: strains in per cent."""
    if not (one.output and is_logarithmic(one.output)):
        return one.event
    return f"{100 * one.target:g} % {one.event.rpartition(' ')[0]}"


def _shown(test: TestForecast, *, times: bool) -> Iterator[KeyFigure]:
    """times : to values are asked for."""
    condition = test.history.condition
    where, end = condition if test.name in condition else f"{test.name}: {condition}", float(test.history.times[-1])
    where = where if test.inside is not None else words.NEW_TEST.format(condition=where)
    reached = [one for one in test.times if math.isfinite(one.median)]
    life = [one for one in reached if not one.output and (one.median <= end or (times and len(test.times) == 1))]
    wanted = [*([one for one in reached if one.output] if times else ()), *life]
    for figure, one in [(time_figure(one), one) for one in wanted] or [(one, None) for one in end_figures(test)][:1]:
        beyond = test.extrapolated_in(one)
        said = [words.FORECAST["beyond"].format(quantities=listed(beyond))] * bool(beyond)
        yield replace(figure, where=where, remark=", ".join(filter(None, [figure.remark, *said])))


def time_figure(one: TimeForecast) -> KeyFigure:
    """When something comes; of a measured test whether it did within its interval."""
    inside = {True: "inside", False: "outside", None: ""}[one.inside]
    said = [f"measured {'> ' * one.censored}{hours_number(one.measured)} h, {inside}"] * math.isfinite(one.measured)
    if math.isfinite(one.value) and abs(one.value - one.median) > OTHER_MEDIAN * one.median:
        said.append(words.FORECAST["by values"].format(hours=_written_out(one.value / SECONDS_PER_HOUR, 3)))
    hours = (one.median, one.low, one.high)
    return _with_interval(f"time to {event_text(one)}", "", hours, 1 / SECONDS_PER_HOUR, "h", "; ".join(said))


def end_figures(test: TestForecast) -> Iterator[KeyFigure]:
    """What the outputs of a test show at its end, or before it where they are predicted no longer."""
    for name, one in test.outputs.items():
        known = np.flatnonzero(np.isfinite(one.value))
        factor, unit = shown_unit(name)
        for k in known[-1:]:
            label = f"{name.replace('_', ' ')} at {time_text(float(one.times[k]))}"
            values = (one.value[k], one.band.low[k], one.band.high[k])
            yield _with_interval(label, test.history.condition, values, factor, unit)


MOST_STRENGTHS = 3
"""Temperatures whose strengths are named first."""


def _longest_strengths(assessment: RuptureAssessment) -> list[StrengthEstimate]:
    """The mean of the methods at the longest time at which one is known, at the outer temperatures and one between."""
    found = [one for one in assessment.strengths if one.method == "average" and one.value is not None]
    hours = max((one.hours for one in found), default=0.0)
    found = [one for one in found if one.hours == hours]
    return [found[k] for k in dict.fromkeys(round(k) for k in np.linspace(0, len(found) - 1, MOST_STRENGTHS)) if found]


def rupture_figures(assessment: RuptureAssessment) -> list[KeyFigure]:
    """Times to rupture at the stresses asked for, and the strength at the longest time, a figure a temperature of each.

    With intervals of their means.
    """
    count = len(assessment.tests.names)
    lives = [_of_mean("time to rupture", f"{one.stress:g} MPa", one.hours, "h", one, count) for one in assessment.lives]
    strengths = [(one, f"{one.hours:g} h", one.value) for one in _longest_strengths(assessment)]
    return [*lives, *(_of_mean("rupture strength", at, value, "MPa", one, count) for one, at, value in strengths)]


def strengths_line(assessment: RuptureAssessment) -> str:
    """The strengths at the longest time in one line, with the intervals of their means; "" where none is known."""
    found = _longest_strengths(assessment)
    if not found:
        return ""
    shown = (interval_text((one.value or 0.0, *known_bounds(one)), "MPa") for one in found)
    whys = (_reason_of_bounds(one).partition(":")[0] for one in found)
    texts = (f"{text} ({why})" if why else text for text, why in zip(shown, whys, strict=True))
    at = [f"{celsius_text(one.temperature, digits=0)} {text}" for one, text in zip(found, texts, strict=True)]
    return f"rupture strength, {found[0].hours:g} h: {', '.join(at)}"


def known_bounds(one: Any) -> tuple[float, float]:
    """Of the mean, of a strength or a life: infinite where one of them is not known, NaN where none is."""
    low, high = one.bounds_of_mean
    if low is None and high is None:
        return math.nan, math.nan
    return (-math.inf if low is None else low), (math.inf if high is None else high)


def _reason_of_bounds(one: Any) -> str:
    """Why a strength has no interval, in short; "" where it has one."""
    return str(getattr(one, "reason", "")).replace(" of the mean", "").partition(";")[0]


def _of_mean(name: str, at: str, value: Any, unit: str, one: Any, count: int) -> KeyFigure:
    """count : of tests that ruptured or ran out, from which it is."""
    low, high = known_bounds(one)
    remark = f"{plural(count, 'rupture test')}{', extrapolated' * bool(one.extrapolation)}"
    remark = "; ".join(filter(None, (remark, _reason_of_bounds(one))))
    return KeyFigure(name, f"{celsius_text(one.temperature, digits=0)}, {at}", value, low, high, unit, remark)


# ---- the answer ------------------------------------------------------------------------------------------------------


def answer(
    fit: Identification,
    ranking: Ranking | None = None,
    *,
    asked: Sequence[KeyFigure] = (),
    quality: DataQuality | None = None,
    searched: Sequence[str] = (),
    design: Design | None = None,
    **page: Any,
) -> Answer:
    """Headline, equations, values, key figures, cautions and what to do next, of the best law of a ranking if given.

    asked : what forecasts say. quality : of the data. searched : names of laws that a search of laws tried. design : of
    further tests, whose first is what to do next. page : picture and files.
    """
    symbols = symbols_of(fit.law)
    remarks = [] if ranking is None or len(ranking.laws) < 2 else [chosen_text(ranking), same_functions(ranking)]
    remarks += [] if ranking is None else [f"left out: {law}: {why}" for law, why in ranking.failed.items()]
    remarks += [fit.sparsity.verdict] if fit.sparsity is not None else []
    figures, n = key_figures(fit), fit.values.get("n", math.nan)
    exponent = next((one.value for one in figures if one.name == "stress exponent"), math.nan)
    other = words.OTHER_N * (abs(n - exponent) > OTHER_EXPONENT * exponent)
    figures = [*asked[:MOST_ASKED], *figures]
    planned = design.sentence.removeprefix(words.DESIGN["test"].partition("{")[0]) if design is not None else ""
    return Answer(
        fit.headline,
        "; ".join(filter(None, (tests_text(fit), mean_misfit_text(fit)))),
        titled_law(fit.law),
        equations(fit.law),
        [(symbols[e.name], *_shown_value(fit.law, e), unit_text(e.unit)) for e in fit.estimates],
        [(one.name, one.where, one.text, one.remark) for one in figures],
        cautions(fit, ranking, quality)[:MOST_CAUTIONS],
        next_step(fit, ranking, searched) if design is None or not design.plan else planned,
        remarks,
        brackets=words.BRACKETS * any("[" in one.text for one in figures),
        role=headline_role(fit),
        units=f"{Answer.units}{other}",
        **page,
    )


def codes_text(fit: Identification) -> str:
    """The law's keyword, or the routine that it needs, in finite element codes; "" where none takes it."""
    found = [f"{program}: {line}" for program, line in input_of_programs(fit).items()]
    return words.CODES.format(codes="; ".join(found)) if found else ""


def answer_text(fit: Identification, ranking: Ranking | None = None, more: object = ".details()", **known: Any) -> str:
    """The answer of one law, or of the best of a ranking with the weights of all; more : what shows the rest.

    known : laws that were searched, and a design, see answer().
    """
    return as_text([answer(fit, ranking, more=str(more), **known)])


def table_of_groups(groups: Mapping[str, tuple[Identification, bool | None]]) -> Table:
    """The law, stress exponent and creep rate of each alloy of several, and what its tests say of the law.

    groups : {name: (best law, whether its choice is decisive, None where it was not one)}.
    """
    rows: list[Sequence[Cell]] = []
    for name, (fit, decisive) in groups.items():
        figures = {one.name: one.text for one in key_figures(fit)}
        choice = {None: "", True: ", decisive", False: ", not decisive"}[decisive]
        rate = figures.get("creep rate", "–").replace(" %/h", "")
        stress = "–" if rate == "–" else number(fit.tested_point.stress, 3)
        numbers = (figures.get("stress exponent", "–"), rate, stress)
        rows.append((name, titled_law(fit.law), *numbers, f"{verdict_text(fit.adequacy)}{choice}"))
    columns = ("material", "best law", "stress exponent", "creep rate, %/h", "at MPa", "by the noise of the tests")
    return Table("in brackets: 95 % intervals; of a law that is rejected the slope of measured rates", columns, rows)


def chosen_text(ranking: Ranking) -> str:
    """Whether the choice of the law is decisive, and the weights of the laws; cautions say why one is not."""
    laws = [one for one in ranking.laws if not one.same_as]
    known = [f"{one.fit.law.name} {one.weight:.2f}" for one in laws[:MOST_NAMED] if one.weight >= LEAST_WEIGHT]
    more = len(laws) - len(known)
    others = f"; {plural(more, 'other')} below {LEAST_WEIGHT:g}" if more else ""
    weights = f"weights: {', '.join(known)}{others}"
    if len(known) == 1:
        same = len(ranking.laws) - len(laws)
        become = f"; {same} of them become{'s' * (same == 1)} the same function" if same else ""
        weights = f"weight {laws[0].weight:.2f} among {plural(len(ranking.laws), 'law')}{become}"
    return f"{'decisive' if ranking.decisive else 'not decisive'}; {weights}"


# ---- laws ------------------------------------------------------------------------------------------------------------


def titled_law(law: CreepLaw) -> Rich:
    """The name of a law, by which commands and files know it; on pages behind its title."""
    name = Markup("<code>{}</code>").format(printable(law.name, 120))
    return Rich(law.name, Markup("{} ({})").format(printable(law.title, 160), name) if law.title else name)


def equations(law: CreepLaw) -> list[Rich]:
    """The creep rate, and the rates of internal variables."""
    rate = " + ".join(expression_text(term) for term in law.terms.values())
    texts = [f"rate = {rate}", *state_equations(law)]
    return [Rich(text, Markup(html)) for text, html in zip(texts, law_equations(law), strict=True)]


def symbols_of(law: CreepLaw) -> dict[str, Rich]:
    """{parameter: its symbol}."""
    return {str(symbol): Rich(str(symbol), expression_mathml(symbol)) for symbol in law.params}


def _shown_value(law: CreepLaw, estimate: Estimate) -> tuple[str, tuple[str, str]]:
    """A value and the ends of its interval, with the digits that this leaves, or that the tests do not determine it."""
    digits = FEWEST_DIGITS - 1
    if estimate.verdict not in (NOT_DETERMINED, POORLY_DETERMINED):
        digits = min(interval_digits(estimate.value, estimate.low, estimate.high), MOST_SHOWN)
    said = NOT_DETERMINED if estimate.verdict == NOT_DETERMINED else f"= {_written_out(estimate.value, digits)}"
    return said, interval_ends(law, estimate, lambda end: _written_out(end, digits))


def value_cells(law: CreepLaw, estimate: Estimate, held: str = "") -> dict[str, str]:
    """A value with the digits that the law needs, the ends of its 95 % interval, and unit, as every table shows them.

    held : what is said of the interval.
    """
    interval = " to ".join(interval_ends(law, estimate))
    return {"value": f"{estimate.value:.10g}", f"95 % interval{held}": interval, "unit": unit_text(estimate.unit)}


def unit_text(unit: str) -> str:
    """A unit as it stands behind a number: "" of pure numbers."""
    return "" if unit == "1" else unit


# ---- rate and stress exponent amid the tests -------------------------------------------------------------------------


def rate_exponent_and_energy(fit: Identification, state: StateAtStrain | None) -> tuple[tuple[float, ...], ...]:
    """Creep rate, 1/s, stress exponent and activation energy, J/mol, amid the tests: of bars at the reference strain.

    (value, low, high) each. Where the law has no more than stress, temperature and time, or no bar can be followed,
    those of the formula. state : of such a bar, if any.
    """
    if state is not None:
        return state.rate, state.exponent, state.energy
    stress = fit.tested_point.stress
    rate, exponent = fit.rate(stress, warn=False), fit.local_exponent(stress, warn=False)
    return tuple(map(float, rate)), tuple(map(float, exponent)), fit.activation_energy()


def _state(fit: Identification) -> StateAtStrain | None:
    return state_at_strain(fit) if depends_on_history(fit.law) and not rate_of_time(fit.law) else None


def states_minimum(fit: Identification) -> bool:
    """Whether the rate amid the tests is the least of a bar, as of laws with tertiary creep."""
    return has_tertiary_creep(fit.law) and not rate_of_time(fit.law)


def rate_of_time(law: CreepLaw) -> bool:
    """Whether time is all that the rate knows of its past: its exponent is then that of equal times, which tests show.

    At equal strains it is n/(1 + m) of s^n t^m, which nobody would look for.
    """
    return law.uses(time) and not (law.states or law.uses(strain))


def held_quantities(fit: Identification) -> str:
    """What the derivative of the law's formula to stress holds, in words."""
    law = fit.law
    held = [word for word, symbol in (("time", time), ("strain", strain)) if law.uses(symbol)]
    held += ["initial internal variables"] if law.states else []
    return listed(held) if held else ""


def reference_sentences(fit: Identification) -> list[str]:
    """Where the rate amid the tests is taken, and the slope of the law's formula where that is another."""
    r, state, held = fit.tested_point, _state(fit), held_quantities(fit)
    lines = []
    if state is not None:
        hours = interval_text(tuple(v / SECONDS_PER_HOUR for v in state.time), "h")
        at = f"{number(r.stress)} MPa and {celsius_text(r.temperature, digits=0)}"
        reaches = "its minimum rate" if states_minimum(fit) else f"{100 * r.strain:.2g} % strain"
        lines.append(f"a bar under a true stress of {at} reaches {reaches} after {hours}")
    if held and (held != "strain" or state is None):
        formula = interval_text(tuple(map(float, fit.local_exponent(r.stress, warn=False))))
        lines.append(f"at constant {held} the slope of the law's formula over stress is {formula}")
        lines += [] if held == "strain" else ["tests compared at one strain show another slope"]
    return lines


def interval_text(values: Sequence[float], unit: str = "") -> str:
    """A value with its unit and the ends of its interval, all with the digits in which they differ.

    The value alone where an end is not known; an end that is infinite in words.
    """
    known = not any(map(math.isnan, values[1:]))
    behind = f" {unit}" if unit and not math.isinf(values[0]) else ""
    digits = interval_digits(*values) if known else 2
    beyond = {-math.inf: "none", math.inf: BEYOND.get(unit, "no limit")}
    value, *ends = (beyond.get(v) or _written_out(v, digits) for v in values)
    return f"{value}{behind} [{', '.join(ends)}]" if known else f"{value}{behind}"


FEWEST_DIGITS, MOST_DIGITS, MOST_SHOWN = 3, 7, 4
"""Of a value with its interval; and of values of a law on the first screen, whose other digits are in the details."""


def interval_digits(value: float, low: float, high: float, *, fewest: int = FEWEST_DIGITS) -> int:
    """Digits with which the ends of an interval differ from its value."""
    distances = [abs(end - value) for end in (low, high) if math.isfinite(end) and end != value]
    if not distances or value == 0.0 or not math.isfinite(value):
        return fewest
    return min(max(fewest, math.floor(math.log10(abs(value) / min(distances))) + 2), MOST_DIGITS)


def constant_load_sentence(fit: Identification) -> str:
    """Where the exponent comes from in tests whose true stress rises with strain; "" where none has a constant load."""
    of_stress = [h for h in fit.histories if "strain" in h.outputs and h.loading.quantity == "stress"]
    if not any(held_of(h.loading) == "load" for h in of_stress):
        return ""
    growth = f"{100 * fit.ranges['strain'][1]:.2g} %"
    return words.CONSTANT_LOAD.format(growth=growth)
