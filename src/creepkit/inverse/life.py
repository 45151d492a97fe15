"""Tests compared over their whole life: their distance from the predicted curve, and when they break."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from creepkit.arrays import ArrayLike, Bools, Floats
from creepkit.errors import FitError
from creepkit.inverse.distance import distance
from creepkit.inverse.entries import Entries
from creepkit.inverse.together import Together, predict, predictor_of
from creepkit.language import CreepLaw
from creepkit.records import History, Life, Prediction, Predictor, WholeLife


@dataclass(frozen=True, eq=False)
class Compared:
    """Residuals of candidates x tests x entries, and how they change with strain and with time.

    values : residuals. by_strain, by_time : derivatives to the compared strain at the frame's time, and to -ln of the
        time at which the measured strain is arrived at, or the specimen breaks.
    heard : which entries say anything: that a test was stopped says nothing of a candidate that lasts longer.
    """

    values: Floats
    by_strain: Floats
    by_time: Floats
    heard: Bools


def over_life(entries: Entries, vertical: Floats, alive: Bools, found: Prediction) -> Compared:
    """Residuals, given those in strain alone (`vertical`), and which frames the prediction lives to see."""
    ones, zeros = np.ones_like(vertical), np.zeros_like(vertical)
    if found.life is None:
        return Compared(vertical, ones, zeros, np.broadcast_to(entries.present, vertical.shape))
    life, frames = found.life, entries.whole[:, None] & entries.present & ~entries.ruptures
    early = entries.log_times - _log(entries.at_frames(life.arrivals))
    lost = ~alive & np.isneginf(early)  # it neither lives nor broke: the solver gave up
    slope = entries.slope(np.where(frames, entries.measured, 1.0)) * entries.at_frames(life.slopes)
    nearest = distance(np.where(alive | lost, vertical, np.inf), np.where(lost, -np.inf, early), slope)
    values = np.where(frames, nearest.values, vertical)
    by_strain, by_time = np.where(frames, nearest.by_strain, ones), np.where(frames, nearest.by_time, zeros)
    return _with_ruptures(entries, life, Compared(values, by_strain, by_time, np.broadcast_to(ones > 0, ones.shape)))


def _with_ruptures(entries: Entries, life: Life, frames: Compared) -> Compared:
    """The same with ln of measured over predicted rupture time; a stopped test counts where it outlasted that."""
    broke = np.isfinite(life.ruptures)
    last = np.log(np.where(broke, life.ruptures, life.horizon))
    early = np.where(entries.ruptures, entries.log_times - last[..., None], 0.0)
    silent = entries.ruptures & entries.censored[:, None] & (early <= 0.0)
    values = np.where(entries.ruptures, np.where(silent, 0.0, early), frames.values)
    moves = np.where(broke[..., None] & ~silent, 1.0, 0.0)
    return Compared(
        values,
        np.where(entries.ruptures, 0.0, frames.by_strain),
        np.where(entries.ruptures, moves, frames.by_time),
        entries.present & ~silent,
    )


def time_jacobian(entries: Entries, life: Life) -> Floats:
    """Derivatives of -ln(time) of arrivals and ruptures to internal parameters.

    (candidates, tests, entries, parameters); zero where neither comes.
    """
    assert life.arrival_jacobian is not None
    assert life.rupture_jacobian is not None
    arrivals = entries.at_frames(life.arrival_jacobian)
    found = -np.where(entries.ruptures[..., None], life.rupture_jacobian[:, :, None], arrivals)
    return np.where(np.isfinite(found), found, 0.0)


def offset_slope(entries: Entries, life: Life) -> Floats:
    """Derivative of -ln(time of arrival) to an offset that is added to a prediction, (candidates, tests, entries)."""
    slope = entries.at_frames(life.slopes)
    steep = np.where(np.isfinite(slope) & (slope > 0), slope, np.inf)
    return np.where(entries.ruptures, 0.0, 1.0 / steep)


def _log(times: Floats) -> Floats:
    """ln of times; of what never comes infinity."""
    with np.errstate(divide="ignore"):
        return np.where(np.isnan(times), np.inf, np.log(np.where(np.isnan(times), 1.0, times)))


def predict_life(
    using: Predictor, law: CreepLaw, values: Mapping[str, ArrayLike], histories: Sequence[History], *,
    jacobian: bool = False,
) -> Prediction:  # fmt: skip
    """Predict with `life`; tests whose predictor follows none to rupture arrive nowhere and never break."""
    groups = using.groups(histories) if isinstance(using, Together) else [(using, list(range(len(histories))))]
    parts = []
    for predictor, tests in groups:
        mine = [histories[k] for k in tests]
        if isinstance(predictor, WholeLife):
            parts.append((tests, predictor.predict_life(law, values, mine, jacobian=jacobian)))
        else:
            found = predict(predictor, law, values, mine, jacobian=jacobian)
            parts.append((tests, replace(found, life=_endless(found, len(law.names)))))
    return parts[0][1] if len(parts) == 1 else Together.joined(parts, histories)


def _endless(found: Prediction, parameters: int) -> Life:
    """The life of what never ends."""
    shape = found.values.shape[:3]
    nowhere, never = np.full(shape, np.nan), np.full(shape[:2], np.nan)
    jacobians = np.full((*shape, parameters), np.nan), np.full((*shape[:2], parameters), np.nan)
    return Life(nowhere, np.full(shape, np.inf), never, np.array([t[-1] for t in found.times]), *jacobians)


def check_effects(explicit: Sequence[str], entries: Entries, histories: Sequence[History], using: Predictor) -> None:
    """Explicit nuisances have no place yet where tests are followed to rupture."""
    if not explicit or not entries.whole.any():
        return
    history = histories[int(np.argmax(entries.whole))]
    name = getattr(predictor_of(using, history), "name", "predictor")
    raise FitError(
        f"nuisance '{explicit[0]}' cannot be fitted beside tests that are followed to their end ('{history.name}', "
        f"{name}); leave it out, or forget how they ended: history.replace(rupture_time=None, unruptured=False)"
    )
