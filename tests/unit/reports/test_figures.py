"""Axes of figures: round labels at both ends, whatever the range; figures in few bytes."""

from __future__ import annotations

import re
from functools import cache
from itertools import pairwise
from types import SimpleNamespace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from creepkit.forecasts.forecast import forecast
from creepkit.inverse.identify import identify
from creepkit.inverse.selection.ranking import ranking_from_scores
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.uncertainty.laplace_approximation import NORMAL_QUANTILE
from creepkit.kernels import lower
from creepkit.language import arrhenius
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from creepkit.records import History, Program, constant_stress, load_steps
from creepkit.reports.compared_values import judged_readings
from creepkit.reports.figures import empty_figure, logarithmic_labels, set_range
from creepkit.reports.forecast import forecast_figure
from creepkit.reports.identification_plot import curve_of_test, fitted_curves, joint_covariance, small_multiples
from creepkit.reports.ranking import MOST_TESTS_DRAWN, misfit_name, misfits
from creepkit.reports.rate_panels import own_rates
from creepkit.reports.svg import svg_text
from creepkit.specimens.uniaxial import Uniaxial
from helpers.steady_rate_predictor import Steady, planted

RANGES = [(80.0, 125.0), (32.0, 175.0), (0.011, 1100.0), (3e-11, 3e-6), (1e-14, 1e2), (1.0, 1.0), (0.99, 1.01)]


@pytest.mark.parametrize(("low", "high"), RANGES)
def test_labels_of_a_logarithmic_axis_enclose_the_data_and_are_few(low, high):
    labels = logarithmic_labels(low, high)
    assert labels[0] <= low * (1 + 1e-9)
    assert labels[-1] >= high * (1 - 1e-9)
    assert 2 <= labels.size <= 8
    assert (np.diff(labels) > 0).all()


@pytest.mark.parametrize(("low", "high"), RANGES)
@pytest.mark.parametrize("which", ["x", "y"])
def test_an_axis_has_a_written_label_within_three_per_cent_of_either_end(low, high, which):
    figure = empty_figure(4.0, 3.0)
    axes = figure.subplots()
    set_range(axes, which, low, high, logarithmic=True)
    figure.canvas.draw()
    axis = axes.xaxis if which == "x" else axes.yaxis
    ends = np.log(axes.get_xlim() if which == "x" else axes.get_ylim())
    written = np.log(
        [v for v, label in zip(axis.get_ticklocs(), axis.get_ticklabels(), strict=True) if label.get_text()]
    )
    tolerance = 0.031 * np.ptp(ends)
    assert written.min() - ends[0] <= tolerance
    assert ends[1] - written.max() <= tolerance
    assert ends[0] <= np.log(low) + 1e-9
    assert ends[1] >= np.log(high) - 1e-9


def test_a_figure_in_few_bytes_has_its_lines_and_bands_where_they_were() -> None:
    """A sine of 10,000 points and a band about it on a logarithmic axis: what is written lies within a pixel."""
    figure = empty_figure(6.0, 4.0)
    axes = figure.subplots()
    x = np.geomspace(1.0, 1e3, 10_000)
    y = 10 + 5 * np.sin(4 * np.log(x))
    axes.plot(x, y, color="red")
    band = axes.fill_between(x, y - 1, y + 1)
    axes.set_xscale("log")
    svg = svg_text(figure, "f1", "title", "description")
    assert len(svg) < 60_000
    (name,) = re.findall(r"\.(\w+)\{[^}]*stroke:#ff0000", svg)
    (path,) = re.findall(rf'<path d="([^"]*)"[^>]*class="{name}"', svg)
    written = 72 / figure.dpi * np.array([1, -1]) * np.array(re.findall(r"-?[\d.]+", path), float).reshape(-1, 2)
    (edge,) = (axes.transData.transform(one.vertices) for one in band.get_paths())
    for shown, curves in ((np.add(written, [0.0, 288.0]), [y]), (edge, [y - 1, y + 1])):
        assert len(shown) < 500
        expected = np.concatenate([axes.transData.transform(np.column_stack([x, one])) for one in curves])
        assert np.linalg.norm(shown[:, None] - expected, axis=-1).min(axis=1).max() < 1.0
        between = np.concatenate([np.linspace(a, b, 200) for a, b in pairwise(shown)])
        assert np.linalg.norm(expected[::100, None] - between, axis=-1).min(axis=1).max() < 1.0


