"""What a check of data quality finds: flags with numbers, and all of them together."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal

from creepkit.records import History
from creepkit.records.presentable import Presentable

FlagKind = Literal[
    "fracture",
    "unloading",
    "falling",
    "outlier",
    "copy",
    "replicate",
    "loading",
    "unit",
    "modulus",
    "record",
    "jump",
    "idle",
    "unreadable",
    "few points",
    "motion",
    "residual",
    "fit",
    "remark",
]


@dataclass(frozen=True)
class QualityFlag:
    """Something of one or several histories that may be wrong and should perhaps not be fitted as it is.

    tests : names of the histories. kind : what is wrong. frames : which frames of a single history, counted from 0;
    empty for a whole test, and for what began at a time. reason : a sentence with the numbers. time : s, when it
    happened. jumps : {test: step of its leading output}, mm or strain. proposal : what may be done about it.
    """

    tests: tuple[str, ...]
    kind: FlagKind
    frames: tuple[int, ...]
    reason: str
    time: float | None = None
    jumps: Mapping[str, float] = field(default_factory=dict)
    proposal: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "jumps", MappingProxyType(dict(self.jumps)))

    @classmethod
    def of_frames(cls, history: History, kind: FlagKind, frames: Iterable[int], reason: str) -> QualityFlag:
        """Of some frames of a history, at the time of the first."""
        chosen = tuple(int(k) for k in frames)
        return cls((history.name,), kind, chosen, reason, time=float(history.times[min(chosen)]))

    @property
    def history(self) -> str:
        """The name of the history, or of all of them."""
        return ", ".join(self.tests)

    def __str__(self) -> str:
        which = f"{frame_ranges_text(self.frames)}: " if self.frames else ""
        return f"{self.history}: {self.kind}: {which}{self.reason}" + (self.proposal and f"; {self.proposal}")


@dataclass(frozen=True)
class DataQuality(Presentable):
    """What is suspect in histories: flags, test by test, then those of several tests; it is iterated over as a list.

    tests : number of histories that were checked.
    """

    flags: tuple[QualityFlag, ...]
    tests: int

    def __iter__(self) -> Iterator[QualityFlag]:
        return iter(self.flags)

    def __len__(self) -> int:
        return len(self.flags)

    shown_by = "histories.quality_blocks"


def frame_ranges_text(frames: Sequence[int]) -> str:
    """Frames as people write them: 'frames 97-191, 193'."""
    runs: list[list[int]] = []
    for k in sorted(frames):
        if runs and k == runs[-1][-1] + 1:
            runs[-1] = [runs[-1][0], k]
        else:
            runs.append([k])
    text = ", ".join("-".join(map(str, run)) for run in runs)
    return f"frame{'s' if len(frames) > 1 else ''} {text}"
