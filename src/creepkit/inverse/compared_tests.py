"""What a law is compared with: curves, minimum rates over a known duration, ends for which it has a mechanism.

A law whose rate does not rise along a test at constant stress has no tertiary creep of its own. Under a constant load
it breaks by loss of section alone, when the strain diverges (Hoff 1953): after 1 / (n rate) for a power law. Measured
tests break before, by damage, as a rule at a product of minimum rate and rupture time several times smaller. Rupture
times would then move the rates of such a law by that factor, and nothing in a table without curves would resist. Curves
that were followed to rupture do: their readings outweigh their end.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
import sympy
from scipy.stats import qmc

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.settings import IdentificationSettings
from creepkit.language import CreepLaw, strain, time
from creepkit.language.symbols import POINT_VARIABLES
from creepkit.records import UNKNOWN_DURATION, History

STRAIN_OF_UNKNOWN_DURATION = 0.05
"""Creep strain to which a test of unknown duration is followed, at its minimum rate: products of minimum rate and time
to rupture (Monkman and Grant 1956) lie mostly between 0.02 and 0.2."""

UNTESTABLE = (
    "no test has a curve: how the rate of this law falls with strain or time rests on the stated durations alone, at "
    "whose end its rate is taken for the minimum; its values and intervals, n and Q among them, are not tested by "
    "minimum rates and may exclude the true ones"
)
"""What is said of a law whose rates rest on durations."""

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
    """Whether the rate of some term can rise along a test at constant stress, by strain, time or internal variables."""
    plain = law.at(None, **{condition.name: 1.0 for condition in law.conditions})
    return any(_is_somewhere(rise, plain) for rise in _rises(plain, strain, time))


def _rises(law: CreepLaw, *variables: sympy.Symbol) -> Iterator[sympy.Expr]:
    """Relative rises of the terms by internal variables, and by ln of variables."""
    for term in law.terms.values():
        yield from (x * term.diff(x) / term for x in variables)
        yield from (term.diff(z) * state.rate / term for z, state in law.states.items())


def _is_somewhere(rise: sympy.Expr, law: CreepLaw) -> bool:
    """Whether a relative rise is above rounding at some of the points within the bounds of the parameters."""
    with np.errstate(all="ignore"):
        symbols = [*law.params, *law.states, *POINT_VARIABLES]
        values = np.asarray(sympy.lambdify(symbols, rise, "numpy")(*_sampled_points(law)), float)
    return bool((np.isfinite(values) & (values > LEAST_INCREASE)).any())


def _sampled_points(law: CreepLaw) -> Floats:
    """(symbols, samples) of parameters in their bounds, internal variables up to their limits, and states of a test."""
    ranges = [param.bounds for param in law.table.values()]
    for state in law.states.values():
        growth = 1.0 if state.limit is None else state.limit - state.initial
        ranges.append((state.initial + 0.01 * growth, state.initial + 0.9 * growth))
    ranges += [POINT_RANGES.get(symbol.name, (10.0, 500.0)) for symbol in POINT_VARIABLES]
    scales = (param.scale == "log" for param in law.table.values())
    logs = np.array([*scales, *(False for _ in law.states), *(True for _ in POINT_VARIABLES)])
    low, high = (np.where(logs, np.log(np.where(logs, end, 1.0)), end) for end in np.array(ranges).T)
    values = low + qmc.Sobol(len(ranges), seed=0).random(SAMPLES) * (high - low)
    return np.asarray(np.where(logs, np.exp(np.where(logs, values, 0.0)), values).T)


def compares_minimum_rate(history: History) -> bool:
    """Whether a test is compared by its minimum rate: it states one and has no frames, which would hold it already."""
    return history.minimum_rate is not None and not history.outputs


def followed_duration(history: History) -> float:
    """For how long a test lasted, s: to its rupture or last time, else to STRAIN_OF_UNKNOWN_DURATION at its rate."""
    if duration_known(history) or history.minimum_rate is None:
        return history.rupture_time or float(history.times[-1])
    return STRAIN_OF_UNKNOWN_DURATION / history.minimum_rate


def duration_known(history: History) -> bool:
    """Whether it is known how long a test lasted; of a minimum creep rate alone it is not."""
    if not compares_minimum_rate(history) or history.end_known:
        return True
    return float(history.times[-1]) > UNKNOWN_DURATION


@lru_cache(maxsize=256)
def needs_durations(law: CreepLaw) -> bool:
    """Whether the minimum rate of a law depends on how long the test lasted: it has a rate of strain or time.

    Or it falls with internal variables, as by transients that fade. Over a duration that is assumed from the measured
    rate such a law would predict that rate from itself.
    """
    return law.uses(strain) or law.uses(time) or any(_is_somewhere(-rise, law) for rise in _rises(law))


def rests_on_durations(law: CreepLaw, histories: Sequence[History]) -> bool:
    """Whether a hardening law is compared with minimum rates of tests without curves.

    Its rate falls with strain or time and has neither a minimum nor a steady state, so that its value at the end of
    each test, a time that damage decides, is compared with the rate.
    """
    rates_alone = any(map(compares_minimum_rate, histories)) and not any(h.outputs for h in histories)
    return rates_alone and needs_durations(law) and not has_tertiary_creep(law)


def testable_laws(laws: Sequence[CreepLaw], histories: Sequence[History]) -> list[CreepLaw]:
    """The laws that tests can judge: those whose rate needs no durations, or none that are unknown or untested.

    A back stress is told from hardening where the load of a bar falls or turns.
    """
    known, falls = all(map(duration_known, histories)), any(map(load_falls, histories))
    laws = [law for law in laws if falls or not law.back_stresses]
    return [law for law in laws if (known or not needs_durations(law)) and not rests_on_durations(law, histories)]


def load_falls(history: History) -> bool:
    """Whether the stress or the strain that a bar is given falls within its test."""
    loading = history.loading
    return loading.quantity in {"stress", "strain"} and bool((np.diff(loading.program().values) < 0.0).any())


def compares_rupture_times(law: CreepLaw, settings: IdentificationSettings) -> bool:
    """Whether ends of tests without curves are compared with a law, as settings say."""
    return settings.rupture_times == "use" or (settings.rupture_times == "auto" and has_tertiary_creep(law))


def compared_tests(
    law: CreepLaw, histories: Sequence[History], settings: IdentificationSettings
) -> tuple[tuple[History, ...], tuple[str, ...]]:
    """The tests that a law is identified from, and notes of those that were left out and why.

    Left out are tests that say nothing but an end that is not compared with the law, and tests that state nothing at
    all where there are others. FitError where no other is left.
    """
    known = [h for h in histories if h.outputs or h.minimum_rate is not None or h.end_known]
    notes = []
    if known and len(known) < len(histories):
        silent = [h for h in histories if not any(h is one for one in known)]
        notes = [f"left out, for they state neither readings, nor a minimum rate, nor an end: {_named(silent)}"]
        histories = known
    ends = [h for h in histories if not h.outputs and h.end_known]
    if compares_rupture_times(law, settings) or not ends:
        return tuple(histories), tuple(notes)
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
    others = f"; left out, for they state nothing else: {_named(out)}" if out else ""
    return kept, (f"the ends of {count} (rupture times and run-outs) were not used: {why}{others}", *notes)


def _named(tests: Sequence[History]) -> str:
    more = f" and {len(tests) - MOST_NAMED} more" if len(tests) > MOST_NAMED else ""
    return ", ".join(f"'{h.name}'" for h in tests[:MOST_NAMED]) + more


def common_rupture_times(laws: Sequence[CreepLaw], settings: IdentificationSettings) -> IdentificationSettings:
    """Settings with which laws are compared from the same values: ends are used by all if some have tertiary creep."""
    if settings.rupture_times != "auto" or len(set(map(has_tertiary_creep, laws))) < 2:
        return settings
    return replace(settings, rupture_times="use")
