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
from creepkit.inverse.history_checks import LENGTHS_BY_DEFAULT
from creepkit.inverse.identified_values import StateAtStrain, depends_on_history, state_at_strain
from creepkit.inverse.nuisance_parameters import beyond_intervals
from creepkit.inverse.reference_conditions import ISOTHERMAL_RANGE
from creepkit.inverse.uncertainty.laplace_approximation import NOT_DETERMINED, POORLY_DETERMINED, interval_ends
from creepkit.language import strain, temperature, time
from creepkit.language.printing import expression_text, state_equations
from creepkit.records import SECONDS_PER_HOUR, is_logarithmic, output_unit
from creepkit.records.loading import held_of
from creepkit.records.units import celsius_text, hours_number, time_text
from creepkit.reports.blocks import (
    MOST_NAMED,
    Answer,
    Cell,
    Rich,
    Table,
    as_text,
    listed,
    named,
    number,
    plural,
    printable,
)
from creepkit.reports.description import headline_role, rejected, tested_range, tests_text
from creepkit.reports.next_steps import next_step
from creepkit.reports.rate_panels import PERCENT_PER_HOUR, compared_minimum_rates, exponents
from creepkit.reports.remarks import challenge_text, combined_change_text, nuisance_text
from creepkit.reports.verdicts import cause_caution, cause_headline, same_functions, unmet_text, verdict_text
from creepkit.reports.words import BRACKETS, CAUTIONS, CONSTANT_LOAD, FORECAST, NEW_TEST, REASONS

if TYPE_CHECKING:
    from creepkit.forecasts.forecast import Forecast
    from creepkit.forecasts.forecast_of_test import TestForecast, TimeForecast
    from creepkit.inverse.adequacy import Adequacy
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.selection.ranking import Ranking
    from creepkit.inverse.uncertainty.laplace_approximation import Estimate
    from creepkit.language import CreepLaw, Param
    from creepkit.quality.flags import DataQuality
    from creepkit.rupture_assessment.assessment import RuptureAssessment


MOST_CAUTIONS = 3
"""On the first screen and in a terminal; the others stand in the details."""


AT_BOUND, WIDER_RATIO = 1e-3, 1e3
"""Of the width of a search: so near to its end a value is held there; and by what a bound of a logarithm is moved."""


MOST_ASKED = 4
"""Numbers of forecasts on the first screen."""


OTHER_EXPONENT = 0.1
"""Of the stress exponent, by which a value called n differs from it where this is said."""


OTHER_MEDIAN = 0.05
"""Of a time, by which that of the law's values differs from it where this is said."""


LEAST_WEIGHT = 0.01
"""Of a law that is named beside the best."""


NOTEWORTHY_EXPONENT = 0.15
"""Of the stress exponent, by which leaving out one test changes it, from which on this is said."""


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
        if not (self.name.endswith(SLOPES) and self.high - self.low > self.value):
            return said
        return (
            f"{NOT_DETERMINED} [{number(max(self.low, 0.0), 2)}, {number(self.high, 2)}]{self.unit and ' '}{self.unit}"
        )


def _written_out(value: float, digits: int) -> str:
    """A number without a power of ten where it has a usual size, such as 2930 h."""
    if not 1e3 <= abs(value) < 1e6:
        return number(value, digits)
    return f"{float(f'{value:.{digits}g}'):.0f}"


# ---- key figures -----------------------------------------------------------------------------------------------------