# ---- prediction bands ------------------------------------------------------------------------------------------------

# Bands of fitted curves: closed forms for a Norton bar, the joint covariance, and the rates that tests show.


QUICK = IdentificationSettings(starts=2, sobol_points=16, frames=20)
TRUTH = {"A": 1e-16, "n": 5.2}
STRESSES = (30.0, 50.0, 80.0)


@pytest.fixture(scope="module")
def fit():
    tests = planted(NORTON, TRUTH, [(s, 1050.0) for s in STRESSES], seed=5, rate=0.1, noise=1e-6)
    return identify(NORTON, tests, Steady(), settings=QUICK)


def test_the_band_of_a_norton_bar_is_that_of_its_rate(fit):
    """strain = A s^n t: ln strain has the standard deviation of ln rate at that stress, at every time."""
    curves, quantile = fitted_curves(fit), NORMAL_QUANTILE
    for k, stress in enumerate(STRESSES):
        to_log_rate = np.array([1.0, np.log(stress)]) @ fit.coordinates.jacobian(fit.u)  # of (ln A, n) to u
        sd = np.sqrt(to_log_rate @ fit.covariance @ to_log_rate)
        curve, half_width, growth = curves.of(k, "strain")
        strain = curve - fit.tests[k].offset
        np.testing.assert_allclose(growth / strain, 1.0, rtol=1e-6)
        (outline,) = curve_of_test(fit, curves, k, "strain").bands()  # across a straight curve its edges are the same
        moved = np.log(outline[:, 1] / outline[:, 0] / (360000.0 * strain / fit.histories[k].times)[0])
        _, low, high = fit.rate(stress, 1050.0)
        widths = [*(half_width / strain), *np.abs(moved), float(0.5 * np.log(high / low))]
        np.testing.assert_allclose(widths, quantile * sd, rtol=1e-4)


def test_a_test_shows_its_own_rate(fit):
    """Of steady creep it is the slope of its strain, within what the prior of the factor takes off."""
    for k, history in enumerate(fit.histories):
        ((celsius, stress, rate),) = own_rates(fit, k)
        assert (celsius, stress) == (pytest.approx(1050.0 - 273.15), STRESSES[k])
        assert rate == pytest.approx(np.polyfit(history.times, history.outputs["strain"], 1)[0], rel=0.02)


def test_the_joint_covariance_keeps_that_of_the_law_and_completes_it():
    """Against the inverse of the precision, where the law's part is just that inverse."""
    rng = np.random.default_rng(0)
    jacobian = rng.normal(size=(12, 5))
    expected = np.linalg.inv(jacobian.T @ jacobian)
    fit = SimpleNamespace(
        u=np.zeros(3),
        nuisances=(None, None),
        x=np.zeros(5),
        covariance=expected[:3, :3],
        least_squares_problem=SimpleNamespace(jacobian=lambda _: jacobian),
    )
    np.testing.assert_allclose(joint_covariance(fit), expected, rtol=1e-9)
    fit.covariance = 4 * expected[:3, :3]
    np.testing.assert_allclose(joint_covariance(fit)[:3, :3], fit.covariance, rtol=1e-9)


# ---- residual panels -------------------------------------------------------------------------------------------------

# Residuals of reports: the numbers by which a law is judged, an axis that most tests need, and texts that say so.


if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification

SIX_STRESSES = (60.0, 70.0, 80.0, 90.0, 100.0, 110.0)
NOISE = 1e-5
QUICK_40 = IdentificationSettings(starts=2, sobol_points=16, frames=40)


@cache
def fit_with_scatter(rate: float = 0.1) -> Identification:
    tests = planted(
        NORTON, {"A": 1e-19, "n": 5.0}, [(s, 873.15) for s in SIX_STRESSES], seed=3, rate=rate, offset=5e-5, noise=NOISE
    )
    return identify(NORTON, tests, Steady(), settings=QUICK_40)


