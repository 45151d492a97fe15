"""Plate: the answers for all alloys, side by side."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from creepkit.errors import FitError, nearest
from creepkit.plates.alloys import Alloy
from creepkit.plates.answer import AlloyResult
from creepkit.plates.compositions import UNKNOWN_CLASS, Compositions
from creepkit.records import History, Predictor


@dataclass(frozen=True, eq=False)
class Plate:
    """The answer of screen().

    answers : one for each alloy, in the order of their first tests. histories : {alloy: its tests}.
    compositions : what they are made of; None where nobody said. folder : where the answers are kept, or None.
    notes : what is odd about the plate as a whole.
    """

    results: tuple[AlloyResult, ...]
    histories: Mapping[str, tuple[History, ...]]
    compositions: Compositions | None = None
    folder: Path | None = None
    notes: tuple[str, ...] = field(default=())

    @classmethod
    def from_results(
        cls, alloys: Sequence[Alloy], results: Sequence[AlloyResult], predictor: Predictor,
        compositions: Compositions | None, folder: Path | None,
    ) -> Plate:  # fmt: skip
        """The plate of these alloys, with tests and predictor attached to their identifications."""
        notes = () if compositions is None else compositions.missing([a.name for a in alloys])
        attached = tuple(result.with_tests(alloy.tests, predictor) for result, alloy in zip(results, alloys, strict=True))
        return cls(attached, {a.name: a.tests for a in alloys}, compositions, folder, notes)

    @property
    def identified(self) -> tuple[AlloyResult, ...]:
        """The alloys that have a law."""
        return tuple(answer for answer in self.results if answer.identified)

    @property
    def failures(self) -> dict[str, str]:
        """{alloy: why it has no law}."""
        return {answer.alloy: answer.failure for answer in self.results if not answer.identified}

    def __getitem__(self, alloy: str) -> AlloyResult:
        for result in self.results:
            if result.alloy == alloy:
                return result
        raise FitError(f"the plate has no alloy '{alloy}'; {nearest(alloy, [a.alloy for a in self.results])}")

    def class_of(self, alloy: str) -> str:
        """The class of an alloy by its principal element; "unknown" without compositions."""
        return UNKNOWN_CLASS if self.compositions is None else self.compositions.class_of(alloy)

    def by_class(self) -> dict[str, tuple[AlloyResult, ...]]:
        """{class: its identified alloys}: rich in something first, the largest class first, then the others."""
        members: dict[str, list[AlloyResult]] = defaultdict(list)
        for result in self.identified:
            members[self.class_of(result.alloy)].append(result)
        ordered_classes = sorted(members, key=lambda name: (not name.endswith("-rich"), name == UNKNOWN_CLASS, -len(members[name]), name))
        return {name: tuple(members[name]) for name in ordered_classes}

    def law_fractions(self) -> dict[str, dict[str, float]]:
        """{class: {law: mean weight over the alloys of the class}} (Fig. 7c, with the undecided ones shared out)."""
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
        from creepkit.plates.table import write_csv

        return write_csv(self, Path(path))

    def to_hdf5(self, path: str | Path) -> Path:
        """Write everything that is a number: values, covariances, tests as measured and as predicted."""
        from creepkit.plates.hdf5 import write_hdf5

        return write_hdf5(self, Path(path))

    def plot(self, folder: str | Path) -> list[Path]:
        """Draw measured against identified displacement, misfit with and without sparsity, and shares of laws."""
        from creepkit.plates.plotting import plot_screening

        return plot_screening(self, Path(folder))

    def __str__(self) -> str:
        from creepkit.plates.table import screening_text

        return screening_text(self)
