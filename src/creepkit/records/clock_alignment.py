"""How the clock of a camera and that of an instrument belong together."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from creepkit.arrays import ArrayLike, Floats, frozen, set_fields
from creepkit.checked_arguments import checked, checked_with_own_words
from creepkit.errors import HistoryError
from creepkit.presentation import Presentable


@checked
@dataclass(frozen=True, eq=False)
class ClockAlignment(Presentable, text="reports.instrument_records:alignment_text"):
    """Times of a camera as times of an instrument's record: t - zero + lag + drift (t - middle).

    zero : s on the camera's clock, at which the record's own time is zero where lag and drift are zero.
    lag : s by which the instrument's clock is ahead of the camera's at `middle`. drift : its gain, s/s.
    middle : s on the camera's clock, where the errors of lag and drift are independent.
    lag_interval, drift_interval : with 95 % probability; both bounds equal where a value was stated, not estimated.
    lags, probability : (points,) s and (points,) the posterior probability of each lag, which sums to 1.
    residual : mm, standard deviation of what the elastic response and a slow drift leave of the displacements.
    noise : mm, that of the displacements from frame to frame. steps : (steps,) s, camera times of the changes of
        pressure that decide. channel : of the record. frames : how many were used.
    """

    zero: float = 0.0
    lag: float = 0.0
    drift: float = 0.0
    middle: float = 0.0
    lag_interval: tuple[float, float] = (0.0, 0.0)
    drift_interval: tuple[float, float] = (0.0, 0.0)
    lags: Floats = field(default_factory=lambda: frozen([]))
    probability: Floats = field(default_factory=lambda: frozen([]))
    residual: float = float("nan")
    noise: float = float("nan")
    steps: Floats = field(default_factory=lambda: frozen([]))
    channel: str = ""
    frames: int = 0

    def __post_init__(self) -> None:
        numbers = (self.zero, self.lag, self.drift, self.middle, *self.lag_interval, *self.drift_interval)
        if not np.isfinite(numbers).all() or not abs(self.drift) < 1.0:
            raise HistoryError(
                f"an alignment with lag {self.lag} s and drift {self.drift}; give finite numbers, a drift within +-1"
            )
        set_fields(self, lags=frozen(self.lags), probability=frozen(self.probability), steps=frozen(self.steps))

    @classmethod
    @checked_with_own_words("lag", "drift", "zero")
    def stated(cls, lag: float, drift: float = 0.0, zero: float = 0.0) -> ClockAlignment:
        """An alignment that is known: the record's time is t - zero + lag + drift (t - zero)."""
        return cls(zero, lag, drift, zero, (lag, lag), (drift, drift))

    def camera_time(self, record_times: ArrayLike) -> Floats:
        """(...,) s on the camera's clock.

        record_times : (...,) s on the record's own clock.
        """
        times = np.asarray(record_times, dtype=float)
        return np.asarray((times - self.lag - self.drift * (self.zero - self.middle)) / (1.0 + self.drift) + self.zero)
