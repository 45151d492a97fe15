"""Cross-validation by test and by condition: errors of held-out tests, times to a strain or to rupture, and their Z factor."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.composite_predictor import compared_outputs, predict_to_rupture
from creepkit.inverse.goodness_of_fit import OutputErrors, output_errors
from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import refit
from creepkit.inverse.observation_vector import noise_standard_deviation, usable_frames
from creepkit.inverse.search.local_refinement import IterationCallback
from creepkit.language import CreepLaw
from creepkit.records import History, Prediction, Predictor, Status


@dataclass(frozen=True)
class HeldOutTest:
    """One test that the fit did not see, as any new test: nuisances at their prior means and no offset.

    errors : {output: Errors}, relative squared errors about the test's own mean.
    """

    name: str
    condition: str
    fit: Identification = field(repr=False)
    errors: Mapping[str, OutputErrors]


def leave_one_test_out(
    fit: Identification, histories: Sequence[History] | None = None, progress: IterationCallback | None = None
) -> tuple[HeldOutTest, ...]:
    """Predict each test from a refit to all the others, which starts where `fit` ended."""
    tests = list(fit.histories if histories is None else histories)
    if len(tests) < 2:
        raise FitError("a test can only be held out of several, found one")
    results = []
    for k, test in enumerate(tests):
        training_fit = refit(fit, [h for h in tests if h is not test])
        results.append(HeldOutTest(test.name, test.condition, training_fit, prediction_errors(training_fit, test)))
        if progress is not None:
            progress("test", k + 1, len(tests))
    return tuple(results)


def prediction_errors(fit: Identification, history: History) -> dict[str, OutputErrors]:
    """{output: Errors} of one history that the fit predicts as a new test."""
    assert fit.predictor is not None
    prediction = fit.predict([history], own_nuisances=False)
    return {
        name: output_errors(*_used_values(history, prediction, name))
        for name in compared_outputs(fit.predictor, history)
        if usable_frames(history, name).any()
    }


def pooled_relative_squared_error(held_out: Sequence[HeldOutTest], histories: Sequence[History], output: str) -> float:
    """Relative squared error of one output over all held-out tests, about the mean of all their frames."""
    by_name = {h.name: h for h in histories}
    errors_and_values = [
        (
            held_out_test.errors[output],
            by_name[held_out_test.name].outputs[output][usable_frames(by_name[held_out_test.name], output)],
        )
        for held_out_test in held_out
    ]
    sum_of_squares = sum(e.mean_squared_error * e.frames for e, _ in errors_and_values)
    measured = np.concatenate([m for _, m in errors_and_values])
    return float(sum_of_squares / ((measured - measured.mean()) ** 2).sum())


def _used_values(history: History, prediction: Prediction, name: str) -> tuple[Floats, Floats, Floats]:
    used = usable_frames(history, name)
    predicted = prediction.of(0)[used, prediction.outputs.index(name)]
    return history.outputs[name][used], predicted, noise_standard_deviation(history, name)[used]


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


def times_to_rupture(
    law: CreepLaw, values: Mapping[str, float], histories: Sequence[History], predictor: Predictor
) -> TimeComparison:
    """Compare the rupture times of every history that ruptured."""
    ruptured = [h for h in histories if h.rupture_time is not None]
    measured = np.array([h.rupture_time for h in ruptured], float)
    if not ruptured:
        return TimeComparison(float("nan"), (), measured, measured)
    life_prediction = predict_to_rupture(predictor, law, law.to_internal(values), ruptured).times_to_strain
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
            comparisons.append(
                times_to_strain(
                    training_fit.law, training_fit.values, tests, fit.predictor, strain, loading_strains(tests)
                )
            )
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
