"""confirm: the identified law simulated by the specimen itself and compared with the tests and with the fit."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Floats
from creepkit.checked_arguments import checked
from creepkit.errors import FitError
from creepkit.inverse.composite_predictor import CompositePredictor
from creepkit.inverse.frame_noise import noise_standard_deviation, usable_frames
from creepkit.inverse.goodness_of_fit import OutputErrors, OutputFit, errors_of_output
from creepkit.inverse.history_checks import without_suspect_frames
from creepkit.inverse.identification import Identification
from creepkit.inverse.known_noise import FREEDOM_PER_FRAME, chance_of_larger
from creepkit.inverse.predictor_documents import registered_specimens
from creepkit.records import History, Prediction, Predictor, Status
from creepkit.records.presentable import Presentable
from creepkit.registry.arguments import resolve_predictors

AGREEMENT_LIMIT = 1.0
"""Largest rms difference to what the fit predicts, in standard deviations of the noise, that confirms it."""


ACCEPTABLE_CHI_SQUARE = 2.0
"""Mean chi-square above which a law does not follow a test, whoever predicts it, if chance does not explain it."""


CONDEMNED = 0.01
"""p-value, of all outputs of tests together, below which a law does not follow a test."""


INCOMPLETE_STATUS = {
    Status.RUPTURED: "the specimen bursts",
    Status.NOT_CONVERGED: "the simulation stops",
    Status.OUTSIDE_CLASS: "which does not know this class of laws, the prediction ends",
}


@dataclass(frozen=True)
class ConfirmedOutput:
    """One output of one test.

    simulation_errors : of the simulation against the measurement; fit_errors : those of the fit, or None of a test that
        it cannot predict.
    rms_difference : rms of simulated less fitted frames over their noise; NaN where the fit cannot predict or no noise
        is known.
    p_value : of a larger chi-square of the simulation by chance, with the noise as uncertain as its estimate is.
    """

    output: str
    simulation_errors: OutputErrors
    fit_errors: OutputErrors | None
    rms_difference: float
    p_value: float = float("nan")

    @property
    def noise_ratio(self) -> float:
        """How far the simulation is from the fit, in noise: the difference, or what chi-square says it must be."""
        if np.isfinite(self.rms_difference) or self.fit_errors is None:
            return self.rms_difference
        return float(np.sqrt(max(self.simulation_errors.chi_square - self.fit_errors.chi_square, 0.0)))


@dataclass(frozen=True)
class ConfirmedTest:
    """One test, how its simulation ended, and when, s."""

    name: str
    status: Status
    end_time: float
    outputs: tuple[ConfirmedOutput, ...]


@dataclass(frozen=True)
class Confirmation(Presentable):
    """The result of confirm(). law, predictor_name : what was simulated, and by what."""

    law: str
    predictor_name: str
    tests: tuple[ConfirmedTest, ...]

    @property
    def confirmed(self) -> bool:
        """Whether the simulation reaches the end of each test and says of it what the fit says."""
        return not self._incomplete_tests and not self.noise_ratio > AGREEMENT_LIMIT

    @property
    def noise_ratio(self) -> float:
        """The largest distance of simulation and fit, in noise; NaN where nothing is known of it."""
        known = [o.noise_ratio for t in self.tests for o in t.outputs if np.isfinite(o.noise_ratio)]
        return max(known, default=float("nan"))

    @property
    def verdict(self) -> str:
        """One sentence: whether the simulation confirms the fit, and whether the law follows the tests."""
        if self._incomplete_tests:
            test = self._incomplete_tests[0]
            how = f"{INCOMPLETE_STATUS[test.status]} at {test.end_time:g} s of test '{test.name}'"
            return f"not confirmed: by {self.predictor_name}, {how}; identify again with using= this specimen"
        if not self.confirmed:
            test_name, output = self._largest(lambda o: o.noise_ratio)
            return (
                f"not confirmed: {self.predictor_name} differs from the fit by {self.noise_ratio:.2g} times the noise "
                f"({output} of '{test_name}'); identify again with using= this specimen"
            )
        if not any(test.outputs for test in self.tests):
            return f"confirmed by {self.predictor_name}: the simulation reaches every end; the tests have no frames"
        test_name, output = self._largest(lambda o: o.simulation_errors.chi_square)
        worst = self[test_name, output].simulation_errors.chi_square
        if worst > ACCEPTABLE_CHI_SQUARE and self[test_name, output].p_value < CONDEMNED / self._comparisons:
            return (
                f"confirmed, but the law does not follow the tests: chi-square {worst:.3g} in {output} of "
                f"'{test_name}'; try another law"
            )
        difference_text = (
            f", {self.noise_ratio:.2g} times the noise from the fit" if np.isfinite(self.noise_ratio) else ""
        )
        return f"confirmed by {self.predictor_name}: chi-square at most {worst:.3g}{difference_text}"

    def __getitem__(self, place: tuple[str, str]) -> ConfirmedOutput:
        for test in self.tests:
            for one in test.outputs:
                if (test.name, one.output) == place:
                    return one
        raise FitError(f"no output '{place[1]}' of a test '{place[0]}' was confirmed")

    @property
    def _comparisons(self) -> int:
        """How many outputs of tests are compared, of which one may be off by chance (Bonferroni)."""
        return max(sum(len(t.outputs) for t in self.tests), 1)

    @property
    def _incomplete_tests(self) -> list[ConfirmedTest]:
        return [t for t in self.tests if t.status in INCOMPLETE_STATUS]

    def _largest(self, measure: Callable[[ConfirmedOutput], float]) -> tuple[str, str]:
        """Test and output of the largest size."""
        measured = [(measure(o), t.name, o.output) for t in self.tests for o in t.outputs]
        _, test, output = max(measured, key=lambda s: -np.inf if np.isnan(s[0]) else s[0])
        return test, output

    shown_by = "inference.confirmation_text"


@checked
def confirm(
    fit: Identification,
    tests: Sequence[History] | None = None,
    using: Predictor | str | Mapping[str, Predictor | str] | None = None,
) -> Confirmation:
    """Simulate an identified law for each test by the specimen itself, and compare: finite elements for a bulge test.

    tests : by default those that were fitted, with the nuisances and offsets that the fit found for them; others are
        predicted with what is known of all tests, without suspect frames as the fit's settings say.
    using : the specimen, or {specimen: predictor}; by default the specimen that the tests name, with the settings that
        it was identified with.
    """
    tests = without_suspect_frames(list(fit.histories if tests is None else tests), fit.settings)
    if not tests:
        raise FitError(f"law '{fit.law.name}': there are no tests to confirm it with")
    known = registered_specimens(fit.predictor) if using is None else {}
    if all(h.specimen in known for h in tests):
        used = {h.specimen: known[h.specimen] for h in tests}
        using = used if len(used) > 1 else next(iter(used.values()))
    predictor = CompositePredictor.of(resolve_predictors(using, tests))
    prediction = fit.predict(tests, predictor)
    can_predict = fit.predictor is not None and not fit.predictor.outside_class(fit.law)
    fit_prediction = fit.predict(tests) if can_predict else None
    return Confirmation(
        fit.law.name,
        predictor.label,
        tuple(_confirmed_test(fit, prediction, fit_prediction, k, h) for k, h in enumerate(tests)),
    )


def outside_domain(fit: Identification) -> bool:
    """Whether the guard of a surrogate doubts what it said of some test at the identified values."""
    return fit.predictor is not None and bool((fit.predict().status == Status.OUTSIDE_DOMAIN).any())


def _confirmed_test(
    fit: Identification, prediction: Prediction, fit_prediction: Prediction | None, k: int, history: History
) -> ConfirmedTest:
    reported = {o.output: o for m in fit.tests if m.name == history.name for o in m.outputs}
    names = [name for name in prediction.outputs if name in history.outputs and usable_frames(history, name).any()]
    fitted = {} if fit_prediction is None else {name: _output_column(fit_prediction, k, name) for name in names}
    outputs = tuple(
        _confirmed_output(history, name, _output_column(prediction, k, name), fitted.get(name), reported.get(name))
        for name in names
    )
    return ConfirmedTest(history.name, Status(int(prediction.status[0, k])), float(prediction.end_times[0, k]), outputs)


def _output_column(prediction: Prediction, k: int, name: str) -> Floats:
    return prediction.of(k)[:, prediction.outputs.index(name)]


def _confirmed_output(
    history: History, name: str, simulated: Floats, fitted: Floats | None, reported: OutputFit | None
) -> ConfirmedOutput:
    used = usable_frames(history, name)
    sd = noise_standard_deviation(history, name)[used]
    simulation_errors = errors_of_output(history, name, simulated)
    frames = simulation_errors.frames
    noise_freedom = np.inf if name in history.standard_deviation else FREEDOM_PER_FRAME * frames
    p_value = chance_of_larger(simulation_errors.chi_square, float(frames), noise_freedom)
    if fitted is None:
        return ConfirmedOutput(
            name, simulation_errors, None if reported is None else reported.errors, float("nan"), p_value
        )
    known = sd > 0
    difference = ((simulated - fitted)[used] / np.where(known, sd, np.nan))[known]
    rms = float(np.sqrt(np.mean(difference**2))) if difference.size else float("nan")
    return ConfirmedOutput(name, simulation_errors, errors_of_output(history, name, fitted), rms, p_value)
