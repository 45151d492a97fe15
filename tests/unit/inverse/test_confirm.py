"""The simulation of an identified law beside its tests: differences of known size, and the sentence for each case."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.stats import chi2, f

import creepkit as ck
from creepkit.inverse.confirmation import Confirmation, ConfirmedTest, _confirmed_output, confirm, outside_domain
from creepkit.inverse.identification_document import load
from creepkit.records import Status
from creepkit.records.history import EVERY_FRAME
from helpers.planted_alloys import bars

BAR = ck.specimen("uniaxial")
SD = 1e-4
TESTS = [h.replace(standard_deviation={"strain": SD}) for h in bars("X")]


@dataclass(frozen=True)
class Stranger:
    """Predicts what a bar does, and something more in strain; says that it ended as `status` tells."""

    more: float = 0.0
    status: Status = Status.COMPLETE
    name: str = "stranger"
    outputs: tuple[str, ...] = ("strain",)

    def predict(self, law, theta, histories, *, nuisances=None, sensitivities=False):
        found = BAR.predict(law, theta, histories, nuisances=nuisances, sensitivities=sensitivities)
        status, ends = np.full_like(found.status, int(self.status)), np.full(found.end_times.shape, 3600.0)
        return replace(found, values=found.values + self.more, status=status, end_times=ends)


@pytest.fixture(scope="module")
def fit():
    return ck.identify("norton", TESTS, starts=2)


def test_a_fit_by_the_specimen_itself_is_confirmed_with_its_own_misfit(fit):
    told = confirm(fit, TESTS, BAR)
    assert told.noise_ratio == 0.0
    for test in fit.tests:
        assert told[test.name, "strain"].simulation_errors == told[test.name, "strain"].fit_errors
        assert told[test.name, "strain"].simulation_errors.mean_squared_error == pytest.approx(
            test["strain"].errors.mean_squared_error, rel=1e-9
        )


@pytest.mark.parametrize("share", [0.5, 2.0])
def test_the_difference_is_told_in_units_of_the_noise(fit, share):
    """A surrogate that is off by `share` times the noise everywhere."""
    told = confirm(replace(fit, predictor=Stranger(share * SD)), TESTS, BAR)
    assert told.noise_ratio == pytest.approx(share, rel=1e-9)
    assert told.confirmed is (share < 1)


def test_a_surrogate_that_is_far_off_is_not_believed(fit):
    told = confirm(replace(fit, predictor=Stranger(3 * SD)), TESTS, BAR)
    assert told.verdict.startswith("not confirmed: uniaxial differs from the fit by 3 times the noise (strain of 'X-")
    assert told.verdict.endswith("identify again with using= this specimen")


@pytest.mark.parametrize(
    ("status", "words"),
    [(Status.RUPTURED, "the specimen bursts at 3600 s"), (Status.NOT_CONVERGED, "the simulation stops at 3600 s")],
)
def test_a_simulation_that_ends_early_confirms_nothing(fit, status, words):
    told = confirm(fit, TESTS, Stranger(status=status))
    assert not told.confirmed
    assert told.verdict.startswith(f"not confirmed: by stranger, {words} of test 'X-60'")


def test_only_the_guard_of_a_surrogate_doubts(fit):
    assert not outside_domain(fit)
    assert outside_domain(replace(fit, predictor=Stranger(status=Status.OUTSIDE_DOMAIN)))
    assert not outside_domain(replace(fit, predictor=None))


def test_a_fit_from_a_file_is_held_against_the_misfit_it_tells(fit, tmp_path):
    found = load(replace(fit, predictor=None).save(tmp_path / "fit.json"))
    told = confirm(found, TESTS, BAR)
    assert np.isnan(told["X-60", "strain"].rms_difference)
    assert told.noise_ratio == pytest.approx(0.0, abs=1e-3)
    far = confirm(found, TESTS, Stranger(100 * SD))
    assert far.noise_ratio == pytest.approx(100.0, rel=0.05)


def test_other_tests_are_predicted_without_a_misfit_of_the_fit(fit):
    others = [h.replace(name=f"new {h.name}") for h in TESTS]
    told = confirm(replace(fit, predictor=None), others, {"uniaxial": BAR})
    assert told.tests[0].outputs[0].fit_errors is None
    assert np.isnan(told.noise_ratio)


# ---- the uncertainty of the noise itself ---------------------------------------------------------------------------

FRAMES = np.linspace(0.025, 1.0, 40) * 1e5


def said_of(seed, misfit=0.0, *, stated=False, outputs=1):
    """What is said of tests of 40 frames with white noise: the law's curve is known, with a wave of `misfit` noises."""
    rng, tests = np.random.default_rng(seed), []
    for k in range(outputs):
        clean = 0.02 * FRAMES / FRAMES[-1]
        noisy = clean + SD * rng.standard_normal(40)
        sd = {"strain": np.full(40, SD)} if stated else {}
        history = TESTS[0].replace(
            name=f"bar {k}", times=FRAMES, outputs={"strain": noisy}, standard_deviation=sd, used=EVERY_FRAME
        )
        simulated = clean + misfit * SD * np.sin(2 * np.pi * FRAMES / FRAMES[-1])
        one = _confirmed_output(history, "strain", simulated, simulated, None)
        tests.append(ConfirmedTest(history.name, Status.COMPLETE, FRAMES[-1], (one,)))
    return Confirmation("norton", "uniaxial", tuple(tests))


@pytest.mark.parametrize(("stated", "outputs", "draws"), [(False, 1, 1000), (False, 6, 300), (True, 1, 500)])
def test_a_true_law_with_white_noise_is_not_condemned(stated, outputs, draws):
    """At most about one in a hundred, whether the noise is known or estimated from 40 frames, of one test or of six."""
    condemned = sum("does not follow" in said_of(seed, stated=stated, outputs=outputs).verdict for seed in range(draws))
    assert condemned <= 0.01 * draws + 2 * np.sqrt(0.01 * draws)


@pytest.mark.parametrize("stated", [False, True])
def test_a_law_that_is_wrong_by_a_few_noises_is_condemned(stated):
    """A wave of six noises: its mean square is 18 beside the 1 of the noise."""
    assert all("the law does not follow the tests" in said_of(seed, 6.0, stated=stated).verdict for seed in range(20))


def test_the_probability_is_that_of_chi_square_or_of_f():
    """40 frames; noise that was estimated from them is known to a fifth of their number of degrees of freedom."""
    known, estimated = (said_of(3, 1.5, stated=s)["bar 0", "strain"] for s in (True, False))
    assert known.p_value == pytest.approx(chi2.sf(40 * known.simulation_errors.chi_square, 40))
    assert estimated.p_value == pytest.approx(f.sf(estimated.simulation_errors.chi_square, 40, 8))
