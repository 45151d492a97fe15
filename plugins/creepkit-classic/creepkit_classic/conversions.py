"""Norton-Bailey creep from one notation to another: the meaning of m, and of A and n with it, differs between codes.

At constant stress all of these are one curve, strain = A s^n t^m in the time form (the names are those of laws):

    norton-bailey-time      strain = A s^n t^m                        Bailey, textbooks
    norton-bailey-rate      rate = A s^n t^m                          Abaqus LAW=TIME, ANSYS 2 and 6, `time-hardening`
    norton-bailey-strain    rate = (A s^n ((m+1) e)^m)^(1/(m+1))      Abaqus LAW=STRAIN
    strain-hardening        rate = A s^n e^m                          ANSYS 1 (TB,CREEP)

The first two harden with time and the last two with strain, so that a conversion between the pairs holds at constant
stress only. Stress in MPa and time in s; `per_second` brings values in h, min or d to s.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import exp, inf, isfinite, log

from creepkit.errors import LawError, nearest

Values = dict[str, float]

UNITS = {"s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}
"""{unit of time: seconds}."""


def convert(values: Mapping[str, float], source: str, target: str) -> Values:
    """Return {A, n, m} in the notation `wanted`, from values in the notation `given`; LawError where there are none.

    >>> convert({"A": 6e-15, "n": 4.0, "m": 0.5}, "norton-bailey-time", "norton-bailey-rate")
    {'A': 3e-15, 'n': 4.0, 'm': -0.5}
    """
    A, n, m = _check_values(values, source)
    to_rate, _ = _notation(source)
    _, from_rate = _notation(target)
    rate = to_rate(A, n, m)
    if not rate[2] > -1:
        raise LawError(f"{source}: m = {m:g} is a strain that does not start from zero; {_ALLOWED[source]}")
    return _values_in_range(*from_rate(*_values_in_range(*rate, source).values()), target)


def per_second(values: Mapping[str, float], notation: str, unit: str) -> Values:
    """Return the values of the notation `given` for time in s, from values for time in `unit`: "h", "min" or "d"."""
    A, n, m = _check_values(values, notation)
    if unit not in UNITS:
        raise LawError(f"no unit of time '{unit}': {nearest(unit, UNITS)}")
    powers = {"norton-bailey-time": m, "strain-hardening": 1.0}
    return _values_in_range(A * UNITS[unit] ** -powers.get(notation, m + 1), n, m, notation)


def _values_in_range(A: float, n: float, m: float, notation: str) -> Values:
    """The values, unless a strain or time exponent far from steady creep has carried A out of double precision."""
    if not 1e-300 < A < 1e300:
        raise LawError(
            f"{notation}: with n = {n:g} and m = {m:g} the number A is not between 1e-300 and 1e300; "
            "stay in the notation in which the values were given"
        )
    return {"A": A, "n": n, "m": m}


def _from_time(A: float, n: float, m: float) -> tuple[float, float, float]:
    return A * m, n, m - 1


def _to_time(A: float, n: float, m: float) -> tuple[float, float, float]:
    return A / (m + 1), n, m + 1


def _same(A: float, n: float, m: float) -> tuple[float, float, float]:
    return A, n, m


def _from_product(A: float, n: float, m: float) -> tuple[float, float, float]:
    """Time eliminated: m = m'/(1-m'), n = n'/(1-m'), A = (A' (1-m')^m')^(1/(1-m'))."""
    if m >= 1:
        return A, n, -1.0
    return _exp((log(A) + m * log(1 - m)) / (1 - m)), n / (1 - m), m / (1 - m)


def _to_product(A: float, n: float, m: float) -> tuple[float, float, float]:
    """Time eliminated: m' = m/(m+1), n' = n/(m+1), A' = (A (m+1)^m)^(1/(m+1))."""
    return _exp((log(A) + m * log(m + 1)) / (m + 1)), n / (m + 1), m / (m + 1)


def _exp(x: float) -> float:
    return exp(x) if x < 700 else inf


_Rule = Callable[[float, float, float], tuple[float, float, float]]
_NOTATIONS: dict[str, tuple[_Rule, _Rule]] = {
    "norton-bailey-time": (_from_time, _to_time),
    "norton-bailey-rate": (_same, _same),
    "norton-bailey-strain": (_same, _same),
    "time-hardening": (_same, _same),
    "strain-hardening": (_from_product, _to_product),
}
"""{law: how its (A, n, m) become those of the rate form, and back}."""

_ALLOWED = {
    "norton-bailey-time": "allowed is m above 0",
    "norton-bailey-rate": "allowed is m above -1",
    "norton-bailey-strain": "allowed is m above -1",
    "time-hardening": "allowed is m above -1",
    "strain-hardening": "allowed is m below 1",
}


def _notation(name: str) -> tuple[_Rule, _Rule]:
    if name not in _NOTATIONS:
        raise LawError(f"no notation '{name}' of Norton-Bailey creep: {nearest(name, _NOTATIONS)}")
    return _NOTATIONS[name]


def _check_values(values: Mapping[str, float], notation: str) -> tuple[float, float, float]:
    _notation(notation)
    if {*values} != {"A", "n", "m"}:
        raise LawError(f"{notation}: the values are those of {', '.join(sorted(values)) or 'nothing'}; give A, n and m")
    A, n, m = (float(values[name]) for name in ("A", "n", "m"))
    if not (A > 0 and isfinite(A) and isfinite(n) and isfinite(m)):
        raise LawError(f"{notation}: A = {A:g}, n = {n:g}, m = {m:g}; A must be positive and all of them finite")
    return A, n, m
