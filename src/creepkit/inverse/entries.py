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
from creepkit.inverse.scales import LOGARITHMIC, RUPTURE, Scale, noise_of, scale_for, usable
from creepkit.inverse.together import lasts, outputs_of
from creepkit.records import History, Prediction, Predictor

WHOLE = 5.0
"""Length of a test on the clock of outputs that are compared as they are, about that of a decade and a half of ln t."""


@dataclass(frozen=True, eq=False)
class Entries:
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
    scales: tuple[Scale, ...]
    output: Ints
    frame: Ints
    present: Bools
    leading: Bools
    measured: Floats
    times: Floats
    noise: Floats
    loudness: Floats
    whole: Bools
    censored: Bools

    @classmethod
    def of(cls, histories: Sequence[History], using: Predictor, full: Sequence[History] | None = None) -> Entries:
        """The entries of histories; their noise is read off `full`, the same histories before frames were left out."""
        full = histories if full is None else full
        whole = np.array([h.ended and lasts(using, h) for h in histories])
        own = [(*_outputs(h, using), *[RUPTURE][: int(w)]) for h, w in zip(histories, whole, strict=True)]
        outputs = tuple(dict.fromkeys(name for names in own for name in names))
        having = {name: [k for k, names in enumerate(own) if name in names] for name in outputs}
        scales = tuple(scale_for([histories[k] for k in having[name]], name) for name in outputs)
        noise, levels = np.zeros(len(outputs)), {}
        for position, name in ((k, n) for k, n in enumerate(outputs) if n != RUPTURE):
            of_tests = [_noise(full[k], histories[k], name) for k in having[name]]
            noise[position] = np.median([np.median(v) for v in of_tests])
            levels.update({(k, name): v for k, v in zip(having[name], of_tests, strict=True)})
        rows = [[(n, _frames(h, n)) for n in names] for h, names in zip(histories, own, strict=True)]
        shape = len(histories), max(sum(f.size for _, f in row) for row in rows)
        blank = cls(
            outputs, scales, np.zeros(shape, np.int64), np.zeros(shape, np.int64), np.zeros(shape, bool),
            np.zeros(shape, bool), np.zeros(shape), np.ones(shape), noise, np.ones(shape),
            whole, whole & np.array([h.unruptured for h in histories]),
        )  # fmt: skip
        for k, (history, row) in enumerate(zip(histories, rows, strict=True)):
            blank._fill(k, history, row, levels)
        return blank

    def _fill(
        self, k: int, history: History, row: Sequence[tuple[str, Ints]], levels: dict[tuple[int, str], Floats]
    ) -> None:
        start = 0
        for place, (name, frames) in enumerate(row):
            reach, position = slice(start, start + frames.size), self.outputs.index(name)
            self.output[k, reach], self.frame[k, reach], self.present[k, reach] = position, frames, True
            self.leading[k, reach] = place == 0
            if name == RUPTURE:
                self.measured[k, reach] = self.times[k, reach] = history.rupture_time or history.times[-1]
                continue
            self.measured[k, reach], self.times[k, reach] = history.outputs[name][frames], history.times[frames]
            level = levels[k, name][frames]
            if name not in LOGARITHMIC or name in history.standard_deviation:
                typical = self.noise[position]
                self.loudness[k, reach] = np.where(level > 0, level, typical) / typical if typical > 0 else 1.0
            start += frames.size

    @property
    def log_times(self) -> Floats:
        """(tests, entries) ln of time."""
        return np.log(self.times)

    @property
    def clock(self) -> Floats:
        """(tests, entries) ln of time where an output is compared by its logarithm, else WHOLE t / its last time."""
        last = np.where(self.present, self.times, 0.0).max(axis=1, keepdims=True)
        logarithmic = self.spread([float(name in (*LOGARITHMIC, RUPTURE)) for name in self.outputs]) > 0
        return np.where(logarithmic, self.log_times, WHOLE * self.times / np.maximum(last, 1e-300))

    def forward(self, y: Floats) -> Floats:
        """What is compared, of outputs (..., tests, entries)."""
        return self._scaled(y, lambda scale: scale.forward)

    def backward(self, g: Floats) -> Floats:
        """Outputs, of what is compared (..., tests, entries)."""
        return self._scaled(g, lambda scale: scale.backward)

    def slope(self, y: Floats) -> Floats:
        """Derivative of what is compared to the output, (..., tests, entries)."""
        return self._scaled(y, lambda scale: scale.slope)

    def spread(self, of_outputs: Sequence[float] | Floats) -> Floats:
        """(outputs,) numbers at each entry, (tests, entries)."""
        return np.asarray(of_outputs, float)[self.output]

    @property
    def ruptures(self) -> Bools:
        """(tests, entries) which entries are rupture times, or times lasted."""
        return np.asarray(self.present & self.spread([float(n == RUPTURE) for n in self.outputs]).astype(bool))

    def taken(self, array: Floats, found: Prediction) -> Floats:
        """The entries out of an array like found.values: (candidates, tests, times, outputs, ...).

        Those of ruptures hold what stands first in the test: they are not among the outputs.
        """
        observed = [name for name in self.outputs if name != RUPTURE]
        missing = [name for name in observed if name not in found.outputs]
        if missing:
            raise SolveError(
                f"the predictor gave no output '{missing[0]}', which the histories have; it gave "
                f"{', '.join(found.outputs)}"
            )
        places = [found.outputs.index(name) if name != RUPTURE else 0 for name in self.outputs]
        columns = np.array(places)[self.output]
        return np.asarray(array[:, np.arange(len(columns))[:, None], self.frame, columns])

    def at_frames(self, array: Floats) -> Floats:
        """The entries out of an array (candidates, tests, times, ...) that knows no outputs."""
        return np.asarray(array[:, np.arange(len(self.frame))[:, None], self.frame])

    def _scaled(self, y: Floats, method: Callable[[Scale], Callable[[Floats], Floats]]) -> Floats:
        out = np.empty_like(y)
        for position, scale in enumerate(self.scales):
            mine = self.output == position
            out[..., mine] = method(scale)(y[..., mine])
        return out


def _outputs(history: History, using: Predictor) -> tuple[str, ...]:
    names = tuple(n for n in outputs_of(using, history) if usable(history, n).any())
    if not names:
        raise FitError(
            f"history '{history.name}' has no output that is predicted; it has {', '.join(history.outputs) or 'none'}"
        )
    return names


def _frames(history: History, name: str) -> Ints:
    return np.zeros(1, np.int64) if name == RUPTURE else np.flatnonzero(usable(history, name))


def _noise(full: History, seen: History, name: str) -> Floats:
    """(frames of `seen`,) noise as the whole history shows it."""
    level = noise_of(full, name)
    return level[np.searchsorted(full.times, seen.times)]
