"""Cross-validation: tests, conditions or the end of every history are predicted from a fit to the rest."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

from creepkit.checked_arguments import checked
from creepkit.errors import FitError
from creepkit.inverse.composite_predictor import compared_outputs
from creepkit.inverse.goodness_of_fit import OutputErrors, compared_readings, output_errors, relative_squared_error
from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import refit
from creepkit.inverse.reference_conditions import usable_frames
from creepkit.inverse.search.local_refinement import IterationCallback
from creepkit.inverse.single_values import SingleValue
from creepkit.records import History, Prediction
from creepkit.records.presentable import Presentable

FITTED_FRACTION = 0.7
"""Of the duration of each history: the part that is fitted in cross-validation by time."""


FoldBy = Literal["test", "condition", "time"]


@dataclass(frozen=True, eq=False)
class Fold:
    """One fold: the tests that are predicted, and the fit to the rest.

    held_out : whole histories; in cross-validation by time all of them, of which the beginning is fitted.
    """

    held_out: tuple[History, ...]
    fit: Identification = field(repr=False)

    @cached_property
    def prediction(self) -> Prediction:
        """The held-out tests as new ones: prior means of nuisance parameters, and no offset."""
        return self.fit.predict(self.held_out, own_nuisances=False)

    def errors(self, k: int) -> dict[str, OutputErrors]:
        """{output: errors} of one of its tests."""
        history, prediction = self.held_out[k], self.prediction
        assert self.fit.predictor is not None
        return {
            name: output_errors(*compared_readings(history, name, prediction.output_of(k, name)))
            for name in compared_outputs(self.fit.predictor, history)
            if usable_frames(history, name).any()
        }

    @cached_property
    def single_values(self) -> list[dict[str, SingleValue]]:
        """Rupture time and minimum rate of each of its tests, predicted as those of a new test; none by time."""
        fit = self.fit
        if any(m.name == h.name for m in fit.tests for h in self.held_out):
            return [{} for _ in self.held_out]
        assert fit.predictor is not None
        compared = fit.at_tests(fit.predictor).compared(self.held_out)
        named = ({"rupture time": end, "minimum rate": rate} for end, rate in compared)
        return [{what: one for what, one in of_test.items() if one is not None} for of_test in named]


@dataclass(frozen=True, eq=False, repr=False)
class CrossValidation(Presentable):
    """The result of cross_validate(): the fit to all histories, and its folds."""

    fit: Identification = field(repr=False)
    by: FoldBy
    folds: tuple[Fold, ...]

    @property
    def errors(self) -> dict[str, dict[str, OutputErrors]]:
        """{test: {output: errors}} of the held-out tests, about the mean of the test."""
        return {h.name: fold.errors(k) for fold in self.folds for k, h in enumerate(fold.held_out)}

    @property
    def single_values(self) -> dict[str, dict[str, SingleValue]]:
        """{test: {"rupture time" or "minimum rate": comparison}} of the held-out tests, with intervals of new tests."""
        return {
            h.name: values for fold in self.folds for h, values in zip(fold.held_out, fold.single_values, strict=True)
        }

    def pooled_error(self, output: str) -> float:
        """Relative squared error of one output over all held-out tests, about the mean of all their frames."""
        readings = [
            compared_readings(history, output, fold.prediction.output_of(k, output))
            for fold in self.folds
            for k, history in enumerate(fold.held_out)
            if output in history.outputs
        ]
        return relative_squared_error([one[0] for one in readings], [one[1] for one in readings])

    shown_by = "identification.cross_validation_text"


@checked
def cross_validate(
    fit: Identification,
    histories: Sequence[History] | None = None,
    *,
    by: FoldBy = "test",
    progress: IterationCallback | None = None,
) -> CrossValidation:
    """Predict held-out data from refits to the rest, each of which starts where `fit` ended.

    histories : by default those of the fit.
    by : "test" leaves out one test after the other, "condition" all tests of one temperature and stress, "time" what
        comes after FITTED_FRACTION of the duration of every history.
    """
    tests = list(fit.histories if histories is None else histories)
    folds, results = list(_folds(tests, by)), []
    for held_out, training in folds:
        results.append(Fold(tuple(held_out), refit(fit, training)))
        if progress is not None:
            progress(by, len(results), len(folds))
    return CrossValidation(fit, by, tuple(results))


def _folds(tests: Sequence[History], by: FoldBy) -> Iterator[tuple[list[History], list[History]]]:
    """(held out, fitted) histories of each fold."""
    if by == "time" and not any(h.outputs for h in tests):
        raise FitError("cross-validation by time holds out the last frames, and these tests have none; take by='test'")
    if by == "time":
        yield list(tests), [_first_part(h) for h in tests]
        return
    groups = [[h] for h in tests]
    if by == "condition":
        groups = [[h for h in tests if h.condition == c] for c in sorted({h.condition for h in tests})]
    if len(groups) < 2:
        raise FitError(f"a {by} can only be held out of several, found one")
    for group in groups:
        yield group, [h for h in tests if not any(h is one for one in group)]


def _first_part(history: History) -> History:
    """The first part of a history, without how the test ended; one without frames has no parts, and is fitted."""
    if not history.outputs:
        return history
    used = history.used & (history.times <= FITTED_FRACTION * float(history.times[-1]))
    return history.replace(used=used, rupture_time=None, unruptured=False)
