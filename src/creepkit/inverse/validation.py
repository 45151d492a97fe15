"""How well a law predicts uniaxial tests: time to a strain or to rupture, its Z factor, leave-one-condition-out.

Z = 10^(2.5 s), with s the standard deviation of log10(measured / predicted time): the factor within which almost all
times fall (Holdsworth et al. (2008), Int. J. Pressure Vessels and Piping 85, 80; below 2 is excellent, to 4 usual).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import refit
from creepkit.inverse.life import predict_to_rupture
from creepkit.inverse.search.refining import IterationCallback
from creepkit.language import CreepLaw
from creepkit.records import History, Prediction, Predictor, Status


@dataclass(frozen=True)
class TimeComparison:
    """Measured and predicted times to one strain, or to rupture, s, for the tests that reached it.

    level : the strain; NaN for rupture. A time that is predicted never to come is infinite.
    spread : standard deviation of log10(measured / predicted); z_factor : 10^(2.5 spread) about the mean ratio;
    bias : mean of log10(measured / predicted).
    """

    strain: float
    names: tuple[str, ...]
    measured: Floats
    predicted: Floats

    @property
    def log_ratios(self) -> Floats:
        """log10(measured / predicted), (tests,)."""
        return np.log10(self.measured / self.predicted)

    @property
    def spread(self) -> float:
        """Standard deviation of the logs."""
        return float(np.std(self.log_ratios, ddof=1)) if self.log_ratios.size > 1 else float("nan")

    @property
    def bias(self) -> float:
        """Mean of the logs."""
        return float(np.mean(self.log_ratios))

    @property
    def z_factor(self) -> float:
        """10^(2.5 spread)."""
        return float(10 ** (2.5 * self.spread))


def measured_time_to_strain(history: History, strain: float, output: str = "strain") -> float | None:
    """First time at which the measured output crosses `level`, s, linear between frames; None if it never does."""
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
    law: CreepLaw, values: Mapping[str, float], histories: Sequence[History], predictor: Predictor, strain: float,
    offsets: Sequence[float] | None = None,
) -> TimeComparison:  # fmt: skip
    """Compare the times to `level` of creep strain of every history that reached it.

    offsets : loading strain of each history, taken off what was measured; predictions carry none.
    """
    loading_offsets = [0.0] * len(histories) if offsets is None else offsets
    reached = [(h, t) for h, o in zip(histories, loading_offsets, strict=True) if (t := measured_time_to_strain(h, strain + o)) is not None]
    time_grids = [t * np.geomspace(1e-4, 1e4, 400) for _, t in reached]
    extended = [
        h.replace(times=grid, outputs={"strain": np.zeros(grid.size)}, standard_deviation={}, includes_elastic=False)
        for (h, _), grid in zip(reached, time_grids, strict=True)
    ]
    prediction = predictor.predict(law, values, extended)
    predicted = [_crossing_time(prediction.of(k)[:, 0], grid, strain, prediction, k) for k, grid in enumerate(time_grids)]
    return TimeComparison(
        strain, tuple(h.name for h, _ in reached), np.array([t for _, t in reached]), np.array(predicted)
    )


def times_to_rupture(
    law: CreepLaw, values: Mapping[str, float], histories: Sequence[History], predictor: Predictor
) -> TimeComparison:
    """Compare the rupture times of every history that ruptured."""
    ruptured = [h for h in histories if h.rupture_time is not None]
    measured = np.array([h.rupture_time for h in ruptured], float)
    if not ruptured:
        return TimeComparison(float("nan"), (), measured, measured)
    life_prediction = predict_to_rupture(predictor, law, values, ruptured).times_to_strain
    assert life_prediction is not None
    predicted = np.where(np.isfinite(life_prediction.rupture_times[0]), life_prediction.rupture_times[0], np.inf)
    return TimeComparison(float("nan"), tuple(h.name for h in ruptured), measured, predicted)


def leave_one_condition_out(
    fit: Identification, histories: Sequence[History], strain: float | None, full: Sequence[History] | None = None,
    progress: IterationCallback | None = None,
) -> tuple[TimeComparison, list[Identification]]:  # fmt: skip
    """Predict each condition (temperature and stress) from a fit to all the others: times to `level` of creep strain.

    level : creep strain, or None for the times to rupture.
    histories : what the fits see; full : the same tests with all frames, to read measured times from.
    """
    assert fit.predictor is not None
    full_histories = {h.name: h for h in (full or histories)}
    comparisons: list[TimeComparison] = []
    fits: list[Identification] = []
    folds = list(_condition_folds(histories))
    for held_out, training in folds:
        training_fit = refit(fit, training)
        fits.append(training_fit)
        tests = [full_histories[h.name] for h in held_out]
        if strain is None:
            comparisons.append(times_to_rupture(training_fit.law, training_fit.values, tests, fit.predictor))
        else:
            comparisons.append(times_to_strain(training_fit.law, training_fit.values, tests, fit.predictor, strain, loading_strains(tests)))
        if progress is not None:
            progress("condition", len(fits), len(folds))
    names = tuple(n for p in comparisons for n in p.names)
    times = [np.concatenate([getattr(p, f) for p in comparisons]) for f in ("measured", "predicted")]
    return TimeComparison(float("nan") if strain is None else strain, names, *times), fits


def _condition_folds(histories: Sequence[History]) -> Iterator[tuple[list[History], list[History]]]:
    """(held out, rest), one fold for each condition."""
    for condition in sorted({h.condition for h in histories}):
        yield [h for h in histories if h.condition == condition], [h for h in histories if h.condition != condition]


def _crossing_time(strain: Floats, times: Floats, target: float, prediction: Prediction, test: int) -> float:
    """Time at which the prediction crosses; its burst when it ends below; the grid's ends beyond them."""
    alive = np.isfinite(strain)
    crossed = np.flatnonzero(alive & (strain >= target))
    if crossed.size == 0:
        status, end = prediction.status[0, test], prediction.end_times[0, test]
        return float(end) if status == Status.RUPTURED else float(times[-1])
    k = int(crossed[0])
    if k == 0:
        return float(times[0])
    fraction = np.log(target / max(strain[k - 1], 1e-300)) / np.log(strain[k] / max(strain[k - 1], 1e-300))
    return float(np.exp(np.log(times[k - 1]) + fraction * np.log(times[k] / times[k - 1])))
