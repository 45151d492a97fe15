"""Where nothing can be predicted there is no answer, but an error that counts how the candidates ended."""

import re
from dataclasses import replace

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import FitError
from creepkit.inverse.identify import identify
from creepkit.inverse.prediction_failures import tests_without_prediction as missing_tests
from creepkit.inverse.search.particle_swarm import ParticleSwarm
from creepkit.inverse.selection import rank
from creepkit.inverse.settings import IdentificationSettings
from creepkit.records import Status
from helpers.steady_rate_predictor import Steady, planted

NORTON = ck.law("norton")
SETTINGS = IdentificationSettings(starts=2, sobol_points=32)
TESTS = planted(
    NORTON, {"A": 1e-15, "n": 4.0}, [(60.0, 900.0), (80.0, 900.0), (110.0, 900.0)], seed=1, noise=1e-5, frames=12
)  # fmt: skip
SEARCHES = {
    "multistart": None,
    "swarm": ParticleSwarm(particles=16, iterations=3),
    "swarm, unrefined": ParticleSwarm(particles=16, iterations=3, refined_candidates=0),
}


class Failing(Steady):
    """Fails at candidates and tests that `fails` names, with one status or the other."""

    def __init__(self, fails=lambda theta, tests: np.ones((len(theta), len(tests)), bool)) -> None:
        self.fails = fails

    def predict(self, law, theta, histories, *, sensitivities=False):
        found = super().predict(law, theta, histories, sensitivities=sensitivities)
        failed = self.fails(theta, histories)
        status = np.where(theta[:, 1:] > 6.0, int(Status.OUTSIDE_CLASS), int(Status.NOT_CONVERGED))
        return replace(
            found,
            values=np.where(failed[..., None, None], np.nan, found.values),
            status=np.where(failed, status, found.status),
            end_times=np.where(failed, 0.0, found.end_times),
        )


@pytest.mark.parametrize("name", SEARCHES)
def test_a_predictor_that_fails_everywhere_is_an_error_with_counts(name: str) -> None:
    with pytest.raises(FitError, match=r"^law 'norton': none of \d+ candidates could be predicted: ") as caught:
        identify(NORTON, TESTS, Failing(), settings=SETTINGS, search=SEARCHES[name])
    text = str(caught.value)
    assert "\n" not in text
    tried, *counts = (int(n) for n in re.findall(r"(\d+) (?:candidates|not converged|outside the class of laws)", text))
    assert sum(counts) == tried > 0
    assert "not converged" in text


def test_a_search_goes_around_candidates_that_fail() -> None:
    steep = Failing(lambda theta, tests: np.repeat(theta[:, 1:] > 6.0, len(tests), axis=1))
    found = identify(NORTON, TESTS, steep, settings=SETTINGS)
    assert found.values["n"] == pytest.approx(4.0, rel=0.01)


def test_a_reduced_order_model_that_works_does_not_hide_that_its_predictor_fails() -> None:
    class WithReducedModel(Failing):
        def reduced_order_model(self):
            return Steady()

    with pytest.raises(FitError, match="could be predicted"):
        identify(NORTON, TESTS, WithReducedModel(), settings=SETTINGS)


def test_a_test_of_which_nothing_is_predicted_is_named() -> None:
    def last_fails(theta, tests):
        return np.tile([h.name == TESTS[-1].name for h in tests], (len(theta), 1))

    found = identify(NORTON, TESTS, Failing(last_fails), settings=SETTINGS)
    assert f"nothing is predicted of test '{TESTS[-1].name}': not converged" in found.notes


def test_the_start_alone_is_no_prediction() -> None:
    """At rest, at time zero, every predictor has a number."""
    history = TESTS[0].replace(times=np.linspace(0.0, 100.0, 12))
    values = np.full((1, 1, 12, 1), np.nan)
    values[..., 0, :] = 0.0
    prediction = replace(Steady().predict(NORTON, np.array([[-30.0, 4.0]]), [history]), values=values)
    assert missing_tests(prediction, [history]).tolist() == [[True]]


SINH = planted(
    ck.law("hyperbolic-sine"), {"A": 1e-7, "n": 3.0, "B": 60.0}, [(s, 1000.0) for s in (55.0, 60.0, 65.0)], seed=1,
    noise=2e-4, frames=12,
)  # fmt: skip


class Partial(Steady):
    """Says nothing of one reading of the last test by the hyperbolic sine, and that it was simulated to its end."""

    def predict(self, law, theta, histories, *, sensitivities=False):
        found = super().predict(law, theta, histories, sensitivities=sensitivities)
        values = found.values.copy()
        if law.name == "hyperbolic-sine":
            values[:, [h.name == SINH[-1].name for h in histories], 5] = np.nan
        return replace(found, values=values)


def test_a_law_whose_misfit_is_no_number_has_no_positive_verdict() -> None:
    """The truth, of which a reading is not predicted; Norton's law predicts them all and comes first."""
    tests = [h.replace(standard_deviation={"strain": np.full(12, 2e-4)}) for h in SINH]
    settings = replace(SETTINGS, weights="likelihood", nuisances=())
    fits = [identify(ck.law(name), tests, Partial(), settings=settings) for name in ("hyperbolic-sine", "norton")]
    assert np.isnan(fits[0].errors["strain"].mean_squared_error)
    assert fits[0].adequacy.unpredicted == (tests[-1].name,)
    expected = f"cannot be judged: it does not predict every reading of test '{tests[-1].name}'"
    assert str(fits[0].adequacy) == expected
    found = rank(fits)
    assert [(r.fit.law.name, r.weight) for r in found.laws] == [("norton", 1.0), ("hyperbolic-sine", 0.0)]
    alone = rank(fits[:1])
    assert alone.verdict.endswith(expected)
