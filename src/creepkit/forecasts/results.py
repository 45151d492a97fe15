"""Results of a forecast: of an output, of a time, and of a test."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Floats
from creepkit.forecasts.bands import Band
from creepkit.forecasts.measured_test import TestScore
from creepkit.inverse.uncertainty.law_misfit import LawMisfit
from creepkit.records import History

LAW, CHOICE_OF_LAW, OFFSET, NOISE, MISFIT, NUMERICAL = (
    "parameters of the law",
    "choice of the law",
    "offset",
    "noise",
    "misfit of the law",
    "numerical error",
)
"""Parts of a band, beside the scatter of rates and the dimensions."""


@dataclass(frozen=True, eq=False)
class OutputForecast:
    """One output of one test.

    times : (times,) s. value : (times,) at the identified values. band : of measured values.
    shares : {part of the band: (times,) its share of the variance}, to first order, in the logarithm of a strain.
    """

    output: str
    times: Floats
    value: Floats
    band: Band
    shares: Mapping[str, Floats]


@dataclass(frozen=True)
class TimeForecast:
    """When an output reaches a value, or the specimen breaks.

    event : in words. output, target : what is reached; "" for rupture. value : s, at the identified values.
    median, low, high : s, of a single test. All may be infinite.
    measured : s, NaN where it is not known; censored : whether the test was stopped then, unbroken.
    chance : probability that it comes before the last time of the test.
    """

    event: str
    value: float
    median: float
    low: float
    high: float
    chance: float
    measured: float = float("nan")
    censored: bool = False
    output: str = ""
    target: float = float("nan")

    @property
    def inside(self) -> bool | None:
        """Whether the measured time lies within the interval; None where nothing was measured."""
        if not np.isfinite(self.measured):
            return None
        return self.measured <= self.high if self.censored else self.low <= self.measured <= self.high


@dataclass(frozen=True, eq=False)
class TestForecast:
    """The forecast of one test.

    outputs : {name: its curve and band}. times : to targets and to rupture. score : of a measured test, else None.
    includes : what the bands are made of, with sizes. caution : why bands are not those of the tests, or "".
    extrapolation : beyond the fitted ranges, in one sentence, or "". misfit : what the law of most weight misses there,
    where bands and times hold that.
    """

    __test__ = False  # not a test case, whatever its name says to pytest

    history: History
    outputs: Mapping[str, OutputForecast]
    times: tuple[TimeForecast, ...]
    includes: Mapping[str, str]
    extrapolation: str = ""
    score: TestScore | None = None
    notes: tuple[str, ...] = ()
    caution: str = ""
    misfit: LawMisfit | None = None

    @property
    def name(self) -> str:
        """Name of the test."""
        return self.history.name
