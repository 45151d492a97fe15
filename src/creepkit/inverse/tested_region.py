"""Combinations of stress and temperature that the tests of an identification covered."""

from __future__ import annotations

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.identification import Identification
from creepkit.records.units import ZERO_CELSIUS, celsius_text

SAME_TEMPERATURE = 2.0
"""K between tests of one temperature."""


SAME_STRESS = 0.01
"""Relative distance of stresses within which they are one."""


def tested_points(fit: Identification) -> Floats:
    """(points, 2) stress, MPa, and temperature, K, of the holds of the fitted tests; none without their histories."""
    points = [
        (float(stress), T)
        for history, stresses in zip(fit.histories, fit.simulated_stresses, strict=True)
        for stress in stresses
        for T in _distinct(history.temperature_program().at(history.used_times))
    ]
    return np.array(points, float).reshape(-1, 2)


def _distinct(temperatures: Floats) -> list[float]:
    """Temperatures (readings,) in K, one of those that are the same to 0.1 °C."""
    first = np.unique(np.round(temperatures - ZERO_CELSIUS, 1), return_index=True)[1]
    return [float(T) for T in temperatures[first]]


def stresses_at_temperatures(fit: Identification) -> list[tuple[float, tuple[float, float]]]:
    """(temperature, K, and the lowest and the highest stress there, MPa), the coldest first."""
    points = tested_points(fit)
    found: list[tuple[float, tuple[float, float]]] = []
    for T, stress in sorted((float(T), float(s)) for s, T in points):
        if found and T - found[-1][0] <= SAME_TEMPERATURE:
            first, (low, high) = found[-1]
            found[-1] = (first, (min(low, stress), max(high, stress)))
        else:
            found.append((T, (stress, stress)))
    return found


def outside_combinations(fit: Identification, stresses: Floats, temperatures: Floats) -> str:
    """Which combination of stress and temperature lies outside the region of the tests; "" where none does.

    The region is the convex hull of (1/T, ln stress) of the tests, widened by SAME_STRESS and SAME_TEMPERATURE.
    stresses : (n,) MPa. temperatures : (n,) K.
    """
    tested = tested_points(fit)
    if not tested.size:
        return ""
    tested_x, tested_y = 1.0 / tested[:, 1], np.log(tested[:, 0])
    for stress, T in dict.fromkeys(zip(stresses.tolist(), temperatures.tolist(), strict=True)):
        if not (stress > 0 and T > 0):
            continue
        allowed = [
            _stress_span(tested_x, tested_y, 1.0 / (T + dT)) for dT in (0.0, -SAME_TEMPERATURE, SAME_TEMPERATURE)
        ]
        spans = [span for span in allowed if span is not None]
        if not spans or any(low - SAME_STRESS <= np.log(stress) <= high + SAME_STRESS for low, high in spans):
            continue  # a temperature beyond all tests is said of the temperature
        low, high = np.exp(spans[0])
        return (
            f"stress {stress:.4g} MPa at {celsius_text(T, digits=0)} (the tests' region in 1/T and ln stress holds "
            f"{low:.4g} to {high:.4g} MPa there)"
        )
    return ""


def _stress_span(x: Floats, y: Floats, at: float) -> tuple[float, float] | None:
    """The lowest and the highest ordinate of the convex hull of points (n,) at an abscissa; None beside all points."""
    same = np.abs(x - at) <= 1e-12 * at
    values = [*y[same]]
    below, above = np.flatnonzero(x < at), np.flatnonzero(x > at)
    if below.size and above.size:  # the ends of the hull lie on lines between two points
        share = (at - x[below, None]) / (x[above] - x[below, None])
        lines = y[below, None] + share * (y[above] - y[below, None])
        values += [float(lines.min()), float(lines.max())]
    return (float(min(values)), float(max(values))) if values else None
