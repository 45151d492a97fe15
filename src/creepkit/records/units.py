"""Units as files spell them: of which quantity each is, and how a number in it becomes one in MPa, mm, s, K, N or rad.

Who reads files names the units that make sense there; spellings, factors and offsets stand here only.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

ZERO_CELSIUS = 273.15
"""K."""


ROOM_TEMPERATURE = ZERO_CELSIUS + 20.0
"""K; stands where a law does not ask for a temperature."""


SECONDS_PER_HOUR = 3600.0
"""s."""


PSI = 6.894757293168361e-3
"""MPa."""


@dataclass(frozen=True)
class UnitConversion:
    """How a number in some unit becomes creepkit's own: factor * number + offset."""

    factor: float
    offset: float = 0.0


@dataclass(frozen=True)
class Unit:
    """A unit: its quantity, its conversion, and how else than by its symbol it is spelled, in small letters."""

    quantity: str
    conversion: UnitConversion
    spellings: tuple[str, ...] = ()


def _unit(quantity: str, factor: float, *spellings: str, offset: float = 0.0) -> Unit:
    return Unit(quantity, UnitConversion(factor, offset), spellings)


UNITS: Mapping[str, Unit] = MappingProxyType(
    {
        "s": _unit("time", 1.0, "sec", "secs", "second", "seconds", "sek", "sekunden", "secondes"),
        "ms": _unit("time", 1e-3, "msec", "millisecond", "milliseconds"),
        "us": _unit("time", 1e-6, "µs", "μs", "microsecond", "microseconds"),
        "ns": _unit("time", 1e-9, "nanosecond", "nanoseconds"),
        "min": _unit("time", 60.0, "mins", "minute", "minutes", "minuten"),
        "h": _unit(
            *("time", 3600.0, "hr", "hrs", "hour", "hours", "std", "std.", "stunden", "heures", "heure", "ore"),
            *("horas", "uur", "uren"),
        ),
        "kh": _unit(
            *("time", 3.6e6, "10^3 h", "10³ h", "10^3h", "10³h", "1e3 h", "1000 h", "1000h", "10**3 h"),
            *("1000 hr", "1000 hrs", "1000 hours", "10^3 hr", "10^3 hrs"),
        ),
        "d": _unit("time", 86400.0, "day", "days", "tag", "tage", "jours", "jour", "giorni", "días", "dias", "dagen"),
        "year": _unit("time", 31557600.0, "years"),
        "mm": _unit("length", 1.0, "millimetre", "millimeter"),
        "cm": _unit("length", 10.0, "centimetre", "centimeter"),
        "m": _unit("length", 1e3, "metre", "meter"),
        "um": _unit("length", 1e-3, "µm", "μm", "micron", "microns"),
        "nm": _unit("length", 1e-6),
        "in": _unit("length", 25.4, "inch", "inches", "in."),
        "mil": _unit("length", 0.0254, "mils", "thou"),
        "mm2": _unit("area", 1.0, "mm²", "mm^2", "sq mm"),
        "cm2": _unit("area", 100.0, "cm²", "cm^2"),
        "in2": _unit("area", 645.16, "in²", "in^2", "sq in"),
        "MPa": _unit("stress", 1.0, "n/mm2", "n/mm²", "n/mm^2", "mn/m2"),
        "GPa": _unit("stress", 1e3),
        "kPa": _unit("stress", 1e-3),
        "hPa": _unit("stress", 1e-4),
        "Pa": _unit("stress", 1e-6),
        "bar": _unit("stress", 0.1, "barg", "bar(g)", "bar g", "bar gauge"),
        "mbar": _unit("stress", 1e-4),
        "atm": _unit("stress", 0.101325),
        "Torr": _unit("stress", 0.101325 / 760.0, "mmhg"),
        "psi": _unit("stress", PSI, "psig", "psi(g)", "psi g", "psi gauge"),
        "kgf/mm2": _unit(
            "stress", 9.80665, "kgf/mm²", "kgf/mm^2", "kp/mm2", "kp/mm²", "kp/mm^2", "kg/mm2", "kg/mm²", "kg/mm^2"
        ),
        "ksi": _unit("stress", 1e3 * PSI),
        "tsi": _unit("stress", 2240.0 * PSI, "tonf/in2", "ton/in2", "tons/in2", "tons/sq in", "tons/sq.in."),
        "Msi": _unit("stress", 1e6 * PSI),
        "K": _unit("temperature", 1.0, "kelvin", "degk"),
        "C": _unit(
            *("temperature", 1.0, "°c", "ºc", "℃", "degc", "deg c", "deg_c", "deg. c", "celsius", "oc"),
            offset=ZERO_CELSIUS,
        ),
        "F": _unit(
            *("temperature", 1.0 / 1.8, "°f", "ºf", "℉", "degf", "deg f", "deg_f", "deg. f", "fahrenheit", "of"),
            offset=ZERO_CELSIUS - 32.0 / 1.8,
        ),
        "1": _unit("strain", 1.0, "-", "mm/mm", "m/m", "in/in", "in./in.", "fraction"),
        "pct": _unit("strain", 1e-2, "%", "percent", "per cent", "1e-2", "10^-2", "10-2", "10⁻²"),
        "permille": _unit("strain", 1e-3, "‰", "per mille", "promille", "mm/m", "1e-3", "10^-3", "10-3", "10⁻³"),
        "microstrain": _unit(
            *("strain", 1e-6, "µstrain", "μstrain", "ustrain", "µm/m", "μm/m", "um/m", "mikrodehnung"),
            *("µε", "με", "ue", "µeps", "µdef", "1e-6", "10^-6", "10-6", "10⁻⁶"),
        ),
        "N": _unit("force", 1.0),
        "kN": _unit("force", 1e3),
        "lbf": _unit("force", 4.4482216152605, "lb", "lbs"),
        "kgf": _unit("force", 9.80665, "kp", "kg"),
        "daN": _unit("force", 10.0),
        "Nmm": _unit("moment", 1.0),
        "Nm": _unit("moment", 1e3),
        "rad": _unit("angle", 1.0),
        "deg": _unit("angle", math.pi / 180.0, "°"),
    }
)
"""{symbol: unit}; capitals of a symbol matter."""


