"""Candidate laws that suit tests: by what their curves show, how many stresses they have, and what else they state.

A law that cannot describe a test is no candidate: curves whose rate falls ask for primary creep, those whose rate rises
for damage, tests over a range of stresses for an exponent that changes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from scipy import stats

from creepkit.arrays import Floats
from creepkit.checked_arguments import checked
from creepkit.errors import FitError, LawError
from creepkit.inverse.compared_tests import testable_laws
from creepkit.inverse.minimum_rates import apparent_exponent, measured_minimum_rate
from creepkit.inverse.reference_conditions import (
    ISOTHERMAL_RANGE,
    reference_condition,
    reference_stresses,
    reference_temperature,
)
from creepkit.language import CreepLaw
from creepkit.quality.curve_shapes import (
    falls_logarithmically,
    shows_primary_creep,
    shows_recovery,
    shows_tertiary_creep,
)
from creepkit.records import History, growing_output, is_logarithmic
from creepkit.registry import default_registry

SHARE = 0.3
"""Of the tests with curves that show primary or tertiary creep, from which on laws with it are candidates."""


FEWEST_STRESSES, STRESS_RATIO = 3, 1.5
"""Levels of stress, and the largest over the smallest, from which on an exponent that changes can be told."""


THRESHOLDS, CHANCE = np.linspace(0.0, 0.96, 25), 0.05
"""Threshold stresses that are tried, of the least stress; how probable by chance a better fit may be: a law too many
costs a fit, one too few the answer."""


USUAL_EXPONENT = 5.0
"""Of stress, of metals that creep by climb of dislocations."""


FEWEST_RUPTURES = 4
"""Of tests without curves, from which damage can be identified beside minimum rates."""


@checked
def candidates(histories: Sequence[History]) -> list[CreepLaw]:
    """Laws that suit tests, the simplest first; those of plugins that are not installed are left out.

    Laws of steady creep are Norton's and, where three stresses or more differ by half, Garofalo's sine, and where
    minimum rates prefer them a threshold stress, constant or linear in temperature, or a sum of two powers, each with
    an activation energy; with primary creep where a third of the curves show it, with and without where a third relax,
    and logarithmic creep where a third of them go with ln t, else beside hardening by strain and by time. Where a third
    of the curves show tertiary creep, more than loss of section under a constant load explains, or where a table states
    rupture times, laws with damage are added; where a bar is reversed, or creeps backwards once its stress has fallen,
    one with a back stress.
    """
    return list(named_candidates(histories).values())


def named_candidates(histories: Sequence[History]) -> dict[str, CreepLaw]:
    """{name by which ck.law() makes it: law} of the candidates; temperatures in it refer to the middle of the tests."""
    tests = [h for h in histories if h.outputs or h.minimum_rate is not None]
    if not tests:
        raise FitError("none of the tests has a curve or a minimum creep rate, from which a law could be identified")
    curves, several = [h for h in tests if h.outputs], _several_stresses(tests)
    strained = [h for h in curves if is_logarithmic(growing_output(h))]
    steady = ["norton", *(["hyperbolic-sine", *laws_of_changing_exponent(tests)] if several else [])]
    if 2 * len(curves) < len(tests):
        ruptures = sum(h.rupture_time is not None for h in tests if not h.outputs) >= FEWEST_RUPTURES
        names = [*steady, *(["kachanov-rabotnov", *(["sinh-damage"] if several else [])] if ruptures else [])]
    elif _share(curves, partial(shows_tertiary_creep, exponent=measured_exponent(tests))) > SHARE:
        names = [*steady[:1], *steady[2:], "mpc-omega", "kachanov-rabotnov", *(["sinh-damage"] if several else [])]
    elif _share(curves, _relaxes) > SHARE:
        names = [*steady, *(f"{name}*primary" for name in steady), "strain-hardening", "time-hardening"]
    elif _share(strained, shows_primary_creep) > SHARE:
        exhaustion = ["logarithmic"] * (_share(strained, falls_logarithmically) > SHARE)
        names = [*(f"{name}*primary" for name in steady), "strain-hardening", "time-hardening", *exhaustion]
    else:
        names = ["norton", "strain-hardening", "time-hardening", *steady[1:]]
    names += ["armstrong-frederick"] * any(map(_remembers_direction, curves))
    named = {name: law for name in names if (law := _law(name)) is not None}
    laws = list(named.values())
    kept = [law.fingerprint for law in testable_laws(laws, tests) or laws[:1]]
    return {name: law for name, law in named.items() if law.fingerprint in kept}


def _several_stresses(tests: Sequence[History]) -> bool:
    stresses = sorted({round(float(v), 6) for h in tests for v in _stresses(h) if v > 0})
    distinct = [s for k, s in enumerate(stresses) if k == 0 or s > 1.02 * stresses[k - 1]]
    return len(distinct) >= FEWEST_STRESSES and distinct[-1] >= STRESS_RATIO * distinct[0]


def _measured_rates(tests: Sequence[History]) -> Floats:
    """(3, tests) stress, MPa, temperature, K, and minimum rate, 1/s, of the tests that show one."""
    known = [h for h in tests if h.loading.quantity == "stress" and (h.outputs or h.minimum_rate is not None)]
    points = np.array([(*reference_condition(h), measured_minimum_rate(h)) for h in known]).reshape(-1, 3)
    return np.asarray(points[np.isfinite(points).all(axis=1)].T)


def measured_exponent(tests: Sequence[History]) -> float:
    """Stress exponent of the minimum rates of tests; USUAL_EXPONENT where they do not show it."""
    stress, temperature, rate = _measured_rates(tests)
    exponent = apparent_exponent(stress, rate, temperature)[0] if stress.size > 1 else np.nan
    return max(exponent, 0.0) if np.isfinite(exponent) else USUAL_EXPONENT


def laws_of_changing_exponent(tests: Sequence[History]) -> list[str]:
    """Names of the laws that minimum rates prefer to Norton's, as ln rate over ln stress bends up or down."""
    stress, temperature, rate = _measured_rates(tests)
    if stress.size == 0:
        return []
    several = float(np.ptp(temperature)) > ISOTHERMAL_RANGE
    if _exponent_rises(stress, temperature, rate):
        return ["double-power" if several else "norton+norton"]
    return threshold_laws(stress, temperature, rate, f"{reference_temperature(tests):g}")


