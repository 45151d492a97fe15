"""Errors that tests usually have, in intervals: against identifications of tests that have them."""

from dataclasses import replace

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import FitError
from creepkit.inverse.history_checks import length_notes
from creepkit.inverse.identify import identify
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.noise_model import NoiseModel, OutputNoise
from creepkit.inverse.settings import USUAL_ERRORS, IdentificationSettings
from creepkit.inverse.uncertainty.quantities import gradient, log_rate
from creepkit.language import Elastic, arrhenius
from creepkit.laws.norton import NORTON
from creepkit.records import History, Nuisance, PressureJump, Program, RecordedLoading, constant_stress, known_specimens
from creepkit.reports.advice import cautions
from creepkit.specimens.bulge.specimen import Bulge
from creepkit.specimens.uniaxial import Uniaxial
from helpers.steady_rate_predictor import Steady, planted

AT_TEMPERATURES = NORTON.times(arrhenius(T_ref=1000.0))
VALUES = {"A": 1e-15, "n": 4.0, "Q": 316e3}
CONDITIONS = [(60.0, 1000.0), (70.0, 980.0), (80.0, 1000.0), (70.0, 1020.0), (65.0, 1010.0), (75.0, 990.0)]
SETTINGS = IdentificationSettings(
    starts=1, sobol_points=8, weights="likelihood", nuisances=(Nuisance("offset"), Nuisance("rate"))
)
NORMAL, R = 1.959964, 8.314462618


def half_width(fit, quantity="rate"):
    value, low, high = getattr(fit, quantity)(70.0, 1000.0)
    assert np.log(high / value) == pytest.approx(np.log(value / low), rel=1e-6)
    return float(np.log(high / value))


def moved(tests, kelvin, share):
    return [
        h.replace(
            temperature=h.temperature + kelvin,
            loading=constant_stress(h.loading.program().values[0] * (1 + share), "stress"),
        )
        for h in tests
    ]


def campaign_of_six(rate=0.05):
    return planted(AT_TEMPERATURES, VALUES, CONDITIONS, seed=4, rate=rate, noise=2e-5)


def shifts_of_rate(tests, fit, at=(70.0, 1000.0)):
    """Of ln rate by 3 K and by 1 % in all tests, by identifications."""
    return [
        np.log(identify(AT_TEMPERATURES, moved(tests, *by), Steady(), settings=SETTINGS).rate(*at)[0])
        - np.log(fit.rate(*at)[0])
        for by in ((USUAL_ERRORS["temperature"], 0.0), (0.0, USUAL_ERRORS["load"]))
    ]


def test_what_is_common_to_all_tests_adds_in_quadrature_and_no_number_of_tests_averages_it_out():
    """Six tests, and the same twice: what 3 K and 1 % in all of them do to the rate is that of identifications."""
    tests = campaign_of_six(0.2)
    fit = identify(AT_TEMPERATURES, tests, Steady(), settings=SETTINGS)
    expected = np.hypot(half_width(fit.by_tests_alone), NORMAL * np.linalg.norm(shifts_of_rate(tests, fit)))
    assert fit.noise_model.rate > 0.13  # more than temperatures and loads off by so much would make
    # six tests tell a little of what they share, which a sum of squares does not know
    assert 0.95 * expected < half_width(fit) < 1.01 * expected
    again = identify(AT_TEMPERATURES, tests, Steady(), settings=SETTINGS.changed({"usual_errors": "none"}))
    assert half_width(again) == pytest.approx(half_width(fit.by_tests_alone), rel=1e-3)
    assert again.rate(70.0, 1000.0)[0] == pytest.approx(fit.rate(70.0, 1000.0)[0], rel=0.03)