def test_the_chi_square_of_all_readings_is_that_of_the_verdict() -> None:
    readings, adequacy = judged_readings(fit_with_scatter()), fit_with_scatter().adequacy
    assert readings is not None
    assert adequacy is not None
    assert readings.chi_square() == pytest.approx(adequacy.chi_square, rel=1e-9)
    counts = [int(readings.mask(k).sum()) for k in range(len(SIX_STRESSES))]
    mean = np.average([readings.chi_square(k) for k in range(len(SIX_STRESSES))], weights=counts)
    assert mean == pytest.approx(adequacy.chi_square, rel=1e-9)


def test_the_scatter_between_tests_is_in_the_misfit_of_the_common_rate_alone() -> None:
    """Rates that scatter by 10 % move strains of 0.02 by 0.002, some 200 noises; with own rates noise is left."""
    readings = judged_readings(fit_with_scatter())
    assert readings is not None
    common = [readings.misfit_of_common_rate(k) for k in range(len(SIX_STRESSES))]
    own = [readings.chi_square(k) for k in range(len(SIX_STRESSES))]
    assert np.median(common) > 100.0
    assert 0.3 < np.median(own) < 3.0
    residuals = np.concatenate([readings.residuals(k, "strain")[1] for k in range(len(SIX_STRESSES))])
    assert np.sqrt(np.mean(residuals**2)) == pytest.approx(1.0, abs=0.35)


# ---- ranking plot ----------------------------------------------------------------------------------------------------

# The plot of a ranking: misfits of each law in each test, weights, and the curves of the credible laws.


BY_NOISE = IdentificationSettings(starts=2, sobol_points=16, frames=20, weights="equal")


@pytest.fixture(scope="module")
def fits():
    tests = planted(NORTON, {"A": 1e-16, "n": 5.2}, [(s, 1050.0) for s in np.geomspace(30, 90, 8)], seed=5, noise=1e-5)
    return [identify(law, tests, Steady(), settings=BY_NOISE) for law in (NORTON, HYPERBOLIC_SINE)]


def ranked(fits, *scores):
    return ranking_from_scores(fits, np.array(scores))


def test_of_two_laws_that_cannot_be_told_apart_both_are_drawn_and_named(fits, tmp_path):
    ranking = ranked(fits, 0.0, 1.0)
    figure = ranking.plot(tmp_path / "ranking.png")
    assert figure.get_suptitle().replace("\n", " ").replace("- ", "-") == ranking.verdict.replace("- ", "-")
    (legend,) = figure.subfigs[1].legends
    assert [t.get_text() for t in legend.get_texts()] == [
        "measured",
        *(f"{r.fit.law.name}, weight {r.weight:.3f}" for r in ranking.laws),
    ]
    panels = [axes for axes in figure.subfigs[1].axes if axes.get_visible()]
    assert len(panels) == MOST_TESTS_DRAWN
    assert all(len(axes.lines) == 3 for axes in panels)  # measured, and a curve of each law
    assert (tmp_path / "ranking.png").stat().st_size > 10_000


def test_misfits_are_those_of_which_the_verdict_is_the_mean(fits):
    """All tests have as many readings, so that the reduced chi-square of all is the mean of theirs."""
    ranking = ranked(fits, 0.0, 1.0)
    shown = misfits(ranking)
    np.testing.assert_allclose(shown.mean(axis=1), [r.fit.adequacy.chi_square for r in ranking.laws], rtol=1e-9)
    (image,) = ranking.plot().subfigs[0].axes[0].images
    np.testing.assert_allclose(image.get_array(), shown)
    assert "own rate" in misfit_name(ranking)


# ---- identification plot ---------------------------------------------------------------------------------------------

# The plot of an identification: its panels, labels, bands and legends, for a few tests and for 84.


ACTIVATED = NORTON.times(arrhenius(T_ref=1073.15))
ACTIVATED_TRUTH = {"A": 1e-16, "n": 5.2, "Q": 350e3}


def fitted(conditions):
    tests = planted(ACTIVATED, ACTIVATED_TRUTH, conditions, seed=5, rate=0.2, offset=5e-5, noise=1e-5)
    return identify(ACTIVATED, tests, Steady(), settings=QUICK)


@pytest.fixture(scope="module")
def few():
    return fitted([(s, T) for T in (1000.0, 1050.0, 1100.0) for s in (30.0, 50.0, 80.0)])


@pytest.fixture(scope="module")
def many():
    return fitted([(s, T) for T in np.linspace(1023.15, 1173.15, 6) for s in np.geomspace(40, 200, 14)])


