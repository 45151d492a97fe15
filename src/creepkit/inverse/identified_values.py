"""What an identified law says of minimum rates of its tests, and of bars that reach a strain under constant stress."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import CreepkitError
from creepkit.inverse.compared_tests import has_tertiary_creep
from creepkit.inverse.identification import Identification
from creepkit.inverse.minimum_rates import measured_minimum_rate
from creepkit.inverse.single_values import SingleValue
from creepkit.language import CreepLaw, strain, time
from creepkit.language.symbols import GAS_CONSTANT
from creepkit.records import History, constant_stress

STRESS_RATIO, TEMPERATURE_RATIO = 1.05, 1.005
"""Ratios of stresses and of temperatures between which exponent and energy of bars are taken, to each side."""


LEAST_SHARE, STRAINS = 1e-3, 41
"""Of the reference strain, the first of the strains among which the minimum rate of a law is looked for; how many."""


@dataclass(frozen=True, kw_only=True)
class MinimumRate(SingleValue):
    """The minimum creep rate of one test, by its position; stress : MPa, that was held; temperature : K."""

    test: int
    stress: float
    temperature: float


def minimum_rates_of(fit: Identification) -> list[MinimumRate]:
    """Measured and predicted minimum rates of the tests of an identification that show one.

    fit : with its histories and predictor.
    """
    measured = {k: rate for k, h in enumerate(fit.histories) if np.isfinite(rate := measured_minimum_rate(h))}
    if not measured or fit.predictor is None:
        return []
    law = fit.at_tests(fit.predictor)
    # as tests of which the minimum rate is known, over the same duration
    known: dict[str, Any] = {"outputs": {}, "minimum_rate_sd": None, "includes_elastic": False}
    whole = [fit.histories[k] for k in measured]
    tests = [
        h.replace(times=h.times[-1:], minimum_rate=rate, **known)
        for h, rate in zip(whole, measured.values(), strict=True)
    ]
    rates = []
    for k, h, one in zip(measured, tests, law.minimum_rates(tests).values(), strict=True):
        held: dict[str, Any] = {"test": k, "stress": float(h.load_levels[0]), "temperature": h.mean_temperature}
        rates.append(MinimumRate(one.measured, one.predicted, one.low, one.high, **held))
    return rates


@dataclass(frozen=True)
class StateAtStrain:
    """The state of a bar under constant true stress, at the reference stress and temperature, at the reference strain.

    Of a law with tertiary creep that of the least rate, at whatever strain. time : s, rate : 1/s, exponent :
    d ln rate / d ln stress and energy : -R d ln rate / d(1/T), J/mol, of such bars, each with its 95 % interval,
    (value, low, high).
    """

    time: tuple[float, float, float]
    rate: tuple[float, float, float]
    exponent: tuple[float, float, float]
    energy: tuple[float, float, float]


def depends_on_history(law: CreepLaw) -> bool:
    """Whether the rate depends on more than stress and temperature: on time, strain or internal variables."""
    return bool(law.states) or law.uses(time) or law.uses(strain)


def state_at_strain(fit: Identification) -> StateAtStrain | None:
    """At the tested point; None where the law never gets to that strain, or no predictor follows bars to it.

    The rate of a law with tertiary creep rises at any strain by what its bars have suffered: stated is its minimum.

    A derivative of the law's formula holds time, strain and internal variables. Bars under different stresses reach one
    strain at different times, so that the exponent which measured rates show is another one: with time hardening,
    rate = A s^n t^m, the strain A s^n t^(1 + m) / (1 + m) is reached after a time ~ s^(-n / (1 + m)), at a rate
    ~ s^(n / (1 + m)); and where A has an activation energy Q, that of the rate is Q / (1 + m).
    """
    r, predictor = fit.tested_point, fit.predictor
    if predictor is None:
        return None
    shares, is_least = np.array([0.5, 1.0]), has_tertiary_creep(fit.law)
    if is_least:
        shares = np.geomspace(LEAST_SHARE, max(fit.ranges["strain"][1] / r.strain, 1.0), STRAINS)
    stresses = r.stress * STRESS_RATIO ** np.array([-1.0, 0.0, 1.0, 0.0, 0.0])
    temperatures = r.temperature * TEMPERATURE_RATIO ** np.array([0.0, 0.0, 0.0, -1.0, 1.0])
    bars = [
        History(
            f"bar {k}",
            r.time * shares,
            {"strain": r.strain * shares},
            constant_stress(float(stress), "stress"),
            float(temperature),
            strain_measure="logarithmic",
        )
        for k, (stress, temperature) in enumerate(zip(stresses, temperatures, strict=True))
    ]

    def function(u: Floats) -> Floats:
        theta = fit.coordinates.theta(u)
        flat = np.ascontiguousarray(theta.reshape(-1, theta.shape[-1]))
        reached = predictor.predict_to_rupture(fit.law, flat, bars).times_to_strain
        assert reached is not None
        with np.errstate(divide="ignore", invalid="ignore"):
            log_times = np.log(reached.times)
            log_rates = np.log(reached.log_time_derivatives) - log_times
        log_time, log_rate = log_times[..., -1], log_rates[..., -1]
        if is_least:
            place = np.where(np.isfinite(log_rates), log_rates, np.inf).argmin(axis=-1)[..., None]
            log_time, log_rate = (np.take_along_axis(v, place, axis=-1)[..., 0] for v in (log_times, log_rates))
        exponent = (log_rate[:, 2] - log_rate[:, 0]) / (2 * np.log(STRESS_RATIO))
        energy = GAS_CONSTANT * (log_rate[:, 4] - log_rate[:, 3]) / -np.diff(1.0 / temperatures[3:])
        return np.stack([log_time[:, 1], log_rate[:, 1], exponent, energy], axis=-1).reshape(*theta.shape[:-1], 4)

    try:
        if not all(predictor.for_history(bar).follows_to_rupture for bar in bars):
            return None
        ends = np.array(fit.interval_of(function))
    except CreepkitError:
        return None
    if not np.isfinite(ends).all():
        return None
    time_, rate = ([math.exp(min(v, 700.0)) for v in column] for column in ends.T[:2])
    return StateAtStrain(*map(tuple, (time_, rate, *ends.T[2:].tolist())))
