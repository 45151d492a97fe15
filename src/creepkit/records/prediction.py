"""What a model says of histories, and who may say it: predictors and specimens, with what is unknown about a test."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING, Literal, Protocol, TypeAlias, runtime_checkable

import numpy as np

from creepkit.arrays import ArrayLike, Floats, Ints
from creepkit.errors import SolveError
from creepkit.records.history import History

if TYPE_CHECKING:
    from creepkit.language.law import CreepLaw


NuisanceValues: TypeAlias = Mapping[str, Floats]
"""{kind: (candidates or 1, tests)}: the value of an explicit nuisance in each test."""


class Status(IntEnum):
    """How a predicted row ended."""

    COMPLETE = 0
    RUPTURED = 1
    NOT_CONVERGED = 2
    OUTSIDE_DOMAIN = 3


@dataclass(frozen=True, eq=False)
class TimesToStrain:
    """When a prediction arrives at what was measured, and when it breaks, for candidates x tests, padded as there.

    arrivals : (candidates, tests, times) s, when the strain measured at each frame is predicted; the rupture where that
        comes first; 0 where the measured strain is not above zero, NaN where neither comes before the horizon.
    slopes : (candidates, tests, times) derivative of the predicted output to ln t there, infinite at rupture.
    ruptures : (candidates, tests) s, NaN where the specimen lasts to the horizon.
    horizon : (tests,) s, up to which was predicted.
    arrival_jacobian, rupture_jacobian : (..., parameters) derivatives of the ln of these times with respect to the
        law's internal parameters, or None.
    """

    times: Floats
    log_time_derivatives: Floats
    rupture_times: Floats
    horizon: Floats
    time_jacobian: Floats | None = None
    rupture_jacobian: Floats | None = None


@dataclass(frozen=True, eq=False)
class Prediction:
    """Predicted outputs for candidates x tests, padded to the longest test.

    values : (candidates, tests, times, outputs); NaN after a row's end and beyond a test's last time.
    outputs : names along the last axis.
    lengths : (tests,) number of times of each test.
    status : (candidates, tests) Status of each row; end_times : (candidates, tests) s, where it ended.
    jacobian : (candidates, tests, times, outputs, parameters) or None: derivatives with respect to the law's
        *internal* parameters (the natural logarithm where the scale is log), in the law's order.
    nuisance_jacobian : {kind: (candidates, tests, times, outputs)}: derivatives with respect to each test's own effect,
        in the unit of that kind (see Nuisance); without the kinds that the predictor cannot differentiate.
    life : when measured strains are arrived at, and rupture, where that was asked for (see WholeLife).
    """

    values: Floats
    outputs: tuple[str, ...]
    lengths: Ints
    status: Ints
    end_times: Floats
    jacobian: Floats | None = None
    times: tuple[Floats, ...] = ()
    nuisance_jacobian: Mapping[str, Floats] = field(default_factory=dict)
    times_to_strain: TimesToStrain | None = None

    def of(self, test: int, candidate: int = 0) -> Floats:
        """Outputs of one test, (times, outputs)."""
        return np.asarray(self.values[candidate, test, : int(self.lengths[test])])


@runtime_checkable
class Predictor(Protocol):
    """Anything that predicts histories from a law and its values: specimen, surrogate or closed form.

    Optional attributes, looked for by name: `outputs`, the names of what is predicted, first the one that grows with
    creep; `nuisances`, the kinds of explicit nuisances that predict() understands (none without it);
    `reference_stress(history)`, the von Mises stress, MPa, that stands for the test (a number, or one for each level
    of its loading); `screening()`, see Screened.
    """

    def predict(
        self,
        law: CreepLaw,
        values: Mapping[str, ArrayLike],
        histories: Sequence[History],
        *,
        jacobian: bool = False,
        nuisances: NuisanceValues | None = None,
    ) -> Prediction:
        """Predict each history's outputs at its times.

        values : {parameter: number or (candidates,)} in the author's units; 0 may switch a parameter off.
        nuisances : {kind: (candidates or 1, tests)} of what differs from test to test, measured as Nuisance says. A
            kind that the predictor does not know is a SolveError. With `jacobian` the prediction has the derivatives
            to the kinds given in `nuisance_jacobian`.
        """
        ...


@runtime_checkable
class SupportsRupturePrediction(Predictor, Protocol):
    """A predictor that follows a specimen to its rupture, beyond the last time of its history."""

    def predict_to_rupture(
        self, law: CreepLaw, values: Mapping[str, ArrayLike], histories: Sequence[History], *, jacobian: bool = False
    ) -> Prediction:
        """Predict as predict() does, with `life`: when measured strains are arrived at, and when it breaks."""
        ...


@runtime_checkable
class SupportsReducedOrderModel(Predictor, Protocol):
    """A predictor too expensive for a global search, with a cheap stand-in of the same outputs and nuisances."""

    def reduced_order_model(self) -> Predictor:
        """Return the stand-in; it may be some per cent off and need not know derivatives."""
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


NuisanceKind: TypeAlias = Literal["offset", "rate", "thickness", "modulus", "temperature", "window"]

SIMULATED_NUISANCES: tuple[NuisanceKind, ...] = ("thickness", "modulus", "temperature", "window")
"""Kinds that change the simulation; "offset" and "rate" only change how its residuals scatter."""
LENGTH_NUISANCES: tuple[NuisanceKind, ...] = ("thickness", "window")
"""Kinds that are lengths in themselves, so that their prior mean is one too; the others are deviations, about zero."""


@dataclass(frozen=True)
class Nuisance:
    """Something unknown about a test that is not part of the law, with its prior.

    kind : "offset" (added to an output, in its unit), "rate" (ln of a factor on this test's creep rate: heat-to-heat
        scatter), "thickness" (the apex thickness itself, mm), "window" (the radius within which the profile was
        observed, mm), "modulus" (relative change of Young's modulus: .05 makes it 5 % stiffer) or "temperature"
        (K above what the history says).
    scope : one unknown for each "test", each "alloy", or for "all" tests together.
    output : to which output an offset belongs; "" stands for each output having its own.
    mean, sd : Gaussian prior, in the unit of the kind; sd = inf leaves it free, sd = None lets the fit estimate the
        spread. A thickness and a window are lengths, and so is their mean: `Nuisance("thickness", mean=0.4935,
        sd=0.027)` says what was measured on such plates and replaces what histories and specimen say; without a mean
        a test's thickness is about what its history (or the specimen) says.
    bounds : hard limits, in the same unit.
    """

    kind: NuisanceKind
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
