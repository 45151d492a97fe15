"""Parameter values in other units of stress and time, such that the same formula gives the rate in those units.

A law's stress is a ratio to 1 MPa and its time a ratio to 1 s. With units of k MPa and c seconds a stress parameter B
becomes B/k and a time parameter tau/c; what then remains of c rate(k stress, c time), such as k^n of A stress^n, is a
number for each term and goes into the term's rate coefficient. Where it is no number, as with an exponent that depends
on time or temperature, the conversion is refused.
"""

from __future__ import annotations

import math
import random
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import mpmath

from creepkit.errors import ExportError
from creepkit.kernels.multiprecision import MultiprecisionLaw
from creepkit.language.law import CreepLaw
from creepkit.records import LawWithValues, Units

_FACTOR_TOLERANCE = 1e-9
"""Relative difference of factors that counts as none; rounding of the inputs leaves some 1e-14."""


_POINT_COUNT = 12


@dataclass(frozen=True)
class ConvertedValues:
    """Values and units of a law's parameters for a system of units, and the sentence that names the reference."""

    values: Mapping[str, float]
    units: Mapping[str, str]
    reference_sentence: str


def convert_values(source: LawWithValues) -> ConvertedValues:
    """Return a law's numbers in `source.units`; ExportError where no number can do it."""
    law, units, values = source.law, source.units, dict(source.values)
    new_units = {name: _unit_text(param.unit, units) for name, param in law.table.items()}
    if not units.is_native:
        for name, param in law.table.items():
            values[name] *= _unit_factor(param.unit, units)
        for index, factor in _coefficient_factors(law, source.values, values, units).items():
            values[law.names[index]] *= factor
    return ConvertedValues(values, new_units, reference_sentence(units))


def reference_sentence(units: Units) -> str:
    """What a law's stress and time are ratios to."""
    return f"stress is a ratio to 1 {units.stress}, time to 1 {units.time}, rates are per {units.time}"


def _coefficient_factors(
    law: CreepLaw, original_values: Mapping[str, float], scaled_values: Mapping[str, float], units: Units
) -> dict[int, float]:
    """{position of a coefficient: what it must be multiplied by}."""
    new_rates = _RateSamples(law, units)
    factors: dict[int, float] = {}
    scaled_rates, target_rates = new_rates.at(scaled_values), _RateSamples(law, Units()).at(original_values)
    degrees = new_rates.homogeneity_degrees(scaled_values)
    labels = [f"term '{k}'" for k in law.terms] + [f"rate of '{s}'" for s in law.states]
    for k, label in enumerate(labels):
        factor = _common_value(
            [_finite_ratio(a * units.seconds, b) for a, b in zip(target_rates[k], scaled_rates[k], strict=True)]
        )
        if factor is not None and abs(factor - 1) < _FACTOR_TOLERANCE:
            continue
        index = next((p for p, degree in degrees.items() if degree[k]), None)
        if factor is None or index is None:
            reason = "the factor varies with the point" if factor is None else "it has no rate coefficient"
            raise ExportError(
                f"law '{law.name}', {label}: no constants give it with {reference_sentence(units)} ({reason}); "
                "export it in MPa and s"
            )
        coefficient_factor = float(factor ** (1 / degrees[index][k]))
        if not 0 < coefficient_factor < float("inf"):
            raise ExportError(
                f"law '{law.name}': {law.names[index]} would leave double precision with {reference_sentence(units)}; "
                "export it in MPa and s"
            )
        if abs(factors.setdefault(index, coefficient_factor) / coefficient_factor - 1) > _FACTOR_TOLERANCE:
            raise ExportError(
                f"law '{law.name}': {law.names[index]} would need two values with {reference_sentence(units)}; "
                "export it in MPa and s"
            )
    return factors


class _RateSamples:
    """Each term and state rate of a law at several points, in some units: [rate][point], 50 digits."""

    def __init__(self, law: CreepLaw, units: Units) -> None:
        self.law, self.exact = law, MultiprecisionLaw(law)
        self.points = _sample_points(law, units)

    def at(self, values: Mapping[str, float]) -> list[list[Any]]:
        """Rates with these values of the parameters."""
        rows = [self.exact.term_and_state_rates(point, [values[n] for n in self.law.names]) for point in self.points]
        return [list(column) for column in zip(*rows, strict=True)]

    def homogeneity_degrees(self, values: Mapping[str, float]) -> dict[int, list[Any]]:
        """{position of a parameter of log scale: the power in which it multiplies each rate, 0 where it does not}."""
        base_rates, result = self.at(values), {}
        for index, (name, param) in enumerate(self.law.table.items()):
            if param.scale == "log" and values[name] > 0:
                doubled_rates = self.at({**values, name: 2 * values[name]})
                factors = [
                    _common_value([_finite_ratio(b, a) for a, b in zip(*pair, strict=True)])
                    for pair in zip(base_rates, doubled_rates, strict=True)
                ]
                result[index] = [0 if f is None or f == 1 else mpmath.log(f, 2) for f in factors]
        return result


def _common_value(factors: list[Any]) -> Any:
    """The one value of factors; None where they differ. A rate that is zero everywhere needs no factor."""
    defined = [f for f in factors if f is not None] or [mpmath.mpf(1)]
    return defined[0] if all(abs(f - defined[0]) <= _FACTOR_TOLERANCE * abs(defined[0]) for f in defined) else None


def _finite_ratio(a: Any, b: Any) -> Any:
    return a / b if b != 0 and mpmath.isfinite(a / b) else None


def _sample_points(law: CreepLaw, units: Units) -> list[list[float]]:
    """Points spread over what tests visit, in some units; states between their start and their limit."""
    draw = random.Random(0).uniform
    spans = [(s.initial, s.initial + 1.0 if s.limit is None else s.limit) for s in law.states.values()]
    points = []
    for _ in range(_POINT_COUNT):
        stress, strain = math.exp(draw(3.0, 5.3)) / units.megapascals, math.exp(draw(-9.0, -2.0))
        time, temperature, fraction = math.exp(draw(7.0, 14.0)) / units.seconds, draw(850.0, 1250.0), draw(0.1, 0.6)
        states = [low + fraction * (high - low) for low, high in spans]
        points.append([stress, strain, time, temperature, 0.9 * stress, stress / 3, *states])
    return points


# ---- units as text -------------------------------------------------------------------------------------------------


def _unit_powers(unit: str) -> tuple[int, int]:
    """The powers of MPa and of s in a unit such as MPa/K or 1/s."""
    numerator, _, denominator = unit.partition("/")
    patterns = [rf"(?<!\w){word}(?![\w^])" for word in ("MPa", "s")]
    stress, time = (len(re.findall(p, numerator)) - len(re.findall(p, denominator)) for p in patterns)
    return stress, time


def _unit_factor(unit: str, units: Units) -> float:
    stress, time = _unit_powers(unit)
    return float(units.megapascals**-stress * units.seconds**-time)


def _unit_text(unit: str, units: Units) -> str:
    text = re.sub(r"(?<!\w)MPa(?![\w^])", units.stress, unit)
    return re.sub(r"(?<!\w)s(?![\w^])", units.time, text)
