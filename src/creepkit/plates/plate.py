"""Plate: the answers for all alloys, side by side."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from creepkit.errors import FitError, nearest
from creepkit.plates.alloys import Alloy
from creepkit.plates.answer import AlloyAnswer
from creepkit.plates.compositions import UNKNOWN, Compositions
from creepkit.records import History, Predictor


@dataclass(frozen=True, eq=False)
class Plate:
    """The answer of screen().

    answers : one for each alloy, in the order of their first tests. histories : {alloy: its tests}.
    compositions : what they are made of; None where nobody said. folder : where the answers are kept, or None.
    notes : what is odd about the plate as a whole.
    """

    answers: tuple[AlloyAnswer, ...]
    histories: Mapping[str, tuple[History, ...]]
    compositions: Compositions | None = None
    folder: Path | None = None
    notes: tuple[str, ...] = field(default=())

    @classmethod
    def of(
        cls, alloys: Sequence[Alloy], answers: Sequence[AlloyAnswer], using: Predictor,
        compositions: Compositions | None, folder: Path | None,
    ) -> Plate:  # fmt: skip
        """The plate of these alloys, with tests and predictor attached to their identifications."""
        told = () if compositions is None else compositions.lacking([a.name for a in alloys])
        whole = tuple(answer.on(alloy.tests, using) for answer, alloy in zip(answers, alloys, strict=True))
        return cls(whole, {a.name: a.tests for a in alloys}, compositions, folder, told)

    @property
    def identified(self) -> tuple[AlloyAnswer, ...]:
        """The alloys that have a law."""
        return tuple(answer for answer in self.answers if answer.identified)

    @property
    def failed(self) -> dict[str, str]:
        """{alloy: why it has no law}."""
        return {answer.alloy: answer.reason for answer in self.answers if not answer.identified}

    def __getitem__(self, alloy: str) -> AlloyAnswer:
        for answer in self.answers:
            if answer.alloy == alloy:
                return answer
        raise FitError(f"the plate has no alloy '{alloy}'; {nearest(alloy, [a.alloy for a in self.answers])}")

    def class_of(self, alloy: str) -> str:
        """The class of an alloy by its principal element; "unknown" without compositions."""
        return UNKNOWN if self.compositions is None else self.compositions.class_of(alloy)

    def classes(self) -> dict[str, tuple[AlloyAnswer, ...]]:
        """{class: its identified alloys}: rich in something first, the largest class first, then the others."""
        found: dict[str, list[AlloyAnswer]] = defaultdict(list)
        for answer in self.identified:
            found[self.class_of(answer.alloy)].append(answer)
        order = sorted(found, key=lambda name: (not name.endswith("-rich"), name == UNKNOWN, -len(found[name]), name))
        return {name: tuple(found[name]) for name in order}

    def shares(self) -> dict[str, dict[str, float]]:
        """{class: {law: mean weight over the alloys of the class}} (Fig. 7c, with the undecided ones shared out)."""
        answer = {}
        for name, members in self.classes().items():
            weights: dict[str, float] = defaultdict(float)
            for member in members:
                for w in member.laws:
                    weights[w.fit.law.name] += w.weight / len(members)
            answer[name] = dict(sorted(weights.items()))
        return answer

    def to_csv(self, path: str | Path) -> Path:
        """Write one row an alloy: class, law, weight, values with intervals, rate, misfits, notes."""
        from creepkit.plates.table import write_csv

        return write_csv(self, Path(path))

    def to_hdf5(self, path: str | Path) -> Path:
        """Write everything that is a number: values, covariances, tests as measured and as predicted."""
        from creepkit.plates.hdf5 import write

        return write(self, Path(path))

    def plot(self, folder: str | Path) -> list[Path]:
        """Draw measured against identified displacement, misfit with and without sparsity, and shares of laws."""
        from creepkit.plates.plotting import draw

        return draw(self, Path(folder))

    def __str__(self) -> str:
        from creepkit.plates.table import text_of

        return text_of(self)