def key_figures(fit: Identification) -> list[KeyFigure]:
    """Stress exponent, activation energy and creep rate at the tests; of a rejected law what was measured."""
    rates = compared_minimum_rates(fit)
    slopes = ([math.nan] * 3 if not rates else exponents(rates, energy=energy) for energy in (False, True))
    (measured, half, predicted), (heat, error, _) = slopes
    of_heat = (heat, heat - error, heat + error)
    by_rates = _with_interval("measured activation energy", tested_range(fit), of_heat, 1e-3, "kJ/mol")
    if fit.adequacy is not None and fit.adequacy.rejects and not fit.adequacy.lies_in_tests:
        by_law = f"{predicted:.2g} by the law" if math.isfinite(predicted) else ""
        interval = (measured, measured - half, measured + half)
        found = [KeyFigure("measured stress exponent", tested_range(fit), *interval, remark=by_law), *_lives(fit)]
        return [one for one in (*found, by_rates) if math.isfinite(one.value)]
    r = fit.tested_point
    of_state = ""
    if depends_on_history(fit.law):
        of_state = f", after {time_text(r.time)}" if rate_of_time(fit.law) else f", {100 * r.strain:.2g} % strain"
    at = f"{r.stress:.4g} MPa, {celsius_text(r.temperature, digits=0)}{of_state}{r.conditions_text(fit.law)}"
    rate, exponent, energy = rate_exponent_and_energy(fit)
    by_tests = f"{measured:.2g} over all tests" if math.isfinite(measured) else ""
    figures = [_with_interval("stress exponent", at, exponent, remark=by_tests)]
    if fit.law.uses(temperature) and float(np.ptp(fit.ranges["temperature"])) > ISOTHERMAL_RANGE:
        by_tests = f"{by_rates.text} over all tests" if math.isfinite(heat) else ""
        figures.append(_with_interval("activation energy", at, energy, 1e-3, "kJ/mol", by_tests))
    included = "with errors of tests" if any(one.included for one in fit.unmodelled) else ""
    rate_figure = _with_interval("creep rate", at, rate, PERCENT_PER_HOUR, "%/h", included)
    return [figures[0], *_lives(fit), *figures[1:], rate_figure]


def _lives(fit: Identification) -> list[KeyFigure]:
    """The life of the test that broke last, by the law, with the interval of a single test; none where none broke."""
    broken = [(one.rupture, one) for one in fit.tests if one.rupture is not None and one.rupture.used]
    broken = [(end, one) for end, one in broken if not end.censored and math.isfinite(end.predicted)]
    if not broken:
        return []
    end, test = max(broken, key=lambda pair: pair[0].measured)
    said = f"measured {_written_out(end.measured / SECONDS_PER_HOUR, 3)} h"
    hours = [time / SECONDS_PER_HOUR for time in (end.predicted, end.low, end.high)]
    where = NEW_TEST.format(condition=test.condition)
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
    where = where if test.inside is not None else NEW_TEST.format(condition=where)
    reached = [one for one in test.times if math.isfinite(one.median)]
    life = [one for one in reached if not one.output and (one.median <= end or (times and len(test.times) == 1))]
    wanted = [*([one for one in reached if one.output] if times else ()), *life]
    for figure, one in [(time_figure(one), one) for one in wanted] or [(one, None) for one in end_figures(test)][:1]:
        beyond = test.extrapolated_in(one)
        said = [FORECAST["beyond"].format(quantities=listed(beyond))] * bool(beyond)
        yield replace(figure, where=where, remark=", ".join(filter(None, [figure.remark, *said])))


def time_figure(one: TimeForecast) -> KeyFigure:
    """When something comes; of a measured test whether it did within its interval."""
    inside = {True: "inside", False: "outside", None: ""}[one.inside]
    said = [f"measured {'> ' * one.censored}{hours_number(one.measured)} h, {inside}"] * math.isfinite(one.measured)
    if math.isfinite(one.value) and abs(one.value - one.median) > OTHER_MEDIAN * one.median:
        said.append(FORECAST["by values"].format(hours=_written_out(one.value / SECONDS_PER_HOUR, 3)))
    hours = (one.median, one.low, one.high)
    return _with_interval(f"time to {event_text(one)}", "", hours, 1 / SECONDS_PER_HOUR, "h", "; ".join(said))


