"""Predictions, their status and times to strain, and the nuisance parameters of a test."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from enum import IntEnum
from typing import Annotated, Literal, TypeAlias

import numpy as np

from creepkit.arrays import Floats, Ints, set_fields
from creepkit.checked_arguments import checked
from creepkit.errors import SolveError, nearest
from creepkit.limits import numbers
from creepkit.records.specimen_lookup import all_dimensions
from creepkit.records.specimen_record import NAME_PATTERN

NuisanceValues: TypeAlias = Mapping[str, Floats]
"""{key: (candidates or 1, tests)}: the value of an explicit nuisance in each test; the key is its kind, of a step with
its start (see Nuisance.key)."""


class Status(IntEnum):
    """How a predicted row ended.

    OUTSIDE_DOMAIN : a surrogate extrapolates; the values are there. OUTSIDE_CLASS : the law is none that the surrogate
    knows; all values are NaN, and the prediction says why in `reason`.
    """

    COMPLETE = 0
    RUPTURED = 1
    NOT_CONVERGED = 2
    OUTSIDE_DOMAIN = 3
    OUTSIDE_CLASS = 4

    @property
    def text(self) -> str:
        """It in words."""
        return ("complete", "burst", "not converged", "outside the domain", "outside the class of laws")[self]


@dataclass(frozen=True, eq=False)
class TimesToStrain:
    """When a prediction reaches what was measured, and when it ruptures, for candidates x tests, padded as Prediction.

    times : (candidates, tests, times) s, when the strain measured at each frame is predicted; the rupture where that
        comes first; 0 where the measured strain is not above zero, NaN where neither comes before the horizon.
    log_time_derivatives : (candidates, tests, times) derivative of the predicted output to ln t there, infinite at
        rupture.
    rupture_times : (candidates, tests) s, NaN where the specimen lasts to the horizon.
    horizon : (tests,) s, up to which was predicted.
    time_jacobian, rupture_jacobian : (..., parameters) derivatives of the ln of these times with respect to the
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

    values : (candidates, tests, times, outputs) in the units of the outputs; NaN after a row's end and
        beyond a test's last time.
    outputs : names along the last axis.
    lengths : (tests,) number of times of each test. times : (times,) s, of each test; may be empty.
    status : (candidates, tests) Status of each row; end_times : (candidates, tests) s, where it ended.
    jacobian : (candidates, tests, times, outputs, parameters) or None: derivatives with respect to the law's
        *internal* parameters (the natural logarithm where the scale is log), in the law's order.
    nuisance_jacobian : {key: (candidates, tests, times, outputs)}: derivatives with respect to each test's own
        nuisance, in the unit of its kind (see Nuisance); without those that the predictor cannot differentiate.
    times_to_strain : when measured strains and rupture are reached, where that was asked for (see TimesToStrain).
    reason : why nothing is predicted, in a sentence, where a predictor refuses the law.
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
    reason: str = ""

    def __repr__(self) -> str:
        candidates, tests = self.status.shape
        return f"<Prediction of {', '.join(self.outputs)}: tests {tests}, candidates {candidates}>"

    def of(self, test: int, candidate: int = 0) -> Floats:
        """Outputs of one test, (times, outputs)."""
        return np.asarray(self.values[candidate, test, : int(self.lengths[test])])

    def output_of(self, test: int, output: str) -> Floats:
        """One output of one test, (times,), of the first candidate."""
        return self.of(test)[:, self.outputs.index(output)]


NuisanceKind: TypeAlias = str
"""What a nuisance parameter is of: one of GENERAL_NUISANCES, or a length of a test piece."""


PROGRAM_NUISANCES: tuple[NuisanceKind, ...] = ("temperature step", "temperature drift", "load step")
"""Kinds that change the programs of a history: every predictor follows them (see nuisance_programs)."""


RATE_NUISANCES: tuple[NuisanceKind, ...] = ("rate step", "rate drift")
"""Kinds that multiply every rate of the law by a function of time: every predictor that takes any law follows them."""


STEP_NUISANCES: tuple[NuisanceKind, ...] = ("temperature step", "rate step", "load step")
"""Kinds that begin at a time of the test."""


COVARIANCE_NUISANCES: tuple[NuisanceKind, ...] = ("offset", "rate")
"""Kinds that only enter the covariance of residuals; all others change the simulation."""


GENERAL_NUISANCES: tuple[NuisanceKind, ...] = (
    *COVARIANCE_NUISANCES,
    "modulus",
    "temperature",
    *PROGRAM_NUISANCES,
    *RATE_NUISANCES,
)
"""Kinds that every experiment may have; beside them each has the lengths of its test piece."""


