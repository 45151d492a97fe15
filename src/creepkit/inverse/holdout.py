"""Leave-one-test-out: each test predicted from a fit to all the others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import refit
from creepkit.inverse.measures import Errors, errors
from creepkit.inverse.scales import noise_of, usable
from creepkit.inverse.search.refining import Progress
from creepkit.inverse.together import outputs_of
from creepkit.records import History, Prediction


@dataclass(frozen=True)
class HeldOut:
    """One test that the fit did not see, as any new test: nuisances at their prior means and no offset.

    errors : {output: Errors}, relative squared errors about the test's own mean.
    """

    name: str
    condition: str
    fit: Identification = field(repr=False)
    errors: Mapping[str, Errors]


def leave_one_test_out(
    fit: Identification, histories: Sequence[History] | None = None, progress: Progress | None = None
) -> tuple[HeldOut, ...]:
    """Predict each test from a refit to all the others, which starts where `fit` ended."""
    tests = list(fit.histories if histories is None else histories)
    if len(tests) < 2:
        raise FitError("a test can only be held out of several, found one")
    found = []
    for k, held in enumerate(tests):
        partial = refit(fit, [h for h in tests if h is not held])
        found.append(HeldOut(held.name, held.condition, partial, prediction_errors(partial, held)))
        if progress is not None:
            progress("test", k + 1, len(tests))
    return tuple(found)


def prediction_errors(fit: Identification, history: History) -> dict[str, Errors]:
    """{output: Errors} of one history that the fit predicts as a new test."""
    assert fit.using is not None
    found = fit.predict([history], own=False)
    return {
        name: errors(*_compared(history, found, name))
        for name in outputs_of(fit.using, history)
        if usable(history, name).any()
    }


def pooled_error(held: Sequence[HeldOut], histories: Sequence[History], output: str) -> float:
    """Relative squared error of one output over all held-out tests, about the mean of all their frames."""
    by_name = {h.name: h for h in histories}
    rows = [(one.errors[output], by_name[one.name].outputs[output][usable(by_name[one.name], output)]) for one in held]
    squares = sum(e.mse * e.frames for e, _ in rows)
    measured = np.concatenate([m for _, m in rows])
    return float(squares / ((measured - measured.mean()) ** 2).sum())


def _compared(history: History, found: Prediction, name: str) -> tuple[Floats, Floats, Floats]:
    used = usable(history, name)
    predicted = found.of(0)[used, found.outputs.index(name)]
    return history.outputs[name][used], predicted, noise_of(history, name)[used]
