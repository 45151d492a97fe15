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
from creepkit.inverse.life import predict_life
from creepkit.inverse.search.refining import Progress
from creepkit.language import CreepLaw
from creepkit.records import History, Prediction, Predictor, Status


@dataclass(frozen=True)
class TimeComparison:
    """Measured and predicted times to one strain, or to rupture, s, for the tests that reached it.

    level : the strain; NaN for rupture. A time that is predicted never to come is infinite.
    spread : standard deviation of log10(measured / predicted); z_factor : 10^(2.5 spread) about the mean ratio;
    bias : mean of log10(measured / predicted).
    """

    level: float
    names: tuple[str, ...]
    measured: Floats
    predicted: Floats

    @property
    def logs(self) -> Floats:
        """log10(measured / predicted), (tests,)."""
        return np.log10(self.measured / self.predicted)

    @property
    def spread(self) -> float:
        """Standard deviation of the logs."""
        return float(np.std(self.logs, ddof=1)) if self.logs.size > 1 else float("nan")

    @property
    def bias(self) -> float:
        """Mean of the logs."""
        return float(np.mean(self.logs))

    @property
    def z_factor(self) -> float:
        """10^(2.5 spread)."""
        return float(10 ** (2.5 * self.spread))


def measured_time(history: History, level: float, output: str = "strain") -> float | None:
    """First time at which the measured output crosses `level`, s, linear between frames; None if it never does."""
    y, t = history.outputs[output], history.times
    over = np.flatnonzero(y >= level)
    if over.size == 0 or over[0] == 0:
        return None
    k = int(over[0])
    return float(t[k - 1] + (level - y[k - 1]) / (y[k] - y[k - 1]) * (t[k] - t[k - 1]))


def loading_strains(histories: Sequence[History], output: str = "strain") -> list[float]:
    """Strain of the first frame after time zero: what was there before creep, as the instrument saw it."""
    return [float(h.outputs[output][np.flatnonzero(h.times > 0)[0]]) for h in histories]


def times_to_strain(
    law: CreepLaw, values: Mapping[str, float], histories: Sequence[History], using: Predictor, level: float,
    offsets: Sequence[float] | None = None,
) -> TimeComparison:  # fmt: skip
    """Compare the times to `level` of creep strain of every history that reached it.

    offsets : loading strain of each history, taken off what was measured; predictions carry none.
    """
    own = [0.0] * len(histories) if offsets is None else offsets
    reached = [(h, t) for h, o in zip(histories, own, strict=True) if (t := measured_time(h, level + o)) is not None]
    grids = [t * np.geomspace(1e-4, 1e4, 400) for _, t in reached]
    probes = [
        h.replace(times=grid, outputs={"strain": np.zeros(grid.size)}, standard_deviation={}, includes_elastic=False)
        for (h, _), grid in zip(reached, grids, strict=True)
    ]
    found = using.predict(law, values, probes)
    predicted = [_crossing(found.of(k)[:, 0], grid, level, found, k) for k, grid in enumerate(grids)]
    return TimeComparison(
        level, tuple(h.name for h, _ in reached), np.array([t for _, t in reached]), np.array(predicted)
    )


def times_to_rupture(
    law: CreepLaw, values: Mapping[str, float], histories: Sequence[History], using: Predictor
) -> TimeComparison:
    """Compare the rupture times of every history that ruptured."""
    broke = [h for h in histories if h.rupture_time is not None]
    measured = np.array([h.rupture_time for h in broke], float)
    if not broke:
        return TimeComparison(float("nan"), (), measured, measured)
    life = predict_life(using, law, values, broke).life
    assert life is not None
    predicted = np.where(np.isfinite(life.ruptures[0]), life.ruptures[0], np.inf)
    return TimeComparison(float("nan"), tuple(h.name for h in broke), measured, predicted)


def leave_one_condition_out(
    fit: Identification, histories: Sequence[History], level: float | None, full: Sequence[History] | None = None,
    progress: Progress | None = None,
) -> tuple[TimeComparison, list[Identification]]:  # fmt: skip
    """Predict each condition (temperature and stress) from a fit to all the others: times to `level` of creep strain.

    level : creep strain, or None for the times to rupture.
    histories : what the fits see; full : the same tests with all frames, to read measured times from.
    """
    assert fit.using is not None
    everything = {h.name: h for h in (full or histories)}
    parts: list[TimeComparison] = []
    fits: list[Identification] = []
    folds = list(_folds(histories))
    for held, rest in folds:
        partial = refit(fit, rest)
        fits.append(partial)
        tests = [everything[h.name] for h in held]
        if level is None:
            parts.append(times_to_rupture(partial.law, partial.values, tests, fit.using))
        else:
            parts.append(times_to_strain(partial.law, partial.values, tests, fit.using, level, loading_strains(tests)))
        if progress is not None:
            progress("condition", len(fits), len(folds))
    names = tuple(n for p in parts for n in p.names)
    joined = [np.concatenate([getattr(p, f) for p in parts]) for f in ("measured", "predicted")]
    return TimeComparison(float("nan") if level is None else level, names, *joined), fits


def _folds(histories: Sequence[History]) -> Iterator[tuple[list[History], list[History]]]:
    """(held out, rest), one fold for each condition."""
    for condition in sorted({h.condition for h in histories}):
        yield [h for h in histories if h.condition == condition], [h for h in histories if h.condition != condition]


def _crossing(strain: Floats, times: Floats, level: float, found: Prediction, test: int) -> float:
    """Time at which the prediction crosses; its burst when it ends below; the grid's ends beyond them."""
    alive = np.isfinite(strain)
    over = np.flatnonzero(alive & (strain >= level))
    if over.size == 0:
        status, end = found.status[0, test], found.end_times[0, test]
        return float(end) if status == Status.BURST else float(times[-1])
    k = int(over[0])
    if k == 0:
        return float(times[0])
    share = np.log(level / max(strain[k - 1], 1e-300)) / np.log(strain[k] / max(strain[k - 1], 1e-300))
    return float(np.exp(np.log(times[k - 1]) + share * np.log(times[k] / times[k - 1])))
