"""Run: what one simulated test gave; a history like a measured one, that also says how it ended."""

from __future__ import annotations

from dataclasses import dataclass

from creepkit.records import History, Status


@dataclass(frozen=True, eq=False)
class Run(History):
    """A simulated test up to where it ended: the times asked for that were reached, and the outputs there.

    status : how it ended; end_time : s, where; reason : why, in words (empty when complete).
    """

    status: Status = Status.COMPLETE
    end_time: float = 0.0
    reason: str = ""
