"""AlloyAnswer: what is known of one alloy once its tests have been screened."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.confirm import Confirmation
from creepkit.inverse.identification import Identification
from creepkit.inverse.selection import CREDIBLE_WEIGHT, DECISIVE_WEIGHT
from creepkit.records import History, Predictor

PredictedOutputs: TypeAlias = Mapping[str, Floats]
"""{output: (frames,)} of one test."""


@dataclass(frozen=True, eq=False)
class WeightedLaw:
    """An identified law of an alloy: BIC less the best, and its share of belief."""

    fit: Identification
    bic_difference: float
    weight: float


@dataclass(frozen=True, eq=False)
class AlloyResult:
    """What was found of one alloy.

    fingerprint : of its tests and of all that was asked; an answer with the same one is not worked out again.
    laws : identified laws, best first; failed : {law: why it could not be identified}.
    verdict : one sentence on which law it is; equivalents : on each pair of laws that the tests cannot separate.
    reason : why there is none; empty otherwise.
    dense, sparse : the law without sparsity and what a penalty made of it, where they were asked for.
    predicted : {test: {output: (frames,)}} of the best law with the test's own nuisances and offsets, by the specimen
        where it was confirmed. seconds : of CPU that it took.
    """

    alloy: str
    fingerprint: str = ""
    laws: tuple[WeightedLaw, ...] = ()
    failed_laws: Mapping[str, str] = field(default_factory=dict)
    verdict: str = ""
    equivalents: tuple[str, ...] = ()
    failure: str = ""
    dense_fit: Identification | None = None
    sparse_fit: Identification | None = None
    confirmation: Confirmation | None = None
    predicted: Mapping[str, PredictedOutputs] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    cpu_seconds: float = 0.0

    @property
    def identified(self) -> bool:
        """Whether some law was."""
        return bool(self.laws)

    @property
    def best(self) -> Identification:
        """The law of largest weight."""
        if not self.laws:
            raise FitError(f"alloy '{self.alloy}' has no identified law: {self.failure}")
        return self.laws[0].fit

    @property
    def decisive(self) -> bool:
        """Whether the best law has nearly all of the belief, in a choice of several."""
        return len(self.laws) > 1 and self.laws[0].weight > DECISIVE_WEIGHT

    @property
    def credible_laws(self) -> tuple[str, ...]:
        """Names of the laws that the tests cannot rule out, best first."""
        return tuple(w.fit.law.name for k, w in enumerate(self.laws) if k == 0 or w.weight > CREDIBLE_WEIGHT)

    @property
    def reduced_fit(self) -> Identification:
        """What is set against the dense law: the one a penalty left, else the best of all."""
        return self.best if self.sparse_fit is None else self.sparse_fit

    def with_tests(self, tests: tuple[History, ...], predictor: Predictor) -> AlloyResult:
        """The same with its tests and predictor attached to every identification, for predictions and plots."""
        laws = tuple(replace(w, fit=w.fit.with_histories(tests, predictor)) for w in self.laws)
        dense_fit, sparse_fit = (None if fit is None else fit.with_histories(tests, predictor) for fit in (self.dense_fit, self.sparse_fit))
        return replace(self, laws=laws, dense_fit=dense_fit, sparse_fit=sparse_fit)


def mean_relative_squared_error(fit: Identification) -> float:
    """Eq. (4) of Chen et al.: relative squared errors, the mean over outputs."""
    return float(np.mean([e.relative_squared_error for e in fit.errors.values()]))


def mean_chi_square(fit: Identification) -> float:
    """Mean of (error / noise)^2 over outputs; one is noise alone."""
    return float(np.mean([e.chi_square for e in fit.errors.values()]))
