"""Forecasts of Norton bars, whose curves, times and their distributions are closed forms; and what is refused."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

import creepkit as ck
from creepkit.errors import CreepkitError, FitError
from creepkit.forecasts.banded_output import band_of_draws
from creepkit.forecasts.draws import law_draws
from creepkit.forecasts.forecast import forecast
from creepkit.inverse.output_transforms import LinearTransform
from creepkit.inverse.selection.ranking import ranking_from_scores
from creepkit.inverse.uncertainty.model_averaging import ModelAverage
from creepkit.records import Status
from creepkit.reports.answer import asked_figures
from creepkit.reports.documents import document
from helpers.rupture_tests import BAR

TIMES = np.geomspace(3.6e3, 3.6e5, 40)
RATE, EXPONENT, SCATTER = 1e-8, 5.0, 0.1  # 1/s at 100 MPa, -, of ln rate


def bar(name, stress, factor=1.0, noise=2e-6, seed=0, **changes):
    rng = np.random.default_rng(seed)
    strain = RATE * (stress / 100.0) ** EXPONENT * factor * TIMES
    outputs = {"strain": strain + rng.normal(0.0, noise, TIMES.size)} if noise else {}
    return ck.History(name, TIMES, outputs, ck.constant_stress(stress, "stress"), 1073.15, **changes)


@pytest.fixture(scope="module")
def tests():
    rng = np.random.default_rng(11)
    stresses = [80, 80, 90, 100, 100, 110, 120, 120]
    return [bar(f"bar {k}", s, np.exp(rng.normal(0.0, SCATTER)), seed=k) for k, s in enumerate(stresses)]


@pytest.fixture(scope="module")
def fit(tests):
    nuisances = [ck.Nuisance("rate", sd=SCATTER)]
    return ck.identify("norton", tests, using=BAR, starts=2, nuisances=nuisances, usual_errors="none")


def test_the_band_of_a_planned_bar_is_that_of_a_linear_regression(fit, tests):
    """ln rate is linear in ln stress: its variance is s^2 (1 + x' (X'X)^-1 x), noise being negligible."""
    plan = bar("plan", 105.0, noise=0.0)
    one = fit.forecast(plan, draws=20000).tests[0]
    x = np.log([h.loading.program().values.max() / 100.0 for h in tests])
    design = np.stack([np.ones_like(x), x], axis=1)
    point = np.array([1.0, np.log(1.05)])
    sd = SCATTER * np.sqrt(1.0 + point @ np.linalg.inv(design.T @ design) @ point)
    strain = one.outputs["strain"]
    half = np.log(strain.band.high[-1] / strain.band.low[-1]) / 2
    assert half == pytest.approx(norm.ppf(0.975) * sd, rel=0.03)
    (time,) = one.times
    assert np.log(time.high / time.low) / 2 == pytest.approx(norm.ppf(0.975) * sd, rel=0.03)
    assert time.value == pytest.approx(0.01 / (RATE * 1.05**EXPONENT), rel=0.25)
    share = strain.shares["scatter between tests"][-1]
    assert share == pytest.approx(SCATTER**2 / sd**2, abs=0.02)
    assert sum(float(v[-1]) for v in strain.shares.values()) == pytest.approx(1.0)


def test_a_factor_on_all_rates_is_followed_by_laws_without_a_coefficient_of_their_own():
    """(A s^n)^q has no coefficient: the factor comes as a parameter of its own; the bands are those of Norton."""
    A, q = ck.parameters("A q")
    law = ck.CreepLaw(
        name="root",
        title="A power law without a coefficient",
        terms={"root": (A + ck.stress / 100) ** (5 * q) * 1e-8},
        params={A: ck.Param("shift", bounds=(-0.5, 0.5)), q: ck.Param("power", bounds=(0.2, 2.0))},
        references=["none"],
    )
    made = [bar(f"bar {k}", s, seed=k) for k, s in enumerate([70, 85, 100, 120])]
    fit = ck.identify(law, made, using=BAR, starts=2, usual_errors="none", nuisances=[ck.Nuisance("rate", sd=SCATTER)])
    strain = fit.forecast(bar("plan", 90.0, noise=0.0), draws=5000).tests[0].outputs["strain"]
    variance = (np.log(strain.band.high[-1] / strain.band.low[-1]) / 2 / norm.ppf(0.975)) ** 2
    assert variance * strain.shares["scatter between tests"][-1] == pytest.approx(SCATTER**2, rel=0.15)


def test_a_measured_test_is_compared_with_its_bands(fit):
    measured = bar("another", 95.0, factor=1.3, seed=5)
    one = fit.forecast(measured, targets={"strain": [0.002]}).tests[0]
    assert one.inside is not None
    assert one.inside.share["strain"] < 0.5  # ln 1.3 is 2.4 standard deviations of two, the law's own being small
    (time,) = one.times
    assert time.measured == pytest.approx(0.002 / (RATE * 0.95**EXPONENT * 1.3), rel=0.02)
    assert time.inside is False


def test_draws_lie_within_the_bounds_of_the_law_and_keep_what_compensates(fit):
    """The exponent is drawn far beyond its bounds; the rate at the reference hardly differs between draws."""
    known, size = fit.scatter_of_rates, fit.x.size
    nothing = {"design": np.zeros((len(known.tests), size)), "gradient": np.zeros(size)}
    scatter = replace(known, precision=np.diag([1e4, 0.25]), **nothing)
    draws = law_draws(replace(fit, rate_scatter=scatter), 400, np.random.default_rng(1))
    assert draws.count == 400
    low, high = fit.law.internal_bounds
    theta = fit.coordinates.theta(draws.u)
    assert ((theta >= low - 1e-3) & (theta <= high + 1e-3)).all()
    assert np.std(draws.u[:, 0]) == pytest.approx(1e-2, rel=0.15)


def test_the_time_to_a_strain_is_that_of_the_measured_strain(fit):
    """With an offset the interval of ln t is wider by that of ln strain: an offset of 0.1 of the strain."""
    offset = 1e-3
    noise = replace(fit.noise_model, outputs={"strain": replace(fit.noise_model["strain"], offset=offset)})
    plan = bar("plan", 100.0, noise=0.0)
    half = [
        np.log(one.high / one.low) / 2
        for f in (fit, replace(fit, noise_model=noise))
        for one in f.forecast(plan, draws=4000).tests[0].times
    ]
    assert half[1] == pytest.approx(np.hypot(half[0], norm.ppf(0.975) * offset / 0.01), rel=0.08)


def test_a_drift_of_the_rate_over_a_test_widens_the_band_by_half_of_it(fit):
    """Strain at the end is the mean of exp(d t / end) times the strain without drift: 1 + d / 2 to first order."""
    plan = bar("plan", 100.0, noise=0.0)
    half = []
    for tolerances in ({}, {"rate drift": 0.2}):
        band = fit.forecast(plan, draws=8000, tolerances=tolerances).tests[0].outputs["strain"].band
        half.append(np.log(band.high[-1] / band.low[-1]) / 2)
    assert half[1] == pytest.approx(np.hypot(half[0], norm.ppf(0.975) * 0.1), rel=0.05)


@pytest.mark.parametrize("label", ["heat", "laboratory"])
def test_a_known_heat_or_laboratory_narrows_the_band(label):
    rng = np.random.default_rng(3)
    heats = {"a": 0.4, "b": -0.4, "c": 0.1, "d": -0.1}
    made = [
        bar(f"{heat} {k}", 80 + 10 * k, np.exp(effect + rng.normal(0.0, 0.03)), seed=k, labels={label: heat})
        for heat, effect in heats.items()
        for k in range(4)
    ]
    fit = ck.identify("norton", made, using=BAR, starts=2, usual_errors="none")
    plans = [bar(h, 95.0, noise=0.0, labels={label: h}) for h in ("a", "b", "new")]
    a, b, new = (t.times[0] for t in fit.forecast(plans).tests)
    assert b.median / a.median == pytest.approx(np.exp(0.8), rel=0.1)
    assert np.log(a.high / a.low) < 0.25
    assert np.log(new.high / new.low) > 0.8


def test_a_known_heat_is_where_its_tests_were_and_its_band_is_that_of_its_own_scatter():
    """Heat a creeps exp(0.5) times as fast as the law; a test of it 3 standard deviations off leaves the band."""
    rng = np.random.default_rng(8)
    made = [
        bar(f"{heat} {k}", 80 + 10 * k, np.exp(effect + rng.normal(0.0, 0.05)), seed=k, labels={"heat": heat})
        for heat, effect in {"a": 0.5, "b": -0.5, "c": 0.2}.items()
        for k in range(5)
    ]
    fit = ck.identify("norton", made, using=BAR, starts=2, usual_errors="none")
    usual, far = (
        fit.forecast(bar("x", 95.0, np.exp(0.5 + b), seed=9, labels={"heat": "a"})).tests[0] for b in (0.0, 0.25)
    )
    strain = usual.outputs["strain"]
    assert strain.band.low[-1] < strain.value[-1] < strain.band.high[-1]
    assert strain.shares["scatter between tests"][-1] > 0.5
    assert usual.inside.share["strain"] > 0.9
    assert far.inside.share["strain"] < 0.5


def test_what_tests_share_is_at_its_estimate_in_a_forecast():
    """All tests are 15 K hotter than stated: a new one like them is forecast as they were fitted."""
    law = ck.law("norton").times(ck.arrhenius(T_ref=1073.15)).fix(n=5.0, Q=3e5)
    shift = 3e5 / 8.314462618 * (1 / 1073.15 - 1 / 1088.15)
    rng = np.random.default_rng(4)
    made = [
        bar(f"bar {k}", s, np.exp(shift + rng.normal(0, 0.02)), seed=k) for k, s in enumerate([80, 90, 100, 110, 120])
    ]
    nuisances = [ck.Nuisance("rate"), ck.Nuisance("temperature", scope="all", sd=10.0)]
    fit = ck.identify(law, made, using=BAR, starts=1, nuisances=nuisances, usual_errors="none")
    one = fit.forecast(bar("new", 95.0, np.exp(shift), seed=9)).tests[0]
    assert one.inside.share["strain"] > 0.9
    assert np.log(one.outputs["strain"].band.high[-1] / one.outputs["strain"].band.low[-1]) < 0.4


def test_the_stress_of_a_relaxing_bar_is_reached_from_above(fit):
    """ds/dt = -E A s^n has the closed form s^(1-n) = s0^(1-n) + (n - 1) E A t."""
    E, s0, target = 150e3, 150.0, 70.0
    plan = ck.History(
        "relaxation",
        np.geomspace(36.0, 3.6e5, 60),
        {},
        ck.constant_strain(s0 / E),
        1073.15,
        "relaxation",
        elastic=ck.Elastic(E),
    )
    one = forecast(fit, plan, targets={"stress": [target]}).tests[0]
    (time,) = one.times
    A, n = float(fit.rate(100.0)[0]) / 100.0 ** fit.values["n"], fit.values["n"]
    exact = (target ** (1 - n) - s0 ** (1 - n)) / ((n - 1) * E * A)
    assert time.value == pytest.approx(exact, rel=0.02)
    assert time.low < time.value < time.high


@pytest.mark.nightly
def test_curves_with_noise_of_their_own_lie_inside(fit):
    """Stated noise ten times that of the fitted tests: 40 whole curves inside at 0.95, give or take 0.035."""
    made = []
    for k in range(40):
        rng = np.random.default_rng(300 + k)
        history = bar(f"new {k}", 100.0, np.exp(rng.normal(0.0, SCATTER)), noise=2e-5, seed=200 + k)
        made.append(history.replace(standard_deviation={"strain": np.full(TIMES.size, 2e-5)}))
    inside = [t.inside.whole["strain"] for t in fit.forecast(made).tests]
    assert np.mean(inside) >= 0.85


def test_draws_that_the_solver_does_not_finish_are_left_out_and_said(fit):
    class Weak(type(BAR)):
        def predict_batch(self, law, theta, histories, nuisances, sensitivities):
            made = super().predict_batch(law, theta, histories, nuisances, sensitivities)
            if len(theta) > 20:
                made.status[:10] = Status.NOT_CONVERGED
            return made

    one = forecast(fit, bar("plan", 100.0, noise=0.0), using=Weak()).tests[0]
    assert np.isfinite(one.outputs["strain"].band.high).all()
    assert any("the solver did not finish 10 of the draws" in note for note in one.notes)


def test_over_laws_the_doubt_about_the_law_is_part_of_the_band(tests):
    laws = ("norton", "hyperbolic-sine")
    fits = tuple(
        ck.identify(law, tests, using=BAR, starts=2, nuisances=[ck.Nuisance("rate", sd=SCATTER)]) for law in laws
    )
    average = ModelAverage(fits, (0.6, 0.4))
    far = bar("plan", 220.0, noise=0.0)
    of_one, of_both = fits[0].forecast(far), average.forecast(far)
    assert "a single test, if the law is right" in " ".join(str(of_one).split())
    assert "a single test, if one of these laws is right, with these weights" in " ".join(str(of_both).split())
    single, both = of_one.tests[0], of_both.tests[0]
    assert both.outputs["strain"].shares["choice of the law"][-1] > 0.05
    width = [np.log(t.times[0].high / t.times[0].low) for t in (single, both)]
    assert width[1] > width[0]


def test_a_dimple_is_forecast_from_bars_with_the_tolerance_of_its_thickness(fit):
    jump = ck.PressureJump(P1=4.0, P2=5.0, Tj=1800.0)
    times = np.linspace(0.0, 3600.0, 13)
    plan = ck.History("dimple", times, {}, jump, 1073.15, "bulge", elastic=ck.Elastic(150e3))
    result = forecast(fit, plan, targets={"amplitude": [0.02]}, draws=60)
    one = result.tests[0]
    assert set(one.outputs) == {"amplitude", "width", "shape"}
    assert one.includes["thickness"] == "0.5 ± 0.01 mm"
    assert any("no fitted test shows the noise" in note for note in one.notes)
    exact = forecast(fit, plan, tolerances={"thickness": 0.0}, draws=60).tests[0]
    assert "thickness" in one.outputs["amplitude"].shares
    assert "thickness" not in exact.outputs["amplitude"].shares


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"level": 0.2}, "level is 0.2; give a probability"),
        ({"draws": 3}, "draws of forecast.. is 3; allowed is a whole number from 50"),
        ({"tolerances": {"thicknes": 0.1}}, "a tolerance of 'thicknes' is not known; did you mean 'thickness'"),
        ({"tolerances": {"thickness": 0.1}}, "means nothing to the specimens of these tests"),
        ({"tolerances": {"temperature": 5.0}}, "no law has a temperature; leave it out"),
        ({"tolerances": {"modulus": -1.0}}, "the tolerance of 'modulus' is -1.0"),
        ({"tolerances": {"modulus": "x"}}, r"tolerances\['modulus'\] of forecast\(\) is 'x'; allowed is"),
        ({"targets": {"strain": ["x"]}}, r"targets\['strain'\]\[0\] of forecast\(\) is 'x'"),
        ({"level": "x"}, r"level of forecast\(\) is 'x'; allowed is a finite number"),
        ({"targets": {"amplitude": [0.1]}}, "no test has an output 'amplitude'"),
        ({"targets": {"strain": [-1.0]}}, "targets of strain"),
    ],
)
def test_nonsense_is_refused(fit, options, sentence):
    with pytest.raises(CreepkitError, match=sentence):
        fit.forecast(bar("plan", 100.0, noise=0.0), **options)


def test_a_saved_identification_forecasts_the_same(fit, tmp_path):
    plan = bar("plan", 105.0, noise=0.0)
    loaded = ck.load(fit.save(tmp_path / "fit.json"))
    assert document(loaded.forecast(plan, using=BAR)) == document(fit.forecast(plan, using=BAR))


def test_extrapolation_is_said_by_how_much(fit):
    one = fit.forecast(bar("plan", 60.0, noise=0.0)).tests[0]
    assert "stress 60 MPa (the tests cover 80 to 120 MPa; 1.33 times beyond)" in one.extrapolation


def test_what_is_shown_is_extrapolated_in_its_own_condition_alone():
    """Tests of 150 to 230 MPa at 800 K, and 70 to 110 MPa at 900 K: 90 MPa is below those at 800 K."""
    stated = ((150.0, 800.0, 0.1), (230.0, 800.0, 0.11), (70.0, 900.0, 1.6), (110.0, 900.0, 1.7))
    tests = [bar(f"{s:g}", s, factor).replace(temperature=T) for s, T, factor in stated]
    fit = ck.identify(ck.law("norton").times(ck.arrhenius(T_ref=850.0)), tests, using=BAR, starts=1)
    for T, said in ((900.0, ""), (800.0, "extrapolated beyond the tests in stress and time")):
        plan = bar("plan", 90.0, noise=0.0).replace(times=np.array([1e5, 1e8]), temperature=T)
        found = fit.forecast(plan, targets={"strain": 0.002})
        assert "time 2.778e+04 h" in found.tests[0].extrapolation  # of its end, 2.8e4 h
        assert asked_figures(found)[0].remark == said
        assert asked_figures(fit.forecast(plan))[0].name == "strain at 27780 h"  # where no value was asked for


def test_celsius_is_refused_and_may_be_insisted_on(fit):
    with pytest.raises(FitError, match="law 'norton' has no temperature, and its tests were at 800 °C"):
        fit.forecast(bar("plan", 100.0, noise=0.0).replace(temperature=800.0))
    with pytest.raises(FitError, match=r"temperature 800 K lies 273 K below .* if 800 °C is meant, give 1073.15"):
        fit.rate(100.0, 800.0)
    with pytest.raises(FitError, match="temperatures are in K"):
        fit.rupture_time(100.0, 800.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fit.rate(100.0, 800.0, warn=False)


# ---- bands -----------------------------------------------------------------------------------------------------------

# Bands of draws whose distribution is known.


IDENTITY = LinearTransform(1.0, 10.0)
RNG = np.random.default_rng(0)


def band(values, noise=0.0, grows=True, level=0.95):
    noise = np.broadcast_to(noise, values.shape[1:]).astype(float)
    times = 1.0 + np.arange(values.shape[1])
    return band_of_draws(values, times, noise, IDENTITY, level, np.random.default_rng(1), grows=grows)


def test_independent_times_need_the_quantile_of_the_largest():
    times = 20
    result = band(np.zeros((20000, times)) + 1e-6 * RNG.standard_normal((20000, 1)), noise=1.0)
    # Sidak (1967): all of m independent normal variables lie within this with probability 0.95.
    sidak = norm.ppf(0.5 + 0.5 * 0.95 ** (1.0 / times))
    np.testing.assert_allclose(result.highest, sidak, rtol=0.03)
    np.testing.assert_allclose(result.high, 1.96, rtol=0.01)


def test_new_curves_lie_inside_as_often_as_stated():
    def walks(count):
        return np.cumsum(RNG.standard_normal((count, 30)), axis=1)

    result = band(walks(4000), level=0.9)
    new = walks(4000)
    inside = ((new >= result.lowest) & (new <= result.highest)).all(axis=1).mean()
    assert inside == pytest.approx(0.9, abs=0.02)
    assert ((new >= result.low) & (new <= result.high)).mean() == pytest.approx(0.9, abs=0.02)


def test_where_many_have_ruptured_there_is_no_upper_end():
    curves = np.tile(np.linspace(0.0, 1.0, 5), (1000, 1)) + 0.01 * RNG.standard_normal((1000, 1))
    curves[:100, 3:] = np.nan
    result = band(curves)
    assert np.isfinite(result.high[:3]).all()
    assert np.isinf(result.high[3:]).all()
    assert np.isfinite(result.low).all()


def test_new_curves_lie_inside_while_they_last():
    times = np.linspace(0.1, 1.6, 25)

    def ruptured(count):
        clock = times / np.exp(0.2 * RNG.standard_normal((count, 1)))
        return np.where(clock < 1.0, -np.log(np.maximum(1.0 - clock, 1e-12)), np.nan)

    result = band_of_draws(ruptured(2000), times, np.zeros(25), IDENTITY, 0.9, np.random.default_rng(1), grows=True)
    new = ruptured(2000)
    assert np.isinf(result.median[-1])
    inside = (np.isnan(new) | ((new >= result.lowest) & (new <= result.highest))).all(axis=1).mean()
    assert inside == pytest.approx(0.92, abs=0.05)


# ---- ranking files ---------------------------------------------------------------------------------------------------

# Files of identifications and rankings from which forecasts are made; and what is refused of them.


@pytest.fixture(scope="module")
def saved_fit():
    times, rng = np.geomspace(3.6e3, 3.6e5, 20), np.random.default_rng(3)
    tests = [
        ck.History(
            f"bar {s:g}", times, {"strain": 1e-18 * s**5 * times + rng.normal(0.0, 2e-6, 20)},
            ck.constant_stress(s, "stress"), 1073.15,
        )
        for s in (80.0, 100.0, 120.0)
    ]  # fmt: skip
    return ck.identify("norton", tests, using=BAR, starts=1, nuisances=[ck.Nuisance("rate", sd=0.1)])


def test_a_ranking_saves_its_laws_beside_itself(saved_fit, tmp_path):
    other = replace(saved_fit, law=replace(saved_fit.law, name="ranking"))  # a law of the name of the file itself
    ranking = ranking_from_scores([saved_fit, other], np.array([0.0, 2.0]))
    path = ranking.save(tmp_path / "ranking.json")
    assert path == tmp_path / "ranking.json"
    found = ck.load(path)
    assert [one.fit.law.name for one in found.laws] == ["norton", "ranking"]
    weight = 1.0 / (1.0 + np.exp(-1.0))  # of a law whose criterion is lower by 2
    assert [one.weight for one in found.laws] == pytest.approx([weight, 1.0 - weight])
    assert (found.verdict, ck.export(found, "latex")) == (ranking.verdict, ck.export(ranking, "latex"))
    assert {file.name for file in tmp_path.glob("[!.]*")} == {"ranking.json", "norton.json", "ranking-2.json"}
