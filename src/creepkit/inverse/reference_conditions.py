"""What a test states or shows of itself, before any law: its usable frames, their noise, and reference conditions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.checked_arguments import checked
from creepkit.errors import CreepkitError, FitError
from creepkit.inverse.compared_tests import followed_duration
from creepkit.language import CreepLaw, arrhenius, temperature
from creepkit.records import ZERO_CELSIUS, History, Predictor, growing_output, is_logarithmic, specimen_of
from creepkit.records.conditions import reference_conditions
from creepkit.records.reading_noise import noise_of_readings


def usable_frames(history: History, output: str) -> Bools:
    """(frames,) which frames of one output may be used: marked so, after time zero, and a number."""
    return np.asarray(history.used & (history.times > 0) & np.isfinite(history.outputs[output]))


def is_reversed(history: History) -> bool:
    """Whether a load changes sign: the noise of a strain that turns is no share of it."""
    values = history.loading.program().values
    return bool(values.min() < 0.0 < values.max())


@lru_cache(maxsize=4096)
def frame_noise(history: History, output: str) -> float:
    """Standard deviation of one output from frame to frame, in its unit; 0 for under 6 frames."""
    used = usable_frames(history, output)
    return 0.0 if used.sum() < 6 else noise_of_readings(history.outputs[output][used], history.times[used], order=3)


def noise_standard_deviation(history: History, output: str) -> Floats:
    """(frames,) standard deviation of one output, in its unit: as the history states it, else from frame to frame."""
    stated = history.standard_deviation.get(output)
    estimated = np.full(history.times.size, frame_noise(history, output))
    if stated is None:
        return estimated
    return np.where(np.isfinite(stated) & (stated > 0), stated, estimated)


HELD_LOAD = 0.02
"""Relative change of a load within which it is held."""


MINIMUM_FRAMES = 6
"""Frames of a hold from which an increase can be estimated."""


SIGNIFICANT_ERRORS = 5.0
"""Standard errors that an increase must exceed; and it must exceed the noise of one frame."""


STRAIN_WITHOUT_FRAMES = 0.1
"""Creep strain at the end of a test of which the end alone is known."""


@dataclass(frozen=True)
class CreepDetection:
    """By how much an output grows during the holds, its standard error, and the noise of a frame, in its unit.

    All are NaN where no hold has frames enough.
    """

    increase: float
    standard_error: float
    noise: float

    @property
    def shows_creep(self) -> bool:
        """Whether it is creep; true also where nothing can be said."""
        return not self.increase <= max(SIGNIFICANT_ERRORS * self.standard_error, self.noise)


def detect_creep(history: History, output: str) -> CreepDetection:
    """Mean of the last third of each hold less that of its first, summed over holds."""
    noise = float(np.median(noise_standard_deviation(history, output)))
    values, holds = history.outputs[output], list(_load_holds(history, usable_frames(history, output)))
    if not holds:
        return CreepDetection(float("nan"), float("nan"), noise)
    thirds = [np.array_split(values[frames], 3) for frames in holds]
    increase = sum(float(last.mean() - first.mean()) for first, _, last in thirds)
    variance = sum(1.0 / first.size + 1.0 / last.size for first, _, last in thirds)
    return CreepDetection(increase, noise * float(np.sqrt(variance)), noise)


def distinct_loads(histories: Sequence[History]) -> list[float]:
    """The loads at the used frames of tests, one for all that lie within 2 % of it."""
    loads: list[float] = []
    for history in histories:
        program = history.loading.program()
        for load in np.interp(history.times[history.used], program.times, program.values):
            if load != 0 and not any(abs(abs(load) - level) <= HELD_LOAD * level for level in loads):
                loads.append(abs(float(load)))
    return loads


def _load_holds(history: History, used: Bools) -> Iterator[Ints]:
    """The frames of each hold of the load that has enough of them."""
    frames = np.flatnonzero(used)
    program = history.loading.program()
    load = np.interp(history.times[frames], program.times, program.values)
    start = 0
    for k in range(1, frames.size + 1):
        if k == frames.size or abs(load[k] - load[start]) > HELD_LOAD * abs(load[start]):
            if k - start >= MINIMUM_FRAMES:
                yield frames[start:k]
            start = k


def reference_stresses(history: History, predictor: Predictor | None = None) -> Floats:
    """(stresses,) MPa, the reference stresses of a test."""
    stated = _stated(history, predictor, "reference_stress")
    if stated is not None:
        return np.atleast_1d(np.asarray(stated, float))
    if history.loading.quantity != "stress":
        raise FitError(
            f"{history.origin}: nothing says which stress a {history.loading.quantity} makes in the specimen "
            f"'{history.specimen}', and searches begin at a stress; give it a method reference_stress(history), MPa"
        )
    return np.abs(history.load_levels)


def simulated_stresses(
    law: CreepLaw, values: Mapping[str, float], history: History, predictor: Predictor | None
) -> Floats:
    """(stresses,) MPa above zero, that a test goes through by a law with values; of reference where it has no others.

    A plate that bulges sees a third of the stress that it begins with: the reference stresses alone do not say which
    stresses tests told of.
    """
    own, stresses = None if predictor is None else predictor.for_history(history), None
    with suppress(CreepkitError):  # a law that ends a test before its first frame says nothing of it
        stresses = None if own is None else own.simulated_stress(law, values, history)
    stresses = reference_stresses(history, predictor) if stresses is None else np.atleast_1d(stresses)
    return stresses[stresses > 0]


def reference_condition(history: History, predictor: Predictor | None = None) -> tuple[float, float]:
    """The condition by the reference stresses of a test."""
    return condition_at(reference_stresses(history, predictor), history)


def condition_at(stresses: Floats, history: History) -> tuple[float, float]:
    """Median of the stresses (stresses,) of a test above zero, MPa, 1e-6 where none is; and its mean temperature, K."""
    return float(np.median(stresses[stresses > 0])) if (stresses > 0).any() else 1e-6, history.mean_temperature


def _stated(history: History, predictor: Predictor | None, method: str) -> Any:
    """What the predictor of a test says of it by a method, else what the specimen that the test names says."""
    own = None if predictor is None else predictor.for_history(history)
    named = (own, None if own is None else own.specimen, specimen_of(history))
    return next((getattr(one, method)(history) for one in named if one is not None and one.states(method)), None)


def growth_per_strain(history: History, predictor: Predictor | None = None) -> float:
    """By how much the leading output grows for each unit of reference strain, in its unit; 1 where nothing says so."""
    stated = _stated(history, predictor, "growth_per_strain")
    return 1.0 if stated is None else float(stated)


def reference_end_strain(history: History, predictor: Predictor | None = None) -> float:
    """The largest strain that a test reached, estimated from its outputs; the predictor may state it."""
    if not history.outputs:
        rate = history.minimum_rate
        return STRAIN_WITHOUT_FRAMES if rate is None else max(rate * followed_duration(history), 1e-7)
    stated = _stated(history, predictor, "reference_strain")
    if stated is not None:
        return max(float(stated), 1e-7)
    output = growing_output(history)
    if is_logarithmic(output):
        return max(float(np.max(np.abs(history.outputs[output][usable_frames(history, output)]), initial=0.0)), 1e-7)
    return max(_output_increase(history)[0] / growth_per_strain(history, predictor), 1e-7)


def _duration(history: History) -> float:
    """s, up to the last used frame; of a test without frames for how long it lasted."""
    return float(history.times[history.used][-1]) if history.outputs else followed_duration(history)


def median_log_strain_rate(histories: Sequence[History], predictor: Predictor | None = None) -> float:
    """Median over tests of ln(strain / time), in 1/s."""
    log_rates = []
    for history in histories:
        output = growing_output(history)
        if not history.outputs or _stated(history, predictor, "reference_strain") is not None:
            strain, time = reference_end_strain(history, predictor), _duration(history)
        elif is_logarithmic(output):
            last = int(np.flatnonzero(usable_frames(history, output))[-1])
            strain, time = abs(float(history.outputs[output][last])), float(history.times[last])
        else:
            increase, time = _output_increase(history)
            strain = increase / growth_per_strain(history, predictor)
        log_rates.append(np.log(max(strain, 1e-9) / time))
    return float(np.median(log_rates))


def median_log_inverse_duration(histories: Sequence[History]) -> float:
    """Median over tests of ln of one over their duration, in 1/s."""
    return float(-np.median([np.log(followed_duration(h)) for h in histories]))


def _output_increase(history: History) -> tuple[float, float]:
    """Increase of the leading output between the first and last usable frame, in its unit, and the time, s."""
    output = growing_output(history)
    used = np.flatnonzero(usable_frames(history, output))
    values, times = history.outputs[output][used], history.times[used]
    if used.size < 2:
        return 0.0, float(history.times[-1])
    return abs(float(values[-1] - values[0])), float(times[-1] - times[0])


ISOTHERMAL_RANGE = 5.0
"""K; tests within this range are taken to be at one temperature."""


def reference_temperature(histories: Sequence[History]) -> float:
    """The median temperature of the tests, rounded to 10 C, in K."""
    temperatures = [float(np.mean(h.followed_temperatures)) for h in histories]
    return float(round((np.median(temperatures) - ZERO_CELSIUS) / 10.0) * 10.0 + ZERO_CELSIUS)


def spans_temperatures(histories: Sequence[History]) -> bool:
    """Whether the tests span more than 5 K."""
    temperatures = [float(v) for h in histories for v in h.followed_temperatures]
    return max(temperatures) - min(temperatures) > ISOTHERMAL_RANGE


@checked
def with_arrhenius(law: CreepLaw, histories: Sequence[History]) -> CreepLaw:
    """The law times an Arrhenius factor about the median temperature, if the tests call for one and it has none.

    Internal variables with rates of their own have activation energies of their own, as CreepLaw.times says.
    """
    if not histories:
        raise FitError("there are no histories whose temperatures say whether the law needs a factor")
    if law.uses(temperature) or not spans_temperatures(histories):
        return law
    return law.times(arrhenius(T_ref=reference_temperature(histories)))


@dataclass(frozen=True)
class ReferencePoint:
    """The point at which term rates are stated: stress MPa, strain, time s, temperature K.

    conditions : (name, value) of those of the law, the medians of the tests, in its units.
    """

    stress: float
    strain: float
    time: float
    temperature: float
    conditions: tuple[tuple[str, float], ...] = ()

    @classmethod
    def from_histories(
        cls, histories: Sequence[History], predictor: Predictor | None = None, law: CreepLaw | None = None
    ) -> ReferencePoint:
        """The middle of what was measured: geometric means of stress and time, of half the end strain; median T.

        predictor : where it states reference stresses, they are taken. law : whose conditions the tests state.
        """
        log_stresses = [np.mean(np.log(np.maximum(reference_stresses(h, predictor), 1e-6))) for h in histories]
        times = [_duration(h) for h in histories]
        strains = [reference_end_strain(h, predictor) for h in histories]
        temperatures = [float(np.mean(h.temperature_program().values)) for h in histories]
        stress, strain, time = (float(np.exp(np.mean(v))) for v in (log_stresses, np.log(strains), np.log(times)))
        conditions = () if law is None else tuple(reference_conditions(law, histories).items())
        return cls(stress, 0.5 * strain, 0.5 * time, float(np.median(temperatures)), conditions)

    def conditions_text(self, law: CreepLaw) -> str:
        """The conditions of the material for people, behind others: ", grain size 0.05 mm"; "" without any."""
        stated = dict(self.conditions)
        return "".join(f", {c.name.replace('_', ' ')} {stated[c.name]:.3g} {c.unit}" for c in law.conditions)

    def law_there(self, law: CreepLaw) -> CreepLaw:
        """The law at these conditions, or at others near by where a parameter would not matter at them."""
        there = law.at(None, **dict(self.conditions))
        moved = {name: 1.1 * value + 0.1 * (value == 0.0) for name, value in self.conditions}
        return there if there.names == law.names else law.at(None, **moved)
