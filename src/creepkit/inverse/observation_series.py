"""Observations as the compiled covariance takes them: those that are data, by test and output and in order of time."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import Any

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.core import address


@dataclass(frozen=True, eq=False)
class ObservationSeries:
    """What the covariance of residuals depends on beside the noise model (see src/core/noise_likelihood.hpp).

    shape : (tests, observations) of the residuals. places : (data,) which of them are data, in order. starts :
    (tests + 1,) first datum of each test; output : (data,). loadings : (data, 5 + effects) lag to the previous datum of
    the output (-1: it is the first), then what a white error, an offset, a discrepancy, ln of the rate and each further
    random effect of one does. test_weights : (tests,) -; root_weights : (data, 1) their roots.
    """

    shape: tuple[int, int]
    places: Ints
    starts: Ints
    output: Ints
    loadings: Floats
    test_weights: Floats
    root_weights: Floats

    @classmethod
    def of_observations(
        cls, present: Bools, output_index: Ints, time: Floats, effects: Floats, test_weights: Floats
    ) -> ObservationSeries:
        """The series of observations.

        present, output_index, time : (tests, observations) which are data, of which output, and correlation time.
        effects : (tests, observations, 4 + effects) the columns of the loadings behind the lag.
        test_weights : (tests,) -.
        """
        tests, observations = present.shape
        places = np.flatnonzero(present)
        test, output, times = places // max(observations, 1), output_index.ravel()[places], time.ravel()[places]
        order = np.lexsort((times, output, test))
        places, test, output, times = places[order], test[order], output[order], times[order]
        follows = np.zeros(places.size, bool)
        follows[1:] = (np.diff(test) == 0) & (np.diff(output) == 0)
        lags = np.where(follows, np.diff(times, prepend=0.0), -1.0)
        loadings = np.concatenate([lags[:, None], effects.reshape(present.size, -1)[places]], axis=1)
        weights = np.ascontiguousarray(test_weights, float)
        starts = np.searchsorted(test, np.arange(tests + 1)).astype(np.int64)
        root_weights = np.sqrt(weights)[test][:, None]
        return cls((tests, observations), places, starts, output.astype(np.int64), loadings, weights, root_weights)

    def rows(self, values: Floats) -> Floats:
        """(data, columns) of values (tests, observations, columns), times the roots of the weights of their tests."""
        return np.ascontiguousarray(values.reshape(self.shape[0] * self.shape[1], -1)[self.places] * self.root_weights)

    def arguments(self, components: Floats) -> tuple[Any, ...]:
        """The first arguments of functions of the core; the caller keeps the series and the components alive.

        components : (5 outputs + 3,) as NoiseModel.components has them.
        """
        outputs, effects = (components.size - 3) // 5, self.loadings.shape[1] - 5
        arrays = (self.starts, self.output, self.loadings, self.test_weights, components)
        return (*(ctypes.c_int64(n) for n in (self.shape[0], outputs, effects)), *(address(array) for array in arrays))
