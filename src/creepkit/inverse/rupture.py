"""When will it break: predicted rupture times with intervals, and how they compare with those that were measured."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.errors import FitError
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.findings import RuptureMisfit
from creepkit.inverse.life import predict_life
from creepkit.inverse.scales import RUPTURE
from creepkit.inverse.scatter import Scatter
from creepkit.inverse.together import lasts, predictor_of
from creepkit.records import History, Predictor, constant_stress

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification

BEYOND = 1000.0
"""How far beyond the longest measured test, or its own last time, a test is followed to its rupture; the predictor's
own horizon comes on top."""


def rupture_times(
    coordinates: Coordinates, u: Floats, covariance: Floats, scatter: Scatter | None, quantile: float,
    histories: Sequence[History], using: Predictor,
) -> tuple[Floats, Floats, Floats]:  # fmt: skip
    """Rupture times of histories, s, with intervals: (time, low, high), (tests,) each; infinite where none comes.

    By the delta method on ln t, from the covariance of u; with `scatter` that of a single test's life comes on top.
    """
    for history in histories:
        if not lasts(using, history):
            name = getattr(predictor_of(using, history), "name", "predictor")
            raise FitError(
                f"history '{history.name}': {name} follows no test to rupture; give using=, such as uniaxial"
            )
    plans = [_far(history) for history in histories]
    found = predict_life(using, coordinates.law, coordinates.values(u), plans, jacobian=True)
    assert found.life is not None
    assert found.life.rupture_jacobian is not None
    time = found.life.ruptures[0]
    slopes = np.nan_to_num(found.life.rupture_jacobian[0]) @ coordinates.jacobian(u)
    variance = np.einsum("ti,ij,tj->t", slopes, covariance, slopes)
    if scatter is not None:
        own = scatter[RUPTURE].misfit if RUPTURE in scatter.outputs else 0.0
        variance = variance + scatter.rate**2 + own**2
    wide = np.exp(quantile * np.sqrt(variance))
    broke = np.isfinite(time)
    return tuple(np.where(broke, each, np.inf) for each in (time, time / wide, time * wide))  # type: ignore[return-value]


def _far(history: History) -> History:
    """What is asked of a test is when it breaks, however long after its last frame that may be."""
    last = max(float(history.times[-1]), history.rupture_time or 0.0)
    return history.replace(times=np.array([BEYOND * last]), outputs={}, standard_deviation={})


def planned(
    stress: ArrayLike, temperature: ArrayLike, longest: float, control: str
) -> tuple[list[History], tuple[int, ...]]:
    """Uniaxial tests at constant load or stress for every pair of stress (MPa) and temperature (K), and their shape."""
    levels, warmth = np.broadcast_arrays(np.asarray(stress, float), np.asarray(temperature, float))
    if control not in ("load", "stress"):
        raise FitError(f"control is '{control}'; allowed are load and stress")
    if not (levels > 0).all():
        raise FitError("a rupture time was asked for at a stress that is not above zero; give tensile stresses, in MPa")
    tests = [
        History(f"{s:g} MPa, {T:g} K", np.array([longest]), {}, constant_stress(float(s), control), float(T))  # type: ignore[arg-type]
        for s, T in zip(levels.ravel(), warmth.ravel(), strict=True)
    ]
    return tests, levels.shape


def rupture_misfits(
    coordinates: Coordinates, u: Floats, covariance: Floats, scatter: Scatter, quantile: float,
    histories: Sequence[History], using: Predictor,
) -> list[RuptureMisfit | None]:  # fmt: skip
    """Measured against predicted, for every history; None where its end is not known or not predicted."""
    ended = [k for k, h in enumerate(histories) if h.ended and lasts(using, h)]
    found: list[RuptureMisfit | None] = [None] * len(histories)
    if not ended:
        return found
    tests = [histories[k] for k in ended]
    times = rupture_times(coordinates, u, covariance, scatter, quantile, tests, using)
    for k, history, time, low, high in zip(ended, tests, *times, strict=True):
        measured = history.rupture_time or float(history.times[-1])
        found[k] = RuptureMisfit(measured, history.unruptured, float(time), float(low), float(high))
    return found


def with_ends(fit: Identification) -> list[tuple[str, str, RuptureMisfit]]:
    """(test, condition, rupture) of the tests whose end is known."""
    return [(m.name, m.condition, m.rupture) for m in fit.misfits if m.rupture is not None]
