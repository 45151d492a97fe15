"""The creep rate and the stress exponent amid the tests in sentences that say of which state and at what held they are.

A law whose rate depends on time, strain or internal variables has several stress exponents: the derivative of its
formula, and that of bars which are compared at one strain, as measured rates are in the literature.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from creepkit.inverse.adequacy import UNDETECTED_SCATTER
from creepkit.inverse.identified_values import StateAtStrain, depends_on_history, state_at_strain
from creepkit.language import strain, time
from creepkit.records.units import celsius_text
from creepkit.reports.blocks import number
from creepkit.reports.load_programs import SECONDS_PER_HOUR

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification


def rate_and_exponent(fit: Identification) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Creep rate, 1/s, and stress exponent amid the tests, (value, low, high) each: of bars at the reference strain.

    Where the law's rate depends on stress and temperature alone, or no bar can be followed, those of the formula.
    """
    state = _state(fit)
    if state is not None:
        return state.rate, state.exponent
    stress = fit.reference.stress
    return tuple(map(float, fit.rate(stress, warn=False))), tuple(map(float, fit.local_exponent(stress, warn=False)))


def _state(fit: Identification) -> StateAtStrain | None:
    return state_at_strain(fit) if depends_on_history(fit.law) else None


def held_quantities(fit: Identification) -> str:
    """What the derivative of the law's formula to stress holds, in words."""
    law = fit.law
    held = [word for word, symbol in (("time", time), ("strain", strain)) if law.uses(symbol)]
    held += ["initial internal variables"] if law.states else []
    return f"{', '.join(held[:-1])} and {held[-1]}" if len(held) > 1 else "".join(held)


def reference_sentences(fit: Identification) -> list[str]:
    """Rate and exponent amid the tests, one sentence each, without full stops."""
    r, state = fit.reference, _state(fit)
    at = f"{number(r.stress)} MPa and {celsius_text(r.temperature, digits=0)}"
    formula = _interval(tuple(map(float, fit.local_exponent(r.stress, warn=False))))
    held = held_quantities(fit)
    if state is not None:
        hours = tuple(v / SECONDS_PER_HOUR for v in state.time)
        lines = [
            f"amid the tests, under a constant true stress of {at}, a bar reaches a logarithmic creep strain of "
            f"{number(r.strain, 2)} after {_interval(hours)} h, and creeps there at a rate of "
            f"{_interval(state.rate)} 1/s (95 % intervals in brackets)",
            "the stress exponent at constant strain, d ln rate / d ln stress of bars compared when each has this "
            f"strain, is {_interval(state.exponent)}: the one to compare with exponents of measured creep rates",
        ]
        if held != "strain":
            lines.append(
                f"the derivative of the law's formula at constant {held} is {formula}, which no test at one strain "
                "shows"
            )
        return lines
    rate = _interval(tuple(map(float, fit.rate(r.stress, warn=False))))
    if not held:
        return [
            f"amid the tests, at {at}, the creep rate is {rate} 1/s and the stress exponent, d ln rate / d ln stress, "
            f"is {formula} (95 % intervals in brackets)"
        ]
    state_text = f"a strain of {number(r.strain, 2)} and {number(r.time / SECONDS_PER_HOUR, 3)} h"
    # Of a law of stress, temperature and strain the derivative at constant strain is what bars at one strain show.
    other = "" if held == "strain" else "; bars compared at one strain show another exponent where their times differ"
    if fit.law.states:
        other = "; bars compared at one strain show another exponent, as their internal variables differ there"
    initial = " with internal variables as at the beginning" if fit.law.states else ""
    return [
        f"at {at}, {state_text}{initial}, the law's formula has a creep rate of {rate} 1/s and, at constant {held}, "
        f"the stress exponent d ln rate / d ln stress of {formula} (95 % intervals in brackets){other}"
    ]


def _interval(values: tuple[float, ...]) -> str:
    value, low, high = values
    digits = interval_digits(value, low, high)
    return f"{number(value, digits)} [{number(low, digits)}, {number(high, digits)}]"


FEWEST_DIGITS, MOST_DIGITS = 3, 7
"""Of a value with its interval."""


def interval_digits(value: float, low: float, high: float) -> int:
    """Digits with which the ends of an interval differ from its value."""
    distances = [abs(end - value) for end in (low, high) if math.isfinite(end) and end != value]
    if not distances or value == 0.0 or not math.isfinite(value):
        return FEWEST_DIGITS
    return min(max(FEWEST_DIGITS, math.floor(math.log10(abs(value) / min(distances))) + 2), MOST_DIGITS)


def constant_load_sentence(fit: Identification) -> str:
    """Where the exponent comes from in tests whose true stress rises with strain; "" where none has a constant load."""
    loads = [h for h in fit.histories if "strain" in h.outputs and getattr(h.loading, "control", "") == "load"]
    if not loads:
        return ""
    growth = fit.ranges["strain"][1]
    scatter = fit.noise_model.rate
    beside = f"rates of single tests scatter by {100 * scatter:.2g} % (one standard deviation) beside it"
    if 0 < scatter <= UNDETECTED_SCATTER:
        beside = "no scatter of rates between tests was detected beside it"
    if not scatter > 0:
        beside = "the scatter of rates between tests is not known beside it"
    return (
        f"under a constant load the true stress rises with strain, here by up to {100 * growth:.2g} %, so that the "
        "stress exponent comes from the curvature of single curves as well as from the comparison of tests: its "
        f"interval holds only if the form of the law is right, and {beside}"
    )