CAPITALS_THAT_MATTER = frozenset(("mPa", "M", "nm", "mN", "Mn", "Mbar"))
"""Spellings that in other capitals mean another unit: millipascal is no megapascal, nanometre no newton metre."""


def conversions(*symbols: str) -> dict[str, UnitConversion]:
    """{symbol: conversion} of some units."""
    return {symbol: UNITS[symbol].conversion for symbol in symbols}


def factors(*symbols: str) -> dict[str, float]:
    """{symbol: factor} of some units, for quantities whose units have no offset."""
    return {symbol: UNITS[symbol].conversion.factor for symbol in symbols}


def spellings(*symbols: str) -> dict[str, str]:
    """{spelling: symbol} of some units; each symbol is a spelling too."""
    return {spelling: symbol for symbol in symbols for spelling in (symbol, *UNITS[symbol].spellings)}


def spelled_factors(*symbols: str) -> dict[str, float]:
    """{spelling: factor} of some units, for quantities whose units have no offset."""
    return {spelling: UNITS[symbol].conversion.factor for spelling, symbol in spellings(*symbols).items()}


LONGEST_IN_SECONDS = 600.0
"""s; longer times are said in hours."""


def time_text(seconds: float) -> str:
    """A time of a test for people: in hours, or in seconds up to LONGEST_IN_SECONDS."""
    return f"{seconds:.4g} s" if abs(seconds) < LONGEST_IN_SECONDS else f"{hours_number(seconds)} h"


def celsius_text(low: float, high: float | None = None, *, digits: int = 1) -> str:
    """A temperature, or from one to another, K, for people: "550 °C", "600 to 620 °C".

    digits : after the decimal point at most.
    """
    ends = [f"{round(T - ZERO_CELSIUS, digits) + 0.0:g}" for T in (low, low if high is None else high)]
    return f"{ends[0]} °C" if ends[0] == ends[1] else f"{ends[0]} to {ends[1]} °C"


def hours_number(seconds: float) -> str:
    """A time in h as a number for people: "later" than anything where infinite, "?" where not known."""
    if math.isnan(seconds):
        return "?"
    return f"{float(f'{seconds / SECONDS_PER_HOUR:.4g}'):.7g}" if math.isfinite(seconds) else "later"


def times_text(first: float, last: float) -> str:
    """From one time to another, for people, in the unit of the later one; s."""
    if abs(last) < LONGEST_IN_SECONDS:
        return f"{first:.4g} to {last:.4g} s"
    return f"{hours_number(first)} to {hours_number(last)} h"
