"""Leave-one-test-out: each test predicted from a fit to all the others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import refit
from creepkit.inverse.measures import OutputErrors, output_errors
from creepkit.inverse.scales import noise_standard_deviation, usable_frames
from creepkit.inverse.search.refining import IterationCallback
from creepkit.inverse.together import compared_outputs
from creepkit.records import History, Prediction


@dataclass(frozen=True)
class HeldOutTest:
    """One test that the fit did not see, as any new test: nuisances at their prior means and no offset.

    errors : {output: Errors}, relative squared errors about the test's own mean.
    """

    name: str
    condition: str
    fit: Identification = field(repr=False)
    errors: Mapping[str, OutputErrors]


def leave_one_test_out(
    fit: Identification, histories: Sequence[History] | None = None, progress: IterationCallback | None = None
) -> tuple[HeldOutTest, ...]:
    """Predict each test from a refit to all the others, which starts where `fit` ended."""
    tests = list(fit.histories if histories is None else histories)
    if len(tests) < 2:
        raise FitError("a test can only be held out of several, found one")
    results = []
    for k, test in enumerate(tests):
        training_fit = refit(fit, [h for h in tests if h is not test])
        results.append(HeldOutTest(test.name, test.condition, training_fit, prediction_errors(training_fit, test)))
        if progress is not None:
            progress("test", k + 1, len(tests))
    return tuple(results)


def prediction_errors(fit: Identification, history: History) -> dict[str, OutputErrors]:
    """{output: Errors} of one history that the fit predicts as a new test."""
    assert fit.predictor is not None
    prediction = fit.predict([history], own_nuisances=False)
    return {
        name: output_errors(*_used_values(history, prediction, name))
        for name in compared_outputs(fit.predictor, history)
        if usable_frames(history, name).any()
    }


def pooled_relative_squared_error(held_out: Sequence[HeldOutTest], histories: Sequence[History], output: str) -> float:
    """Relative squared error of one output over all held-out tests, about the mean of all their frames."""
    by_name = {h.name: h for h in histories}
    errors_and_values = [(held_out_test.errors[output], by_name[held_out_test.name].outputs[output][usable_frames(by_name[held_out_test.name], output)]) for held_out_test in held_out]
    sum_of_squares = sum(e.mean_squared_error * e.frames for e, _ in errors_and_values)
    measured = np.concatenate([m for _, m in errors_and_values])
    return float(sum_of_squares / ((measured - measured.mean()) ** 2).sum())


def _used_values(history: History, prediction: Prediction, name: str) -> tuple[Floats, Floats, Floats]:
    used = usable_frames(history, name)
    predicted = prediction.of(0)[used, prediction.outputs.index(name)]
    return history.outputs[name][used], predicted, noise_standard_deviation(history, name)[used]
