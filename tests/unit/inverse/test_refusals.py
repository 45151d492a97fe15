"""What an identification and what follows from it refuse: each mistake has one sentence that names it."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import CreepkitError, FitError
from creepkit.inverse.identify import identify
from creepkit.inverse.nuisance_parameters import NuisanceParameters
from creepkit.inverse.selection import rank
from creepkit.inverse.selection.ranking import ModelAverage
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.uncertainty.correlation import correlation
from creepkit.laws.norton import NORTON
from creepkit.records import History, Nuisance, PressureJump, Status, StressSteps, constant_stress
from helpers.steady_rate_predictor import Steady, planted

QUICK = IdentificationSettings(starts=1, sobol_points=8, frames=20)
A, N = NORTON.params


@pytest.fixture(scope="module")
def tests():
    return planted(NORTON, {"A": 1e-16, "n": 5.2}, [(s, 1050.0) for s in (30, 50, 80)], seed=3, noise=1e-5)


@pytest.fixture(scope="module")
def fit(tests):
    return identify(NORTON, tests, Steady(), settings=QUICK)


def settings(**changes):
    return lambda tests, fit: IdentificationSettings(**changes)


def nuisances(*given):
    return settings(nuisances=given)


def identified(law=NORTON, change=lambda tests: tests, **changes):
    return lambda tests, fit: identify(law, change(tests), Steady(), settings=replace(QUICK, **changes))


def rates(**further):
    """Norton's law from minimum rates alone, with one further test."""
    given = [stated(s) for s in (60.0, 90.0, 100.0)]
    return lambda tests, fit: ck.identify(NORTON, [replace(stated(), **further).replace(name="odd"), *given])


def stated(stress=80.0):
    load = constant_stress(stress, "stress")
    return History(f"{stress:g}", np.array([1e7]), {}, load, 1000.0, minimum_rate=1e-16 * stress**4)


def bounded(A_bounds):
    return NORTON.with_bounds(A=A_bounds, n=(1, 5))


BAR = (np.array([1.0, 10.0]), {"strain": [0.0, 0.1]}, constant_stress(80.0), 1000.0)
DIMPLES = [
    History(name, np.array([1.0]), {}, PressureJump(1.0, 1.2, 1e4), 1000.0, "bulge", minimum_rate=1e-9)
    for name in "abc"
]


def lengths_of_one(tests, fit):
    NuisanceParameters.from_histories([Nuisance("thickness", sd=0.01, tests=("a",))], DIMPLES, ck.specimen("bulge"))


