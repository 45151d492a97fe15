"""Post-assessment checks of a rupture assessment, as the European Creep Collaborative Committee (ECCC) asks for them.

ECCC Recommendations, Volume 5, Part I (Holdsworth et al., first 1996), with PD 6605 (1998) beside them, name three
groups:

1. physical realism: isotherms fit the tests by eye (a plot), do not cross, come together or turn back between 10 h and
   1e6 h at stresses from 0.8 of the lowest tested, and -d log t / d log s is at least 1.5 there;
2. effectiveness within the tests: of log t* (predicted) over log t, for all tests and for each main temperature, at
   most 1.5 % of the tests lie beyond 2.5 standard deviations of the residuals, and the mean line has a slope of 0.78 to
   1.22 and stays within a factor of 2 from 100 h to 100,000 h (here: over the range of the tests, where that is
   shorter);
3. repeatability: without a random half of the tests that lasted longer than a tenth of the longest, and without the
   tenth of the tests at the lowest stresses of each main temperature, the strength at the longest time changes by at
   most 10 %.

The figures are as they are commonly quoted: no copy of the recommendations was at hand to compare them with. Here the
longest time is that asked for (ECCC: 300,000 h), the stresses of group 1 start at 0.8 of the lowest tested or at the
strength at the longest time, whichever is lower, and the main temperatures have a tenth of the tests each, or
are the lowest and the highest. Of few tests one may always lie beyond 2.5 standard deviations. Run-outs are left out of
group 2, since their rupture times are not known.

Beside these groups it is asked whether tests of one product form, or of another label, last as long as the others.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.stats import chi2, norm

from creepkit.arrays import Bools, Floats
from creepkit.errors import CreepkitError
from creepkit.inverse.rate_explanations import are_numbers
from creepkit.inverse.reference_conditions import ISOTHERMAL_RANGE
from creepkit.records.units import celsius_text
from creepkit.rupture_assessment.methods import METHODS, Conditions
from creepkit.rupture_assessment.observed_tests import GROUP_LABELS, RuptureTests, TensileStrength
from creepkit.rupture_assessment.rupture_fit import RuptureFit, power_of_ten

MOST_KINDS, FEWEST_OF_KIND, LEAST_P_OF_KINDS = 5, 4, 0.01
"""Values of a label that tell populations of tests apart, tests that broke of each, and by how rare a chance."""

LEAST_SLOPE = 1.5
"""-d log t / d log s."""

SLOPE_RANGE = (0.78, 1.22)
BAND_FACTOR = 2.0
BAND_HOURS = (100.0, 100_000.0)
OUTSIDE_SHARE, OUTSIDE_DEVIATIONS = 0.015, 2.5
LARGEST_CHANGE = 0.1
CULLED_SHARE, CULLED_LONG, LOW_STRESS_SHARE = 0.5, 0.1, 0.1
MAIN_SHARE = 0.1
"""Of the tests: from it on a temperature counts as a main one."""

LOWEST_CHECKED = 0.8
"""Of the lowest stress tested."""

ISOTHERM_STEP = 25.0
"""K between isotherms that are checked for crossing."""

CHECKED_HOURS = (10.0, 1e6)
STRESS_POINTS = 61
LEAST_ISOTHERM = 5
"""Tests from which a temperature has a line of its own fitted in group 2."""


@dataclass(frozen=True)
class AssessmentCheck:
    """One check: name, whether it passed (None where it cannot be made), and what was found against what is allowed.

    fault : what is wrong where it does not pass, in words that stand alone; "" where the name and `found` say it.
    """

    name: str
    passed: bool | None
    found: str
    fault: str = ""


def turning(fit: RuptureFit, tests: RuptureTests, tensile: TensileStrength) -> str:
    """Where the time does not fall with stress within the stresses tested at a temperature; "" where it does."""
    for T in tests.isotherms:
        near = np.abs(tests.temperature - T) <= ISOTHERMAL_RANGE
        low, high = float(tests.stress[near].min()), float(tests.stress[near].max())
        stress = np.geomspace(low, 1.0001 * high, STRESS_POINTS)
        times = fit.location(Conditions.isotherm(stress, T, tensile))
        rising = np.flatnonzero(~(np.diff(times) < 0))
        if rising.size:
            return f"the time rises with stress at {celsius_text(T)}, {stress[rising[0]]:.3g} MPa, within the tests"
    return ""


def physical_realism(
    fit: RuptureFit, tests: RuptureTests, tensile: TensileStrength, lowest_strength: float | None
) -> list[AssessmentCheck]:
    """Group 1: isotherms fall, keep their order, and are not too flat in log-log coordinates.

    lowest_strength : MPa, the least that the assessment states.
    """
    lowest = LOWEST_CHECKED * float(tests.stress.min())
    if lowest_strength is not None:
        lowest = min(lowest, lowest_strength)
    stress = np.geomspace(lowest, float(tests.stress.max()), STRESS_POINTS)
    low, high = float(tests.temperature.min()), float(tests.temperature.max())
    thermal = METHODS[fit.method].thermal and high > low
    T = (
        np.arange(low - ISOTHERM_STEP, high + ISOTHERM_STEP + 1.0, ISOTHERM_STEP)
        if thermal
        else np.array([0.5 * (low + high)])
    )
    known = np.isfinite(tensile(T)) if METHODS[fit.method].needs == "tensile_strength" else np.ones(T.size, bool)
    T = T[known]
    times = np.array([fit.location(Conditions.isotherm(stress, float(t), tensile)) for t in T])
    inside = (times >= np.log10(CHECKED_HOURS[0])) & (times <= np.log10(CHECKED_HOURS[1]))
    slopes = -np.diff(times, axis=1) / np.diff(np.log10(stress))
    slopes = np.where(inside[:, 1:] & inside[:, :-1], slopes, np.inf)
    least, where = _least(slopes, T, stress)
    found = f"the least -d log t / d log s is {least:.2f}, at {where}"
    checks = [
        AssessmentCheck("isotherms do not turn back", least > 0, f"{found} (allowed: above 0)", "isotherms turn back"),
        AssessmentCheck(
            "isotherms are steep enough",
            least >= LEAST_SLOPE,
            f"{found} (allowed: {LEAST_SLOPE} and more)",
            "isotherms are too flat",
        ),
    ]
    if T.size > 1:
        gap, where = _least(np.where(inside[1:] & inside[:-1], times[:-1] - times[1:], np.inf), T, stress)
        text = f"a step of {ISOTHERM_STEP:g} K shortens the time by a factor of at least {power_of_ten(gap):.3g}"
        checks.append(AssessmentCheck("isotherms do not cross", gap > 0, f"{text}, at {where}", "isotherms cross"))
    return checks


def _least(values: Floats, temperatures: Floats, stress: Floats) -> tuple[float, str]:
    """The least of values (temperatures, points), and where; temperatures : K. stress : (points and more,) MPa."""
    row, column = np.unravel_index(int(np.argmin(values)), values.shape)
    return float(values[row, column]), f"{celsius_text(float(temperatures[row]))}, {stress[column]:.3g} MPa"


def effectiveness(fit: RuptureFit, tests: RuptureTests, at: Conditions) -> list[AssessmentCheck]:
    """Group 2: predicted against measured times, of all tests and at each main temperature."""
    predicted, broken = fit.location(at), ~tests.censored
    checks = [_predicted_against_measured("all tests", predicted[broken], tests.log_time[broken])]
    for T, near in main_isotherms(tests):
        chosen = near & broken
        if len(tests.isotherms) > 1 and chosen.sum() >= LEAST_ISOTHERM and np.ptp(tests.log_time[chosen]) > 0.3:
            checks.append(_predicted_against_measured(celsius_text(T), predicted[chosen], tests.log_time[chosen]))
    return checks


def populations(
    fit: RuptureFit, tests: RuptureTests, at: Conditions, labels: Sequence[Mapping[str, str]]
) -> list[AssessmentCheck]:
    """Whether tests of each value of a label, such as a product form, last as long as the others.

    By the ratio of likelihoods of a factor on the times of each value, run-outs as such; heats and laboratories are
    effects of the fit. labels : of each test.
    """
    residuals = tests.log_time - fit.location(at)
    scale = float(np.sqrt(fit.scale**2 + sum(s**2 for s in fit.scatter.values())))

    def best(those: Bools) -> tuple[float, float]:
        """log10 of the most likely factor on the times of some tests, and ln of its likelihood."""
        broken, running = residuals[those & ~tests.censored], residuals[those & tests.censored]

        def cost(shift: float) -> float:
            return -float(norm.logpdf((broken - shift) / scale).sum() + norm.logsf((running - shift) / scale).sum())

        return (found := minimize_scalar(cost, bounds=(-3.0, 3.0), method="bounded")).x, -found.fun

    checks = []
    for name in sorted(set.intersection(*map(set, labels)) - {"assumed", *GROUP_LABELS}):
        values = np.array([one[name] for one in labels])
        if are_numbers(name, map(str, values)):
            continue
        masks = {str(kind): values == kind for kind in np.unique(values)}
        if (
            not 1 < len(masks) <= MOST_KINDS
            or min((m & ~tests.censored).sum() for m in masks.values()) < FEWEST_OF_KIND
        ):
            continue
        apart = {kind: best(mask) for kind, mask in masks.items()}
        gain = sum(likelihood for _, likelihood in apart.values()) - best(np.ones(len(tests), bool))[1]
        p_value, kind = float(chi2.sf(2.0 * gain, len(masks) - 1)), min(apart, key=lambda one: apart[one][0])
        factor = power_of_ten(apart[kind][0] - best(~masks[kind])[0])
        found = f"p = {p_value:.2g} (allowed: from {LEAST_P_OF_KINDS})"
        fault = f"tests of {name} '{kind}' last {factor:.2g} times as long as others (add --only '{name}={kind}')"
        checks.append(AssessmentCheck(f"{name} makes no difference", p_value >= LEAST_P_OF_KINDS, found, fault))
    return checks


def _predicted_against_measured(name: str, predicted: Floats, measured: Floats) -> AssessmentCheck:
    title = f"predicted against measured, {name}"
    if measured.size < LEAST_ISOTHERM or np.ptp(measured) < 1e-6:
        return AssessmentCheck(title, None, f"{measured.size} tests that broke are too few")
    slope, constant = np.polyfit(measured, predicted, 1)
    deviation = float(np.std(predicted - measured, ddof=1))
    outside = int((np.abs(predicted - measured) > OUTSIDE_DEVIATIONS * deviation).sum())
    ends = np.clip(np.log10(BAND_HOURS), measured.min(), measured.max())
    departure = power_of_ten(float(np.abs(constant + (slope - 1.0) * ends).max()))
    passed = (
        SLOPE_RANGE[0] <= slope <= SLOPE_RANGE[1]
        and departure <= BAND_FACTOR
        and outside <= max(OUTSIDE_SHARE * measured.size, 1)
    )
    found = (
        f"slope {slope:.2f} (allowed: {SLOPE_RANGE[0]} to {SLOPE_RANGE[1]}), mean line within a factor {departure:.2f} "
        f"(2), {outside} of {measured.size} beyond {OUTSIDE_DEVIATIONS} standard deviations (1.5 %, or one)"
    )
    return AssessmentCheck(title, bool(passed), found, f"predicted times depart from measured ones, {name}")


def main_isotherms(tests: RuptureTests) -> list[tuple[float, Bools]]:
    """Temperatures with a tenth of the tests each, the lowest and the highest; and which tests are at it, (tests,)."""
    isotherms = tests.isotherms
    near = [np.abs(tests.temperature - T) <= ISOTHERMAL_RANGE for T in isotherms]
    kept = [k for k, n in enumerate(near) if n.mean() >= MAIN_SHARE or k in (0, len(isotherms) - 1)]
    return [(isotherms[k], near[k]) for k in kept]


Strengths = Callable[[RuptureTests], Sequence[float | None]]
"""Strengths at the longest time, one for each temperature asked for, of the method fitted to other tests."""


def repeatability(
    tests: RuptureTests, original: Sequence[float | None], strengths: Strengths, *, hours: float, seed: int
) -> list[AssessmentCheck]:
    """Group 3: the method is fitted anew without some of the tests."""
    longest = float(tests.log_time.max())
    long = np.flatnonzero(tests.log_time > longest + np.log10(CULLED_LONG))
    rng = np.random.default_rng(seed)
    half = rng.choice(long, size=max(int(CULLED_SHARE * long.size), 1), replace=False)
    low = [
        places[np.argsort(tests.stress[places], kind="stable")[: int(np.ceil(LOW_STRESS_SHARE * places.size))]]
        for _, near in main_isotherms(tests)
        if (places := np.flatnonzero(near)).size
    ]
    culled = {
        f"without a random half of the tests beyond {10 ** (longest - 1):.3g} h": half,
        "without a tenth of the tests, those at the lowest stresses": np.concatenate(low),
    }
    return [_changed(name, tests, places, original, strengths, hours) for name, places in culled.items()]


def _changed(
    name: str, tests: RuptureTests, places: Floats, original: Sequence[float | None], strengths: Strengths, hours: float
) -> AssessmentCheck:
    kept = np.ones(len(tests), bool)
    kept[np.asarray(places, int)] = False
    try:
        repeated = strengths(tests[kept])
    except CreepkitError as error:
        return AssessmentCheck(name, None, f"the other {int(kept.sum())} tests cannot be assessed: {error}")
    if any(a is None or b is None for a, b in zip(original, repeated, strict=True)):
        lost = any(a is not None and b is None for a, b in zip(original, repeated, strict=True))
        text = "there is nothing to compare"
        return AssessmentCheck(name, False if lost else None, text, f"no strength at {hours:g} h is left {name}")
    if not original:
        return AssessmentCheck(name, None, "no strength can be stated at the temperatures asked for")
    changes = [b / a - 1.0 for a, b in zip(original, repeated, strict=True) if a is not None and b is not None]
    largest = max(changes, key=abs)
    text = f"the strength at {hours:.3g} h changes by up to {100 * largest:+.1f} % ({len(places)} tests less)"
    fault = f"the strength changes by more than 10 % {name}"
    return AssessmentCheck(name, abs(largest) <= LARGEST_CHANGE, f"{text}; allowed: 10 %", fault)