def test_a_few_tests_have_curves_and_rates_with_units(few, tmp_path):
    panels = [axes for axes in few.plot(tmp_path / "fit.png").axes if axes.get_xlabel()]
    assert [axes.get_ylabel() for axes in panels] == ["strain, %", "creep rate, %/h"]
    assert [axes.get_xlabel() for axes in panels] == ["time, h", "von Mises stress, MPa"]


def test_84_tests_have_a_colour_scale_and_fit_on_a_page(many):
    figure = many.plot()
    assert any(axes.get_ylabel() == "temperature, °C" for axes in figure.axes)  # the colour bar
    assert sum(line.get_marker() == "." for axes in figure.axes for line in axes.lines) == 84


# ---- stepped temperature ---------------------------------------------------------------------------------------------

# Figures of a test with a step of temperature beside tests at one: its levels are named, and no mean of them.


STEPPED_LAW = NORTON.times(arrhenius(T_ref=873.15))
STEPPED_TRUTH = {"A": 1e-16, "n": 5.2, "Q": 350e3}
COLD, HOT, HALF = 873.15, 893.15, 3600.0


def rate(stress, kelvin):
    return float(lower(STEPPED_LAW, "numpy").rate(STEPPED_TRUTH, stress=stress, temperature=kelvin))


def stepped_test(stress):
    """Strain grows at the rate at COLD until HALF and then at that at HOT."""
    times = np.linspace(HALF / 20, 2 * HALF, 40)
    strain = rate(stress, COLD) * np.minimum(times, HALF) + rate(stress, HOT) * np.maximum(times - HALF, 0.0)
    program = Program((0.0, HALF, HALF, 2 * HALF), (COLD, COLD, HOT, HOT))
    return History("stepped", times, {"strain": strain}, constant_stress(stress, "stress"), program)


def steady_test(stress, kelvin):
    times = np.linspace(HALF / 20, 2 * HALF, 40)
    name = f"{stress:g} MPa at {kelvin:g} K"
    strain = rate(stress, kelvin) * times
    return History(name, times, {"strain": strain}, constant_stress(stress, "stress"), kelvin)


@pytest.fixture(scope="module")
def stepped_fit():
    tests = [steady_test(s, T) for T in (COLD, HOT) for s in (200.0, 230.0)]
    settings = IdentificationSettings(starts=2, sobol_points=16, frames=20)
    return identify(STEPPED_LAW, [*tests, stepped_test(215.0)], Uniaxial(), settings=settings)


def test_each_hold_of_temperature_has_the_rate_at_that_temperature(stepped_fit):
    shown = own_rates(stepped_fit, 4)
    assert [celsius for celsius, _, _ in shown] == pytest.approx([COLD - 273.15, HOT - 273.15])
    for celsius, stress, own in shown:
        by_law = float(stepped_fit.rate(stress, celsius + 273.15)[0])
        assert (stress, own / by_law) == pytest.approx((215.0, stepped_fit.tests[4].rate_factor))


def test_a_bar_that_is_compressed_and_its_forecast_are_drawn_below_zero():
    """Norton's bar at s, then at -s: strains r t, then r (2 h - t); the origin of time and of strain is on the axes."""
    times = np.linspace(0.0, 3 * 3600.0, 46)[1:]
    tests = [
        History(
            f"bar {s:g}", times, {"strain": 1e-7 * (s / 100.0) ** 5 * np.where(times < 3600, times, 7200 - times)},
            load_steps("stress", [(0.0, s), (3600.0, -s)]), 900.0, standard_deviation={"strain": 1e-6},
        )
        for s in (90.0, 100.0)
    ]  # fmt: skip
    fit = identify(NORTON, tests, Uniaxial(), settings=IdentificationSettings(starts=1, sobol_points=8))
    lowest = 100 * min(h.outputs["strain"].min() for h in tests)
    for figure in (small_multiples(fit, [0, 1]), forecast_figure(forecast(fit, tests))):
        drawn = [axes for axes in figure.axes if axes.get_ylabel().startswith("strain")]
        assert drawn
        assert all(axes.get_yscale() == axes.get_xscale() == "linear" for axes in drawn)
        assert min(axes.get_ylim()[0] for axes in drawn) <= lowest
