"""What an identification compared: frames as measured and as selected for the fit, values, and their transforms.

And what the law leaves of each reading over its noise, as its adequacy is judged: one noise, one count of readings and
one chi-square for the tables, figures and alternative texts of a report.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.errors import CreepkitError
from creepkit.inverse.compared_tests import compares_rupture_times
from creepkit.inverse.composite_predictor import CompositePredictor
from creepkit.inverse.judging import JudgedResiduals, judged_residuals_of
from creepkit.inverse.observation_vector import (
    FLOOR_NOISES,
    FLOOR_SHARE,
    MINIMUM_RATE_OUTPUT,
    RUPTURE_OUTPUT,
    ObservationVector,
    frames_with_data,
    selected_frames,
    thinned_history,
)
from creepkit.inverse.output_transforms import LinearTransform, LogTransform
from creepkit.records import output_unit
from creepkit.reports.blocks import number, plural, printable

if TYPE_CHECKING:
    from creepkit.inverse.goodness_of_fit import TestFit
    from creepkit.inverse.identification import Identification
    from creepkit.records import History


FLOOR = (
    f", {100 * FLOOR_SHARE:g} % of the median end value of a material and at least {FLOOR_NOISES:g} times the noise of "
    "a reading"
)
"""What the floor of a logarithmic transform is."""


@dataclass(frozen=True)
class FrameCounts:
    """Frames of tests: as measured, those of them that a fit may use, and those that were selected for it.

    excluded : left out by hand or as suspect, also by their file; at_zero : of the others those at time zero, without
    creep yet; empty : of the rest those without a value. thinned : tests of which not all usable ones were selected.
    """

    measured: int
    usable: int
    fitted: int
    excluded: int = 0
    at_zero: int = 0
    empty: int = 0
    thinned: tuple[str, ...] = ()


def frame_counts(histories: Sequence[History], frames: int) -> FrameCounts:
    """The frames of tests with outputs; frames : at most so many were selected in each test."""
    tests = [h for h in histories if h.outputs]
    later = [h.used & (h.times > 0) for h in tests]
    usable = [int((mask & frames_with_data(h)).sum()) for mask, h in zip(later, tests, strict=True)]
    fitted = [int(selected_frames(h, frames).size) for h in tests]
    measured, used, after_zero = (
        sum(values)
        for values in (
            [h.times.size for h in tests],
            [int(h.used.sum()) for h in tests],
            [int(mask.sum()) for mask in later],
        )
    )
    return FrameCounts(
        measured,
        sum(usable),
        sum(fitted),
        measured - used,
        used - after_zero,
        after_zero - sum(usable),
        tuple(h.name for h, all_, kept in zip(tests, usable, fitted, strict=True) if kept < all_),
    )


@dataclass(frozen=True)
class ComparedValues:
    """The values that a fit compared with its law's predictions.

    by_test : {test: how many}, with its rupture time or minimum rate. transforms : half a sentence on each output, in
    what quantity it is compared, with its numbers; kinds_of_transforms : the same without them, as materials share it.
    followed : tests that are compared up to their rupture. run_outs : those of them that were stopped before.
    """

    by_test: Mapping[str, int]
    transforms: tuple[str, ...]
    kinds_of_transforms: tuple[str, ...] = ()
    followed: int = 0
    run_outs: int = 0

    @property
    def count(self) -> int:
        """Of all tests."""
        return sum(self.by_test.values())


def compared_values(fit: Identification) -> ComparedValues | None:
    """What a fit compared; None where its tests are not at hand."""
    if not fit.histories or fit.predictor is None:
        return None
    predictor = fit.predictor
    predictor = CompositePredictor.of(predictor)
    try:
        tests = [thinned_history(h, fit.settings.frames) for h in fit.histories]
        used = compares_rupture_times(fit.law, fit.settings)
        observations = ObservationVector.from_histories(tests, predictor, fit.histories, rupture_times=used)
    except CreepkitError:
        return None
    counts = np.asarray(observations.present).sum(axis=1)
    return ComparedValues(
        {h.name: int(count) for h, count in zip(tests, counts, strict=True)},
        tuple(_transforms(observations, numbers=True)),
        tuple(_transforms(observations, numbers=False)),
        int(observations.followed_to_rupture.sum()),
        int(observations.censored.sum()),
    )


def _transforms(observations: ObservationVector, *, numbers: bool) -> list[str]:
    """In what quantity each output is compared; numbers : those of the material, or what they are in general."""
    sentences = []
    for output, transform in zip(observations.outputs, observations.transforms, strict=True):
        name, unit = output.replace("_", " "), output_unit(output)
        unit = f" {unit}" if unit else ""
        if output == RUPTURE_OUTPUT:
            sentences.append("rupture times by their logarithms")
        elif output == MINIMUM_RATE_OUTPUT:
            sentences.append("minimum creep rates by their logarithms")
        elif isinstance(transform, LogTransform):
            floor = f" = {number(transform.floor, 3)}{unit}" if numbers else FLOOR
            sentences.append(f"{name} ε as arsinh(ε / 2f), which is ln(ε / f) well above the floor f{floor}")
        elif isinstance(transform, LinearTransform):
            scale = f" {number(transform.scale, 3)}{unit}" if numbers else " of its readings"
            sentences.append(f"{name} linearly, divided by the standard deviation{scale}")
    return sentences


def selection_sentence(counts: FrameCounts, most: int) -> str:
    """How many frames were selected for a fit, and how."""
    if counts.fitted == counts.usable == counts.measured:
        return f"All {plural(counts.measured, 'reading')} were fitted."
    reasons = [
        (counts.excluded, "left out by the study, as suspect, or by their file"),
        (counts.at_zero, "at time zero"),
        (counts.empty, "without a value"),
        (counts.usable - counts.fitted, _thinning_text(counts.thinned, most)),
    ]
    parts = ", ".join(f"{count} {reason}" for count, reason in reasons if count)
    return f"{counts.fitted} of {plural(counts.measured, 'reading')} were selected for the fit; not selected: {parts}."


def _thinning_text(tests: Sequence[str], most: int) -> str:
    """Why readings of tests were thinned."""
    named = ", ".join(f"'{printable(name, 80)}'" for name in tests[:3]) + (
        f" and {len(tests) - 3} more" if len(tests) > 3 else ""
    )
    spread = "half of them spread evenly in time and half in its logarithm, some readings by both"
    return f"of {named}, of which at most {most} are taken, {spread}"


# ---- readings over their noise ---------------------------------------------------------------------------------------


OWN_RATE_CHI_SQUARE = (
    "reduced chi-square of each test, its own rate, rupture life and offset taken out, by which the law is judged: "
    "over all tests it is that of the verdict, 1 is noise alone"
)
"""What the chi-square of a test is, wherever one is shown."""


LAW_RATE_MISFIT = "mean square misfit over noise² with the law's rate for every test"


LAW_RATE_MEANING = f"{LAW_RATE_MISFIT} holds the scatter between tests, which is no fault of the law"


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


_KNOWN: WeakKeyDictionary[Identification, JudgedReadings | None] = WeakKeyDictionary()
"""Of identifications that are in use: tables and figures of one report judge the same readings."""


def judged_readings(fit: Identification) -> JudgedReadings | None:
    """The readings by which an identification is judged; None where no noise is known, or its tests are not at hand."""
    if fit not in _KNOWN:
        _KNOWN[fit] = _judged_readings(fit)
    return _KNOWN[fit]


def _judged_readings(fit: Identification) -> JudgedReadings | None:
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
