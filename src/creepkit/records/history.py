"""What was measured: one test, everything known about how it was made, and how the noise of its outputs correlates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from creepkit.arrays import Bools, Floats, frozen, set_fields
from creepkit.checked_arguments import checked
from creepkit.errors import HistoryError, quoted
from creepkit.limits import HOTTEST
from creepkit.records.loading import Loading, Program, loading_text
from creepkit.records.presentable import NotebookCell, Plotted, Tabulated
from creepkit.records.specimen_lookup import load_unit
from creepkit.records.units import celsius_text

if TYPE_CHECKING:
    from pandas import DataFrame

    from creepkit.language.elastic import Elastic


def correlation_matrix(correlations: Mapping[tuple[str, str], float], names: Sequence[str] = ()) -> Floats:
    """(names, names), ones on its diagonal; names : in order, by default those of the pairs."""
    order = list(names) or list(dict.fromkeys(name for pair in correlations for name in pair))
    matrix = np.eye(len(order))
    for (first, second), value in correlations.items():
        i, j = order.index(first), order.index(second)
        matrix[i, j] = matrix[j, i] = value
    return matrix


def can_hold_together(correlations: Mapping[tuple[str, str], float]) -> bool:
    """Whether some noise has these correlations: their matrix is finite and positive definite."""
    if not correlations:
        return True
    matrix = correlation_matrix(correlations)
    return bool(np.isfinite(matrix).all() and (np.linalg.eigvalsh(matrix) > 0.0).all())


RUPTURE_TIME_TOLERANCE = 0.01
"""By how much of a rupture time frames may lie after it: laboratories round it to three digits."""


UNKNOWN_DURATION = 1.0
"""s; the one time of a test without frames whose duration nobody stated."""


LOADING_RAMP, RISES = 0.1, 0.98
"""Of the duration of a test, the longest ramp that raises its load first; it rises to more than what was over this."""


EVERY_FRAME: Bools = frozen([], dtype=bool)
"""The value of History.used that marks every frame."""


class Measured(NotebookCell, Plotted, Tabulated):
    """One or several tests, which notebooks show as a table and a picture of their outputs over time."""

    drawn_by = "histories.tests_figure", "histories.draw_tests"


@checked
@dataclass(frozen=True, eq=False)
class History(Measured):
    """One measured (or planned) test: outputs over time, and everything known about how it was made.

    times : (frames,) s, strictly increasing.
    outputs : {name: (frames,)}; uniaxial: "strain", equivalent creep strain as `strain_measure` says.
    loading : what was imposed.
    temperature : K, a number or a Program.
    strain_measure : "logarithmic" or "engineering" (the observation operator of a uniaxial strain); files that state
        none hold engineering strains. includes_elastic : whether the strain contains the elastic strain on loading.
    standard_deviation : {output: (frames,)} of the noise, where it is known, in the unit of the output.
    used : (frames,) which frames a fit may use; EVERY_FRAME stands for all of them.
    operator : which observation operator, and window, made the outputs (empty: the specimen's default).
    rupture_time : s, when the specimen broke; None where it did not, or where that is not known.
    unruptured : whether the test was stopped, at its last time, before the specimen broke. A test with neither says
        nothing of how it ended.
    noise_correlation : {(output, output): correlation} of the noise of two outputs in one frame, -1 to 1; pairs
        that are not given err independently. A plan, with outputs {}, keeps those of the test it was made from.
    minimum_rate : 1/s, the smallest creep rate of the test, where it is all or part of what is known; minimum_rate_sd :
        its standard deviation, 1/s. A test of which only that, or only its end, is known has outputs {} and one time.
    stated : {"temperature", "stress" or "pressure": program} that was stated of a quantity whose record is used, K and
        MPa; a check of data quality compares them.
    """

    name: str
    times: Floats
    outputs: Mapping[str, Floats]
    loading: Loading
    temperature: float | Program
    specimen: str = "uniaxial"
    elastic: Elastic | None = None
    strain_measure: Literal["logarithmic", "engineering"] = "logarithmic"
    includes_elastic: bool = False
    standard_deviation: Mapping[str, Floats] = field(default_factory=dict)
    used: Bools = field(default_factory=lambda: EVERY_FRAME)
    geometry: Mapping[str, float] = field(default_factory=dict)
    operator: str = ""
    alloy: str = ""
    labels: Mapping[str, str] = field(default_factory=dict)
    source: str = ""
    rupture_time: float | None = None
    unruptured: bool = False
    stated: Mapping[str, Program] = field(default_factory=dict)
    noise_correlation: Mapping[tuple[str, str], float] = field(default_factory=dict)
    minimum_rate: float | None = None
    minimum_rate_sd: float | None = None

    def __post_init__(self) -> None:
        origin = self.origin
        times = frozen(self.times)
        if times.ndim != 1 or times.size == 0:
            raise HistoryError(f"{origin}: no frames; a history needs at least one time")
        if not np.isfinite(times).all() or times[0] < 0:
            raise HistoryError(f"{origin}: times must be finite and start at or after 0 s")
        if (np.diff(times) <= 0).any():
            k = int(np.argmax(np.diff(times) <= 0)) + 1
            description = f"{times[k]:g} s after {times[k - 1]:g} s"
            raise HistoryError(f"{origin}: time does not increase at frame {k + 1} ({description})")
        outputs = {name: frozen(values) for name, values in self.outputs.items()}
        for name, values in outputs.items():
            if values.shape != times.shape:
                raise HistoryError(f"{origin}: output '{name}' has {values.size} values for {times.size} times")
        used = np.ones(times.size, bool) if self.used is EVERY_FRAME else self.used
        if np.shape(used) != times.shape:
            raise HistoryError(f"{origin}: 'used' marks {np.size(used)} frames of {times.size}")
        set_fields(self, times=times, outputs=MappingProxyType(outputs), used=frozen(used, dtype=bool))
        temperatures = (
            self.temperature.values if isinstance(self.temperature, Program) else np.array([float(self.temperature)])
        )
        possible = (temperatures > 0) & (temperatures < HOTTEST)
        if not possible.all():
            raise HistoryError(
                f"{origin}: a temperature of {temperatures[~possible][0]:g} K is not above 0 and below {HOTTEST:g} K"
            )
        if not isinstance(self.temperature, Program):
            set_fields(self, temperature=float(self.temperature))
        if not callable(getattr(self.loading, "program", None)):
            raise HistoryError(
                f"{origin}: loading is {quoted(repr(self.loading))}; give what was imposed, such as "
                "ck.constant_stress(100.0)"
            )
        self._check_end(origin)
        sd = {n: self._checked_sd(origin, n, v, times.size) for n, v in self.standard_deviation.items()}
        given = {name: dict(getattr(self, name)) for name in ("geometry", "stated", "labels")}
        given |= {"standard_deviation": sd, "noise_correlation": self._checked_correlation(origin)}
        set_fields(self, **{name: MappingProxyType(mapping) for name, mapping in given.items()})
        self._check_minimum_rate(origin)

    @staticmethod
    def _checked_sd(origin: str, name: str, values: Floats, frames: int) -> Floats:
        """(frames,) standard deviations of one output; HistoryError for what cannot be one."""
        array = np.asarray(values, float)
        if array.ndim > 1 or array.size not in (1, frames):
            raise HistoryError(f"{origin}: standard_deviation of '{name}' has {array.size} values for {frames} times")
        if np.isinf(array).any() or (array < 0).any():
            raise HistoryError(
                f"{origin}: a standard_deviation of '{name}' is negative or infinite; give numbers above zero, NaN "
                "where it is not known"
            )
        return frozen(np.broadcast_to(array.ravel() if array.size == 1 else array, (frames,)))

    def _checked_correlation(self, origin: str) -> dict[tuple[str, str], float]:
        """Correlations by pair, in the order of the outputs; HistoryError for what cannot be one."""
        # a plan without outputs keeps what will be known of their noise
        order = list(self.outputs)
        correlations: dict[tuple[str, str], float] = {}
        for pair, value in self.noise_correlation.items():
            if len(set(pair)) != 2 or (order and not set(pair) <= set(order)):
                names = " and ".join(str(name) for name in pair)
                raise HistoryError(
                    f"{origin}: a noise_correlation of {names}; give it of two of its outputs: {', '.join(order)}"
                )
            first, second = sorted(pair, key=order.index) if order else pair
            correlations[first, second] = float(value)
        if not can_hold_together(correlations):
            stated = ", ".join(f"{a} {b} {value:g}" for (a, b), value in correlations.items())
            raise HistoryError(f"{origin}: the noise correlations {stated} cannot all hold; give numbers within +-1")
        return correlations

    def _check_minimum_rate(self, origin: str) -> None:
        for name in ("minimum_rate", "minimum_rate_sd"):
            value = getattr(self, name)
            if value is None:
                continue
            if not (np.isfinite(value) and value > 0):
                raise HistoryError(f"{origin}: {name} is {value:g} 1/s; it must be a finite number above zero")
            object.__setattr__(self, name, float(value))
        if self.minimum_rate is None and self.minimum_rate_sd is not None:
            raise HistoryError(f"{origin}: a minimum_rate_sd without a minimum_rate; give both")

    def _check_end(self, origin: str) -> None:
        """A specimen breaks once, and has no frames afterwards but for the rounding of the rupture time."""
        if self.rupture_time is None:
            return
        time, last = float(self.rupture_time), float(self.times[self.used][-1]) if self.used.any() else 0.0
        if not (np.isfinite(time) and time > 0):
            raise HistoryError(f"{origin}: a rupture time of {time:g} s is not a finite time above zero")
        if self.unruptured:
            raise HistoryError(f"{origin}: it ruptured at {time:g} s and was stopped unruptured; keep one of them")
        if last > (1 + RUPTURE_TIME_TOLERANCE) * time:
            raise HistoryError(
                f"{origin}: a used frame at {last:g} s lies after the rupture at {time:g} s; mark it unused"
            )
        object.__setattr__(self, "rupture_time", time)

    @property
    def origin(self) -> str:
        """The file it was read from, or its name, as errors begin."""
        return self.source or f"history '{self.name}'"

    @property
    def end_known(self) -> bool:
        """Whether it is known how the test ended: by rupture, or stopped before."""
        return self.rupture_time is not None or self.unruptured

    def __repr__(self) -> str:
        return f"<History '{self.name}': {self.specimen}, {self.condition}, {self.times.size} readings>"

    @classmethod
    def from_dataframe(cls, frame: DataFrame, /, **conditions: Any) -> History:
        """One test from a table of pandas: columns and conditions named with units, as in test files.

        frame : one row a reading, with columns such as time_h and strain_pct; those of to_dataframe() are read back.
        conditions : what stands in the head of a file: stress_MPa=120, temperature_C=750, name="bar 12".

        >>> ck.History.from_dataframe(frame, stress_MPa=120, temperature_C=750)  # doctest: +SKIP
        """
        from creepkit.reports.dataframes import history_from_dataframe

        return history_from_dataframe(frame, conditions)

    def replace(self, **changes: Any) -> History:
        """The same history with some fields changed.

        New times are all used, and say nothing of how the test ended, unless that is given too. Outputs that are left
        out take the correlations of their noise with them.
        """
        if "times" in changes:
            changes = {"used": EVERY_FRAME, "rupture_time": None, "unruptured": False, **changes}
        if changes.get("outputs") and "noise_correlation" not in changes:
            kept = {p: rho for p, rho in self.noise_correlation.items() if set(p) <= set(changes["outputs"])}
            changes = {**changes, "noise_correlation": kept}
        return replace(self, **changes)

    def __reduce__(self) -> tuple[Any, ...]:
        state = {f.name: getattr(self, f.name) for f in fields(self)}
        plain: dict[str, Any] = {k: dict(v) if isinstance(v, MappingProxyType) else v for k, v in state.items()}
        return partial(type(self), **plain), ()

    def up_to(self, output: str, limit: float) -> History:
        """Mark unused every frame from the first used one whose `output` exceeds `limit` on.

        A history that is cut says nothing any more of how the test ended. One without frames stays as it is.
        """
        if not self.outputs:
            return self
        exceeding = np.flatnonzero((self.outputs[output] > limit) & self.used)
        if not exceeding.size:
            return self
        used = np.array(self.used)
        used[exceeding[0] :] = False
        return self.replace(used=used, rupture_time=None, unruptured=False)

    def temperature_program(self) -> Program:
        """Temperature over time, K."""
        return self.temperature if isinstance(self.temperature, Program) else Program.constant(self.temperature)

    @property
    def used_times(self) -> Floats:
        """(used frames,) s; of all frames where none is used."""
        return self.times[self.used] if self.used.any() else self.times

    @property
    def frames_with_data(self) -> Bools:
        """(frames,) whether any output has a number there."""
        finite = [np.isfinite(values) for values in self.outputs.values()]
        return np.asarray(np.any(finite, axis=0)) if finite else np.zeros(self.times.size, bool)

    @property
    def mean_temperature(self) -> float:
        """Mean temperature over the used frames, K."""
        return float(self.temperature_program().at(self.used_times).mean())

    @property
    def followed_temperatures(self) -> Floats:
        """(levels,) K, those of the program up to the last used frame: later ones decide nothing that is compared."""
        program, end = self.temperature_program(), self.used_times[-1]
        return np.append(program.values[program.times < end], program.before(end))  # a step at it did nothing to it

    @property
    def load_levels(self) -> Floats:
        """(levels,) the load at the breakpoints of its program, from the end of a short ramp that raised it on."""
        program = self.loading.program()
        times, loads = program.times, np.abs(program.values)
        short, first = LOADING_RAMP * max(self.times[-1] - times[0], 0.0), 0
        while (
            first + 1 < times.size and loads[first] < RISES * loads[first + 1] and times[first + 1] - times[0] <= short
        ):
            first += 1
        return program.values[first:]

    @property
    def condition(self) -> str:
        """The nominal condition in words, '850 °C, 43 MPa': what leave-one-condition-out holds out."""
        kelvin = self.temperature_program().values
        ends = (kelvin[0], kelvin[-1]) if abs(kelvin[-1] - kelvin[0]) >= 0.5 else (kelvin.min(), kelvin.max())
        if np.ptp(kelvin) < 0.5:
            ends = (kelvin[0], kelvin[0])
        return f"{celsius_text(*ends, digits=0)}, {loading_text(self.loading, load_unit(self))}"


class Histories(list[History], Measured):
    """A list of tests, which notebooks show as a table and a picture."""

    def __repr__(self) -> str:
        return f"<Histories: {len(self)}, {', '.join(one.name for one in self[:4])}{', ...' * (len(self) > 4)}>"
