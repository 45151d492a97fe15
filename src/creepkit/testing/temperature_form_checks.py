"""Checks of temperature forms and factors: at the reference temperature they leave a law as it is."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from creepkit.errors import LawError
from creepkit.kernels.lowering import lower
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import Param, parameters, stress
from creepkit.language.temperature_forms import TemperatureFactor, TemperatureForm
from creepkit.testing.reports import ConformanceCheck

REFERENCE = 1073.15
"""K."""


TEMPERATURES = (900.0, 1000.0, 1200.0)
"""K, at which the rate must be a number above zero."""


@dataclass(frozen=True)
class TemperatureFormCase:
    """A function of T_ref that gives a form or a factor, under its name."""

    name: str
    form: Callable[..., Any]

    def check(self) -> Iterator[ConformanceCheck]:
        """It gives a form or a factor, equal to one at T_ref, and finite rates elsewhere."""
        made = self.form(T_ref=REFERENCE)
        if not isinstance(made, TemperatureForm | TemperatureFactor):
            detail = f"it returned a {type(made).__name__}; return a TemperatureForm or a TemperatureFactor"
            yield ConformanceCheck("kind", False, detail)
            return
        yield ConformanceCheck("kind", True, type(made).__name__)
        plain = _plain_law()
        law = _applied(plain, made)
        values = law.center() | plain.center()
        values |= {name: 0.1 * law.table[name].bounds[1] for name in law.names if name not in plain.names}
        kernel = lower(law, "numpy")
        at = {T: float(kernel.rate(values, stress=100.0, temperature=T)) for T in (REFERENCE, *TEMPERATURES)}
        wanted = float(lower(plain, "numpy").rate(plain.center(), stress=100.0))
        gap = abs(at[REFERENCE] / wanted - 1.0)
        detail = f"{gap:.1e}" + ("" if gap <= 1e-9 else "; the parameter must be its own value at T_ref")
        yield ConformanceCheck("the same at T_ref", gap <= 1e-9, detail)
        bad = [T for T, rate in at.items() if not (np.isfinite(rate) and rate > 0)]
        detail = f"the rate at {bad[0]:g} K is {at[bad[0]]:g} 1/s" if bad else f"at {len(at)} temperatures"
        yield ConformanceCheck("rates are above zero", not bad, detail)


def _plain_law() -> CreepLaw:
    A, n = parameters("A n")
    return CreepLaw(
        name="plain",
        title="A plain law",
        terms={"power law": A * stress**n},
        params={A: Param("rate coefficient", (1e-20, 1e-10), "1/s", "log"), n: Param("stress exponent", (1, 8))},
        references=("none, for a check",),
    )


def _applied(law: CreepLaw, made: TemperatureForm | TemperatureFactor) -> CreepLaw:
    """The law with the factor, or with a parameter of log or of linear scale in that form, whichever it takes."""
    if isinstance(made, TemperatureFactor):
        return law.times(made)
    try:
        return law.with_temperature(A=made)
    except LawError:
        return law.with_temperature(n=made)