MISTAKES = [
    (settings(starts=0), "starts is 0"),
    (settings(weights="none"), "weights is 'none'; allowed is 'automatic', 'equal' or 'likelihood'"),
    (settings(rupture_times="never"), "rupture_times is 'never'; allowed is 'auto', 'use' or 'ignore'"),
    (nuisances(Nuisance("offset", mean=0.01, sd=1e-3)), "about zero"),
    (nuisances(Nuisance("thickness", sd=0.02, scope="all")), "'thickness' is a length in mm and needs its prior mean"),
    (nuisances(Nuisance("thickness", mean=0.5, bounds=(0.6, 0.7))), "its mean 0.5 lies outside its bounds"),
    (nuisances(Nuisance("offset"), Nuisance("offset")), "nuisance 'offset' is given twice"),
    (nuisances(Nuisance("temperature", output="width")), "it has no output"),
    (nuisances(Nuisance("rate", tests=("bar_3",))), "'rate' belongs to every test; leave out tests="),
    (lengths_of_one, "test 'b' has no nuisance 'thickness', which other tests have"),
    (identified(change=lambda tests: []), "no histories"),
    (identified(change=lambda tests: [tests[0], tests[0]]), "two histories are called"),
    (identified(change=lambda tests: [tests[0].replace(used=np.zeros(40, bool))]), "fewer than two usable frames"),
    (identified(change=lambda tests: [h.replace(outputs={"strain": 0 * h.times}) for h in tests]), "no strain"),
    (identified(change=lambda tests: [tests[0].replace(outputs={"nonsense": tests[0].times})]), "none of the outputs"),
    (identified(NORTON.fix(A=1e-16, n=5.0)), "no parameter left"),
    (identified(bounded((1e-40, 1e-30))), "the bounds exclude the data"),
    (identified(nuisances=(Nuisance("thickness", mean=0.5, sd=0.1),)), "'thickness' means nothing to the predictor"),
    (lambda tests, fit: fit.with_histories(tests[:1], Steady()), "not among the histories"),
    (lambda tests, fit: ck.identify(NORTON, [History("plan", np.array([1e5]), {}, BAR[2], 1000.0)]), "'plan' has no"),
    (rates(loading=StressSteps(((0.0, 80.0), (1e5, 100.0)))), "a load that changes from 80 to 100 MPa; give each load"),
    (lambda tests, fit: ck.identify(NORTON, [stated()]), "has 2 parameters"),
    (lambda tests, fit: ck.identify(NORTON, DIMPLES), "leading output is a strain; of specimen 'bulge'"),
    (lambda tests, fit: History("bar", *BAR, rupture_time=-1.0), "a rupture time of -1 s is not a finite time"),
    (lambda tests, fit: History("bar", *BAR, rupture_time=np.inf), "a rupture time of inf s is not"),
    (lambda tests, fit: History("bar", *BAR, rupture_time=9.0), "a used frame at 10 s lies after the rupture at 9 s"),
    (lambda tests, fit: History("bar", *BAR, rupture_time=10.0, unruptured=True), "keep one of them"),
    (lambda tests, fit: rank([]), "there are no identifications to rank"),
    (lambda tests, fit: rank([fit, replace(fit, provenance={"data": "others"})]), "were made from different histories"),
    (lambda tests, fit: ck.select([], tests, "uniaxial"), "there are no candidate laws"),
    (lambda tests, fit: correlation(fit, "raw"), "is 'raw'; allowed is 'author' or 'conditioned'"),
    (lambda tests, fit: ModelAverage((fit,), (0.5, 0.5)), "as many laws as weights"),
    (lambda tests, fit: ModelAverage((fit,), (-1.0,)), "must not be negative"),
    (lambda tests, fit: fit.rupture_time(-10.0), "a stress that is not above zero"),
]  # fmt: skip


def test_every_mistake_is_named_in_one_sentence(tests, fit) -> None:
    wrong = []
    for number, (mistake, words) in enumerate(MISTAKES):
        try:
            mistake(tests, fit)
        except CreepkitError as error:
            if not re.search(re.escape(words), str(error)) or "\n" in str(error):
                wrong.append(f"{number}: '{words}' is not in: {error}")
        else:
            wrong.append(f"{number}: nothing was said of '{words}'")
    assert wrong == []


# ---- prediction failures ---------------------------------------------------------------------------------------------

# Where nothing can be predicted there is no answer, but an error that counts how the candidates ended.


SETTINGS = IdentificationSettings(starts=2, sobol_points=32)
TESTS = planted(
    NORTON, {"A": 1e-15, "n": 4.0}, [(60.0, 900.0), (80.0, 900.0), (110.0, 900.0)], seed=1, noise=1e-5, frames=12
)  # fmt: skip


class Failing(Steady):
    """Fails at candidates and tests that `fails` names, with one status or the other."""

    def __init__(self, fails=lambda theta, tests: np.ones((len(theta), len(tests)), bool)) -> None:
        self.fails = fails

    def predict_batch(self, law, theta, histories, nuisances, sensitivities):
        found = super().predict_batch(law, theta, histories, nuisances, sensitivities)
        failed = self.fails(theta, histories)
        status = np.where(theta[:, 1:] > 6.0, int(Status.OUTSIDE_CLASS), int(Status.NOT_CONVERGED))
        return replace(
            found,
            values=np.where(failed[..., None, None], np.nan, found.values),
            status=np.where(failed, status, found.status),
            end_times=np.where(failed, 0.0, found.end_times),
        )


def test_a_predictor_that_fails_everywhere_is_an_error_with_counts() -> None:
    with pytest.raises(FitError, match=r"^law 'norton': none of \d+ candidates could be predicted: ") as caught:
        identify(NORTON, TESTS, Failing(), settings=SETTINGS)
    text = str(caught.value)
    assert "\n" not in text
    tried, *counts = (int(n) for n in re.findall(r"(\d+) (?:candidates|not converged|outside the class of laws)", text))
    assert sum(counts) == tried > 0
    assert "not converged" in text


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
