"""Tests whose creep rates lie far from the law's, which more often says something of the tests than of the material."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from creepkit.inverse.outlying_tests import OUTLYING_FACTOR, OUTSIDE
from creepkit.language import temperature
from creepkit.language.symbols import GAS_CONSTANT

if TYPE_CHECKING:
    from creepkit.inverse.goodness_of_fit import TestFit
    from creepkit.inverse.identification import Identification

FAR = 3.0
"""Factor on the law's rate beyond which any test lies apart, also of tests that all scatter."""


MOST_NAMED, MOST_EXPLAINED = 6, 3


ROUND_FACTORS = (10.0, 100.0, 1000.0, 3600.0, 60.0, 6.895, 9.81)
"""Between units that are taken for one another: percent and per mille, percent and one, GPa and MPa, h and s, min and
s, ksi and MPa, kgf and N."""


ROUND_TOLERANCE = 0.2
"""Of ln: rates scatter, and an outlying test draws the exponents of the law."""


STEP = 0.01
"""Of ln of strain and time, for derivatives of the rate."""


def tests_apart(tests: Sequence[TestFit]) -> tuple[TestFit, ...]:
    """Tests that lie apart from the law by their own factors on its rate, the farthest first."""
    known = [one for one in tests if 0.0 < one.rate_factor < np.inf]
    if not known:
        return ()
    logs = np.log([one.rate_factor for one in known])
    distances = np.abs(logs - np.median(logs))
    spread = 1.4826 * float(np.median(distances))
    outside = (distances > OUTSIDE * spread) & (distances > np.log(OUTLYING_FACTOR)) & (len(known) > 2)
    apart = (np.abs(logs) > np.log(FAR)) | outside
    return tuple(known[k] for k in np.argsort(-np.abs(logs), kind="stable") if apart[k])


def apart_sentence(fit: Identification) -> str:
    """Which tests lie apart by which factor, and which error of a quantity would make it; "" where none does."""
    apart = tests_apart(fit.tests)
    if not apart:
        return ""
    named = [f"'{one.name}' {one.rate_factor:.3g} times ({one.condition})" for one in apart[:MOST_NAMED]]
    more = f" and {len(apart) - MOST_NAMED} more" if len(apart) > MOST_NAMED else ""
    others = [one.rate_factor for one in fit.tests if one not in apart and one.rate_factor > 0] or [1.0]
    usual = float(np.median(others))
    ratios = {one.name: one.rate_factor / usual for one in apart}
    outside = [one for one in apart if abs(np.log(ratios[one.name])) > np.log(OUTLYING_FACTOR)][:MOST_EXPLAINED]
    errors = "".join(f". {_errors_text(fit, one, ratios[one.name])}" for one in outside)
    return (
        f"creep rates that lie far from the law's: {', '.join(named)}{more}{errors}. Check the units of strain, load, "
        "time and temperature of these tests, and their conditions, first: a unit that was misread is the usual cause, "
        "and one such test draws the law away from all others"
    )


def _errors_text(fit: Identification, test: TestFit, factor_to_others: float) -> str:
    """Which error of strain, load, time or temperature alone would make a test's factor on the rate of the others.

    It is not that on the law's rate, which an outlying test draws towards itself.
    """
    log_factor = float(np.log(factor_to_others))
    texts = []
    for quantity, exponent in _rate_exponents(fit).items():
        factor = float(np.exp(min(abs(log_factor / exponent), 100.0)))
        texts.append(
            f"{quantity} {factor:.3g} times too {_STATED_OF_FASTER[quantity][log_factor < 0]}{_round_text(factor)}"
        )
    kelvin = _temperature_error(fit, test, log_factor)
    texts += [f"temperature {abs(kelvin):.2g} K too {'low' if kelvin > 0 else 'high'}"] if kelvin else []
    return f"For '{test.name}' one of these errors of what its file states would do: {', or '.join(texts)}"


_STATED_OF_FASTER = {"strain": ("large", "small"), "load": ("small", "large"), "time": ("short", "long")}
"""How a quantity is misstated of a test that seems to creep faster than the law, and slower."""


def _rate_exponents(fit: Identification) -> dict[str, float]:
    """{quantity: exponent of the factor on it in the factor on the law's rate}, at the reference point.

    A rate k g(s) e^m t^r makes e^(1 - m) grow as k t^(1 + r): a strain c times as large needs k = c^(1 - m), a time c
    times as short k = c^(1 + r), a load c times as large k = c^n.
    """
    point = fit.reference
    about = np.exp([-STEP, STEP])

    def slope(name: str) -> float:
        strain, time = (
            value * (about if name == own else np.ones(2))
            for own, value in (("strain", point.strain), ("time", point.time))
        )
        low, high = np.log(fit.rate(point.stress, strain=strain, time=time, warn=False)[0])
        return float(high - low) / (2 * STEP)

    n = float(fit.local_exponent(point.stress, warn=False)[0])
    exponents = {"strain": 1.0 - slope("strain"), "load": n, "time": 1.0 + slope("time")}
    return {name: value for name, value in exponents.items() if np.isfinite(value) and value > 0.05}


def _round_text(factor: float) -> str:
    """The factors between units that it nearly is; "" where it is none."""
    near = [f"{known:g}" for known in ROUND_FACTORS if abs(np.log(factor / known)) < ROUND_TOLERANCE]
    return f" (nearly {' or '.join(near)})" if near else ""


def _temperature_error(fit: Identification, test: TestFit, log_factor: float) -> float:
    """K by which a test must have been warmer than stated; 0 where the law does not know it, or none would do."""
    history = next((h for h in fit.histories if h.name == test.name), None)
    if history is None or not fit.law.uses(temperature):
        return 0.0
    T = history.mean_temperature
    rates = np.log(fit.rate(fit.reference.stress, np.array([T - 0.5, T + 0.5]), warn=False)[0])
    energy = float(rates[1] - rates[0]) * GAS_CONSTANT * T**2
    inverse = 1.0 / T - GAS_CONSTANT * log_factor / energy if energy > 0 else 0.0
    return 1.0 / inverse - T if inverse > 0 else 0.0