def end_figures(test: TestForecast) -> Iterator[KeyFigure]:
    """What the outputs of a test show at its end, or before it where they are predicted no longer."""
    for name, one in test.outputs.items():
        known = np.flatnonzero(np.isfinite(one.value))
        unit, factor = ("%", 100.0) if is_logarithmic(name) else (output_unit(name), 1.0)
        for k in known[-1:]:
            label = f"{name.replace('_', ' ')} at {time_text(float(one.times[k]))}"
            values = (one.value[k], one.band.low[k], one.band.high[k])
            yield _with_interval(label, test.history.condition, values, factor, unit)


def rupture_figures(assessment: RuptureAssessment) -> list[KeyFigure]:
    """Times to rupture at the stresses asked for, and the strength at the longest time, a figure a temperature of each.

    With intervals of their means.
    """
    found = [one for one in assessment.strengths if one.method == "average" and one.value is not None]
    hours = max((one.hours for one in found), default=0.0)
    lives = [_of_mean("time to rupture", f"{one.stress:g} MPa", one.hours, "h", one) for one in assessment.lives]
    at = f"{hours:g} h"
    return [*lives, *(_of_mean("rupture strength", at, one.value, "MPa", one) for one in found if one.hours == hours)]


def known_bounds(one: Any) -> tuple[float, float]:
    """Of the mean, of a strength or a life: infinite where one of them is not known, NaN where none is."""
    low, high = one.bounds_of_mean
    if low is None and high is None:
        return math.nan, math.nan
    return (-math.inf if low is None else low), (math.inf if high is None else high)


def _of_mean(name: str, at: str, value: Any, unit: str, one: Any) -> KeyFigure:
    low, high = known_bounds(one)
    remark = f"mean of methods{', extrapolated' * bool(one.extrapolation)}"
    return KeyFigure(name, f"{celsius_text(one.temperature, digits=0)}, {at}", value, low, high, unit, remark)


# ---- cautions --------------------------------------------------------------------------------------------------------


def cautions(fit: Identification, ranking: Ranking | None = None, quality: DataQuality | None = None) -> list[str]:
    """What to mind, the most serious first, a sentence each without a full stop."""
    others = [one.fit for one in ranking.laws if one.fit is not fit] if ranking is not None else []
    choice = [*_choice(ranking)]  # whose first sentence stands on the first screen
    tests = [*(one for one in fit.notes if one.startswith(LENGTHS_BY_DEFAULT)), *_of_tests(fit)]
    of_law = [*tests, *_held([fit]), *choice[:1], *_contradictions(fit), *choice[1:], *_precision(fit)]
    return list(dict.fromkeys([*of_law, *(_held(others) if rejected(fit) else ()), *_data(quality)]))


def _of_tests(fit: Identification) -> Iterator[str]:
    """Tests that do not agree with all others, with the error that would make it."""
    found = fit.adequacy.explanations[:1] if fit.adequacy is not None else ()
    yield from (
        cause_caution(one) if one.kind == "one test" else cause_headline(one) for one in found if not one.is_of_law
    )


def _held(fits: Sequence[Identification]) -> Iterator[str]:
    """A law that a bound of the search keeps from the tests, and how to move it; what is physical is no such bound."""
    for one in fits:
        for name, param in one.law.table.items():
            low, high = (param.to_internal(end) for end in param.bounds)
            value = param.to_internal(one.values[name]) if name in one.values else math.nan
            free = [end not in (param.limits or ()) and end not in (0.0, param.off) for end in param.bounds]
            for at_upper, distance in ((False, value - low), (True, high - value)):
                if distance <= AT_BOUND * (high - low) and free[at_upper]:
                    yield _bound_text(one.law.name, name, param, at_upper=at_upper)
                    return


