"""What a network sees of a law's parameters: a row of numbers, and how it moves with the internal parameters.

Parameters on a log scale enter as log10, others as they are. A coefficient that is switched off (0) has no logarithm:
its column is NaN, which modules standardise to zero (as if it stood at the mean of the samples that have it), and a
column of its own says so with a one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.language import CreepLaw

LN10 = float(np.log(10.0))


@dataclass(frozen=True)
class LawInputs:
    """The columns that stand for the parameters of one law."""

    law: CreepLaw

    @cached_property
    def switchable(self) -> tuple[int, ...]:
        """Positions of the parameters that can be switched off and then have no logarithm."""
        return tuple(k for k, p in enumerate(self.law.params.values()) if p.scale == "log" and p.off == 0)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Of the columns."""
        columns = [f"log10 {name}" if p.scale == "log" else name for name, p in self.law.table.items()]
        return (*columns, *(f"{self.law.names[k]} is off" for k in self.switchable))

    @cached_property
    def _column_scales(self) -> Floats:
        """(parameters,) what a column grows by with its internal parameter."""
        return np.array([1.0 / LN10 if p.scale == "log" else 1.0 for p in self.law.params.values()])

    def internal(self, values: Mapping[str, Any]) -> Floats:
        """(candidates, parameters) internal, from the author's values; 0 of a coefficient is -inf."""
        columns = np.broadcast_arrays(*(np.atleast_1d(np.asarray(values[n], float)) for n in self.law.names))
        return self.internal_rows(np.stack(columns, axis=-1))

    def internal_rows(self, parameters: Floats) -> Floats:
        """(rows, parameters) internal, from the author's."""
        theta, on_log_scale = np.array(parameters, float), [p.scale == "log" for p in self.law.params.values()]
        with np.errstate(divide="ignore"):
            theta[:, on_log_scale] = np.log(theta[:, on_log_scale])
        return theta

    def input_rows(self, theta: Floats) -> Floats:
        """(rows, columns) of internal parameters (rows, parameters)."""
        off = np.isneginf(theta)
        return np.concatenate([np.where(off, np.nan, theta * self._column_scales), off[:, list(self.switchable)]], axis=1)

    def derivatives(self, theta: Floats) -> Floats:
        """(rows, columns, parameters) derivatives of `rows`; zero where a coefficient is off."""
        count = theta.shape[1]
        derivatives = np.zeros((len(theta), len(self.names), count))
        derivatives[:, range(count), range(count)] = np.where(np.isneginf(theta), 0.0, self._column_scales)
        return derivatives
