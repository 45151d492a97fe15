"""What a law says of bars under constant true stress when they reach a strain: the time, the rate, and the exponent.

A derivative of the law's formula to stress holds time, strain and internal variables. Bars under different stresses
reach one strain at different times, so that the exponent which measured rates show is another one: with time hardening,
rate = A s^n t^m, the strain A s^n t^(1 + m) / (1 + m) is reached after a time ~ s^(-n / (1 + m)), at a rate
~ s^(n / (1 + m)).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import CreepkitError
from creepkit.inverse.composite_predictor import predict_to_rupture, predicts_rupture
from creepkit.language import CreepLaw, strain, time
from creepkit.records import History, constant_stress

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification

STRESS_RATIO = 1.05
"""Ratio of the stresses between which the exponent is taken, to each side."""


@dataclass(frozen=True)
class StateAtStrain:
    """The state of a bar under constant true stress, at the reference stress and temperature, at the reference strain.

    time : s, rate : 1/s, and exponent : d ln rate / d ln stress of bars at that strain, each with its 95 % interval,
    (value, low, high).
    """

    time: tuple[float, float, float]
    rate: tuple[float, float, float]
    exponent: tuple[float, float, float]


def depends_on_history(law: CreepLaw) -> bool:
    """Whether the rate depends on more than stress and temperature: on time, strain or internal variables."""
    return bool(law.states) or law.uses(time) or law.uses(strain)


def state_at_strain(fit: Identification) -> StateAtStrain | None:
    """At the reference point; None where the law never gets to that strain, or no predictor follows bars to it."""
    r = fit.reference
    levels = np.array([0.5, 1.0]) * r.strain
    bars = [
        History(
            f"bar {k}",
            r.time * np.array([0.5, 1.0]),
            {"strain": levels},
            constant_stress(r.stress * STRESS_RATIO**k, "stress"),
            r.temperature,
            strain_measure="logarithmic",
        )
        for k in (-1, 0, 1)
    ]
    predictor = fit.predictor
    if predictor is None:
        return None

    def function(u: Floats) -> Floats:
        theta = fit.coordinates.theta(u)
        flat = np.ascontiguousarray(theta.reshape(-1, theta.shape[-1]))
        reached = predict_to_rupture(predictor, fit.law, flat, bars).times_to_strain
        assert reached is not None
        with np.errstate(divide="ignore", invalid="ignore"):
            log_time = np.log(reached.times[..., 1])
            log_rate = np.log(reached.log_time_derivatives[..., 1]) - log_time
        exponent = (log_rate[:, 2] - log_rate[:, 0]) / (2 * np.log(STRESS_RATIO))
        return np.stack([log_time[:, 1], log_rate[:, 1], exponent], axis=-1).reshape(*theta.shape[:-1], 3)

    try:
        if not all(predicts_rupture(predictor, bar) for bar in bars):
            return None
        value, low, high = fit.interval_of(function)
    except CreepkitError:
        return None
    if not all(np.isfinite(v).all() for v in (value, low, high)):
        return None
    time_, rate, exponent = ((float(v), float(a), float(b)) for v, a, b in zip(value, low, high, strict=True))
    t, q = (tuple(float(np.exp(min(v, 700.0))) for v in one) for one in (time_, rate))
    return StateAtStrain((t[0], t[1], t[2]), (q[0], q[1], q[2]), exponent)
