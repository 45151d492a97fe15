"""What a stage of a study is: its kind, its result, all that this depends on, and the numbers of it that are locked."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

from creepkit.records import Predictor

StageKind = Literal[
    "extraction",
    "record",
    "quality",
    "identification",
    "confirmation",
    "temperature",
    "rupture",
    "forecast",
    "design",
    "export",
    "report",
]


STAGE_KINDS: tuple[StageKind, ...] = get_args(StageKind)
"""In the order in which they are made, which stands here alone; `creepkit run --only` takes these names."""


Tick = Callable[[str, int, int], None]


Results = Mapping[str, Any]
"""{name of a stage: its result}."""


def no_numbers(result: Any) -> dict[str, Any]:
    """The numbers of a stage of which study.lock records none."""
    return {}


@dataclass(frozen=True)
class Stage:
    """One stage.

    kind : what it makes. group : of the tests that it is about, "" for all.
    settings : JSON-able data of all that decides the result beside what it `needs`, names of other stages.
    make : from the results of these, with something to report progress to. record : class of the result, by which a
        file is read; None where the result is made again from identifications that are kept.
    numbers : of its result by name, which study.lock records, so that a run says whether it gives them again.
    document : what of a result that no record can be read from is written down, as JSON-able data.
    predictor : of identifications that its file holds. file : that an export is written to, "" for other stages.
    remark : what is known beforehand that the result leaves out of account, "" where nothing is.
    name : of its result, by default that of a stage of which each group has one.
    """

    kind: StageKind
    group: str
    settings: Any
    make: Callable[[Results, Tick], Any]
    record: Any = None
    numbers: Callable[[Any], Mapping[str, Any]] = no_numbers
    needs: tuple[str, ...] = ()
    document: Callable[[Any], Any] | None = None
    predictor: Predictor | None = field(default=None, repr=False)
    file: str = ""
    remark: str = ""
    name: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", self.name or stage_name(self.kind, self.group))


def stage_name(kind: StageKind, group: str = "") -> str:
    """The name of a stage of which each group has one."""
    return f"{kind} of {group}" if group else kind


def needed_stages(stages: Sequence[Stage], kinds: Sequence[str]) -> set[str]:
    """Names of the stages of some kinds, and of all that these need; stages stand behind those that they need."""
    wanted: set[str] = set()
    for stage in reversed(stages):
        if stage.kind in kinds or stage.name in wanted:
            wanted |= {stage.name, *stage.needs}
    return wanted
