"""A law's numbers in other units: the same formula, fed with stress and time in those units, gives its rate in them.

A law's stress is a ratio to 1 MPa and its time a ratio to 1 s. With units of k MPa and c seconds a stress parameter B
becomes B/k and a time parameter tau/c; what then remains of c rate(k stress, c time), such as k^n of A stress^n, is a
number for each term and goes into the term's rate coefficient. Where it is no number, as with an exponent that depends
on time or temperature, there is no such coefficient.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np

from creepkit.errors import ExportError
from creepkit.kernels.exact import Exact
from creepkit.language.law import CreepLaw
from creepkit.records import Units, ValuedLaw

_SAME = 1e-9
"""Relative difference of factors that counts as none; rounding of the inputs leaves some 1e-14."""

_POINTS = 12


@dataclass(frozen=True)
class Converted:
    """Values and units of a law's parameters for a system of units, and the sentence that names the reference."""

    values: Mapping[str, float]
    units: Mapping[str, str]
    reference: str


def converted(source: ValuedLaw) -> Converted:
    """Return a law's numbers in `source.units`; ExportError where no number can do it."""
    law, units, values = source.law, source.units, dict(source.values)
    told = {name: _renamed(param.unit, units) for name, param in law.table.items()}
    if not units.native:
        for name, param in law.table.items():
            values[name] *= _factor(param.unit, units)
        for position, factor in _folded(law, source.values, values, units).items():
            values[law.names[position]] *= factor
    return Converted(values, told, reference_of(units))


def reference_of(units: Units) -> str:
    """What a law's stress and time are ratios to."""
    return f"stress is a ratio to 1 {units.stress}, time to 1 {units.time}, rates are per {units.time}"


def _folded(law: CreepLaw, before: Mapping[str, float], after: Mapping[str, float], units: Units) -> dict[int, float]:
    """{position of a coefficient: what it must be multiplied by}."""
    new = _Rates(law, units)
    found: dict[int, float] = {}
    rates, wanted = new.at(after), _Rates(law, Units()).at(before)
    degrees = new.degrees(after)
    labels = [f"term '{k}'" for k in law.terms] + [f"rate of '{s}'" for s in law.states]
    for k, label in enumerate(labels):
        factor = _steady([_ratio(a * units.seconds, b) for a, b in zip(wanted[k], rates[k], strict=True)])
        if factor is not None and abs(factor - 1) < _SAME:
            continue
        position = next((p for p, degree in degrees.items() if degree[k]), None)
        if factor is None or position is None:
            why = "the factor varies with the point" if factor is None else "it has no rate coefficient"
            raise ExportError(
                f"law '{law.name}', {label}: no constants give it with {reference_of(units)} ({why}); "
                "export it in MPa and s"
            )
        share = float(factor ** (1 / degrees[position][k]))
        if not 0 < share < float("inf"):
            raise ExportError(
                f"law '{law.name}': {law.names[position]} would leave double precision with {reference_of(units)}; "
                "export it in MPa and s"
            )
        if abs(found.setdefault(position, share) / share - 1) > _SAME:
            raise ExportError(
                f"law '{law.name}': {law.names[position]} would need two values with {reference_of(units)}; "
                "export it in MPa and s"
            )
    return found


class _Rates:
    """Each term and state rate of a law at several points, in some units: [rate][point], 50 digits."""

    def __init__(self, law: CreepLaw, units: Units) -> None:
        self.law, self.exact = law, Exact(law)
        scaled = np.array(_points(law))
        scaled[:, [0, 4, 5]] /= units.megapascals
        scaled[:, 2] /= units.seconds
        self.points = scaled.tolist()

    def at(self, values: Mapping[str, float]) -> list[list[Any]]:
        """Rates with these values of the parameters."""
        rows = [self.exact.parts(point, [values[n] for n in self.law.names]) for point in self.points]
        return [list(column) for column in zip(*rows, strict=True)]

    def degrees(self, values: Mapping[str, float]) -> dict[int, list[Any]]:
        """{position of a parameter of log scale: the power in which it multiplies each rate, 0 where it does not}."""
        plain, found = self.at(values), {}
        for position, (name, param) in enumerate(self.law.table.items()):
            if param.scale == "log" and values[name] > 0:
                doubled = self.at({**values, name: 2 * values[name]})
                factors = [
                    _steady([_ratio(b, a) for a, b in zip(*pair, strict=True)])
                    for pair in zip(plain, doubled, strict=True)
                ]
                found[position] = [0 if f is None or f == 1 else mpmath.log(f, 2) for f in factors]
        return found


def _steady(factors: list[Any]) -> Any:
    """The one value of factors; None where they differ. A rate that is zero everywhere needs no factor."""
    known = [f for f in factors if f is not None] or [mpmath.mpf(1)]
    return known[0] if all(abs(f - known[0]) <= _SAME * abs(known[0]) for f in known) else None


def _ratio(a: Any, b: Any) -> Any:
    return a / b if b != 0 and mpmath.isfinite(a / b) else None


def _points(law: CreepLaw) -> Sequence[Sequence[float]]:
    """Points spread over what tests visit; states between their start and their limit."""
    rng = np.random.default_rng(0)
    stress = np.exp(rng.uniform(np.log(20.0), np.log(200.0), _POINTS))
    strain, time = np.exp(rng.uniform(-9, -2, _POINTS)), np.exp(rng.uniform(7, 14, _POINTS))
    warmth, shares = rng.uniform(850.0, 1250.0, _POINTS), rng.uniform(0.1, 0.6, _POINTS)
    spans = [(s.initial, s.initial + 1.0 if s.limit is None else s.limit) for s in law.states.values()]
    inner = [low + shares * (high - low) for low, high in spans]
    columns = [stress, strain, time, warmth, 0.9 * stress, stress / 3, *inner]
    return [[float(v) for v in row] for row in np.column_stack(columns)]


# ---- units as text -------------------------------------------------------------------------------------------------


def _powers(unit: str) -> tuple[int, int]:
    """The powers of MPa and of s in a unit such as MPa/K or 1/s."""
    top, _, bottom = unit.partition("/")
    counts = [len(re.findall(rf"(?<!\w){word}(?![\w^])", top)) - len(re.findall(rf"(?<!\w){word}(?![\w^])", bottom))
              for word in ("MPa", "s")]  # fmt: skip
    return counts[0], counts[1]


def _factor(unit: str, units: Units) -> float:
    stress, time = _powers(unit)
    return float(units.megapascals**-stress * units.seconds**-time)


def _renamed(unit: str, units: Units) -> str:
    renamed = re.sub(r"(?<!\w)MPa(?![\w^])", units.stress, unit)
    return re.sub(r"(?<!\w)s(?![\w^])", units.time, renamed)
