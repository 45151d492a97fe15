"""What tests hold that decides which stages of a study make sense."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from creepkit.inverse.compared_tests import duration_known
from creepkit.inverse.held_levels import held_temperatures
from creepkit.quality.curve_shapes import shows_tertiary_creep
from creepkit.records import History, load_unit
from creepkit.records.units import celsius_text

FEWEST_RUPTURES = 5
"""For methods of rupture times."""


SAME_TEMPERATURE = 5.0
"""K."""


@dataclass(frozen=True)
class DataSummary:
    """What tests hold that decides which stages make sense.

    loads : levels above zero that are held, of all tests. temperatures : K, of distinct levels. alloys, heats : that
    are named. ruptured, tertiary : tests that ended by rupture, and those with tertiary creep.
    """

    tests: tuple[History, ...]
    loads: tuple[float, ...]
    temperatures: tuple[float, ...]
    alloys: tuple[str, ...]
    heats: tuple[str, ...]
    ruptured: int
    tertiary: int

    @classmethod
    def of(cls, tests: Sequence[History]) -> DataSummary:
        """The summary of tests."""
        levels: list[float] = []
        for temperature in sorted(value for history in tests for value in held_temperatures(history)):
            if not levels or temperature > levels[-1] + SAME_TEMPERATURE:
                levels.append(temperature)
        return cls(
            tuple(tests),
            tuple(sorted({round(float(v), 6) for h in tests for v in _held_levels(h)})),
            tuple(levels),
            tuple(dict.fromkeys(h.alloy for h in tests if h.alloy)),
            tuple(dict.fromkeys(h.labels["heat"] for h in tests if h.labels.get("heat"))),
            sum(history.rupture_time is not None for history in tests),
            sum(shows_tertiary_creep(history) for history in tests),
        )

    @property
    def framed(self) -> list[History]:
        """Tests with frames or a minimum rate, from which a law can be identified."""
        return [h for h in self.tests if h.outputs or h.minimum_rate is not None]

    @property
    def with_curves(self) -> bool:
        """Whether any test has a curve."""
        return any(history.outputs for history in self.tests)

    @property
    def durations_known(self) -> bool:
        """Whether all tests say how long they lasted."""
        return all(map(duration_known, self.tests))

    @property
    def rupture_table(self) -> bool:
        """Whether most tests have no curves, and enough of these ended by rupture to identify damage from."""
        without_curves = [history for history in self.tests if not history.outputs]
        ruptured = sum(history.rupture_time is not None for history in without_curves)
        return 2 * len(without_curves) > len(self.tests) and ruptured >= FEWEST_RUPTURES

    @property
    def lines(self) -> list[str]:
        """It in sentences."""
        low, high, several = self.temperatures[0], self.temperatures[-1], len(self.loads) > 1
        at = celsius_text(low, high, digits=0) + (f" ({len(self.temperatures)} levels)" if high - low >= 1 else "")
        units = {load_unit(history) for history in self.tests}
        loads = f"{len(self.loads)} level{'s' if several else ''} of load"
        if len(units) == 1:
            loads += f", {self.loads[0]:g}"
            loads += f" to {self.loads[-1]:g} {units.pop() or self.tests[0].loading.quantity}" if several else ""
        kinds = ", ".join(dict.fromkeys(history.specimen for history in self.tests))
        stopped = sum(history.unruptured for history in self.tests)
        count = f"{len(self.tests)} test{'s' if len(self.tests) > 1 else ''} ({kinds})"
        return [
            f"{count}, {len(self.framed)} with curves or rates; {loads}; {at}",
            f"ended by rupture: {self.ruptured}; stopped before: {stopped}; with tertiary creep: {self.tertiary}",
        ]


def _held_levels(history: History) -> list[float]:
    """Levels of the load above zero that last: those of a ramp are passed."""
    values = history.loading.program().values
    held = [float(v) for v, later in pairwise((*values, values[-1])) if v == later and v > 0]
    return held or [float(values.max())]
