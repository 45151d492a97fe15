"""One output of one test of an identification as it is drawn: measured, identified, band and residuals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.inverse.frame_noise import noise_standard_deviation, usable_frames
from creepkit.records import is_logarithmic, output_unit
from creepkit.reports.load_programs import SECONDS_PER_HOUR
from creepkit.reports.prediction_bands import FittedCurves

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification

PLOTTED_STRAIN_RATIO = 0.02
"""Residuals of strains are drawn where a test's strain exceeds this share of its last one; below, noise fills them."""


@dataclass(frozen=True, eq=False)
class TestCurve:
    """One output of one test, as it is drawn.

    hours : (frames,) h.
    measured, identified : (frames,) in the unit of the axis, offsets taken off where the axis is logarithmic.
    half_width : (frames,) of the 95 % band, in the same unit; of the logarithm where the axis is logarithmic.
    residuals : (frames,) measured less identified, in standard deviations of the noise, or 100 times the difference of
        their logarithms where the axis is logarithmic.
    noise : (frames,) two standard deviations of the frame noise in the same measure.
    residual_frames : (frames,) which residuals are drawn.
    """

    __test__ = False  # not a test case, whatever its name says to pytest

    hours: Floats
    measured: Floats
    identified: Floats
    half_width: Floats
    residuals: Floats
    noise: Floats
    residual_frames: Bools
    logarithmic: bool

    @property
    def band(self) -> tuple[Floats, Floats]:
        """Lower and upper end of the 95 % band, (frames,) each."""
        if self.logarithmic:
            factor = np.exp(np.minimum(self.half_width, 50.0))
            return self.identified / factor, self.identified * factor
        return self.identified - self.half_width, self.identified + self.half_width


def curve_of_test(fit: Identification, curves: FittedCurves, test: int, output: str) -> TestCurve:
    """One output of one test of an identification, as it is drawn."""
    history = fit.histories[test]
    identified, half_width = curves.of(test, output)
    used = usable_frames(history, output) & np.isfinite(identified)
    hours, measured = history.times[used] / SECONDS_PER_HOUR, history.outputs[output][used]
    noise = noise_standard_deviation(history, output)[used]
    identified, half_width = identified[used], half_width[used]
    if not is_logarithmic(output):
        sd = np.where(noise > 0, noise, np.nan)
        every = np.isfinite(sd)
        residuals = (measured - identified) / sd
        return TestCurve(
            hours, measured, identified, half_width, residuals, np.full(hours.size, 2.0), every, logarithmic=False
        )
    offset = fit.tests[test][output].offset
    measured, identified = 100 * (measured - offset), 100 * (identified - offset)
    positive = identified > 0
    divisor = np.where(positive, identified, np.nan)
    last = measured[-1] if measured.size else 0.0
    return TestCurve(
        hours,
        measured,
        np.where(positive, identified, np.nan),
        np.where(positive, 100 * half_width / divisor, np.nan),
        100 * np.log(np.where(measured > 0, measured, np.nan) / divisor),
        100 * 2 * 100 * noise / divisor,
        positive & (measured > max(PLOTTED_STRAIN_RATIO * last, 0.0)),
        logarithmic=True,
    )


def unit_of(output: str) -> str:
    """The unit in which an output is drawn."""
    if is_logarithmic(output):
        return "%"
    return output_unit(output)


def axis_label(output: str) -> str:
    """Name and unit of an output."""
    name = output.replace("_", " ")
    return f"{name}, {unit_of(output)}" if unit_of(output) else name
