"""What a fit compares: for each test the frames of all its outputs end to end, padded to the longest test.

A uniaxial test is its strains, and its rupture time where that is known (a test that was stopped before says that it
lasted so long); a bulge test its amplitudes, then its widths, then its shapes. Whatever acts on tests
(covariance, least squares, intervals) sees one row of entries a test, each of which knows its output and its frame.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.errors import FitError, SolveError
from creepkit.inverse.scales import LOGARITHMIC_OUTPUTS, RUPTURE_OUTPUT, OutputTransform, noise_standard_deviation, transform_for, usable_frames
from creepkit.inverse.together import predicts_rupture, compared_outputs
from creepkit.records import History, Prediction, Predictor

LINEAR_TEST_DURATION = 5.0
"""Length of a test on the clock of outputs that are compared as they are, about that of a decade and a half of ln t."""


@dataclass(frozen=True, eq=False)
class ObservationVector:
    """Measured values of all tests, (tests, entries) each.

    outputs, scales : names of what is compared, and on which scale.
    output, frame : of each entry, positions in `outputs` and among the frames of its history.
    present : which entries are data; the others pad, with zeros (times with ones).
    leading : which belong to the output that grows with creep, the first that the predictor names.
    measured, times : in the output's unit, and s.
    noise : typical standard deviation of a frame of each output, (outputs,), in its unit.
    loudness : noise of each entry over that.
    whole : (tests,) which tests are compared over their whole life.
    censored : (tests,) which of them were stopped before rupture.
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
    followed_to_rupture: Bools
    censored: Bools

    @classmethod
    def from_histories(cls, histories: Sequence[History], predictor: Predictor, full: Sequence[History] | None = None) -> ObservationVector:
        """The entries of histories; their noise is read off `full`, the same histories before frames were left out."""
        full = histories if full is None else full
        followed_to_rupture = np.array([h.end_known and predicts_rupture(predictor, h) for h in histories])
        outputs_by_test = [(*_observed_outputs(h, predictor), *[RUPTURE_OUTPUT][: int(w)]) for h, w in zip(histories, followed_to_rupture, strict=True)]
        outputs = tuple(dict.fromkeys(name for names in outputs_by_test for name in names))
        tests_by_output = {name: [k for k, names in enumerate(outputs_by_test) if name in names] for name in outputs}
        transforms = tuple(transform_for([histories[k] for k in tests_by_output[name]], name) for name in outputs)
        noise, noise_levels = np.zeros(len(outputs)), {}
        for position, name in ((k, n) for k, n in enumerate(outputs) if n != RUPTURE_OUTPUT):
            noise_by_test = [_noise_at_frames(full[k], histories[k], name) for k in tests_by_output[name]]
            noise[position] = np.median([np.median(v) for v in noise_by_test])
            noise_levels.update({(k, name): v for k, v in zip(tests_by_output[name], noise_by_test, strict=True)})
        rows = [[(n, _observed_frames(h, n)) for n in names] for h, names in zip(histories, outputs_by_test, strict=True)]
        shape = len(histories), max(sum(f.size for _, f in row) for row in rows)
        observations = cls(
            outputs, transforms, np.zeros(shape, np.int64), np.zeros(shape, np.int64), np.zeros(shape, bool),
            np.zeros(shape, bool), np.zeros(shape), np.ones(shape), noise, np.ones(shape),
            followed_to_rupture, followed_to_rupture & np.array([h.unruptured for h in histories]),
        )  # fmt: skip
        for k, (history, row) in enumerate(zip(histories, rows, strict=True)):
            observations._fill_test(k, history, row, noise_levels)
        return observations

    def _fill_test(
        self, k: int, history: History, row: Sequence[tuple[str, Ints]], noise_levels: dict[tuple[int, str], Floats]
    ) -> None:
        start = 0
        for rank, (name, frames) in enumerate(row):
            columns, position = slice(start, start + frames.size), self.outputs.index(name)
            self.output_index[k, columns], self.frame_index[k, columns], self.present[k, columns] = position, frames, True
            self.leading_output[k, columns] = rank == 0
            if name == RUPTURE_OUTPUT:
                self.values[k, columns] = self.times[k, columns] = history.rupture_time or history.times[-1]
                continue
            self.values[k, columns], self.times[k, columns] = history.outputs[name][frames], history.times[frames]
            noise = noise_levels[k, name][frames]
            if name not in LOGARITHMIC_OUTPUTS or name in history.standard_deviation:
                typical_noise = self.noise[position]
                self.relative_noise[k, columns] = np.where(noise > 0, noise, typical_noise) / typical_noise if typical_noise > 0 else 1.0
            start += frames.size

    @property
    def log_times(self) -> Floats:
        """(tests, entries) ln of time."""
        return np.log(self.times)

    @property
    def correlation_time(self) -> Floats:
        """(tests, entries) ln of time where an output is compared by its logarithm, else WHOLE t / its last time."""
        last_times = np.where(self.present, self.times, 0.0).max(axis=1, keepdims=True)
        logarithmic = self.per_observation([float(name in (*LOGARITHMIC_OUTPUTS, RUPTURE_OUTPUT)) for name in self.outputs]) > 0
        return np.where(logarithmic, self.log_times, LINEAR_TEST_DURATION * self.times / np.maximum(last_times, 1e-300))

    def forward(self, y: Floats) -> Floats:
        """What is compared, of outputs (..., tests, entries)."""
        return self._transformed(y, lambda scale: scale.forward)

    def inverse(self, g: Floats) -> Floats:
        """Outputs, of what is compared (..., tests, entries)."""
        return self._transformed(g, lambda scale: scale.inverse)

    def derivative(self, y: Floats) -> Floats:
        """Derivative of what is compared to the output, (..., tests, entries)."""
        return self._transformed(y, lambda scale: scale.derivative)

    def per_observation(self, values: Sequence[float] | Floats) -> Floats:
        """(outputs,) numbers at each entry, (tests, entries)."""
        return np.asarray(values, float)[self.output_index]

    @property
    def rupture_mask(self) -> Bools:
        """(tests, entries) which entries are rupture times, or times lasted."""
        return np.asarray(self.present & self.per_observation([float(n == RUPTURE_OUTPUT) for n in self.outputs]).astype(bool))

    def select_outputs(self, array: Floats, prediction: Prediction) -> Floats:
        """The entries out of an array like found.values: (candidates, tests, times, outputs, ...).

        Those of ruptures hold what stands first in the test: they are not among the outputs.
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
        """The entries out of an array (candidates, tests, times, ...) that knows no outputs."""
        return np.asarray(array[:, np.arange(len(self.frame_index))[:, None], self.frame_index])

    def _transformed(self, y: Floats, method: Callable[[OutputTransform], Callable[[Floats], Floats]]) -> Floats:
        out = np.empty_like(y)
        for position, transform in enumerate(self.transforms):
            mask = self.output_index == position
            out[..., mask] = method(transform)(y[..., mask])
        return out


def _observed_outputs(history: History, predictor: Predictor) -> tuple[str, ...]:
    names = tuple(n for n in compared_outputs(predictor, history) if usable_frames(history, n).any())
    if not names:
        raise FitError(
            f"history '{history.name}' has no output that is predicted; it has {', '.join(history.outputs) or 'none'}"
        )
    return names


def _observed_frames(history: History, name: str) -> Ints:
    return np.zeros(1, np.int64) if name == RUPTURE_OUTPUT else np.flatnonzero(usable_frames(history, name))


def _noise_at_frames(full: History, thinned: History, name: str) -> Floats:
    """(frames of `seen`,) noise as the whole history shows it."""
    noise = noise_standard_deviation(full, name)
    return noise[np.searchsorted(full.times, thinned.times)]
