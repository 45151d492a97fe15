"""Checks of published laws of materials: a source to look up, a range, and rates above zero that grow with stress."""

from __future__ import annotations

import re
from itertools import product

import numpy as np

from creepkit.kernels.lowering import lower
from creepkit.language.symbols import temperature
from creepkit.records import Material
from creepkit.testing.reports import finding

STRAIN, TIME = 1e-3, 3600.0
"""At which rates of laws that harden are taken; s."""


STRESSES = 5
"""Points from the lowest stress of the range to the highest, at each end of the other ranges."""


UNSTATED = (0.1, 10.0)
"""MPa, at which rates are taken where the source is silent of the stress."""


@finding("source")
def check_source(material: Material) -> str:
    """The source has a year, and a place in it or an address."""
    place = re.search(r"\b(p\.|pp\.|Table|Eq\.|Sect\.|Fig\.|doi|https?:|github\.com)", material.source)
    assert place and re.search(r"\b(18|19|20)\d\d\b", material.source), (
        f"'{material.source}' has no year, or no page, table, equation or address; say where the values can be read"
    )
    return material.source


@finding("values")
def check_values(material: Material) -> str:
    """Each value is physical, as the law's table has it."""
    for name, value in material.values.items():
        param = material.law.table[name]
        assert param.is_physical(value), f"{name} = {value:g} {param.unit} is not one of {param.meaning}"
    return ", ".join(f"{name} = {value:.6g}" for name, value in material.values.items())


@finding("range", needed=True)
def check_range(material: Material) -> str:
    """The ranges of a temperature and of conditions that the law asks for are stated."""
    asked = [one.name for one in material.law.conditions]
    asked += ["temperature"] if material.law.uses(temperature) else []
    missing = [name for name in asked if name not in material.ranges]
    assert not missing, f"ranges has no {', '.join(missing)}; state from where to where the law holds"
    return ", ".join(material.spans)


@finding("rates")
def check_rates(material: Material) -> str:
    """At the corners of the range rates are finite and above zero, and grow with stress."""
    kernel, others = lower(material.law, "numpy"), {k: v for k, v in material.ranges.items() if k != "stress"}
    low, high = material.ranges.get("stress", UNSTATED)
    stress = np.linspace(max(low, 0.01 * high), high, STRESSES)
    found: list[float] = []
    for corner in product(*others.values()):
        point = {"strain": STRAIN, "time": TIME, "temperature": 300.0} | dict(zip(others, corner, strict=True))
        known = {one.name for one in material.law.conditions}
        values = dict(material.values) | {name: point.pop(name) for name in known}
        rates = np.asarray(kernel.rate(values, stress=stress, **point))
        where = ", ".join(f"{name} {value:g}" for name, value in (point | values).items() if name in others)
        assert np.isfinite(rates).all() and (rates > 0).all(), f"{rates} 1/s at stress {stress} MPa, {where}"
        assert (np.diff(rates) >= 0).all(), f"rates fall with stress, {rates} 1/s at {stress} MPa, {where}"
        found += [float(rates.min()), float(rates.max())]
    return f"{min(found):.2g} to {max(found):.2g} 1/s over the range"