def test_intervals_hold_where_every_test_is_off_by_itself():
    """60 campaigns of five tests whose rates do not scatter otherwise; intervals of tests taken as exact hold too few.

    Half of the campaigns are off alike in all tests. The standard error of a share of 0.95 is 0.03.
    """
    inside = {"with": 0, "alone": 0}
    truth = float(ck.lower(AT_TEMPERATURES, "numpy").rate(VALUES, stress=70.0, temperature=1000.0))
    for seed in range(60):
        rng = np.random.default_rng(seed)
        tests = []
        common = rng.standard_normal(2)
        for k, (stress, T) in enumerate(CONDITIONS[:5]):
            kelvin, share = (common if seed % 2 else rng.standard_normal(2)) * (3.0, 0.01)
            true = (stress * (1 + share), T + kelvin)
            (test,) = planted(AT_TEMPERATURES, VALUES, [true], seed=100 * seed + k, noise=2e-5)
            stated = {"loading": constant_stress(stress, "stress"), "temperature": T, "name": f"bar {k}"}
            tests.append(test.replace(**stated))
        fit = identify(AT_TEMPERATURES, tests, Steady(), settings=SETTINGS.changed({"frames": 15}))
        for name, one in (("with", fit), ("alone", fit.by_tests_alone)):
            _, low, high = one.rate(70.0, 1000.0)
            inside[name] += bool(low <= truth <= high)
    assert inside["with"] >= 54
    assert inside["alone"] < 50


@pytest.mark.parametrize(
    ("errors", "message"),
    [
        ("all", 'usual_errors is "all"; allowed are usual, none and such as'),
        ({"temperatures": 3.0}, "usual_errors names 'temperatures'.*temperature"),
        ({"load": -0.01}, "load is -0.01; give a standard deviation from 0 to 0.3"),
    ],
)
def test_errors_that_are_none_are_refused(errors, message):
    with pytest.raises(FitError, match=message):
        IdentificationSettings(usual_errors=errors)


def test_lives_hold_them_too():
    """A bar of a law of rupture: what 3 K in all tests do to the logarithm of its life, in the interval of the law."""
    tests = campaign_of_six()
    fit = identify(AT_TEMPERATURES, tests, Steady(), settings=SETTINGS)
    (mean, with_errors), (_, alone) = (
        one.scatter_of_rates.joint(np.array([0.05])) for one in (fit, fit.by_tests_alone)
    )
    row = gradient(log_rate(fit.coordinates, 70.0, 1000.0), fit.u, np.ones(3))
    assert row @ (with_errors - alone) @ row == pytest.approx(np.sum(np.square(shifts_of_rate(tests, fit))), rel=0.02)
    assert mean.size == 3


# ---- values under these errors ---------------------------------------------------------------------------------------


def test_errors_common_to_tests_are_the_covariance_of_all_of_them_as_one_matrix():
    """Whitening, the inverse, its determinant and its diagonal against the matrix itself, and draws counted twice."""
    tests = planted(AT_TEMPERATURES, VALUES, CONDITIONS[:3], seed=2, noise=2e-5, frames=6)
    problem = identify(AT_TEMPERATURES, tests, Steady(), settings=SETTINGS).least_squares_problem
    rng, plain = np.random.default_rng(0), problem.residuals(problem.bounds.centre)
    noise = NoiseModel({"strain": OutputNoise(3e-5, 0.02, 1e-4)}, 0.1)
    blocks = np.zeros((plain.values.size, plain.values.size))
    for k, block in enumerate(CovarianceFactor.of_residuals(plain, noise).blocks):
        part = slice(k * len(block), (k + 1) * len(block))
        blocks[part, part] = block
    common = rng.normal(size=(*plain.values.shape, 2)) * plain.present[..., None]
    rows, v = common.reshape(-1, 2), rng.normal(size=(*plain.values.shape, 3))
    whole = blocks + rows @ rows.T
    factor = CovarianceFactor.of_residuals(plain.with_effects([], np.moveaxis(common, -1, 0)), noise)
    expected = np.linalg.solve(whole, v.reshape(-1, 3))
    np.testing.assert_allclose(factor.inverse_times(v).reshape(-1, 3), expected, rtol=1e-6, atol=1e-6 * expected.max())
    white = factor.whiten(v).reshape(-1, 3)
    np.testing.assert_allclose(white.T @ white, v.reshape(-1, 3).T @ expected, rtol=1e-7)
    assert factor.log_determinant == pytest.approx(np.linalg.slogdet(whole)[1], rel=1e-9)


