"""Run: what one simulated test gave."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from creepkit.arrays import Floats, frozen
from creepkit.records import Status


@dataclass(frozen=True, eq=False)
class Run:
    """A simulated test up to where it ended.

    times : (frames,) s, those asked for that were reached. outputs : {name: (frames,)}.
    status : how it ended; end_time : s, where; reason : why, in words (empty when complete).
    """

    times: Floats
    outputs: Mapping[str, Floats]
    status: Status
    end_time: float
    reason: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "times", frozen(self.times))
        object.__setattr__(self, "outputs", MappingProxyType({n: frozen(v) for n, v in self.outputs.items()}))
