"""One output of one test of an identification as it is drawn: measured, identified, band and residuals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.frame_noise import usable_frames
from creepkit.records import is_logarithmic, output_unit
from creepkit.reports.figures import set_range
from creepkit.reports.load_programs import SECONDS_PER_HOUR
from creepkit.reports.prediction_bands import FittedCurves

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from creepkit.inverse.identification import Identification

PLOTTED_STRAIN_RATIO = 0.02
"""Differences of logarithms of strains are taken where a test's strain exceeds this share of its last one."""


DASHED_BELOW_WEIGHT = 0.5
"""Weight below which a test is drawn dashed."""


@dataclass(frozen=True, eq=False)
class TestCurve:
    """One output of one test, as it is drawn.

    hours : (frames,) h.
    measured, identified : (frames,) in the unit of the axis, offsets taken off where the axis is logarithmic.
    half_width : (frames,) of the 95 % band, in the same unit; of the logarithm where the axis is logarithmic.
        NaN where the law predicts nothing, as after a rupture.
    residuals : (frames,) measured less identified, in the unit of the axis, or 100 times the difference of their
        logarithms where the axis is logarithmic; NaN where that would be noise alone.
    """

    __test__ = False  # not a test case, whatever its name says to pytest

    hours: Floats
    measured: Floats
    identified: Floats
    half_width: Floats
    residuals: Floats
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
    used = usable_frames(history, output)
    hours, measured = history.times[used] / SECONDS_PER_HOUR, history.outputs[output][used]
    identified, half_width = identified[used], half_width[used]
    if not is_logarithmic(output):
        return TestCurve(hours, measured, identified, half_width, measured - identified, logarithmic=False)
    offset = fit.tests[test][output].offset
    measured, identified = 100 * (measured - offset), 100 * (identified - offset)
    divisor = np.where(identified > 0, identified, np.nan)
    last = measured[-1] if measured.size else 0.0
    shown = np.where(measured > max(PLOTTED_STRAIN_RATIO * last, 0.0), measured, np.nan)
    return TestCurve(
        hours, measured, divisor, 100 * half_width / divisor, 100 * np.log(shown / divisor), logarithmic=True
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


def line_style(weight: float) -> Literal["-", "--"]:
    """Of the curves of a test by its weight in the fit."""
    return "--" if weight < DASHED_BELOW_WEIGHT else "-"


def set_time_range(axes: Axes, hours: Floats, output: str) -> None:
    """Logarithmic where creep spans decades of time: strains, and stresses that relax. hours : (readings,)."""
    logarithmic = is_logarithmic(output) or output.startswith("stress")
    set_range(axes, "x", float(hours.min()) if logarithmic else 0.0, float(hours.max()), logarithmic=logarithmic)
