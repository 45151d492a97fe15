"""Fitting a law to the temperatures of the tests: an Arrhenius factor when there are several and the law knows none."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from creepkit.language import CreepLaw, arrhenius, temperature
from creepkit.records import ZERO_CELSIUS, History

ISOTHERMAL_RANGE = 5.0
"""K; tests within this range are taken to be at one temperature."""


def reference_temperature(histories: Sequence[History]) -> float:
    """The median temperature of the tests, rounded to 10 C, in K."""
    temperatures = [float(np.mean(h.temperature_program().values)) for h in histories]
    return float(round((np.median(temperatures) - ZERO_CELSIUS) / 10.0) * 10.0 + ZERO_CELSIUS)


def spans_temperatures(histories: Sequence[History]) -> bool:
    """Whether the tests span more than 5 K."""
    temperatures = [float(v) for h in histories for v in h.temperature_program().values]
    return max(temperatures) - min(temperatures) > ISOTHERMAL_RANGE


def with_arrhenius(law: CreepLaw, histories: Sequence[History]) -> CreepLaw:
    """The law times an Arrhenius factor about the median temperature, if the tests call for one and it has none."""
    if law.uses(temperature) or not spans_temperatures(histories):
        return law
    return law.times(arrhenius(T_ref=reference_temperature(histories)))
