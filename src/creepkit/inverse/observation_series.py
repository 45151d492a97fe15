"""Observations as the compiled covariance takes them: those that are data, by test and output and in order of time."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.core import address

if TYPE_CHECKING:
    from creepkit.inverse.noise_model import Residuals


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
    def of_residuals(cls, residuals: Residuals) -> ObservationSeries:
        """The series of residuals."""
        tests, observations = residuals.values.shape
        places = np.flatnonzero(residuals.present)
        test, output = places // max(observations, 1), residuals.output_index.ravel()[places]
        time = residuals.correlation_coordinate.ravel()[places]
        order = np.lexsort((time, output, test))
        places, test, output, time = places[order], test[order], output[order], time[order]
        follows = np.zeros(places.size, bool)
        follows[1:] = (np.diff(test) == 0) & (np.diff(output) == 0)
        lag = np.where(follows, np.diff(time, prepend=0.0), -1.0)
        unit, effects = residuals.discrepancy_unit, residuals.random_effect_sensitivities
        columns = [
            residuals.relative_noise * residuals.offset_sensitivity,
            residuals.offset_sensitivity,
            np.zeros_like(residuals.values) if unit is None else unit,
            residuals.log_rate_sensitivity,
        ]
        loadings = np.concatenate(
            [
                lag[:, None],
                *(np.asarray(column, float).reshape(-1, 1)[places] for column in columns),
                *([] if effects is None else [effects.reshape(residuals.values.size, -1)[places]]),
            ],
            axis=1,
        )
        weights = np.ascontiguousarray(residuals.test_weights, float)
        starts = np.searchsorted(test, np.arange(tests + 1)).astype(np.int64)
        root_weights = np.sqrt(weights)[test][:, None]
        return cls((tests, observations), places, starts, output.astype(np.int64), loadings, weights, root_weights)

    def rows(self, values: Floats) -> Floats:
        """(data, columns) of values (tests, observations, columns), times the roots of the weights of their tests."""
        return np.ascontiguousarray(values.reshape(self.shape[0] * self.shape[1], -1)[self.places] * self.root_weights)

    def arguments(self, components: Floats) -> tuple[Any, ...]:
        """The first arguments of functions of the core, under components as NoiseModel.components has them.

        The caller keeps the series and the components alive.
        """
        outputs, effects = (components.size - 3) // 5, self.loadings.shape[1] - 5
        arrays = (self.starts, self.output, self.loadings, self.test_weights, components)
        return (*(ctypes.c_int64(n) for n in (self.shape[0], outputs, effects)), *(address(array) for array in arrays))
