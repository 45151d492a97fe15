"""How the clock of a camera and that of an instrument belong together."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from creepkit.arrays import ArrayLike, Floats, frozen, set_fields
from creepkit.checked_arguments import checked
from creepkit.errors import HistoryError
from creepkit.records.presentable import Presentable


@checked
@dataclass(frozen=True, eq=False)
class ClockAlignment(Presentable):
    """Times of a camera as times of an instrument's record: t - zero + lag.

    zero : s on the camera's clock, at which the record's own time is zero where the lag is zero.
    lag : s by which the instrument's clock is ahead of the camera's. lag_interval : with 95 % probability; both bounds
    equal where it was stated, not estimated. lags, probability : (points,) s and (points,) the posterior probability of
    each lag, which sums to 1. channel : of the record. frames : how many were used.
    """

    zero: float = 0.0
    lag: float = 0.0
    lag_interval: tuple[float, float] = (0.0, 0.0)
    lags: Floats = field(default_factory=lambda: frozen([]))
    probability: Floats = field(default_factory=lambda: frozen([]))
    channel: str = ""
    frames: int = 0

    def __post_init__(self) -> None:
        if not np.isfinite((self.zero, self.lag, *self.lag_interval)).all():
            raise HistoryError(f"an alignment with lag {self.lag} s and zero {self.zero} s; give finite numbers")
        set_fields(self, lags=frozen(self.lags), probability=frozen(self.probability))

    @classmethod
    @checked
    def stated(cls, lag: float, zero: float = 0.0) -> ClockAlignment:
        """An alignment that is known: the record's time is t - zero + lag."""
        return cls(zero, lag, (lag, lag))

    def camera_time(self, record_times: ArrayLike) -> Floats:
        """(...,) s on the camera's clock.

        record_times : (...,) s on the record's own clock.
        """
        return np.asarray(record_times, dtype=float) - self.lag + self.zero

    shown_by = "extraction.alignment_text"
