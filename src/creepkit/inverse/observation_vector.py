"""Observation vector: the measured values of all tests, usable and thinned frames, and the noise of a frame.

An observation is a functional of the trajectory of a test with a noise of its own: the values of an output at frames,
the times at which strains are reached (of tests that are followed to rupture, see inverse.residuals), the minimum creep
rate, or the end. Each test is one row: the frames of all its outputs, then its minimum rate or its end where that is
known, padded to the longest test.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.errors import FitError, SolveError
from creepkit.inverse.compared_tests import compares_minimum_rate, followed_duration
from creepkit.inverse.composite_predictor import compared_outputs
from creepkit.inverse.observation_series import SharedNoise
from creepkit.inverse.output_transforms import LinearTransform, LogTransform, OutputTransform, SingleValueTransform
from creepkit.inverse.reference_conditions import frame_noise, is_reversed, noise_standard_deviation, usable_frames
from creepkit.quality.curve_shapes import runs_away
from creepkit.records import History, Prediction, Predictor, is_logarithmic
from creepkit.records.history import correlation_matrix

RUPTURE_OUTPUT = "rupture"
"""The output of tests that were followed to rupture: the rupture time, s. It has no frames of its own."""


MINIMUM_RATE_OUTPUT = "minimum_rate"
"""The output of tests without frames of which the minimum creep rate is known, 1/s."""


SINGLE_VALUES = (MINIMUM_RATE_OUTPUT, RUPTURE_OUTPUT)
"""Outputs of which a test has one value: no frames, no offset, no drift, and all of its scatter in one misfit."""


FLOOR_SHARE, FLOOR_NOISES = 0.01, 3.0
"""Floor of a logarithmic transform: over the median end value, and at least so many times the noise of a frame."""


def transform_for(histories: Sequence[History], output: str) -> OutputTransform:
    """The transform of one output of these histories, all of which have it.

    Of strains logarithmic, with a floor at 1 % of the median end value and never below three times the noise of a
    frame; of other curves linear, in standard deviations of all their frames about their one mean.
    """
    if output == RUPTURE_OUTPUT:
        return SingleValueTransform(-1.0)
    if output == MINIMUM_RATE_OUTPUT:  # a test that breaks at once has e times the largest rate that was measured
        return SingleValueTransform(1.0, float(np.log(max(h.minimum_rate or 0.0 for h in histories))) + 1.0)
    values = [h.outputs[output][usable_frames(h, output)] for h in histories]
    if is_logarithmic(output):
        typical = float(np.median([np.max(np.abs(one), initial=0.0) for one in values]))
        noise = float(np.median([frame_noise(h, output) for h in histories]))
        return LogTransform(max(FLOOR_SHARE * typical, FLOOR_NOISES * noise, 1e-14))
    joined = np.concatenate(values)
    largest, spread = float(np.max(joined, initial=0.0)), float(np.std(joined)) if joined.size else 0.0
    return LinearTransform(max(spread, 1e-6 * abs(largest), 1e-14), largest)


def selected_frames(history: History, count: int) -> Ints:
    """(selected,) indices of at most `count` used frames after time zero, half spread in ln t and half in t."""
    candidates = np.flatnonzero(history.used & (history.times > 0) & history.frames_with_data)
    if candidates.size <= count:
        return candidates
    times = history.times[candidates]
    targets = np.concatenate(
        [np.geomspace(times[0], times[-1], count - count // 2), np.linspace(times[0], times[-1], count // 2)]
    )
    nearest = np.abs(times[:, None] - targets[None, :]).argmin(axis=0)
    return np.asarray(candidates[np.unique(nearest)])


def thinned_history(history: History, count: int) -> History:
    """The history at its selected frames only, all outputs of a frame together; one without frames as it is."""
    if not history.outputs:
        return history
    selected = selected_frames(history, count)
    return replace(
        history,
        times=history.times[selected],
        outputs={name: values[selected] for name, values in history.outputs.items()},
        standard_deviation={name: values[selected] for name, values in history.standard_deviation.items()},
        used=np.ones(selected.size, bool),
    )


RELATIVE_DISCREPANCY_UNIT = 0.01
"""Unit of the model discrepancy of an output that spans decades, in its logarithm."""


SMALLEST_NOISE = 1e-2
"""Least noise of a likelihood, over the floor of the output's transform: simulated histories have none of their own."""


LINEAR_COORDINATE_LENGTH = 5.0
"""Correlation time of a whole test where outputs have a linear transform: about a decade and a half in ln t."""


