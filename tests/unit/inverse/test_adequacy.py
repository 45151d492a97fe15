"""Adequacy against textbooks: chi-square and F, false alarms of simulated residuals, planted discrepancies found."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from creepkit.inverse.identify import identify
from creepkit.inverse.judging import Judge
from creepkit.inverse.known_noise import FREEDOM_PER_FRAME
from creepkit.inverse.noise_model import NoiseModel, OutputNoise
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.reference_conditions import frame_noise
from creepkit.inverse.residuals import orthogonal_distance
from creepkit.inverse.settings import IdentificationSettings
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from helpers.steady_rate_predictor import planted
from helpers.two_outputs_predictor import TwoOutputs, with_two_outputs

VALUES = {"A": 1e-15, "n": 4.0}
CONDITIONS = [(s, 1000.0) for s in (50.0, 70.0, 100.0)]
NOISE = {"amplitude": 2e-3, "width": 2e-2}
PREDICTOR = TwoOutputs()
SETTINGS = IdentificationSettings(starts=1, sobol_points=8, frames=60, weights="likelihood", nuisances=())


def gauged(seed, *, law=NORTON, values=VALUES, stated=True, frames=40):
    bars = planted(law, values, CONDITIONS, seed=0, frames=frames)
    return with_two_outputs(bars, NOISE, seed=seed, stated=stated)


def at_the_truth(tests):
    """The problem of Norton's law, and its linear form at the planted values."""
    problem = LeastSquaresProblem.from_histories(NORTON, tests, PREDICTOR, SETTINGS)
    u = problem.coordinates.u(NORTON.to_internal(VALUES)[0])
    return problem, problem.linearised(u)


def judged(tests, problem, linear, values=None, **noise_model):
    if values is not None:
        linear = replace(linear, residuals=replace(linear.residuals, values=values))
    return Judge(problem, white(**noise_model), {}, tests).adequacy(linear)


def white(**more):
    return NoiseModel({name: OutputNoise(sd) for name, sd in NOISE.items()}, **more)


@pytest.fixture(scope="module")
def stated():
    tests = gauged(1)
    return tests, *at_the_truth(tests)


def white_draws(problem, linear, count, seed):
    """Residuals of white noise of the stated size, (count, tests, observations)."""
    sd = linear.residuals.offset_sensitivity * problem.observations.per_observation([*NOISE.values()])
    return sd * np.random.default_rng(seed).normal(size=(count, *sd.shape))


# ---- probabilities -----------------------------------------------------------------------------------------------


def test_chi_square_is_the_residual_sum_of_squares_over_its_degrees(stated):
    """Weighted least squares by numpy: RSS over n - p, and its tail."""
    _, problem, linear = stated
    found = judged(*stated)
    sd = linear.residuals.offset_sensitivity * problem.observations.per_observation([*NOISE.values()])
    y, design = (linear.residuals.values / sd).ravel(), (linear.residuals.jacobian / sd[..., None]).reshape(-1, 2)
    left = y - design @ np.linalg.lstsq(design, y, rcond=None)[0]
    freedom = y.size - 2
    assert found.freedom == pytest.approx(freedom, rel=1e-4)
    assert found.chi_square == pytest.approx((left**2).sum() / freedom, rel=1e-4)
    pooled = chi2.sf((left**2).sum(), freedom)
    assert found.p_value == pytest.approx(min(1.0, 3 * min(pooled, *(o.p_value for o in found.outputs))), rel=1e-3)
    assert [o.frames for o in found.outputs] == [120, 120]
    assert [o.noise for o in found.outputs] == pytest.approx([*NOISE.values()])
    assert found.explains
    assert np.isnan(found.correlation)


def test_false_alarms_of_a_true_law_are_one_in_a_hundred(stated):
    """Three correlated p-values, each at a third of 1 %: at most 6 of 600 draws, and 8 more for three sigma."""
    tests, problem, linear = stated
    alarms = sum(not judged(tests, problem, linear, values).explains for values in white_draws(problem, linear, 600, 2))
    assert alarms <= 14


