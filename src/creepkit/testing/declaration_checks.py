"""Checks of what is declared or made by one function: instrument formats and temperature forms."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from creepkit.errors import LawError
from creepkit.files.time_stamps import DATE_ORDERS
from creepkit.instruments.column_heads import TIME_UNITS, channel_unit
from creepkit.kernels.lowering import lower
from creepkit.language.temperature_forms import TemperatureFactor, TemperatureForm
from creepkit.records import InstrumentFormat
from creepkit.registry import default_registry
from creepkit.testing.reports import finding


@finding("declaration")
def check_declaration(declared: InstrumentFormat) -> str:
    """Units and the order of dates mean something; what else is declared was checked when the format was made."""
    unknown = [unit for unit in declared.units.values() if channel_unit(unit) is None]
    assert not unknown, f"'{unknown[0]}' is no unit of a channel; write one such as barg, psia, C"
    unit, order = declared.time_unit, declared.date_order
    assert unit in ("", *TIME_UNITS), f"'{unit}' is no unit of times; write one of {', '.join(TIME_UNITS)}"
    assert order in ("", *DATE_ORDERS), f"'{order}' is no order of dates; write one of {', '.join(DATE_ORDERS)}"
    return "units of channels and times, and the order of dates, are known"


REFERENCE = 1073.15
"""K, at which temperature forms leave a law as it is."""


TEMPERATURES = (900.0, 1000.0, 1200.0)
"""K, at which the rate of a law with a temperature form must be a number above zero."""


@finding("temperature form")
def check_form(form: Callable[..., Any]) -> str:
    """A function of T_ref gives a form or a factor, equal to one at T_ref, and finite rates elsewhere."""
    made, plain = form(T_ref=REFERENCE), default_registry().law("norton")
    assert isinstance(made, TemperatureForm | TemperatureFactor), (
        f"it returned a {type(made).__name__}; return a TemperatureForm or a TemperatureFactor"
    )
    if isinstance(made, TemperatureFactor):
        law = plain.times(made)
    else:
        try:  # of a parameter of log scale, or else of a linear one
            law = plain.with_temperature(A=made)
        except LawError:
            law = plain.with_temperature(n=made)
    own = {name: 0.1 * law.table[name].bounds[1] for name in law.names if name not in plain.names}
    values, kernel = law.center() | plain.center() | own, lower(law, "numpy")
    rates = {T: float(kernel.rate(values, stress=100.0, temperature=T)) for T in (REFERENCE, *TEMPERATURES)}
    gap = abs(rates[REFERENCE] / float(lower(plain, "numpy").rate(plain.center(), stress=100.0)) - 1.0)
    assert gap <= 1e-9, f"{gap:.1e}; the parameter must be its own value at T_ref"
    for T, rate in rates.items():
        assert np.isfinite(rate) and rate > 0, f"the rate at {T:g} K is {rate:g} 1/s"
    return f"{type(made).__name__}; {gap:.1e} off at T_ref, rates above zero at {len(rates)} temperatures"
