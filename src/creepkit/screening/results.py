"""Results of a screening: AlloyResult of one alloy, and Plate of all alloys."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from creepkit.errors import FitError, nearest
from creepkit.inverse.confirmation import Confirmation
from creepkit.inverse.identification import Identification
from creepkit.inverse.selection import CREDIBLE_WEIGHT
from creepkit.presentation import Presentable, present
from creepkit.records import History, Predictor
from creepkit.screening.alloys import UNKNOWN_CLASS, Alloy, Compositions

"""{output: (frames,) mm or strain} of one test."""


@dataclass(frozen=True, eq=False)
class WeightedLaw:
    """An identified law of an alloy: its BIC less that of the best law, and its weight."""

    fit: Identification
    bic_difference: float
    weight: float


@dataclass(frozen=True, eq=False)
class AlloyResult:
    """The laws of one alloy.

    fingerprint : of its tests and settings; a result with the same one is not computed again.
    laws : identified laws, best first; failed_laws : {law: why it could not be identified}.
    verdict : one sentence on which law it is; equivalents : on each pair of laws that the tests cannot separate.
    failure : why there is no law; empty otherwise.
    dense_fit, sparse_fit : the law without sparsity and what a penalty made of it, where they were requested.
    cpu_seconds : CPU time of the identification.
    decisive : whether the ranking of its laws is (see inverse.selection.ranking).
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
    notes: tuple[str, ...] = ()
    cpu_seconds: float = 0.0
    decisive: bool = False

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
    def credible_laws(self) -> tuple[str, ...]:
        """Names of the laws that the tests cannot rule out, best first."""
        return tuple(w.fit.law.name for k, w in enumerate(self.laws) if k == 0 or w.weight > CREDIBLE_WEIGHT)

    @property
    def reduced_fit(self) -> Identification:
        """The law that is compared with the dense one: what a penalty left of it, else the best of all."""
        return self.best if self.sparse_fit is None else self.sparse_fit

    def with_tests(self, tests: tuple[History, ...], predictor: Predictor) -> AlloyResult:
        """The same with its tests and predictor attached to every identification, for predictions and plots."""
        laws = tuple(replace(w, fit=w.fit.with_histories(tests, predictor)) for w in self.laws)
        dense, sparse = (f and f.with_histories(tests, predictor) for f in (self.dense_fit, self.sparse_fit))
        return replace(self, laws=laws, dense_fit=dense, sparse_fit=sparse)


def mean_relative_squared_error(fit: Identification) -> float:
    """Eq. (4) of Chen et al.: relative squared errors, the mean over outputs."""
    return float(np.mean([e.relative_squared_error for e in fit.errors.values()]))


def mean_chi_square(fit: Identification) -> float:
    """Mean of (error / noise)^2 over outputs; one is noise alone."""
    return float(np.mean([e.chi_square for e in fit.errors.values()]))


@dataclass(frozen=True, eq=False)
class ScreeningResult(Presentable, text="reports.screening:screening_text"):
    """The result of screen().

    results : one for each alloy, in the order of their first tests. histories : {alloy: its tests}.
    compositions : of the alloys, None where they are not known. folder : where the results are kept, or None.
    notes : what is unusual about the plate as a whole.
    """

    results: tuple[AlloyResult, ...]
    histories: Mapping[str, tuple[History, ...]]
    compositions: Compositions | None = None
    folder: Path | None = None
    notes: tuple[str, ...] = field(default=())

    @classmethod
    def from_results(
        cls,
        alloys: Sequence[Alloy],
        results: Sequence[AlloyResult],
        predictor: Predictor,
        compositions: Compositions | None,
        folder: Path | None,
    ) -> ScreeningResult:
        """The plate of these alloys, with tests and predictor attached to their identifications."""
        notes = () if compositions is None else compositions.missing([a.name for a in alloys])
        attached = tuple(
            result.with_tests(alloy.tests, predictor) for result, alloy in zip(results, alloys, strict=True)
        )
        return cls(attached, {a.name: a.tests for a in alloys}, compositions, folder, notes)

    @property
    def identified(self) -> tuple[AlloyResult, ...]:
        """The alloys that have a law."""
        return tuple(result for result in self.results if result.identified)

    @property
    def failures(self) -> dict[str, str]:
        """{alloy: why it has no law}."""
        return {result.alloy: result.failure for result in self.results if not result.identified}

    def __getitem__(self, alloy: str) -> AlloyResult:
        known = {result.alloy: result for result in self.results}
        if alloy not in known:
            raise FitError(f"the plate has no alloy '{alloy}'; {nearest(alloy, known)}")
        return known[alloy]

    def class_of(self, alloy: str) -> str:
        """The class of an alloy by its principal element; "unknown" without compositions."""
        return UNKNOWN_CLASS if self.compositions is None else self.compositions.class_of(alloy)

    def by_class(self) -> dict[str, tuple[AlloyResult, ...]]:
        """{class: its identified alloys}: rich in something first, the largest class first, then the others."""
        members: dict[str, list[AlloyResult]] = defaultdict(list)
        for result in self.identified:
            members[self.class_of(result.alloy)].append(result)
        ordered_classes = sorted(
            members, key=lambda name: (not name.endswith("-rich"), name == UNKNOWN_CLASS, -len(members[name]), name)
        )
        return {name: tuple(members[name]) for name in ordered_classes}

    def law_fractions(self) -> dict[str, dict[str, float]]:
        """{class: {law: mean weight over the alloys of the class}} (Fig. 7c, undecided alloys counted by weight)."""
        fractions = {}
        for name, members in self.by_class().items():
            weights: dict[str, float] = defaultdict(float)
            for member in members:
                for w in member.laws:
                    weights[w.fit.law.name] += w.weight / len(members)
            fractions[name] = dict(sorted(weights.items()))
        return fractions

    def to_csv(self, path: str | Path) -> Path:
        """Write one row an alloy: class, law, weight, values with intervals, rate, misfits, notes."""
        return present("screening.files:write_csv", self, Path(path))

    def plot(self, folder: str | Path) -> list[Path]:
        """Draw the share of each law by class, and the rate of each alloy by its law; the paths of the pictures."""
        return present("reports.screening:plot_screening", self, Path(folder))