def test_false_alarms_of_a_true_law_are_as_few_where_its_outputs_share_the_rate_of_a_test(stated):
    tests, problem, linear = stated
    scatter, rng = 0.3, np.random.default_rng(4)
    rates = scatter * rng.standard_normal((300, len(tests), 1)) * linear.residuals.log_rate_sensitivity
    found = [judged(tests, problem, linear, v, rate=scatter) for v in white_draws(problem, linear, 300, 5) + rates]
    assert sum(not one.explains for one in found) <= 5  # 0.9 expected
    reduced = np.array([[o.chi_square for o in one.outputs] for one in found])
    assert reduced.std(axis=0) == pytest.approx((2.0 / 118.0) ** 0.5, rel=0.15)  # chi-square of 120 less two values


def test_false_alarms_with_noise_estimated_from_neighbours_are_few():
    """Three whole tests drawn 100 times without stated noise: 1 % is 1, and four sigma more 5."""
    alarms = 0
    for seed in range(100):
        tests = gauged(100 + seed, stated=False)
        found = judged(tests, *at_the_truth(tests))
        assert found.outputs[0].noise_source == "estimated"
        alarms += not found.explains
    assert alarms <= 5


def test_a_frame_gives_a_fifth_of_a_degree_of_freedom_to_its_noise():
    """The variance of 1000 estimates over their squared mean is 2 over their degrees of freedom."""
    rng, times = np.random.default_rng(10), np.linspace(0.02, 1.0, 48)
    bar = planted(NORTON, VALUES, CONDITIONS[:1], seed=0, frames=48)[0].replace(times=times)
    drawn = [bar.replace(outputs={"strain": times + rng.normal(size=48)}) for _ in range(1000)]
    variances = np.array([frame_noise(one, "strain") for one in drawn]) ** 2
    freedom = 2.0 * (variances.mean() / variances.std()) ** 2
    assert pytest.approx(freedom / 48, abs=0.03) == FREEDOM_PER_FRAME


# ---- discrepancies -----------------------------------------------------------------------------------------------


def test_a_planted_discrepancy_is_measured_in_its_unit(stated):
    """A bump of the amplitude of one test: its rms beside all other frames, in mm and in noises."""
    tests, problem, linear = stated
    mask = problem.observations.output_index == 0
    times = problem.observations.times
    share = times / times.max(axis=1, keepdims=True)
    bump = np.where(mask, 8e-3 * np.exp(-((share - 0.3) ** 2) / 0.02), 0.0)
    bump[[0, 2]] = 0.0
    values = white_draws(problem, linear, 1, 4)[0] + bump * linear.residuals.offset_sensitivity
    found = judged(tests, problem, linear, values)
    assert found.verdict == "leaves a discrepancy"
    amplitude = found["amplitude"]
    rms = np.sqrt((bump[mask] ** 2).mean())
    assert amplitude.discrepancy == pytest.approx(rms, rel=0.25)
    assert amplitude.discrepancy_in_noises == pytest.approx(amplitude.discrepancy / 2e-3)
    assert found.discrepancy_in_noises == amplitude.discrepancy_in_noises
    assert found["width"].discrepancy == 0.0
    assert (found.largest.test, found.largest.output) == (tests[1].name, "amplitude")
    assert found.largest.time == pytest.approx(times[1, np.abs(bump[1]).argmax()], rel=0.5)
    assert found.largest.deviation == pytest.approx(bump.max(), rel=0.4)
    assert found.largest.noises == pytest.approx(found.largest.deviation / 2e-3)


def test_what_the_values_can_follow_is_no_discrepancy(stated):
    """A move along the Jacobian, of many noises, is taken up by the values."""
    tests, problem, linear = stated
    values = white_draws(problem, linear, 1, 5)[0]
    moved = values + linear.residuals.jacobian @ np.array([0.05, -0.1])
    assert judged(tests, problem, linear, moved).chi_square == pytest.approx(
        judged(tests, problem, linear, values).chi_square, rel=1e-4
    )


