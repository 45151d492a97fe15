"""Candidate laws that suit tests: by what their curves show, how many stresses they have, and what else they state.

A law that cannot describe a test is no candidate: curves whose rate falls ask for primary creep, those whose rate rises
for damage, tests over a range of stresses for an exponent that changes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy import stats

from creepkit.checked_arguments import checked
from creepkit.errors import FitError, LawError
from creepkit.inverse.compared_tests import testable_laws
from creepkit.inverse.minimum_rates import measured_minimum_rate
from creepkit.inverse.reference_conditions import ISOTHERMAL_RANGE, reference_condition, reference_stresses
from creepkit.language import CreepLaw
from creepkit.quality.curve_shapes import shows_primary_creep, shows_tertiary_creep
from creepkit.records import History, growing_output, is_logarithmic
from creepkit.registry import default_registry

SHARE = 0.3
"""Of the tests with curves that show primary or tertiary creep, from which on laws with it are candidates."""


FEWEST_STRESSES, STRESS_RATIO = 3, 1.5
"""Levels of stress, and the largest over the smallest, from which on an exponent that changes can be told."""


FEWEST_RUPTURES = 4
"""Of tests without curves, from which damage can be identified beside minimum rates."""


@checked
def candidates(histories: Sequence[History]) -> list[CreepLaw]:
    """Laws that suit tests, the simplest first; those of plugins that are not installed are left out.

    Laws of steady creep are Norton's and, where three stresses or more differ by half, Garofalo's sine, or a threshold
    stress where the exponent falls as the stress rises; with primary creep where a third of the curves show it, with
    and without where a third relax, else beside hardening by strain and by time. Where a third of the curves show
    tertiary creep, or where a table states rupture times, laws with damage are added.
    """
    tests = [h for h in histories if h.outputs or h.minimum_rate is not None]
    if not tests:
        raise FitError("none of the tests has a curve or a minimum creep rate, from which a law could be identified")
    curves = [h for h in tests if h.outputs]
    several = _several_stresses(tests)
    steady = ["norton", *(["hyperbolic-sine"] if several else [])]
    if several and exponent_falls(tests):
        steady.append("threshold-stress")
    if 2 * len(curves) < len(tests):
        ruptures = sum(h.rupture_time is not None for h in tests if not h.outputs) >= FEWEST_RUPTURES
        names = [*steady, *(["kachanov-rabotnov", *(["sinh-damage"] if several else [])] if ruptures else [])]
    elif _share(curves, shows_tertiary_creep) > SHARE:
        names = [*steady[:1], *steady[2:], "mpc-omega", "kachanov-rabotnov", *(["sinh-damage"] if several else [])]
    elif _share(curves, _relaxes) > SHARE:
        names = [*steady, *(f"{name}*primary" for name in steady), "strain-hardening", "time-hardening"]
    elif _share(_strained(curves), shows_primary_creep) > SHARE:
        names = [*(f"{name}*primary" for name in steady), "strain-hardening", "time-hardening"]
    else:
        names = ["norton", "strain-hardening", "time-hardening", *steady[1:]]
    laws = [law for name in names if (law := _law(name)) is not None]
    return testable_laws(laws, tests) or laws[:1]


def _several_stresses(tests: Sequence[History]) -> bool:
    stresses = sorted({round(float(v), 6) for h in tests for v in _stresses(h) if v > 0})
    distinct = [s for k, s in enumerate(stresses) if k == 0 or s > 1.02 * stresses[k - 1]]
    return len(distinct) >= FEWEST_STRESSES and distinct[-1] >= STRESS_RATIO * distinct[0]


def exponent_falls(tests: Sequence[History]) -> bool:
    """Whether ln rate over ln stress bends down as the stress rises, more than its scatter explains (1 %, one side).

    A line with a quadratic term is fitted to minimum rates, with a level of each temperature; a threshold stress below
    the tests makes such a bend, an exponential dependence on stress the opposite one.
    """
    points = np.array(
        [(*reference_condition(h), measured_minimum_rate(h)) for h in tests if h.loading.quantity == "stress"]
    )
    stress, temperature, rate = points.reshape(-1, 3)[np.isfinite(points.reshape(-1, 3)).all(axis=1)].T
    x, levels = (
        np.log(stress / np.median(stress)) if stress.size else stress,
        np.unique(np.round(temperature / ISOTHERMAL_RANGE)),
    )
    columns = np.column_stack([*(np.round(temperature / ISOTHERMAL_RANGE) == level for level in levels), x, x**2])
    freedom = len(x) - columns.shape[1]
    if freedom < 2 or np.linalg.matrix_rank(columns) < columns.shape[1]:
        return False
    values, squares, *_ = np.linalg.lstsq(columns, np.log(rate), rcond=None)
    variance = float(squares[0]) / freedom * np.linalg.inv(columns.T @ columns)[-1, -1]
    return bool(values[-1] < -stats.t.ppf(0.99, freedom) * np.sqrt(variance))


def _stresses(history: History) -> list[float]:
    try:
        return [float(v) for v in reference_stresses(history)]
    except FitError:  # nothing says which stress its load makes
        return [float(abs(history.loading.program().values).max())]


def _relaxes(history: History) -> bool:
    """Whether strain is held: such a curve does not show whether its first fall is primary creep."""
    return history.loading.quantity == "strain"


def _strained(curves: Sequence[History]) -> list[History]:
    return [h for h in curves if is_logarithmic(growing_output(h))]


def _share(tests: Sequence[History], shows: Callable[[History], bool]) -> float:
    return sum(map(shows, tests)) / len(tests) if tests else 0.0


def _law(name: str) -> CreepLaw | None:
    try:
        return default_registry().law(name)
    except LawError:
        return None