@dataclass(frozen=True, eq=False)
class ObservedOutput:
    """What one test says of one output: its values at frames, its minimum rate, or its end.

    frames : (values,) their positions among the frames of the history; of a single value the first.
    values, times : (values,) in the output's unit, and s.
    noise : (frames,) standard deviation in the output's unit, 0 where it is not known; of a single value (1,).
    relative : whether noise differs between values: it was stated, or the output has a linear transform.
    stated : whether the test states the noise of all values.
    """

    frames: Ints
    values: Floats
    times: Floats
    noise: Floats
    relative: bool
    stated: bool

    @classmethod
    def of_history(cls, history: History, full: History, name: str) -> ObservedOutput:
        """Of one output of a history; its noise is that of `full`, the same before frames were left out."""
        if name in SINGLE_VALUES:
            value, time, noise = history.minimum_rate or 0.0, followed_duration(history), full.minimum_rate_sd
            if name == RUPTURE_OUTPUT:
                value = time = history.rupture_time or float(history.times[-1])
                noise = None
            first, noises = np.zeros(1, np.int64), np.array([noise or 0.0])
            return cls(first, np.array([value]), np.array([time]), noises, relative=True, stated=noise is not None)
        usable, sd = usable_frames(history, name), history.standard_deviation.get(name)
        frames = np.flatnonzero(usable)
        return cls(
            frames,
            history.outputs[name][frames],
            history.times[frames],
            noise_standard_deviation(full, name)[np.searchsorted(full.times, history.times)],
            relative=sd is not None or is_reversed(history) or not is_logarithmic(name),
            stated=sd is not None and bool((np.isfinite(sd) & (sd > 0))[usable].all()),
        )

    def relative_noise(self, typical: float, *, single: bool) -> Floats | float:
        """(values,) noise of each over a typical one."""
        if typical <= 0 or not self.relative:
            return 1.0
        noise = self.noise[self.frames]
        return noise / typical if single else np.where(noise > 0, noise, typical) / typical


