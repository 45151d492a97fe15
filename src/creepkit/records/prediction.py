"""What a model says of histories, and who may say it: predictors and specimens, with what is unknown about a test."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Literal, Protocol, runtime_checkable

import numpy as np

from creepkit.arrays import ArrayLike, Floats, Ints
from creepkit.errors import SolveError
from creepkit.records.history import History

if TYPE_CHECKING:
    from creepkit.language.law import CreepLaw


class Status(IntEnum):
    """How a predicted row ended."""

    COMPLETE = 0
    BURST = 1
    NOT_CONVERGED = 2
    OUTSIDE_DOMAIN = 3


@dataclass(frozen=True, eq=False)
class Prediction:
    """Predicted outputs for candidates x tests, padded to the longest test.

    values : (candidates, tests, times, outputs); NaN after a row's end and beyond a test's last time.
    outputs : names along the last axis.
    lengths : (tests,) number of times of each test.
    status : (candidates, tests) Status of each row; end_times : (candidates, tests) s, where it ended.
    jacobian : (candidates, tests, times, outputs, parameters) or None: derivatives with respect to the law's
        *internal* parameters (the natural logarithm where the scale is log), in the law's order.
    """

    values: Floats
    outputs: tuple[str, ...]
    lengths: Ints
    status: Ints
    end_times: Floats
    jacobian: Floats | None = None
    times: tuple[Floats, ...] = ()

    def of(self, test: int, candidate: int = 0) -> Floats:
        """Outputs of one test, (times, outputs)."""
        return np.asarray(self.values[candidate, test, : int(self.lengths[test])])


@runtime_checkable
class Predictor(Protocol):
    """Anything that predicts histories from a law and its values: specimen, surrogate or closed form."""

    def predict(
        self,
        law: CreepLaw,
        values: Mapping[str, ArrayLike],
        histories: Sequence[History],
        *,
        jacobian: bool = False,
    ) -> Prediction:
        """Predict each history's outputs at its times.

        values : {parameter: number or (candidates,)} in the author's units; 0 may switch a parameter off.
        """
        ...


@runtime_checkable
class Specimen(Predictor, Protocol):
    """A frozen record of a test piece: which outputs are observed, and how to predict them."""

    @property
    def name(self) -> str:
        """Short, lower case, unique in the registry."""
        ...

    @property
    def title(self) -> str:
        """One line for people."""
        ...

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of what is observed."""
        ...


@dataclass(frozen=True)
class Nuisance:
    """Something unknown about a test that is not part of the law, with its prior.

    kind : "offset" (added to an output), "rate" (ln of a factor on this test's creep rate: heat-to-heat scatter),
        "thickness" (apex, mm), "modulus" (relative), "temperature" (K) or "window" (mm).
    scope : one unknown for each "test", each "alloy", or for "all" tests together.
    mean, sd : Gaussian prior; sd = inf leaves it free, sd = None lets the fit estimate the spread.
    """

    kind: Literal["offset", "rate", "thickness", "modulus", "temperature", "window"]
    scope: Literal["test", "alloy", "all"] = "test"
    output: str = ""
    mean: float = 0.0
    sd: float | None = None
    bounds: tuple[float, float] = (-np.inf, np.inf)

    def __post_init__(self) -> None:
        if self.sd is not None and not self.sd > 0:
            raise SolveError(f"nuisance '{self.kind}': sd = {self.sd} must be above zero (or None to estimate it)")
        if not self.bounds[0] < self.bounds[1]:
            raise SolveError(f"nuisance '{self.kind}': bounds {self.bounds} are reversed")