def _bound_text(law: str, name: str, param: Param, *, at_upper: bool) -> str:
    low, high = param.bounds
    bound = high if at_upper else low
    further = WIDER_RATIO if param.scale == "log" else 2.0
    if at_upper:
        high = high * further if high > 0 else high + (high - low)
    else:
        low = low / further if low > 0 else low - (high - low)
    wider = f"bounds = {{ {name} = [{number(low)}, {number(high)}] }}"
    end = "upper" if at_upper else "lower"
    return CAUTIONS["held"].format(law=law, name=name, value=number(bound), end=end, wider=wider)


RUNAWAY = 1.0
"""Strain above what was measured, from which on a law has broken before the test."""


def _contradictions(fit: Identification) -> Iterator[str]:
    """What keeps the law from describing the tests."""
    adequacy = fit.adequacy
    if not fit.converged:
        yield CAUTIONS["not converged"]
    if adequacy is None:
        yield CAUTIONS["unknown"]
        return
    if adequacy.unpredicted:
        yield CAUTIONS["unpredicted"].format(tests=named(adequacy.unpredicted, "test"))
    for k, reason in enumerate(_reasons(fit, adequacy)):
        yield reason if k else CAUTIONS["rejected"].format(reason=reason)
    if adequacy.mentioned is not None:
        yield cause_caution(adequacy.mentioned)
    if adequacy.remedies and not adequacy.explanations:
        yield CAUTIONS["remedy"].format(remedy=adequacy.remedies[0])
    yield from (CAUTIONS["implausible"].format(nuisance=nuisance_text(one)) for one in adequacy.implausible[:1])
    if adequacy.verdict == "cannot be judged" and not adequacy.unpredicted:
        yield CAUTIONS["noise unknown"]


def _reasons(fit: Identification, adequacy: Adequacy) -> list[str]:
    """Why the tests reject the law; none where they do not, or where what it misses lies in some of them."""
    if not adequacy.rejects or adequacy.lies_in_tests:
        return []
    found = [REASONS["two exponents"]] * (adequacy.contradicting is not None)
    if adequacy.is_explained:
        found.append(REASONS["cause"].format(cause=cause_headline(adequacy.explanations[0])))
    if adequacy.misses_shape() and adequacy.largest is not None:
        worst = adequacy.largest
        factor, unit = (100.0, "% (absolute)") if is_logarithmic(worst.output) else (1.0, output_unit(worst.output))
        what, amount = worst.output.replace("_", " "), f"{factor * abs(worst.deviation):.2g} {unit}".strip()
        side, at = "large" if worst.deviation > 0 else "small", time_text(worst.time)
        kind = "runs away" if is_logarithmic(worst.output) and worst.deviation > RUNAWAY else "worst"
        found.append(REASONS[kind].format(test=_test(fit, worst.test), what=what, amount=amount, side=side, time=at))
    return found or [REASONS["noise"]]


def _test(fit: Identification, name: str) -> str:
    """A test with its temperature and load."""
    condition = next((one.condition for one in fit.tests if one.name == name), "")
    return f"'{name}'" if not condition or condition in name else f"'{name}' ({condition})"


def _choice(ranking: Ranking | None) -> Iterator[str]:
    """What else the tests allow."""
    if ranking is None or len(ranking.laws) < 2 or ranking.adequacy is None:
        return
    others = [one.fit.law.name for one in ranking.credible[1:]]
    if others:
        yield CAUTIONS["undecided"].format(laws=named(others, "law"))
    same = f"{ranking.best.law.name} above "  # a threshold
    yield from (challenge_text(one).replace(same, "the same law above ") for one in (ranking.challenges or ())[:1])
    if not (others or ranking.challenges or ranking.adequacy.rejects):
        yield from (unmet_text(ranking, name) for name in ("weight", "challenges") if name in ranking.unmet)


