"""The nouns: what goes into and comes out of the verbs. Frozen records; MPa, mm, s, K throughout."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from enum import IntEnum
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, Protocol, runtime_checkable

import numpy as np

from creepkit.arrays import ArrayLike, Bools, Floats, Ints, frozen
from creepkit.errors import HistoryError, SolveError

if TYPE_CHECKING:
    from creepkit.language.elastic import Elastic
    from creepkit.language.law import CreepLaw

ZERO_CELSIUS = 273.15


# ---- what is imposed -----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Program:
    """A piecewise linear function of time; a repeated time is a jump (the value after it holds from then on).

    times : (breakpoints,) s, non-decreasing, starting at 0.
    values : (breakpoints,).
    """

    times: Floats
    values: Floats

    def __post_init__(self) -> None:
        times, values = frozen(np.atleast_1d(self.times)), frozen(np.atleast_1d(self.values))
        if times.shape != values.shape or times.ndim != 1 or times.size == 0:
            raise SolveError(f"a program needs as many values as times, found {values.size} and {times.size}")
        if not (np.isfinite(times).all() and np.isfinite(values).all()):
            raise SolveError("a program of times and values must hold finite numbers only")
        if times[0] != 0.0 or (np.diff(times) < 0).any():
            raise SolveError("the times of a program must start at 0 and never decrease")
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "values", values)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Program):
            return NotImplemented
        return np.array_equal(self.times, other.times) and np.array_equal(self.values, other.values)

    def __hash__(self) -> int:
        return hash((self.times.tobytes(), self.values.tobytes()))

    @classmethod
    def constant(cls, value: float) -> Program:
        """The program that holds one value for ever."""
        return cls(np.zeros(1), np.full(1, float(value)))

    @classmethod
    def steps(cls, steps: Sequence[tuple[float, float]]) -> Program:
        """Constant pieces from (start time, value) pairs: [(0, 100), (3600, 120)]."""
        times, values = [0.0], [float(steps[0][1])]
        for start, value in steps[1:]:
            times += [float(start)] * 2
            values += [values[-1], float(value)]
        return cls(np.array(times), np.array(values))

    def at(self, times: ArrayLike) -> Floats:
        """Values at `times` (any shape), the later one at a jump, the last one beyond the end."""
        t = np.asarray(times, dtype=float)
        k = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, self.times.size - 1)
        following = np.minimum(k + 1, self.times.size - 1)
        width = self.times[following] - self.times[k]
        share = np.divide(t - self.times[k], width, out=np.zeros_like(t), where=width > 0)
        return np.asarray(self.values[k] + share * (self.values[following] - self.values[k]))


@runtime_checkable
class Loading(Protocol):
    """What drives a specimen: one prescribed quantity as a piecewise linear program."""

    @property
    def quantity(self) -> Literal["stress", "pressure"]:
        """What is prescribed."""
        ...

    def program(self) -> Program:
        """The prescribed quantity over time, MPa."""
        ...


@dataclass(frozen=True)
class StressSteps:
    """Uniaxial loading by steps of stress: [(0, 100), (3600, 120)] is 100 MPa, then 120 MPa from one hour on.

    control : "load" when the load is constant in each step (stress is engineering stress and true stress grows as
        exp(strain)); "stress" when true stress is held.
    """

    steps: tuple[tuple[float, float], ...]
    control: Literal["load", "stress"] = "load"
    quantity: Literal["stress", "pressure"] = field(default="stress", init=False)

    def __post_init__(self) -> None:
        steps = tuple((float(t), float(s)) for t, s in self.steps)
        if not steps or steps[0][0] != 0.0 or any(b[0] <= a[0] for a, b in pairwise(steps)):
            raise SolveError("stress steps must start at time 0 and follow one another in time")
        if any(not 0 <= s < 1e5 for _, s in steps):
            raise SolveError(f"stress must lie from 0 to 1e5 MPa in every step, found {[s for _, s in steps]}")
        if self.control not in ("load", "stress"):
            raise SolveError(f"control is '{self.control}'; allowed are 'load' and 'stress'")
        object.__setattr__(self, "steps", steps)

    def program(self) -> Program:
        """Stress over time, MPa."""
        return Program.steps(self.steps)


def constant_stress(stress: float, control: Literal["load", "stress"] = "load") -> StressSteps:
    """One stress, MPa, held from time zero."""
    return StressSteps(((0.0, stress),), control)


@dataclass(frozen=True)
class PressureJump:
    """Gas pressure P1, then P2 from Tj on, each reached by a linear ramp; MPa and s."""

    P1: float
    P2: float
    Tj: float
    ramp: float = 5.0
    quantity: Literal["stress", "pressure"] = field(default="pressure", init=False)

    def __post_init__(self) -> None:
        if not (self.P1 > 0 and self.P2 > 0 and self.ramp > 0 and self.Tj > self.ramp):
            raise SolveError("a pressure jump needs P1, P2 and ramp above zero and Tj after the first ramp")

    def program(self) -> Program:
        """Pressure over time, MPa."""
        times = np.array([0.0, self.ramp, self.Tj, self.Tj + self.ramp])
        return Program(times, np.array([0.0, self.P1, self.P1, self.P2]))


@dataclass(frozen=True)
class RecordedLoading:
    """A loading known as a program over time, MPa: a recorded column, or ramps that no simpler record describes.

    control : as in StressSteps; without meaning for a pressure.
    """

    record: Program
    quantity: Literal["stress", "pressure"]
    control: Literal["load", "stress"] = "load"

    def program(self) -> Program:
        """Stress or pressure over time, MPa."""
        return self.record


# ---- what was measured ---------------------------------------------------------------------------------------------


EVERY_FRAME: Bools = frozen([], dtype=bool)
"""The value of History.used that marks every frame."""


@dataclass(frozen=True, eq=False)
class History:
    """One measured (or planned) test: outputs over time, and everything known about how it was made.

    times : (frames,) s, strictly increasing.
    outputs : {name: (frames,)}; uniaxial: "strain", equivalent creep strain as `strain_measure` says.
    loading : what was imposed.
    temperature : K, a number or a Program.
    strain_measure : "logarithmic" or "engineering" (the observation operator of a uniaxial strain).
    includes_elastic : whether the strain contains the elastic strain on loading.
    used : (frames,) which frames a fit may use; EVERY_FRAME stands for all of them.
    operator : which observation operator, and window, made the outputs (empty: the specimen's default).
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

    def __post_init__(self) -> None:
        where = self.source or f"history '{self.name}'"
        times = frozen(self.times)
        if times.ndim != 1 or times.size == 0:
            raise HistoryError(f"{where}: no frames; a history needs at least one time")
        if not np.isfinite(times).all() or times[0] < 0:
            raise HistoryError(f"{where}: times must be finite and start at or after 0 s")
        if (np.diff(times) <= 0).any():
            k = int(np.argmax(np.diff(times) <= 0)) + 1
            found = f"{times[k]:g} s after {times[k - 1]:g} s"
            raise HistoryError(f"{where}: time does not increase at frame {k + 1} ({found})")
        outputs = {name: frozen(values) for name, values in self.outputs.items()}
        for name, values in outputs.items():
            if values.shape != times.shape:
                raise HistoryError(f"{where}: output '{name}' has {values.size} values for {times.size} times")
        used = np.ones(times.size, bool) if self.used is EVERY_FRAME else self.used
        if np.shape(used) != times.shape:
            raise HistoryError(f"{where}: 'used' marks {np.size(used)} frames of {times.size}")
        freeze = object.__setattr__
        freeze(self, "times", times)
        freeze(self, "outputs", MappingProxyType(outputs))
        freeze(self, "used", frozen(used, dtype=bool))
        if not isinstance(self.temperature, Program):
            if not 0 < float(self.temperature) < 1e4:
                raise HistoryError(f"{where}: temperature {self.temperature} K is not above 0 and below 10000 K")
            freeze(self, "temperature", float(self.temperature))
        sd = {n: frozen(np.broadcast_to(np.asarray(v, float), times.shape)) for n, v in self.standard_deviation.items()}
        freeze(self, "standard_deviation", MappingProxyType(sd))
        freeze(self, "geometry", MappingProxyType(dict(self.geometry)))
        freeze(self, "labels", MappingProxyType(dict(self.labels)))

    def replace(self, **changes: Any) -> History:
        """The same history with some fields changed; new times are all used unless `used` is given too."""
        if "times" in changes:
            changes = {"used": EVERY_FRAME, **changes}
        return replace(self, **changes)

    def __reduce__(self) -> tuple[Any, ...]:
        state = {f.name: getattr(self, f.name) for f in fields(self)}
        return _history, ({k: dict(v) if isinstance(v, MappingProxyType) else v for k, v in state.items()},)

    def up_to(self, output: str, limit: float) -> History:
        """Mark unused every frame from the first used one whose `output` exceeds `limit` on."""
        over = np.flatnonzero((self.outputs[output] > limit) & self.used)
        used = np.array(self.used)
        if over.size:
            used[over[0] :] = False
        return self.replace(used=used)

    def temperature_program(self) -> Program:
        """Temperature over time, K."""
        return self.temperature if isinstance(self.temperature, Program) else Program.constant(self.temperature)

    @property
    def condition(self) -> str:
        """The nominal condition in words, '850 C, 43 MPa': what leave-one-condition-out holds out."""
        load = self.loading.program().values
        low, high = float(load.min()), float(load.max())
        driven = f"{high:g}" if low == high or self.loading.quantity == "pressure" else f"{load[0]:g} to {load[-1]:g}"
        T = self.temperature_program().values - ZERO_CELSIUS
        warm = f"{T[0]:.0f}" if np.ptp(T) < 0.5 else f"{T[0]:.0f} to {T[-1]:.0f}"
        return f"{warm} C, {driven} MPa"


def _history(state: dict[str, Any]) -> History:
    return History(**state)


# ---- what a model says ---------------------------------------------------------------------------------------------


class Status(IntEnum):
    """How a predicted row ended."""

    COMPLETE = 0
    BURST = 1
    NOT_CONVERGED = 2
    OUTSIDE_DOMAIN = 3


@dataclass(frozen=True, eq=False)
class Prediction:
    """Predicted outputs for candidates x tests, padded to the longest test.

    values : (candidates, tests, times, outputs); NaN after a row's end and beyond a test's last time.
    outputs : names along the last axis.
    lengths : (tests,) number of times of each test.
    status : (candidates, tests) Status of each row; end_times : (candidates, tests) s, where it ended.
    jacobian : (candidates, tests, times, outputs, parameters) or None: derivatives with respect to the law's
        *internal* parameters (the natural logarithm where the scale is log), in the law's order.
    """

    values: Floats
    outputs: tuple[str, ...]
    lengths: Ints
    status: Ints
    end_times: Floats
    jacobian: Floats | None = None
    times: tuple[Floats, ...] = ()

    def of(self, test: int, candidate: int = 0) -> Floats:
        """Outputs of one test, (times, outputs)."""
        return np.asarray(self.values[candidate, test, : int(self.lengths[test])])


@runtime_checkable
class Predictor(Protocol):
    """Anything that predicts histories from a law and its values: specimen, surrogate or closed form."""

    def predict(
        self,
        law: CreepLaw,
        values: Mapping[str, ArrayLike],
        histories: Sequence[History],
        *,
        jacobian: bool = False,
    ) -> Prediction:
        """Predict each history's outputs at its times.

        values : {parameter: number or (candidates,)} in the author's units; 0 may switch a parameter off.
        """
        ...


@runtime_checkable
class Specimen(Predictor, Protocol):
    """A frozen record of a test piece: which outputs are observed, and how to predict them."""

    @property
    def name(self) -> str:
        """Short, lower case, unique in the registry."""
        ...

    @property
    def title(self) -> str:
        """One line for people."""
        ...

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of what is observed."""
        ...


@dataclass(frozen=True)
class Nuisance:
    """Something unknown about a test that is not part of the law, with its prior.

    kind : "offset" (added to an output), "rate" (ln of a factor on this test's creep rate: heat-to-heat scatter),
        "thickness" (apex, mm), "modulus" (relative), "temperature" (K) or "window" (mm).
    scope : one unknown for each "test", each "alloy", or for "all" tests together.
    mean, sd : Gaussian prior; sd = inf leaves it free, sd = None lets the fit estimate the spread.
    """

    kind: Literal["offset", "rate", "thickness", "modulus", "temperature", "window"]
    scope: Literal["test", "alloy", "all"] = "test"
    output: str = ""
    mean: float = 0.0
    sd: float | None = None
    bounds: tuple[float, float] = (-np.inf, np.inf)

    def __post_init__(self) -> None:
        if self.sd is not None and not self.sd > 0:
            raise SolveError(f"nuisance '{self.kind}': sd = {self.sd} must be above zero (or None to estimate it)")
        if not self.bounds[0] < self.bounds[1]:
            raise SolveError(f"nuisance '{self.kind}': bounds {self.bounds} are reversed")


# ---- doors of plugins ----------------------------------------------------------------------------------------------


@runtime_checkable
class Reader(Protocol):
    """Turns measured files into histories."""

    @property
    def name(self) -> str:
        """Short, lower case, unique in the registry."""
        ...

    @property
    def title(self) -> str:
        """One line for people."""
        ...

    def accepts(self, path: Path) -> bool:
        """Say whether this reader understands the file or folder, without reading all of it."""
        ...

    def read(self, path: Path) -> list[History]:
        """Return the histories in the file or folder; HistoryError with file and line when it cannot."""
        ...


@runtime_checkable
class Exporter(Protocol):
    """Writes a law and its values as text."""

    @property
    def name(self) -> str:
        """Short, lower case, unique in the registry."""
        ...

    @property
    def title(self) -> str:
        """One line for people."""
        ...

    @property
    def suffix(self) -> str:
        """Ending of a file's name, with its dot."""
        ...

    def text(self, law: CreepLaw, values: Mapping[str, float], notes: Sequence[str]) -> str:
        """Return the text; `notes` (intervals, validity) become comments; ExportError when it cannot."""
        ...
