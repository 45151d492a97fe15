"""What a network sees of a law's parameters: a row of numbers each, and how it moves with the internal parameters.

Parameters on a log scale enter as log10, others as they are. A coefficient that is switched off (0) has no logarithm:
its column is NaN, which modules standardise to zero (as if it stood at the mean of the samples that have it), and a
column of its own says so with a one. With "rates" the column of a term's coefficient is log10 of the term's rate at the
stress of the very test instead, its mean over the times of a usual one: A and n of a power law trade against one
another, its rate in the test and n do not.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from creepkit.arrays import Floats
from creepkit.kernels import lower
from creepkit.kernels.logform import log_form
from creepkit.language import CreepLaw

Form = Literal["values", "rates"]
LN10 = float(np.log(10.0))
SHARES = (0.05, 0.2, 0.4, 0.6, 0.8, 1.0)
"""Of a usual test, at which rates are taken; a law with explicit time goes through decades of them in it."""


@dataclass(frozen=True)
class Point:
    """Where the rates of terms are taken: at a stress of `per_load` times a test's load; strain, s, K."""

    per_load: float
    strain: float
    time: float
    temperature: float

    def arguments(self, law: CreepLaw, load: Floats, share: float) -> list[Any]:
        """What kernels take: the point in simple tension, and virgin states; load : (rows,), share : of the time."""
        virgin, stress = [state.initial for state in law.states.values()], self.per_load * load
        return [stress, self.strain, share * self.time, self.temperature, stress, stress / 3, *virgin]


@dataclass(frozen=True)
class LawInputs:
    """The columns that stand for the parameters of one law."""

    law: CreepLaw
    form: Form
    point: Point

    @cached_property
    def switches(self) -> tuple[int, ...]:
        """Positions of the parameters that can be switched off and then have no logarithm."""
        return tuple(k for k, p in enumerate(self.law.params.values()) if p.scale == "log" and p.off == 0)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Of the columns."""
        rates = {k: f"log10 rate of {label}" for k, label in self._rates.items()}
        own = [
            rates.get(k, f"log10 {name}" if p.scale == "log" else name)
            for k, (name, p) in enumerate(self.law.table.items())
        ]
        return (*own, *(f"{self.law.names[k]} is off" for k in self.switches))

    @cached_property
    def _rates(self) -> dict[int, str]:
        """{position: term} of coefficients whose column is a rate: those that stand in that term alone."""
        if self.form == "values":
            return {}
        found = {}
        for label in self.law.terms:
            single = self.law.only(label)
            own = [single.names[k] for k in log_form(single).coefficients[0]]
            alone = [name for name in own if self._uses(name) == 1]
            if alone:
                found[self.law.names.index(alone[0])] = label
        return found

    def _uses(self, name: str) -> int:
        symbol = self.law.symbol(name)
        everything = [*self.law.terms.values(), *(state.rate for state in self.law.states.values())]
        return sum(symbol in expression.free_symbols for expression in everything)

    def internal(self, values: Mapping[str, Any]) -> Floats:
        """(candidates, parameters) internal, from the author's values; 0 of a coefficient is -inf."""
        columns = np.broadcast_arrays(*(np.atleast_1d(np.asarray(values[n], float)) for n in self.law.names))
        return self.of_table(np.stack(columns, axis=-1))

    def of_table(self, parameters: Floats) -> Floats:
        """(rows, parameters) internal, from the author's."""
        theta, logs = np.array(parameters, float), [p.scale == "log" for p in self.law.params.values()]
        with np.errstate(divide="ignore"):
            theta[:, logs] = np.log(theta[:, logs])
        return theta

    def rows(self, theta: Floats, load: Floats) -> Floats:
        """(rows, columns) of internal parameters (rows, parameters) in tests of these loads (rows,), MPa."""
        logs = np.array([p.scale == "log" for p in self.law.params.values()])
        own = np.where(logs, theta / LN10, theta)
        for k, label in self._rates.items():
            single, places = self._single(label)
            logs = self._log_rates(single, _parts(theta, places), load)
            own[:, k] = np.where(np.isfinite(theta[:, k]), np.logaddexp.reduce(logs) / LN10, -np.inf)
        off = np.isneginf(own)
        return np.concatenate([np.where(off, np.nan, own), off[:, list(self.switches)]], axis=1)

    def slopes(self, theta: Floats, load: Floats) -> Floats:
        """(rows, columns, parameters) derivatives of `rows`; zero where a coefficient is off."""
        count = theta.shape[1]
        logs = np.array([p.scale == "log" for p in self.law.params.values()])
        slopes = np.zeros((len(theta), len(self.names), count))
        slopes[:, range(count), range(count)] = np.where(logs, 1.0 / LN10, 1.0)
        for k, label in self._rates.items():
            single, places = self._single(label)
            parts = _parts(theta, places)
            logs = self._log_rates(single, parts, load)
            slopes[:, k] = 0.0
            for share, weight in zip(SHARES, np.exp(logs - np.logaddexp.reduce(logs)), strict=True):
                found = lower(single, "numpy").internal_derivatives(*self.point.arguments(single, load, share), *parts)
                for name, place in zip(single.names, places, strict=True):
                    slopes[:, k, place] += weight * np.asarray(found.params[name]) / np.asarray(found.rate) / LN10
        for k in range(count):
            slopes[np.isneginf(theta[:, k]), k] = 0.0
        return slopes

    def _log_rates(self, single: CreepLaw, parts: Floats, load: Floats) -> Floats:
        """(shares, rows) ln of what a term contributes to the mean over SHARES of the time."""
        kernel = lower(single, "numpy")
        logs = [kernel.internal_log_rate(*self.point.arguments(single, load, share), *parts) for share in SHARES]
        return np.asarray(np.stack([np.asarray(log, float) for log in logs]) - np.log(len(SHARES)))

    def _single(self, label: str) -> tuple[CreepLaw, list[int]]:
        single = self.law.only(label)
        return single, [self.law.names.index(n) for n in single.names]


def _parts(theta: Floats, places: list[int]) -> Floats:
    """(parameters, rows) of one term; where its coefficient is off, any number does."""
    return np.moveaxis(np.where(np.isfinite(theta), theta, 0.0)[:, places], -1, 0)
