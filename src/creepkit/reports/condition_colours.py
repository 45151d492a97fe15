"""Colours of tests by their conditions: a colour each for a few tests, a colour scale for many."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.reference_conditions import ISOTHERMAL_RANGE, reference_stresses
from creepkit.records import ZERO_CELSIUS, History, Predictor
from creepkit.records.held_levels import held_temperatures, is_isothermal, temperature_holds

if TYPE_CHECKING:
    from matplotlib.axes import Axes


USED, SAME, LABELS = (0.15, 0.65), 1e-6, 5
"""Of a colour map, whose palest colours cannot be seen on white, nor its darkest told apart on a dark page; the
relative difference of conditions that are one; and labels along a colour bar, its ends among them."""


@dataclass(frozen=True, eq=False)
class ColourScale:
    """A colour scale by a condition.

    label : the condition and its unit; values : (tests,) the condition of each test; logarithmic : of the scale.
    levels : (levels,) of the tests where single ones have several, which the scale spans too.
    """

    label: str
    values: Floats
    logarithmic: bool = False
    colour_map: str = "viridis"
    levels: Floats = field(default_factory=lambda: np.zeros(0))

    @property
    def ends(self) -> tuple[float, float]:
        """The least and the largest value that the scale spans."""
        spanned = np.append(self.values, self.levels)
        return float(spanned.min()), float(spanned.max())

    def __call__(self, value: float) -> Any:
        """The colour of a value of the condition."""
        from matplotlib import colormaps

        transform: Callable[[Any], Any] = np.log if self.logarithmic else np.asarray
        low, high = (float(transform(end)) for end in self.ends)
        share = (float(transform(value)) - low) / (high - low) if high - low > SAME * abs(high) else 0.0
        return colormaps[self.colour_map](USED[0] + (USED[1] - USED[0]) * share)

    @property
    def colours(self) -> list[Any]:
        """The colour of each test."""
        return [self(value) for value in self.values]

    def add_bar(self, axes: Axes) -> None:
        """The colour bar of the scale at the right of a panel, with a label at either end."""
        from matplotlib import colormaps
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import ListedColormap, LogNorm, Normalize
        from matplotlib.ticker import NullLocator

        low, high = self.ends
        norm = (LogNorm if self.logarithmic else Normalize)(low, high)
        colours = ListedColormap(colormaps[self.colour_map](np.linspace(*USED, 256)))
        bar = axes.figure.colorbar(ScalarMappable(norm, colours), ax=axes, label=self.label, pad=0.01, aspect=30)
        ticks = np.unique([float(f"{value:.3g}") for value in np.append(self.values, self.levels)])
        if ticks.size > LABELS or ticks[0] < low or ticks[-1] > high:  # of few conditions those that were tested
            ticks = (np.geomspace if self.logarithmic else np.linspace)(low, high, LABELS)
        bar.set_ticks(list(ticks), labels=[f"{float(f'{v:.3g}'):g}" for v in ticks])
        bar.ax.yaxis.set_minor_locator(NullLocator())


def temperatures_celsius(histories: Sequence[History]) -> Floats:
    """(tests,) mean temperature, °C."""
    return np.array([h.mean_temperature for h in histories]) - ZERO_CELSIUS


def mean_stresses(histories: Sequence[History], predictor: Predictor | None) -> Floats:
    """(tests,) MPa, the geometric mean of the reference stresses of each test."""
    means = []
    for history in histories:
        stresses = reference_stresses(history, predictor)
        positive = stresses[stresses > 0]
        means.append(float(np.exp(np.mean(np.log(positive)))) if positive.size else 1.0)
    return np.array(means)


def temperature_scale(histories: Sequence[History]) -> ColourScale:
    """Colours by temperature: a test with steps has that of its mean, which is no level of the scale."""
    levels = np.array([T for h in histories for T in held_temperatures(h)]) - ZERO_CELSIUS
    return ColourScale("temperature, °C", temperatures_celsius(histories), colour_map="plasma", levels=levels)


def tested_temperatures(histories: Sequence[History]) -> list[float]:
    """°C at which tests are held, those within ISOTHERMAL_RANGE as their mean; of ramps alone, the means of tests."""
    held = sorted(T for h in histories if is_isothermal(h) or temperature_holds(h) for T in held_temperatures(h))
    found: list[list[float]] = []
    for kelvin in held or sorted(h.mean_temperature for h in histories):
        if found and kelvin - found[-1][0] <= ISOTHERMAL_RANGE:
            found[-1].append(kelvin)
        else:
            found.append([kelvin])
    return [float(np.mean(one)) - ZERO_CELSIUS for one in found]


def stress_scale(histories: Sequence[History], predictor: Predictor | None) -> ColourScale:
    """Colours by stress."""
    return ColourScale("stress, MPa", mean_stresses(histories, predictor), logarithmic=True)


def distinct_colours(count: int) -> list[Any]:
    """A colour for each of at most ten tests."""
    from matplotlib import colormaps

    return [colormaps["tab10"](k % 10) for k in range(count)]