def _exponent_rises(stress: Floats, temperature: Floats, rate: Floats) -> bool:
    """Whether ln rate is quadratic in ln stress with a positive coefficient, the exponent at each temperature free.

    At one temperature a sum of powers bends up only; an exponent that goes with 1/T alone does not.
    """
    x, inverse = np.log(stress / stress.mean()), temperature.mean() / temperature - 1.0
    several = float(np.ptp(temperature)) > ISOTHERMAL_RANGE
    columns = np.column_stack([x**2, np.ones_like(x), x, *([inverse, x * inverse] if several else [])])
    freedom = len(x) - columns.shape[1]
    if freedom < 2 or np.linalg.matrix_rank(columns) < columns.shape[1]:
        return False
    coefficients = np.linalg.lstsq(columns, np.log(rate))[0]
    variance = float(((np.log(rate) - columns @ coefficients) ** 2).sum()) / freedom
    sd = (variance * np.linalg.inv(columns.T @ columns)[0, 0]) ** 0.5
    return bool(stats.t.sf(coefficients[0] / max(sd, 1e-12), freedom) < CHANCE)


def threshold_laws(stress: Floats, temperature: Floats, rate: Floats, T_ref: str) -> list[str]:
    """Names of the laws above a threshold stress that minimum rates prefer to Norton's by an F test.

    stress, temperature, rate : (tests,) MPa, K, 1/s.

    ln rate = a + n ln(s - s_0) - Q/(R T) is fitted to them with s_0 of a grid, constant or falling as the temperature
    rises. One that follows the stresses down bends ln rate over ln stress at each temperature alone, and shows as an
    activation energy that depends on stress.
    """
    rise, names = temperature - temperature.min(), list[str]()
    several, share = rise.max() > ISOTHERMAL_RANGE, rise / max(rise.max(), 1.0)
    levels = (share >= 0.0, rise < ISOTHERMAL_RANGE, rise > rise.max() - ISOTHERMAL_RANGE)
    all_least, coldest, hottest = (THRESHOLDS * stress[level].min() for level in levels)
    squares = _least_squares(stress, temperature, rate, [0.0 * stress])
    for ends, further, name in (
        ([(s_0, s_0) for s_0 in all_least], 1, "threshold-stress"),
        (
            [(first, last) for first in coldest for last in hottest if several and last < first], 2,
            f"threshold-stress[s_0:linear({T_ref})]*arrhenius({T_ref})",
        ),
    ):  # fmt: skip
        found = _least_squares(stress, temperature, rate, [first + (last - first) * share for first, last in ends])
        more, freedom = further - len(names), stress.size - 2 - several - further
        if freedom < 2 or not 0.0 < found < squares:
            continue
        if stats.f.sf((squares - found) / more / (found / freedom), more, freedom) < CHANCE:
            names, squares = [*names, name], found
    return names


def _least_squares(stress: Floats, temperature: Floats, rate: Floats, thresholds: Sequence[Floats]) -> float:
    """The least sum of squares of ln rate (tests,) with n and Q free, over thresholds (tests,) below the stresses."""
    sums = [np.inf]
    for above in (stress - threshold for threshold in thresholds):
        if np.all(above > 0):
            columns = np.column_stack([np.ones_like(stress), np.log(above), temperature.mean() / temperature])
            sums.append(float(((columns @ np.linalg.lstsq(columns, np.log(rate))[0] - np.log(rate)) ** 2).sum()))
    return min(sums)


def _stresses(history: History) -> list[float]:
    try:
        return [float(v) for v in reference_stresses(history)]
    except FitError:  # nothing says which stress its load makes
        return [float(abs(history.loading.program().values).max())]


def _relaxes(history: History) -> bool:
    """Whether strain is held: such a curve does not show whether its first fall is primary creep."""
    return history.loading.quantity == "strain"


def _remembers_direction(history: History) -> bool:
    """Whether a bar is reversed, or recovers: what a law without a back stress does not tell from other loads."""
    if history.loading.quantity not in {"stress", "strain"}:
        return False
    values = history.loading.program().values
    return bool(values.min() < 0.0 < values.max()) or shows_recovery(history)


def _share(tests: Sequence[History], shows: Callable[[History], bool]) -> float:
    return sum(map(shows, tests)) / len(tests) if tests else 0.0


def _law(name: str) -> CreepLaw | None:
    try:
        return default_registry().law(name)
    except LawError:
        return None