def test_tests_together_are_known_no_worse_than_the_best_of_them_alone():
    """A bar, a dimple and three beams of one alloy: the exponent and the coefficient, each beside the narrowest."""
    dimple = Bulge().reduced_order_model()
    using = {"uniaxial": Uniaxial(), "three-point-bend": ck.specimen("three-point-bend"), "bulge": dimple}
    times, rng = np.geomspace(600.0, 360e3, 40), np.random.default_rng(0)

    def carried_out(name, specimen, loading, noise, times=times):
        blank = History(name, times, {}, loading, 1000.0, specimen, elastic=Elastic(150e3))
        predicted = using[specimen].predict(NORTON, NORTON.to_internal({"A": 1e-15, "n": 4.0}), [blank])
        outputs = {
            output: predicted.of(0)[:, predicted.outputs.index(output)] + rng.normal(0.0, sd, times.size)
            for output, sd in noise.items()
        }
        stated = {output: np.full(times.size, sd) for output, sd in noise.items()}
        return blank.replace(outputs=outputs, standard_deviation=stated)

    bar = [carried_out("bar", "uniaxial", constant_stress(60.0, "stress"), {"strain": 2e-5})]
    jump, sizes = PressureJump(4.0, 6.0, 5400.0), {"amplitude": 1.5e-3, "width": 3e-3}
    bulge = [carried_out("dimple", "bulge", jump, sizes, np.linspace(900.0, 10800.0, 30))]
    forces = [Program(np.array([0.0, times[-1]]), np.array([force, force])) for force in (160.0, 190.0, 230.0)]
    beams = [
        carried_out(f"beam {k}", "three-point-bend", RecordedLoading(force, "force"), {"deflection": 2e-3})
        for k, force in enumerate(forces)
    ]
    widths = []
    for tests in (bar, bulge, beams, bar + bulge + beams):
        fit = identify(NORTON, tests, {h.specimen: using[h.specimen] for h in tests}, settings=SETTINGS)
        widths.append([param.to_internal(e.high) - param.to_internal(e.low)
                       for param, e in zip(NORTON.table.values(), fit.estimates, strict=True)])  # fmt: skip
    *alone, together = widths
    assert (np.array(together) < np.min(alone, axis=0)).all(), widths


def test_values_and_samples_are_one_estimate_whatever_errors_are_included():
    """Of nine planted curves, within 0.2 standard deviations; errors that vanish move nothing."""
    curves, law = ck.read_histories(ck.example_data("planted creep curves")), ck.law("strain-hardening")
    none, vanishing, usual = (
        ck.identify(law.times(ck.arrhenius(T_ref=1073.15)), curves, weights="likelihood", starts=1, usual_errors=errors)
        for errors in ("none", {"temperature": 1e-6}, "usual")
    )
    sd, draws = np.sqrt(np.diag(usual.covariance)), usual.sample(draws=1000).u
    shifts = [100.0 * (vanishing.u - none.u), usual.u - none.u, draws.mean(axis=0) - usual.u] / sd
    assert np.abs(shifts).max() < 0.2
    np.testing.assert_allclose(draws.std(axis=0), sd, rtol=0.2)


def test_a_dimple_is_sampled_with_the_errors_that_its_values_were_found_with():
    """Readings of 1.5 um are far more exact than dimensions: by the readings alone other values would be the likeliest,
    and those that were found so unlikely that nothing could be drawn about them.
    """
    tests = ck.read_histories(ck.example_data("planted bulge test"))
    fit = ck.identify("strain-hardening", tests, ck.specimen("bulge"), starts=1)
    draws = fit.sample(draws=200)
    np.testing.assert_allclose(draws.u.std(axis=0), np.sqrt(np.diag(fit.covariance)), rtol=0.2)
    for name, truth in {"A": 4e-16, "n": 4.4, "m": -0.35}.items():
        _, low, high = draws.interval(name)
        assert low < truth < high


def test_lengths_that_no_file_states_are_noted_and_are_the_first_caution(tmp_path):
    head = "specimen,four-point-bend\nWidth,4,mm\nLoad,72,N\nT (C),1300"
    (tmp_path / "b.csv").write_text(f"{head}\n\nTime (h),deflection (mm)\n0,0\n1,0.001\n")
    tests, beam = ck.read_histories(tmp_path), known_specimens()["four-point-bend"]
    note = length_notes(tests, beam)[0]
    assert "no file states them: height, span, inner span;" in note
    assert not length_notes(tests, replace(beam, height=3.0, span=60.0, inner_span=30.0))
    fit = identify(AT_TEMPERATURES, campaign_of_six(), Steady(), settings=SETTINGS)
    assert cautions(replace(fit, notes=(note,)))[0] == note
