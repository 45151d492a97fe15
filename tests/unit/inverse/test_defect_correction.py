"""Defect correction: predictors that are wrong by known amounts, and what comes back with and without the exact one."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from creepkit.inverse.defect_correction import correct_defect, shift_of_values, with_cheaper_predictor
from creepkit.inverse.identification_document import identification_from_json, identification_to_json
from creepkit.inverse.identify import identify
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.settings import IdentificationSettings
from creepkit.laws.norton import NORTON
from creepkit.records import Predictor, Status
from creepkit.reports.identification_plot import fitted_curves
from helpers.steady_rate_predictor import planted
from helpers.two_outputs_predictor import TwoOutputs, with_two_outputs

VALUES = {"A": 1e-15, "n": 4.0}
THETA = NORTON.to_internal(VALUES)[0]
NOISE = {"amplitude": 2e-3, "width": 2e-2}
NONE = dict.fromkeys(NOISE, 0.0)
BARS = planted(NORTON, VALUES, [(s, 1000.0) for s in (50.0, 70.0, 100.0)], seed=0, frames=24)
SETTINGS = IdentificationSettings(starts=1, sobol_points=8, weights="likelihood", nuisances=(), usual_errors="none")
EXACT = TwoOutputs()


def additive(values: np.ndarray, share: np.ndarray) -> np.ndarray:
    """0.02 mm of the amplitude, smooth in time."""
    return values + np.stack([0.02 * np.sin(2.5 * share), 0.0 * share], axis=-1)


def relative(values: np.ndarray, share: np.ndarray) -> np.ndarray:
    """A few per cent of the amplitude, which grow with time: the error depends on the values of the law."""
    return values * np.stack([1.0 - 0.04 * share, 1.0 + 0.0 * share], axis=-1)


@dataclass(frozen=True)
class Coarse(Predictor):
    """Predicts what `TwoOutputs` does, with an error; refined() is without it, where it is offered."""

    defect: Callable[[np.ndarray, np.ndarray], np.ndarray] = additive
    status: Status = Status.COMPLETE
    name: str = "coarse"
    outputs: tuple[str, ...] = EXACT.outputs

    def predict_batch(self, law, theta, histories, nuisances, sensitivities):
        found = EXACT.predict(law, theta, histories, sensitivities=sensitivities)
        values = np.array(found.values)
        for k, h in enumerate(histories):
            values[:, k, : h.times.size] = self.defect(values[:, k, : h.times.size], h.times / h.times[-1])
        return replace(found, values=values)


@dataclass(frozen=True)
class Refinable(Coarse):
    """The same, with the exact predictor; `status` is how that ends in the first test."""

    def refined(self) -> Predictor:
        return Stopping(self.status)


@dataclass(frozen=True)
class Stopping(TwoOutputs):
    """The exact predictor, which says of the first test that it ended as `status`."""

    status: Status = Status.COMPLETE

    def predict_batch(self, law, theta, histories, nuisances, sensitivities):
        found = EXACT.predict(law, theta, histories, sensitivities=sensitivities)
        status = np.array(found.status)
        status[:, 0] = int(self.status)
        return replace(found, status=status)


def measured(noise=NONE, seed=0):
    """Tests that state the usual noise, and have `noise`."""
    return [
        h.replace(standard_deviation={name: np.full(h.times.size, sd) for name, sd in NOISE.items()})
        for h in with_two_outputs(BARS, noise, seed=seed)
    ]


def problem_of(predictor, tests=None):
    problem = LeastSquaresProblem.from_histories(NORTON, tests or measured(), predictor, SETTINGS)
    return problem, problem.coordinates.u(THETA)


# ---- identification ----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def fits():
    """Noise-free tests of the exact predictor, identified through the wrong one, with and without its correction."""
    kinds = {"exact": EXACT, "plain": Coarse(), "corrected": Refinable(), "relative": Refinable(relative)}
    return {name: identify(NORTON, measured(), one, settings=SETTINGS) for name, one in kinds.items()}


def deviation(fit):
    """Of n, in the standard deviations of a fit by the exact predictor."""
    return abs(fit.values["n"] - VALUES["n"])


def test_the_planted_values_come_back_with_the_correction_and_not_without(fits):
    """An error of 0.02 mm that does not depend on the values: nothing of it is left."""
    assert deviation(fits["exact"]) < 1e-5
    assert deviation(fits["corrected"]) < 1e-4
    assert fits["corrected"].numerical_error.confirms
    true = VALUES["A"] * 70.0 ** VALUES["n"]
    rates = {name: float(fit.rate(70.0, 1000.0)[0]) for name, fit in fits.items()}
    assert np.log(rates["corrected"] / true) == pytest.approx(0.0, abs=1e-4)
    assert np.log(rates["plain"] / true) < -0.015
    _, low, high = fits["plain"].rate(70.0, 1000.0)
    assert not low <= true <= high


def test_an_error_that_depends_on_the_values_is_corrected_to_second_order(fits):
    """4 % of the amplitude at an optimum that is 4 % off: a few thousandths of the rate are left."""
    rate, _, _ = fits["relative"].rate(70.0, 1000.0)
    plain = identify(NORTON, measured(), Coarse(relative), settings=SETTINGS).rate(70.0, 1000.0)[0]
    true = VALUES["A"] * 70.0 ** VALUES["n"]
    assert abs(np.log(plain / true)) > 0.015
    assert abs(np.log(rate / true)) < 0.1 * abs(np.log(plain / true))


def test_the_curves_of_a_report_are_the_corrected_ones(fits):
    """The exact predictor at the planted values; the predictor of the fit alone is off by up to 0.02 mm."""
    fit = fits["corrected"]
    curves = fitted_curves(fit)
    exact = EXACT.predict(NORTON, THETA[None], fit.histories)
    for k, test in enumerate(fit.tests):
        amplitude = exact.of(k)[:, 0]
        np.testing.assert_allclose(curves.of(k, "amplitude")[0] - test["amplitude"].offset, amplitude, atol=1e-3)
        assert np.abs(fit.predict().of(k)[:, 0] - test["amplitude"].offset - amplitude).max() > 0.015


def test_a_loaded_identification_builds_the_corrected_problem_again(fits):
    fit = fits["corrected"]
    again = identification_from_json(identification_to_json(replace(fit, predictor=None)))
    assert again.numerical_error == fit.numerical_error
    attached = again.with_histories(measured(), Refinable())
    np.testing.assert_allclose(
        attached.least_squares_problem.correction, fit.least_squares_problem.correction, rtol=0.02, atol=1e-5
    )


# ---- corrections -------------------------------------------------------------------------------------------------


def test_the_correction_is_the_difference_at_the_point():
    problem, x = problem_of(Refinable())
    corrected, _ = correct_defect(problem, x)
    other, _ = problem_of(EXACT)
    np.testing.assert_allclose(corrected.residuals(x).values, other.residuals(x).values, atol=1e-10)
    far = x + np.array([0.3, -0.2])  # the error does not depend on the values
    np.testing.assert_allclose(corrected.residuals(far).values, other.residuals(far).values, atol=1e-10)
    again, error = correct_defect(corrected, x)
    np.testing.assert_allclose(again.correction, corrected.correction, atol=1e-12)
    assert error.size["amplitude"] > 0.01


def test_the_shift_is_what_the_values_would_have_moved():
    """To first order: the optimum of the corrected problem less that of the plain one, in standard deviations."""
    problem, x = problem_of(Refinable())
    corrected, error = correct_defect(problem, x)
    ends = [one.minimise(x).x for one in (problem, corrected)]
    jacobian = problem.jacobian(x)
    sd = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    assert np.isnan(error.shift)  # it is found at the end of the estimate, under the covariance found there
    shift = shift_of_values(problem, x, corrected.correction)
    assert shift == pytest.approx(np.abs((ends[0] - ends[1]) / sd).max(), rel=0.1)


def test_a_test_that_the_exact_predictor_does_not_finish_is_not_corrected():
    problem, x = problem_of(Refinable(status=Status.NOT_CONVERGED))
    corrected, error = correct_defect(problem, x)
    assert error.incomplete == (BARS[0].name,)
    assert not corrected.correction[0].any()
    assert np.abs(corrected.correction[1:]).max() == pytest.approx(0.02, rel=0.01)


def test_a_cheaper_predictor_agrees_where_it_is_corrected():
    problem, x = problem_of(EXACT)
    cheap = with_cheaper_predictor(problem, x, Coarse(relative))
    assert cheap.predictor == Coarse(relative)
    np.testing.assert_allclose(cheap.residuals(x).values, problem.residuals(x).values, atol=1e-10)
    difference = with_cheaper_predictor(problem, x, Coarse()).correction
    mask = problem.observations.output_index == 0
    share = problem.observations.times / problem.observations.times.max(axis=1, keepdims=True)
    np.testing.assert_allclose(difference[mask], -0.02 * np.sin(2.5 * share[mask]), atol=1e-10)