CLOSE_SPELLING = 0.8
"""Similarity above which an unknown kind is a misspelt one."""


@checked
@dataclass(frozen=True)
class Nuisance:
    """A nuisance parameter: something unknown about a test that is not part of the law, with its prior.

    kind : "offset" (added to an output, in its unit), "rate" (ln of a factor on this test's creep rate: heat-to-heat
        scatter), "modulus" (relative change of Young's modulus: 0.05 makes it 5 % stiffer), "temperature" (K above what
        the history says), or a length of the test piece itself, mm, such as "thickness" of a
        dimple. What the rig did during the test: "temperature step" (K, from `start` on),
        "temperature drift" (K gained linearly from the start of the test to its last used frame), "rate step" (ln of a
        factor on every rate of the law, from `start` on), "rate drift" (such a factor's ln, gained linearly over the
        test) or "load step" (relative change of stress or pressure, from `start` on).
    scope : one nuisance parameter for each "test", each "alloy", or for "all" tests together.
    output : to which output an offset belongs; "" stands for each output having its own.
    mean, sd : Gaussian prior, in the unit of the kind; sd = inf leaves it free, sd = None lets the fit estimate the
        spread. The mean of a length is one too: `Nuisance("thickness", mean=0.4935, sd=0.027)` says what was measured
        on such plates and replaces what histories and specimen say; without a mean a test's length is about what its
        history (or the specimen) says.
    bounds : hard limits, in the same unit.
    start : s, when a step begins.
    tests : names of the tests that it applies to; () stands for all. The other tests have a deviation of zero, or one
        of their own by another nuisance of this kind: two groups of tests, each with scope "all".
    """

    kind: NuisanceKind
    scope: Literal["test", "alloy", "all"] = "test"
    output: str = ""
    mean: float = 0.0
    sd: Annotated[float, numbers(0, above=True, infinite=True)] | None = None
    bounds: tuple[float, float] = (-np.inf, np.inf)
    start: float = 0.0
    tests: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        _check_kind(self.kind)
        if not self.bounds[0] < self.bounds[1]:
            raise SolveError(f"nuisance '{self.kind}': bounds {self.bounds} are reversed")
        if self.kind in STEP_NUISANCES and not 0.0 < self.start < np.inf:
            raise SolveError(
                f"nuisance '{self.kind}': start is {self.start:g} s; say when it begins, such as start=3600.0"
            )
        if self.kind not in STEP_NUISANCES and self.start != 0.0:
            raise SolveError(f"nuisance '{self.kind}' has no start; only {', '.join(STEP_NUISANCES)} begin later")
        set_fields(self, start=float(self.start), tests=tuple(self.tests))

    @property
    def key(self) -> str:
        """What values and derivatives are filed under: the kind, of a step with its start, 'rate step@3600'."""
        return nuisance_key(self.kind, self.start)

    @property
    def is_simulated(self) -> bool:
        """Whether it changes the simulation, not only the covariance of residuals."""
        return self.kind not in COVARIANCE_NUISANCES

    @property
    def is_length(self) -> bool:
        """Whether it is a length in itself, so that its prior mean is one too; others are deviations, about zero."""
        return is_length_nuisance(self.kind)

    def applies_to(self, test: str) -> bool:
        """Whether a test, by name, has this nuisance."""
        return not self.tests or test in self.tests


def _check_kind(kind: str) -> None:
    """SolveError for what is neither a general kind nor can be a length; a specimen may be known only later."""
    known = (*GENERAL_NUISANCES, *all_dimensions())
    misspelt = get_close_matches(str(kind), known, 1, cutoff=CLOSE_SPELLING)
    if kind not in known and (misspelt or not (isinstance(kind, str) and NAME_PATTERN.fullmatch(kind))):
        raise SolveError(f"nuisance '{kind}' is not known; {nearest(str(kind), known)}")


def is_length_nuisance(kind: str) -> bool:
    """Whether nuisance parameters of a kind are lengths of test pieces."""
    return kind not in GENERAL_NUISANCES


def nuisance_key(kind: str, start: float = 0.0) -> str:
    """The key of a kind, of a step with its start in s."""
    return f"{kind}@{start:.15g}" if kind in STEP_NUISANCES else kind


def kind_and_start(key: str) -> tuple[str, float]:
    """The kind, and the start in s (0 but for a step), of a key that `nuisance_key` made."""
    kind, _, start = key.partition("@")
    return kind, float(start or 0.0)
