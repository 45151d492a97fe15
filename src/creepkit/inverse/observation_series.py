"""Observations as the compiled covariance takes them: those that are data, by test and output and in order of time.

Where the noise of outputs is correlated they are by test and frame: see SharedNoise.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import Any

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.core import address


@dataclass(frozen=True, eq=False)
class SharedNoise:
    """White noise that the outputs of one frame share: their correlation by factors, R = L L' + diag(1 - row sums).

    frame : (tests, observations) the frame of each. loadings : (tests, observations, factors) - its row of L.
    """

    frame: Ints
    loadings: Floats

    @classmethod
    def of_correlations(cls, correlations: Floats, output_index: Ints, frame: Ints) -> SharedNoise | None:
        """The factors of correlation matrices; None where all outputs err independently.

        correlations : (tests, outputs, outputs) -, of the noise of two outputs in one frame.
        output_index, frame : (tests, observations).
        """
        identity = np.eye(correlations.shape[1])
        if np.array_equal(correlations, np.broadcast_to(identity, correlations.shape)):
            return None
        # R - c I with c the least eigenvalue has a rank below the number of outputs
        values, vectors = np.linalg.eigh(correlations)
        roots = np.sqrt(np.maximum(values - values[:, :1], 0.0))[:, None, :] * vectors
        kept = np.abs(roots).max(axis=(0, 1)) > SMALLEST_LOADING
        return cls(frame, roots[..., kept][np.arange(len(output_index))[:, None], output_index])


SMALLEST_LOADING = 1e-9
"""A factor that no output has more of is rounding."""


@dataclass(frozen=True, eq=False)
class ObservationSeries:
    """What the covariance of residuals depends on beside the noise model (see src/core/noise_likelihood.hpp).

    shape : (tests, observations) of the residuals. places : (data,) which of them are data, in order. starts :
    (tests + 1,) first datum of each test; output : (data,). loadings : (data, 6 + effects) lag to the previous datum of
    the output (-1: it is the first), then what a white error, an offset, a discrepancy, ln of the rate, ln of the life
    and each further random effect of one does; with factors, (data, 7 + effects + factors), whether the datum is the
    first of its frame, and the factors of its white error. effects, factors : how many.
    """

    shape: tuple[int, int]
    places: Ints
    starts: Ints
    output: Ints
    loadings: Floats
    effects: int = 0
    factors: int = 0

    @classmethod
    def of_observations(
        cls, present: Bools, output_index: Ints, time: Floats, effects: Floats, shared_noise: SharedNoise | None = None
    ) -> ObservationSeries:
        """The series of observations.

        present, output_index, time : (tests, observations) which are data, of which output, and correlation time.
        effects : (tests, observations, 5 + effects) the columns of the loadings behind the lag.
        shared_noise : of outputs whose noise is correlated.
        """
        tests, observations = present.shape
        places = np.flatnonzero(present)
        test, output, times = places // max(observations, 1), output_index.ravel()[places], time.ravel()[places]
        order = np.lexsort(((time if shared_noise is None else shared_noise.frame).ravel()[places], output, test))
        places, test, output, times = places[order], test[order], output[order], times[order]
        follows = np.zeros(places.size, bool)
        follows[1:] = (np.diff(test) == 0) & (np.diff(output) == 0)
        lags = np.where(follows, np.diff(times, prepend=0.0), -1.0)
        loadings = np.concatenate([lags[:, None], effects.reshape(present.size, -1)[places]], axis=1)
        factors = 0
        if shared_noise is not None:
            frame, factors = shared_noise.frame.ravel()[places], shared_noise.loadings.shape[2]
            order = np.lexsort((output, frame, test))
            places, test, output, frame = places[order], test[order], output[order], frame[order]
            is_new = np.ones((places.size, 1))
            is_new[1:, 0] = (np.diff(test) != 0) | (np.diff(frame) != 0)
            own = shared_noise.loadings.reshape(present.size, factors)[places]
            loadings = np.concatenate([loadings[order], is_new, own], axis=1)
        starts = np.searchsorted(test, np.arange(tests + 1)).astype(np.int64)
        return cls(
            (tests, observations), places, starts, output.astype(np.int64), np.ascontiguousarray(loadings),
            effects.shape[-1] - 5, factors,
        )  # fmt: skip

    def rows(self, values: Floats) -> Floats:
        """(data, columns) of values (tests, observations, columns)."""
        return np.ascontiguousarray(values.reshape(self.shape[0] * self.shape[1], -1)[self.places])

    def arguments(self, components: Floats) -> tuple[Any, ...]:
        """The first arguments of functions of the core; the caller keeps the series and the components alive.

        components : (5 outputs + 4,) as NoiseModel.components has them.
        """
        counts = (self.shape[0], (components.size - 4) // 5, self.effects, self.factors)
        arrays = (self.starts, self.output, self.loadings, components)
        return (*(ctypes.c_int64(n) for n in counts), *(address(array) for array in arrays))
