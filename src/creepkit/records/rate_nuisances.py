"""Rate steps and rate drifts: a law whose every rate is multiplied by exp[b g(t)], with b as further parameters.

The derivative to such a nuisance is then a column of the predictor's own Jacobian.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
import sympy

from creepkit.arrays import Floats
from creepkit.language import CreepLaw, Param, time
from creepkit.language.symbols import Symbol
from creepkit.records import STEP_DURATION, STEP_NUISANCES, History, drift_duration, kind_and_start

UNBOUNDED = (-100.0, 100.0)
"""Formal bounds of the further parameters; the nuisances' own limits hold."""


@lru_cache(maxsize=128)
def law_with_rate_factors(law: CreepLaw, keys: tuple[str, ...]) -> CreepLaw:
    """The law with every rate, those of internal variables included, multiplied by exp[b g(t)].

    keys : of rate nuisances. Each adds a parameter b after those of the law: the nuisance itself for a step, with g
        from 0 at its start to 1 STEP_DURATION later, and for "rate", with g = 1; ln of the factor a second for a drift,
        with g = t.
    """
    exponent, params = sympy.S.Zero, dict(law.params)
    for k, key in enumerate(keys):
        kind, start = kind_and_start(key)
        symbol = Symbol(_unused_name(law, f"{kind.replace(' ', '_')}_{k}"))
        shape = _shape_in_time(kind, start)
        exponent += symbol * shape
        params[symbol] = Param(f"ln of a factor on all rates, {kind}", UNBOUNDED)
    factor = sympy.exp(exponent)
    return replace(
        law,
        name=f"{law.name} with {', '.join(keys)}",
        terms={label: term * factor for label, term in law.terms.items()},
        states={symbol: replace(state, rate=state.rate * factor) for symbol, state in law.states.items()},
        params=params,
    )


def _shape_in_time(kind: str, start: float) -> sympy.Expr:
    if kind == "rate":
        return sympy.S.One
    return sympy.Min(sympy.Max((time - start) / STEP_DURATION, 0), 1) if kind in STEP_NUISANCES else time


def rate_parameters(keys: Sequence[str], values: Floats, histories: Sequence[History]) -> tuple[Floats, Floats]:
    """The further parameters of each test and their derivatives to the nuisances.

    values : (candidates, tests, keys) ln of factors. Returns parameters (candidates, tests, keys) and derivatives
    (tests, keys), each - for a step, 1/s for a drift.
    """
    is_step = np.array([kind_and_start(key)[0] in STEP_NUISANCES for key in keys])
    durations = np.array([drift_duration(history) for history in histories])
    scales = np.where(is_step, 1.0, 1.0 / durations[:, None])
    return values * scales, scales


def _unused_name(law: CreepLaw, name: str) -> str:
    taken = {symbol.name for symbol in (*law.params, *law.states)}
    while name in taken:
        name += "_"
    return name
