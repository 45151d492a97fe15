"""What an identification compared: readings as measured and as selected for the fit.

And what the law leaves of each reading over its noise, as its adequacy is judged: one noise, one count of readings and
one chi-square for the tables, figures and alternative texts of a report.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import wraps
from typing import TYPE_CHECKING, NamedTuple, TypeVar
from weakref import WeakKeyDictionary

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.errors import CreepkitError
from creepkit.inverse.judging import JudgedResiduals, judged_residuals_of
from creepkit.inverse.observation_vector import ObservationVector, selected_frames
from creepkit.reports.blocks import plural

if TYPE_CHECKING:
    from creepkit.inverse.goodness_of_fit import TestFit
    from creepkit.inverse.identification import Identification
    from creepkit.records import History


T = TypeVar("T")


class ReadingCounts(NamedTuple):
    """Readings of tests: as measured, those of them that a fit may use, and those that were selected for it.

    excluded : left out by hand or as suspect, also by their file.
    """

    measured: int
    excluded: int
    usable: int
    fitted: int


def reading_counts(histories: Sequence[History], frames: int) -> ReadingCounts:
    """The readings of tests with outputs; frames : at most so many were selected in each test."""
    tests = [h for h in histories if h.outputs]
    usable = (h.used & (h.times > 0) & h.frames_with_data for h in tests)
    return ReadingCounts(
        sum(h.times.size for h in tests),
        sum(int((~h.used).sum()) for h in tests),
        sum(int(one.sum()) for one in usable),
        sum(int(selected_frames(h, frames).size) for h in tests),
    )


def selection_sentence(counts: ReadingCounts, most: int) -> str:
    """How many readings were selected for a fit, at most so many of a test, and why the others were not."""
    measured, excluded, usable, fitted = counts
    reasons = {
        "left out by the study, as suspect, or by their file": excluded,
        "at time zero or without a value": measured - excluded - usable,
        f"beyond the {most} of a test, half even in time and half in its logarithm": usable - fitted,
    }
    others = ", ".join(f"{count} {reason}" for reason, count in reasons.items() if count)
    selected = f"{fitted} of {plural(measured, 'reading')} were selected for the fit"
    return f"{selected}; not selected: {others}." if others else f"All {plural(measured, 'reading')} were fitted."


def compared_observations(fit: Identification) -> ObservationVector | None:
    """The values that a fit compared with its law's predictions; None where its tests are not at hand."""
    if not fit.histories or fit.predictor is None:
        return None
    try:
        return fit.least_squares_problem.observations
    except CreepkitError:
        return None


# ---- readings over their noise ---------------------------------------------------------------------------------------


OWN_RATE_CHI_SQUARE = (
    "reduced chi-square of each test, its own rate, rupture life and offset taken out, by which the law is judged: "
    "over all tests it is that of the verdict, 1 is noise alone"
)
"""What the chi-square of a test is, wherever one is shown."""


LAW_RATE_MEANING = "mean square misfit over noise² with the law's rate for every test holds the scatter between tests"


@dataclass(frozen=True, eq=False)
class JudgedReadings:
    """The readings of the tests of an identification by which its law is judged.

    judged : what is left of them. offsets : (tests, observations) of the tests, in the output's unit.
    """

    judged: JudgedResiduals
    observations: ObservationVector
    offsets: Floats

    def mask(self, test: int | None = None, output: str | None = None) -> Bools:
        """(tests, observations) which readings of a test and of an output are judged; None: of all."""
        mask = np.array(self.judged.known.judged)
        if test is not None:
            mask &= np.arange(len(mask))[:, None] == test
        if output is not None:
            mask &= self.observations.output_index == _position(self.observations, output)
        return mask

    def residuals(self, test: int, output: str) -> tuple[Floats, Floats]:
        """Times, s, and measured less predicted over the standard deviation of the noise, (readings,) each.

        Rate, rupture life and offset of the test are taken out, as where the law is judged.
        """
        mask = self.mask(test, output)
        return self.observations.times[mask], -(self.judged.deviation / self.judged.known.sd)[mask]

    def chi_square(self, test: int | None = None, output: str | None = None) -> float:
        """Reduced chi-square, tests with their own rates, lives and offsets: that of the verdict for all of them."""
        return self.judged.reduced_chi_square(self.mask(test, output))

    def misfit_of_common_rate(self, test: int) -> float:
        """Mean square misfit over noise squared with the law's own rate for the test, and the test's offset."""
        residuals, mask = self.judged.residuals, self.mask(test)
        if not mask.any():
            return float("nan")
        scale = residuals.offset_sensitivity[mask]
        noises = (residuals.values[mask] / scale + self.offsets[mask]) / self.judged.known.sd[mask]
        return float(np.mean(noises**2))

    def noise(self, test: int | None = None, output: str | None = None) -> tuple[float, float] | None:
        """The least and the largest standard deviation of the noise of a reading; None of no readings."""
        sd = self.judged.known.sd[self.mask(test, output)]
        return (float(sd.min()), float(sd.max())) if sd.size else None


def once(function: Callable[[Identification], T]) -> Callable[[Identification], T]:
    """A function of an identification that is called once for each that is in use: a report asks it often."""
    known: WeakKeyDictionary[Identification, T] = WeakKeyDictionary()

    @wraps(function)
    def found(fit: Identification) -> T:
        if fit not in known:
            known[fit] = function(fit)
        return known[fit]

    return found


@once
def judged_readings(fit: Identification) -> JudgedReadings | None:
    """The readings by which an identification is judged; None where no noise is known, or its tests are not at hand."""
    if not fit.histories or fit.predictor is None:
        return None
    try:
        judged = judged_residuals_of(fit)
    except CreepkitError:
        return None
    if judged is None:
        return None
    observations = fit.least_squares_problem.observations
    known = [{one.output: one.offset for one in test.outputs} for test in fit.tests]
    by_output = np.array([[offsets.get(name, 0.0) for name in observations.outputs] for offsets in known])
    offsets = np.take_along_axis(by_output, observations.output_index, axis=1)
    return JudgedReadings(judged, observations, offsets)


def misfit_of(test: TestFit) -> float:
    """Reduced chi-square of a test over the frames of all its outputs, against the noise of a frame."""
    rows = [(one.errors.frames, one.errors.chi_square) for one in test.outputs if np.isfinite(one.errors.chi_square)]
    frames = sum(count for count, _ in rows)
    return sum(count * chi_square for count, chi_square in rows) / frames if frames else float("nan")


def _position(observations: ObservationVector, output: str) -> int:
    return observations.outputs.index(output) if output in observations.outputs else -1