def test_the_noise_that_was_estimated_from_the_misfit_does_not_count(stated):
    """Thirty times the noise, a drift and a discrepancy in the noise model excuse nothing; scatter of rates does."""
    tests, problem, linear = stated
    slope = linear.residuals.log_rate_sensitivity
    values = white_draws(problem, linear, 1, 6)[0] + 0.2 * np.array([[1.0], [-1.0], [0.5]]) * slope
    plain = judged(tests, problem, linear, values)
    assert not plain.explains
    excused = NoiseModel(
        {name: OutputNoise(30 * sd, drift=1.0, misfit=1.0) for name, sd in NOISE.items()}, discrepancy=40.0
    )
    same = Judge(problem, excused, {}, tests).adequacy(
        replace(linear, residuals=replace(linear.residuals, values=values))
    )
    assert (same.chi_square, same.p_value) == (plain.chi_square, plain.p_value)
    assert same.correlation == pytest.approx(1.0 / 5.0)
    assert judged(tests, problem, linear, values, rate=0.2).explains


def test_a_stated_error_of_the_predictor_is_no_discrepancy(stated):
    """A smooth error of four noises, which the predictor admits."""
    tests, problem, linear = stated
    share = problem.observations.times / problem.observations.times.max(axis=1, keepdims=True)
    wrong = np.where(problem.observations.output_index == 0, 8e-3 * np.sin(4 * share), 0.0)
    values = white_draws(problem, linear, 1, 7)[0] + wrong * linear.residuals.offset_sensitivity
    assert not judged(tests, problem, linear, values).explains
    moved = replace(linear, residuals=replace(linear.residuals, values=values))
    assert Judge(problem, white(), {"amplitude": 8e-3}, tests).adequacy(moved).explains


def test_a_law_outside_the_truth_is_flagged_and_the_true_one_is_not():
    """A sinh whose exponent goes from 3 to 7 over the tests, fitted with Norton's law and with itself."""
    values = {"A": 1e-7, "n": 3.0, "B": 40.0}
    tests = gauged(8, law=HYPERBOLIC_SINE, values=values)
    right, wrong = (identify(law, tests, PREDICTOR, settings=SETTINGS).adequacy for law in (HYPERBOLIC_SINE, NORTON))
    assert right.explains
    assert wrong.verdict == "leaves a discrepancy"
    assert wrong.discrepancy_in_noises > 3.0


def test_without_any_noise_nothing_can_be_judged():
    tests = gauged(9, stated=False, frames=5)
    found = judged(tests, *at_the_truth(tests))
    assert found.verdict == "cannot be judged"
    assert not found.explains
    assert np.isnan(found.p_value)
    assert np.isnan(found.discrepancy_in_noises)
    assert "in Python as standard_deviation" in str(found)
    assert f"too few readings of '{tests[0].name}' (5)" in str(found)
    assert "fewer than 30 readings of a test cannot judge" in str(found)


# ---- residuals -------------------------------------------------------------------------------------------------------

# The distance of a point from a curve in the plane of ln time and ln strain.


@pytest.mark.parametrize("slope", [0.1, 1.0, 30.0])
def test_a_straight_line(slope):
    """A line of this slope passes at |a b|/sqrt(a^2 + b^2); steady creep counts its ln strain."""
    for b in (-2.0, -1e-12, 1e-3, 0.5):
        a = slope * b
        found = orthogonal_distance(np.array(a), np.array(b), np.array(slope))
        assert found.values == pytest.approx(np.sqrt(2) * a / np.hypot(1, slope), rel=1e-12)
        moved = slope * found.strain_derivative + found.time_derivative  # the line shifts in time: db = 1, da = slope
        assert moved == pytest.approx(np.sqrt(2) * slope / np.hypot(1, slope), rel=1e-9)


def test_after_rupture_time_alone_counts_and_before_arrival_strain_alone():
    root, inf = np.sqrt(2), np.inf
    for (a, b, slope), expected in (((inf, 0.7, inf), (0.7, 0, 1)), ((-0.7, -inf, np.nan), (-0.7, 1, 0))):
        found = orthogonal_distance(np.array(a), np.array(b), np.array(slope))
        numbers = (found.values, found.strain_derivative, found.time_derivative)
        assert numbers == pytest.approx(tuple(root * one for one in expected))