@dataclass(frozen=True, eq=False)
class ObservationVector:
    """Measured values of all tests.

    outputs, transforms : names of what is compared, and the transform of each.
    output_index, frame_index : (tests, observations) positions in `outputs` and among the frames of the history.
    present : (tests, observations) which are data; the others pad, with zeros (times with ones).
    leading_output : (tests, observations) which are of the output that grows with creep, the predictor's first.
    values, times : (tests, observations) in the output's unit, and s.
    noise : (outputs,) typical standard deviation of a frame, in the output's unit.
    relative_noise : (tests, observations) -, noise of each observation over that.
    stated : (outputs,) whether every history states the noise of its frames; else it is estimated from neighbours.
    followed_to_rupture : (tests,) which tests are compared up to rupture: their end is stated, or their rate rises.
    censored : (tests,) which of them were stopped before rupture.
    noise_correlation : (tests, outputs, outputs) - of the noise of two outputs in one frame, as histories state it.
    """

    outputs: tuple[str, ...]
    transforms: tuple[OutputTransform, ...]
    output_index: Ints
    frame_index: Ints
    present: Bools
    leading_output: Bools
    values: Floats
    times: Floats
    noise: Floats
    relative_noise: Floats
    stated: Bools
    followed_to_rupture: Bools
    censored: Bools
    noise_correlation: Floats

    @classmethod
    def from_histories(
        cls,
        histories: Sequence[History],
        predictor: Predictor,
        full: Sequence[History] | None = None,
        *,
        rupture_times: bool = True,
        accelerating: bool = True,
    ) -> ObservationVector:
        """The observations of histories; noise is estimated from `full`, the same before frames were left out.

        rupture_times : whether ends of tests without frames are among them. accelerating : whether curves that run
        away are followed to their end where nobody states it.
        """
        full = histories if full is None else full
        follows = np.array([predictor.for_history(h).follows_to_rupture for h in histories])
        ends = follows & [h.end_known and (rupture_times or bool(h.outputs)) for h in histories]
        followed = ends | [
            bool(accelerating and one and h.outputs and runs_away(h)) for one, h in zip(follows, full, strict=True)
        ]
        rows = [
            {
                name: ObservedOutput.of_history(h, whole, name)
                for name in _observed_outputs(h, predictor, followed=bool(end))
            }
            for h, whole, end in zip(histories, full, ends, strict=True)
        ]
        distinct = dict.fromkeys(name for row in rows for name in row)
        # Those of single values last: absent observations are padded as the first output, whose value may be zero.
        outputs = tuple(sorted(distinct, key=lambda name: name in SINGLE_VALUES and 1 + SINGLE_VALUES.index(name)))
        transforms, typical, stated = [], np.zeros(len(outputs)), []
        for position, name in enumerate(outputs):
            transforms.append(transform_for([h for h, row in zip(histories, rows, strict=True) if name in row], name))
            observed = [row[name] for row in rows if name in row]
            stated.append(all(one.stated for one in observed))
            known = [one.noise for one in observed if name not in SINGLE_VALUES or one.noise.any()]
            typical[position] = np.median([np.median(noise) for noise in known]) if known else 0.0
        shape = len(histories), max(sum(one.frames.size for one in row.values()) for row in rows)
        (index, frames), (present, leading) = np.zeros((2, *shape), np.int64), np.zeros((2, *shape), bool)
        values, (times, relative_noise) = np.zeros(shape), np.ones((2, *shape))
        for k, row in enumerate(rows):
            start = 0
            for rank, (name, one) in enumerate(row.items()):
                place, position = (k, slice(start, start + one.frames.size)), outputs.index(name)
                start += one.frames.size
                index[place], frames[place], present[place] = position, one.frames, True
                values[place], times[place] = one.values, one.times
                leading[place] = rank == 0 and name != RUPTURE_OUTPUT
                relative_noise[place] = one.relative_noise(typical[position], single=name in SINGLE_VALUES)
        return cls(
            outputs,
            tuple(transforms),
            index,
            frames,
            present,
            leading,
            values,
            times,
            typical,
            relative_noise,
            np.array(stated),
            followed,
            ends & [h.unruptured for h in histories],
            np.stack([_correlation_matrix(h, outputs) for h in histories]),
        )

    @cached_property
    def transformed_values(self) -> Floats:
        """(tests, observations) -, the measured values as they are compared."""
        return self.forward(self.values)

    @property
    def count(self) -> int:
        """Number of measured values."""
        return int(self.present.sum())

    def with_noise_of(self, other: ObservationVector) -> ObservationVector:
        """The same with the transforms and the noise of other observations of these outputs."""
        position = [other.outputs.index(name) for name in self.outputs]
        return replace(self, transforms=tuple(other.transforms[k] for k in position), noise=other.noise[position])

    @cached_property
    def discrepancy_unit(self) -> Floats:
        """(tests, observations) -, what a model discrepancy of one is on the scale of the transformed output."""
        units = [
            0.0
            if name in SINGLE_VALUES
            else RELATIVE_DISCREPANCY_UNIT
            if is_logarithmic(name)
            else max(float(noise), SMALLEST_NOISE * transform.floor) / transform.scale  # type: ignore[union-attr]
            for name, noise, transform in zip(self.outputs, self.noise, self.transforms, strict=True)
        ]
        return self.per_observation(units) * np.where(self.logarithmic_mask, 1.0, self.relative_noise)

    @cached_property
    def shared_noise(self) -> SharedNoise | None:
        """The factors of the correlated noise of frames; None where outputs err independently."""
        return SharedNoise.of_correlations(self.noise_correlation, self.output_index, self.frame_index)

    @cached_property
    def strain_floor(self) -> Floats:
        """(tests, observations) the floor of the transform of strains, infinite of other outputs."""
        named = zip(self.outputs, self.transforms, strict=True)
        return self.per_observation([one.floor if is_logarithmic(name) else np.inf for name, one in named])

    @cached_property
    def direction(self) -> Floats:
        """(tests, observations) -, -1 where a bar is shorter than at its start by more than the floor, else 1."""
        return np.where(self.values < -self.strain_floor, -1.0, 1.0)

    @cached_property
    def log_times(self) -> Floats:
        """(tests, observations) ln of time in s."""
        return np.log(self.times)

    @cached_property
    def correlation_coordinate(self) -> Floats:
        """(tests, observations) -, ln t where the transform is logarithmic, else 5 t / last time."""
        last_times = np.where(self.present, self.times, 0.0).max(axis=1, keepdims=True)
        logarithmic = self.logarithmic_mask | self._mask_of(*SINGLE_VALUES)
        return np.where(
            logarithmic, self.log_times, LINEAR_COORDINATE_LENGTH * self.times / np.maximum(last_times, 1e-300)
        )

    def forward(self, y: Floats) -> Floats:
        """(..., tests, observations) - transformed outputs y (..., tests, observations)."""
        return self._transformed(y, "forward")

    def inverse(self, g: Floats) -> Floats:
        """(..., tests, observations) outputs of transformed g (..., tests, observations)."""
        return self._transformed(g, "inverse")

    def derivative(self, y: Floats) -> Floats:
        """(..., tests, observations) 1 / unit, derivative of the transform at outputs y (..., tests, observations)."""
        return self._transformed(y, "derivative")

    def per_observation(self, values: Sequence[float] | Floats) -> Floats:
        """(tests, observations) numbers of the output of each observation, from values (outputs,)."""
        return np.asarray(values, float)[self.output_index]

    @cached_property
    def series(self) -> tuple[tuple[int, int, Ints], ...]:
        """(test, position of an output, (observations,) their indices) of each test and each output that it has."""
        return tuple(
            (test, int(position), np.flatnonzero(present & (index == position)))
            for test, (present, index) in enumerate(zip(self.present, self.output_index, strict=True))
            for position in np.unique(index[present])
        )

    @property
    def rupture_mask(self) -> Bools:
        """(tests, observations) which are rupture times, or times without rupture."""
        return self.present & self._mask_of(RUPTURE_OUTPUT)

    @property
    def stopped_ends(self) -> Bools:
        """(tests, observations) which are times without rupture."""
        return self.rupture_mask & self.censored[:, None]

    @property
    def single_value_mask(self) -> Bools:
        """(tests, observations) which are the only value of their output: rupture times and minimum rates."""
        return self.present & self._mask_of(*SINGLE_VALUES)

    @property
    def followed_frames(self) -> Bools:
        """(tests, observations) which are frames of tests that are compared up to rupture."""
        return np.asarray(self.followed_to_rupture[:, None] & self.present & ~self.single_value_mask)

    @property
    def logarithmic_mask(self) -> Bools:
        """(tests, observations) which are of outputs with a logarithmic transform, padding included."""
        return self._mask_of(*filter(is_logarithmic, self.outputs))

    def _mask_of(self, *outputs: str) -> Bools:
        return np.array([name in outputs for name in self.outputs])[self.output_index]

    def select_outputs(self, array: Floats, prediction: Prediction) -> Floats:
        """(candidates, tests, observations, ...) of an array (candidates, tests, times, outputs, ...).

        Rupture times are not among the outputs: at their places stands the first value of the test.
        """
        observed = [name for name in self.outputs if name != RUPTURE_OUTPUT]
        missing = [name for name in observed if name not in prediction.outputs]
        if missing:
            raise SolveError(
                f"the predictor gave no output '{missing[0]}', which the histories have; it gave "
                f"{', '.join(prediction.outputs)}"
            )
        places = [prediction.outputs.index(name) if name != RUPTURE_OUTPUT else 0 for name in self.outputs]
        columns = np.array(places)[self.output_index]
        return np.asarray(array[:, np.arange(len(columns))[:, None], self.frame_index, columns])

    def select_frames(self, array: Floats) -> Floats:
        """(candidates, tests, observations, ...) of an array (candidates, tests, times, ...) without outputs."""
        return np.asarray(array[:, np.arange(len(self.frame_index))[:, None], self.frame_index])

    def _transformed(self, y: Floats, method: str) -> Floats:
        out = np.empty_like(y)
        for position, transform in enumerate(self.transforms):
            mask = self.output_index == position
            out[..., mask] = getattr(transform, method)(y[..., mask])
        return out


def _correlation_matrix(history: History, outputs: Sequence[str]) -> Floats:
    """(outputs, outputs) correlation of the noise of a frame."""
    fitted = {pair: rho for pair, rho in history.noise_correlation.items() if set(pair) <= set(outputs)}
    return correlation_matrix(fitted, outputs)


def _observed_outputs(history: History, predictor: Predictor, *, followed: bool) -> tuple[str, ...]:
    """Outputs with usable frames, the minimum rate of a test without any, and the end of one that is followed to it."""
    names = [n for n in compared_outputs(predictor, history) if usable_frames(history, n).any()]
    names += [MINIMUM_RATE_OUTPUT] if compares_minimum_rate(history) else []
    if not names and (history.outputs or not followed):
        raise FitError(
            f"history '{history.name}' has no output that is predicted; it has {', '.join(history.outputs) or 'none'}"
        )
    return (*names, *([RUPTURE_OUTPUT] if followed else []))
