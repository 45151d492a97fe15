"""Measured and predicted times to a creep strain or to rupture, and the factor Z of Holdsworth et al. (2008)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.cross_validation import CrossValidation
from creepkit.inverse.single_values import SingleValue
from creepkit.language import CreepLaw
from creepkit.records import History, Prediction, Predictor, Status


@dataclass(frozen=True)
class TimeComparison:
    """Measured and predicted times to one strain, or to rupture, for the tests that reached it.

    strain : the creep strain; NaN for rupture. measured, predicted : (tests,) s; infinite where the prediction never
    reaches it.
    """

    strain: float
    names: tuple[str, ...]
    measured: Floats
    predicted: Floats

    @property
    def log_ratios(self) -> Floats:
        """(tests,) - log10(measured / predicted)."""
        return np.log10(self.measured / self.predicted)

    @property
    def spread(self) -> float:
        """Standard deviation of log10(measured / predicted)."""
        return float(np.std(self.log_ratios, ddof=1)) if self.log_ratios.size > 1 else float("nan")

    @property
    def bias(self) -> float:
        """Mean of log10(measured / predicted)."""
        return float(np.mean(self.log_ratios))

    @property
    def z_factor(self) -> float:
        """10^(2.5 spread), the factor Z about the mean ratio."""
        return float(10 ** (2.5 * self.spread))


def measured_time_to_strain(history: History, strain: float, output: str = "strain") -> float | None:
    """First time at which the measured output reaches `strain`, s, linear between frames; None if it never does."""
    values, times = history.outputs[output], history.times
    crossed = np.flatnonzero(values >= strain)
    if crossed.size == 0 or crossed[0] == 0:
        return None
    k = int(crossed[0])
    return float(times[k - 1] + (strain - values[k - 1]) / (values[k] - values[k - 1]) * (times[k] - times[k - 1]))


def loading_strains(histories: Sequence[History], output: str = "strain") -> list[float]:
    """Strain of the first frame after time zero: what was there before creep, as the instrument saw it."""
    return [float(h.outputs[output][np.flatnonzero(h.times > 0)[0]]) for h in histories]


def times_to_strain(
    law: CreepLaw,
    values: Mapping[str, float],
    histories: Sequence[History],
    predictor: Predictor,
    strain: float,
    offsets: Sequence[float] | None = None,
) -> TimeComparison:
    """Compare the times to a creep strain of every history that reached it.

    offsets : loading strain of each history, taken off what was measured; predictions carry none.
    """
    loading_offsets = [0.0] * len(histories) if offsets is None else offsets
    reached = [
        (h, t)
        for h, o in zip(histories, loading_offsets, strict=True)
        if (t := measured_time_to_strain(h, strain + o)) is not None
    ]
    time_grids = [t * np.geomspace(1e-4, 1e4, 400) for _, t in reached]
    extended = [
        h.replace(times=grid, outputs={"strain": np.zeros(grid.size)}, standard_deviation={}, includes_elastic=False)
        for (h, _), grid in zip(reached, time_grids, strict=True)
    ]
    prediction = predictor.predict(law, law.to_internal(values), extended)
    predicted = [
        _crossing_time(prediction.of(k)[:, 0], grid, strain, prediction, k) for k, grid in enumerate(time_grids)
    ]
    return TimeComparison(
        strain, tuple(h.name for h, _ in reached), np.array([t for _, t in reached]), np.array(predicted)
    )


def held_out_times_to_strain(validated: CrossValidation, strain: float, full: Sequence[History] = ()) -> TimeComparison:
    """Measured and predicted times to a creep strain of the held-out tests.

    full : the same tests with all frames, to read measured times from. Loading strains are taken off them.
    """
    by_name, parts = {h.name: h for h in full}, []
    for fold in validated.folds:
        tests, fit = [by_name.get(h.name, h) for h in fold.held_out], fold.fit
        assert fit.predictor is not None
        parts.append(times_to_strain(fit.law, fit.values, tests, fit.predictor, strain, offsets=loading_strains(tests)))
    measured, predicted = (np.concatenate([getattr(one, n) for one in parts]) for n in ("measured", "predicted"))
    return TimeComparison(strain, tuple(name for one in parts for name in one.names), measured, predicted)


def times_to_rupture(ends: Iterable[tuple[str, SingleValue | None]]) -> TimeComparison:
    """Compare the rupture times of every test that ruptured; ends : names of tests, and their ends."""
    ruptured = [(name, end) for name, end in ends if end is not None and not end.censored]
    times = np.array([(end.measured, end.predicted) for _, end in ruptured]).reshape(-1, 2)
    return TimeComparison(float("nan"), tuple(name for name, _ in ruptured), *times.T)


def _crossing_time(strain: Floats, times: Floats, target: float, prediction: Prediction, test: int) -> float:
    """Time at which the prediction crosses; its burst when it ends below; the grid's ends beyond them."""
    finite = np.isfinite(strain)
    crossed = np.flatnonzero(finite & (strain >= target))
    if crossed.size == 0:
        status, end = prediction.status[0, test], prediction.end_times[0, test]
        return float(end) if status == Status.RUPTURED else float(times[-1])
    k = int(crossed[0])
    if k == 0:
        return float(times[0])
    fraction = np.log(target / max(strain[k - 1], 1e-300)) / np.log(strain[k] / max(strain[k - 1], 1e-300))
    return float(np.exp(np.log(times[k - 1]) + fraction * np.log(times[k] / times[k - 1])))
