"""Which rupture times a law is compared with: those that it has a mechanism for.

A law whose rate does not rise along a test at constant stress has no tertiary creep of its own. Under a constant load
it breaks by loss of section alone, when the strain diverges (Hoff 1953): after 1 / (n rate) for a power law. Measured
tests break before, by damage, as a rule at a product of minimum rate and rupture time several times smaller. Rupture
times would then move the rates of such a law by that factor, and nothing in a table without curves would resist. Curves
that were followed to rupture do: their readings outweigh their end.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import sympy
from scipy.stats import qmc

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.settings import IdentificationSettings
from creepkit.language import CreepLaw, strain, time
from creepkit.language.symbols import POINT_VARIABLES
from creepkit.records import History

SAMPLES = 256
"""Points of a law's bounds and of tests at which its rate is differentiated."""

POINT_RANGES = {
    **{"stress": (10.0, 500.0), "strain": (1e-4, 0.2), "time": (1e3, 1e8), "temperature": (600.0, 1400.0)},
    **{"principal_stress": (10.0, 500.0), "mean_stress": (3.0, 200.0)},
}
"""MPa, -, s and K, sampled in the logarithm."""

MOST_NAMED = 4
"""Tests left out that a note names."""

LEAST_INCREASE = 1e-6
"""Relative rise of a rate per relative rise of strain or time (or per unit of an internal variable): above rounding."""


@lru_cache(maxsize=256)
def has_tertiary_creep(law: CreepLaw) -> bool:
    """Whether the rate of some term can rise along a test at constant stress, by strain, time or internal variables.

    It is differentiated at points within the bounds of the parameters.
    """
    symbols = [*law.params, *law.states, *POINT_VARIABLES]
    points = _sampled_points(law)
    for term in law.terms.values():
        rises = [strain * term.diff(strain) / term, time * term.diff(time) / term]
        rises += [term.diff(z) * state.rate / term for z, state in law.states.items()]
        for rise in rises:
            if rise == 0:
                continue
            with np.errstate(all="ignore"):
                values = np.asarray(sympy.lambdify(symbols, rise, "numpy")(*points), float)
            if (np.isfinite(values) & (values > LEAST_INCREASE)).any():
                return True
    return False


def _sampled_points(law: CreepLaw) -> Floats:
    """(symbols, samples) of parameters in their bounds, internal variables up to their limits, and states of a test."""
    ranges, logarithmic = [], []
    for param in law.table.values():
        ranges.append(param.bounds)
        logarithmic.append(param.scale == "log")
    for state in law.states.values():
        limit = state.initial + 1.0 if state.limit is None else state.limit
        ranges.append((state.initial + 0.01 * (limit - state.initial), state.initial + 0.9 * (limit - state.initial)))
        logarithmic.append(False)
    for symbol in POINT_VARIABLES:
        ranges.append(POINT_RANGES.get(symbol.name, (10.0, 500.0)))
        logarithmic.append(True)
    shares = qmc.Sobol(len(ranges), seed=0).random(SAMPLES)
    low, high = np.array(ranges).T
    logs = np.array(logarithmic)
    ends = [np.where(logs, np.log(np.where(logs, end, 1.0)), end) for end in (low, high)]
    values = ends[0] + shares * (ends[1] - ends[0])
    return np.asarray(np.where(logs, np.exp(np.where(logs, values, 0.0)), values).T)


@dataclass(frozen=True)
class ComparedTests:
    """The tests that a law is identified from.

    histories : of them. rupture_times : whether the ends of tests without curves are compared with the law.
    notes : what was left out and why, in sentences.
    """

    histories: tuple[History, ...]
    rupture_times: bool
    notes: tuple[str, ...] = ()


def compares_rupture_times(law: CreepLaw, settings: IdentificationSettings) -> bool:
    """Whether ends of tests without curves are compared with a law, as settings say."""
    return settings.rupture_times == "use" or (settings.rupture_times == "auto" and has_tertiary_creep(law))


def compared_tests(law: CreepLaw, histories: Sequence[History], settings: IdentificationSettings) -> ComparedTests:
    """The tests without those that say nothing but an end that is not compared with the law.

    A test that states nothing at all is left out where there are others. FitError where no other is left.
    """
    silent = [h for h in histories if not h.outputs and h.minimum_rate is None and not h.end_known]
    if silent and len(silent) < len(histories):
        rest = compared_tests(law, [h for h in histories if not any(h is one for one in silent)], settings)
        note = f"left out, for they state neither readings, nor a minimum rate, nor an end: {_named(silent)}"
        return replace(rest, notes=(*rest.notes, note))
    if compares_rupture_times(law, settings):
        return ComparedTests(tuple(histories), True)
    ends = [h for h in histories if not h.outputs and h.end_known]
    if not ends:
        return ComparedTests(tuple(histories), False)
    out = [h for h in ends if h.minimum_rate is None]
    kept = tuple(h for h in histories if not any(h is one for one in out))
    if not kept:
        raise FitError(
            f"law '{law.name}' has no tertiary creep, so that it breaks by loss of section alone, and these tests "
            "state nothing but their ends: its rates would follow from rupture times of damage; take a law with "
            "damage, such as kachanov-rabotnov, or ask for it by rupture_times='use'"
        )
    why = (
        "this law has no tertiary creep and breaks by loss of section alone (rupture_times='use' compares them)"
        if not has_tertiary_creep(law)
        else "rupture_times is 'ignore'"
    )
    count = f"{len(ends)} test{'s' if len(ends) > 1 else ''} without curves"
    note = f"the ends of {count} (rupture times and run-outs) were not used: {why}"
    if out:
        note += f"; left out, for they state nothing else: {_named(out)}"
    return ComparedTests(kept, False, (note,))


def _named(tests: Sequence[History]) -> str:
    more = f" and {len(tests) - MOST_NAMED} more" if len(tests) > MOST_NAMED else ""
    return ", ".join(f"'{h.name}'" for h in tests[:MOST_NAMED]) + more


def common_rupture_times(laws: Sequence[CreepLaw], settings: IdentificationSettings) -> IdentificationSettings:
    """Settings with which laws are compared from the same values: ends are used by all if some have tertiary creep."""
    if settings.rupture_times != "auto" or len(set(map(has_tertiary_creep, laws))) < 2:
        return settings
    return replace(settings, rupture_times="use")