def _precision(fit: Identification) -> Iterator[str]:
    """What the tests do not determine, and what intervals leave out."""
    by = "by this law the tests" if rejected(fit) else "the tests"
    for verdict, kind in ((NOT_DETERMINED, "not determined"), (POORLY_DETERMINED, "hardly determined")):
        names = [e.name for e in fit.estimates if e.verdict == verdict]
        if names:
            yield CAUTIONS[kind].format(by=by, names=named(names, "parameter"))
    exponent = float(fit.local_exponent(fit.tested_point.stress, warn=False)[0])
    far = max(fit.left_out, key=lambda one: abs(one.exponent - exponent), default=None)
    if far is not None and not rejected(fit) and abs(far.exponent - exponent) > NOTEWORTHY_EXPONENT * exponent:
        yield CAUTIONS["one test"].format(test=_test(fit, far.test), exponent=f"{far.exponent:.3g}")
    change = combined_change_text(fit.unmodelled)
    if change:
        kinds = " and ".join(dict.fromkeys(one.description for one in beyond_intervals(fit.unmodelled)[:2]))
        yield CAUTIONS["not included"].format(kinds=kinds, change=change)


def _data(quality: DataQuality | None) -> Iterator[str]:
    if quality is not None and quality.flags:
        tests = list(dict.fromkeys(name for flag in quality.flags for name in flag.tests))
        yield CAUTIONS["suspect"].format(tests=named(tests, "test"))


# ---- the answer ------------------------------------------------------------------------------------------------------


def answer(
    fit: Identification,
    ranking: Ranking | None = None,
    *,
    asked: Sequence[KeyFigure] = (),
    quality: DataQuality | None = None,
    searched: Sequence[str] = (),
    **page: Any,
) -> Answer:
    """Headline, equations, values, key figures, cautions and what to do next, of the best law of a ranking if given.

    asked : what forecasts say. quality : of the data. searched : names of laws that a search of laws tried. page :
    picture and files.
    """
    symbols = symbols_of(fit.law)
    remarks = [] if ranking is None else [f"left out: {law}: {why}" for law, why in ranking.failed.items()]
    remarks += [] if ranking is None or len(ranking.laws) < 2 else [chosen_text(ranking), same_functions(ranking)]
    remarks += [fit.sparsity.verdict] if fit.sparsity is not None else []
    figures, n = key_figures(fit), fit.values.get("n", math.nan)
    exponent = next((one.value for one in figures if one.name.endswith("stress exponent")), math.nan)
    other = "; n is not the stress exponent" * (abs(n - exponent) > OTHER_EXPONENT * exponent)
    figures = [*asked[:MOST_ASKED], *figures]
    return Answer(
        fit.headline,
        tests_text(fit),
        titled_law(fit.law),
        equations(fit.law),
        [(symbols[e.name], *_shown_value(fit.law, e), unit_text(e.unit)) for e in fit.estimates],
        [(one.name, one.where, one.text, one.remark) for one in figures],
        cautions(fit, ranking, quality)[:MOST_CAUTIONS],
        next_step(fit, ranking, searched),
        remarks,
        brackets=BRACKETS * any("[" in one.text for one in figures),
        role=headline_role(fit),
        units=f"{Answer.units}{other}",
        **page,
    )


def answer_text(
    fit: Identification, ranking: Ranking | None = None, more: object = ".details()", searched: Sequence[str] = ()
) -> str:
    """The answer of one law, or of the best of a ranking with the weights of all; more : what shows the rest."""
    return as_text([answer(fit, ranking, more=str(more), searched=searched)])


def table_of_groups(groups: Mapping[str, tuple[Identification, bool | None]]) -> Table:
    """The law, stress exponent and creep rate of each alloy of several, and what its tests say of the law.

    groups : {name: (best law, whether its choice is decisive, None where it was not one)}.
    """
    rows: list[Sequence[Cell]] = []
    for name, (fit, decisive) in groups.items():
        figures = {one.name.removeprefix("measured "): one.text for one in key_figures(fit)}
        choice = {None: "", True: ", decisive", False: ", not decisive"}[decisive]
        rate, stress = figures.get("creep rate", "–").replace(" %/h", ""), number(fit.tested_point.stress, 3)
        numbers = (figures.get("stress exponent", "–"), rate, stress)
        rows.append((name, titled_law(fit.law), *numbers, f"{verdict_text(fit.adequacy)}{choice}"))
    columns = ("material", "best law", "stress exponent", "creep rate, %/h", "at MPa", "by the noise of the tests")
    caption = "in brackets: 95 % intervals; of a law that the tests reject the measured stress exponent, and no rate"
    return Table(caption, columns, rows)


