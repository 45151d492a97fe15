"""The plot of a temperature law: each parameter against temperature, with the curves of the forms that remain."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.discovery.points import ENDLESS
from creepkit.figures import blank, written
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.uncertainty import band, quantile
from creepkit.language import Param

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from creepkit.discovery.trend import Candidate, TemperatureLaw

COLUMNS = 3
SHOWN = 0.02
"""Combinations of less weight are not drawn, but those that a parameter's set names."""


def figure_of(trend: TemperatureLaw, path: str | Path | None = None) -> Figure:
    """One panel a parameter: estimates with 95 % intervals, and curves; a coefficient is shown by its rate.

    The rate is that at the reference stress: coefficients themselves move with their exponents.
    """
    coordinates = Coordinates(trend.base, trend.points.reference)
    names = trend.base.names
    across = min(COLUMNS, len(names))
    down = -(-len(names) // across)
    figure = blank(4.6 * across, 3.7 * down)
    panels = figure.subplots(down, across, squeeze=False)
    for k, name in enumerate(names):
        _draw(panels.flat[k], trend, coordinates, k)
        panels.flat[k].set_title(_title(trend, coordinates, k, name), fontsize=9)
    for spare in list(panels.flat)[len(names) :]:
        spare.set_visible(False)
    figure.suptitle(f"{trend.law.title or trend.law.name}, judged by the {trend.judged_by}", fontsize=10)
    return written(figure, path)


def _draw(axes: Any, trend: TemperatureLaw, coordinates: Coordinates, k: int) -> None:
    points, name = trend.points, trend.base.names[k]
    rate = k in coordinates.coefficients
    scale = 1 / np.log(10.0) if rate or trend.base.table[name].scale == "log" else 1.0

    def shown_of(theta: Floats) -> Floats:
        return np.asarray((coordinates.u(theta) if rate else theta)[..., k] * scale)

    middle, half = shown_of(points.theta), quantile(ENDLESS) * _spread(shown_of, points.theta, points.covariance)
    low, high = (-np.inf, np.inf) if rate else _ends(trend.base.table[name], scale)
    arms = np.maximum([np.minimum(half, middle - low), np.minimum(half, high - middle)], 0.0)
    axes.errorbar(points.temperatures, middle, arms, fmt="o", ms=4, color="0.25", capsize=2, lw=1)
    seen = [middle]
    T = np.linspace(*trend.range, 60)
    drawn: set[str] = set()
    for one in trend.candidates:
        form = one.forms[name]
        if form in drawn or (one.weight < SHOWN and drawn):
            continue
        drawn.add(form)
        curve = shown_of(one.theta(T))
        seen.append(curve)
        axes.plot(T, curve, lw=1.8 if len(drawn) == 1 else 1.0, label=f"{form} {_weight(trend, k, form):.2f}")
        if len(drawn) == 1:
            wide = _band(shown_of, one, T) * quantile(one.freedom)
            axes.fill_between(T, curve - wide, curve + wide, color="C0", alpha=0.15, lw=0)
    bottom, top = float(np.min(np.concatenate(seen))), float(np.max(np.concatenate(seen)))
    room = max(0.15 * (top - bottom), min(1.2 * float(np.median(half)), top - bottom), 0.02 * abs(top) + 1e-9)
    axes.set(xlabel="temperature, K", ylim=(bottom - room, top + room))
    axes.legend(fontsize=7)
    axes.grid(alpha=0.25)


def _weight(trend: TemperatureLaw, k: int, form: str) -> float:
    own = trend.sets[trend.base.names[k]]
    return next((one.weight for one in own if one.name == form), 0.0)


def _title(trend: TemperatureLaw, coordinates: Coordinates, k: int, name: str) -> str:
    param, r = trend.base.table[name], trend.points.reference
    if k in coordinates.coefficients:
        return f"log10 of the rate of {name} (1/s) at {r.stress:.3g} MPa, {r.time:.3g} s"
    unit = "" if param.unit == "1" else f", {param.unit}"
    return f"{'log10 of ' if param.scale == 'log' else ''}{name}: {param.meaning}{unit}"


def _ends(param: Param, scale: float) -> tuple[float, float]:
    """The bounds as they are drawn, beyond which no interval goes."""
    low, high = (param.to_internal(b) * scale for b in param.bounds)
    return low, high


def _spread(function: Callable[[Floats], Floats], theta: Floats, covariance: Floats) -> Floats:
    """(temperatures,) standard deviations of a function of theta at each point."""
    own = [band(function, row, each)[1] for row, each in zip(theta, covariance, strict=True)]
    return np.array(own, float)


def _band(function: Callable[[Floats], Floats], one: Candidate, T: Floats) -> Floats:
    """(temperatures,) standard deviations of a function of theta along a candidate's curve."""
    names = list(one.internal)

    def along(numbers: Floats) -> Floats:
        moved = replace(one, internal=dict(zip(names, map(float, numbers), strict=True)))
        return function(moved.theta(T))

    return band(along, np.array(list(one.internal.values())), one.covariance)[1]