def chosen_text(ranking: Ranking) -> str:
    """Whether the choice of the law is decisive, and the weights of the laws; cautions say why one is not."""
    laws = [one for one in ranking.laws if not one.same_as]
    known = [f"{one.fit.law.name} {one.weight:.2f}" for one in laws[:MOST_NAMED] if one.weight >= LEAST_WEIGHT]
    more = len(laws) - len(known)
    others = f"; {plural(more, 'other')} below {LEAST_WEIGHT:g}" if more else ""
    weights = f"weights: {', '.join(known)}{others}"
    if len(known) == 1:
        weights = f"weight {laws[0].weight:.2f} among {plural(len(laws), 'law')}"
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
    fewest = FEWEST_DIGITS - (estimate.verdict in (NOT_DETERMINED, POORLY_DETERMINED))
    digits = min(interval_digits(estimate.value, estimate.low, estimate.high, fewest=fewest), MOST_SHOWN)
    said = NOT_DETERMINED if estimate.verdict == NOT_DETERMINED else f"= {number(estimate.value, digits)}"
    return said, interval_ends(law, estimate, digits)


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


def rate_exponent_and_energy(fit: Identification) -> tuple[tuple[float, ...], ...]:
    """Creep rate, 1/s, stress exponent and activation energy, J/mol, amid the tests: of bars at the reference strain.

    (value, low, high) each. Where the law has no more than stress, temperature and time, or no bar can be followed,
    those of the formula.
    """
    state = _state(fit)
    if state is not None:
        return state.rate, state.exponent, state.energy
    stress = fit.tested_point.stress
    rate, exponent = fit.rate(stress, warn=False), fit.local_exponent(stress, warn=False)
    return tuple(map(float, rate)), tuple(map(float, exponent)), fit.activation_energy()


def _state(fit: Identification) -> StateAtStrain | None:
    return state_at_strain(fit) if depends_on_history(fit.law) and not rate_of_time(fit.law) else None


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
    """Where the rate amid the tests is taken, and the exponent of the law's formula where that is another."""
    r, state, held = fit.tested_point, _state(fit), held_quantities(fit)
    lines = []
    if state is not None:
        hours = interval_text(tuple(v / SECONDS_PER_HOUR for v in state.time))
        at = f"{number(r.stress)} MPa and {celsius_text(r.temperature, digits=0)}"
        lines.append(f"a bar under a true stress of {at} reaches {100 * r.strain:.2g} % strain after {hours} h")
    if held and (held != "strain" or state is None):
        formula = interval_text(tuple(map(float, fit.local_exponent(r.stress, warn=False))))
        lines.append(f"at constant {held} the law's formula has the stress exponent {formula}")
        lines += [] if held == "strain" else ["tests compared at one strain show another exponent"]
    return lines


def interval_text(values: Sequence[float], unit: str = "") -> str:
    """A value with its unit and the ends of its interval, all with the digits in which they differ.

    The value alone where an end is not known; an end that is infinite in words.
    """
    known = not (any(map(math.isnan, values[1:])) or math.isinf(values[1]))
    behind = f" {unit}" if unit and not math.isinf(values[0]) else ""
    digits = interval_digits(*values) if known else 2
    value, *ends = (_written_out(v, digits) if not math.isinf(v) else BEYOND.get(unit, "no limit") for v in values)
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
    return CONSTANT_LOAD.format(growth=growth)
