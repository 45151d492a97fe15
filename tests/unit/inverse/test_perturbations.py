"""Unmodelled effects: each against a simulation, or an identification, in which it is there."""

from dataclasses import replace

import numpy as np
import pytest

import creepkit as ck
from creepkit.inverse.identify import identify
from creepkit.inverse.noise_covariance import CovarianceFactor
from creepkit.inverse.noise_model import NoiseModel, OutputNoise
from creepkit.inverse.nuisance_parameters import DRIFT
from creepkit.inverse.perturbations import (
    OFFSET_IN_NOISES,
    USUAL_DRIFT,
    _log_rate_gradient,
    perturbations,
    value_changes,
    with_expected_scatter,
)
from creepkit.inverse.problem import EvaluationCache, LeastSquaresProblem
from creepkit.inverse.search.local_refinement import Tolerances
from creepkit.inverse.settings import USUAL_ERRORS, IdentificationSettings
from creepkit.inverse.uncertainty.quantities import log_rate
from creepkit.language import Elastic, arrhenius
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.records import History, Nuisance, PressureJump, StressSteps, constant_stress
from creepkit.specimens.bulge.specimen import Bulge
from creepkit.specimens.uniaxial import Uniaxial
from helpers.planted_bars import carried_out
from helpers.steady_rate_predictor import Steady, planted
from helpers.two_outputs_predictor import TwoOutputs, with_two_outputs

T_REF, R = 1048.15, 8.314462618
BAR = Uniaxial(tolerance=1e-9)
NOISE = 1e-5
END = 14400.0
TIMES = np.linspace(120.0, END, 60)
NORTON_AT = NORTON.times(arrhenius(T_ref=T_REF))
HARDENING_AT = STRAIN_HARDENING.times(arrhenius(T_ref=T_REF))
VALUES = {
    NORTON_AT.name: {"A": 3e-16, "n": 4.5, "Q": 420e3},
    HARDENING_AT.name: {"A": 1e-15, "n": 4.0, "m": -0.5, "Q": 420e3},
}
SETTINGS = IdentificationSettings(starts=1, sobol_points=8, weights="likelihood", nuisances=())
HELD = constant_stress(90.0, "stress")
STEP = StressSteps(((0.0, 80.0), (7200.0, 105.0)), "stress")


def theta(law):
    return law.to_internal(VALUES[law.name])[0]


def bars(law, loadings=(HELD,), temperature=1040.0, seed=0):
    """Simulated bars with little noise, which is stated."""
    made = [History(f"bar {k}", TIMES, {"strain": 0.0 * TIMES}, one, temperature) for k, one in enumerate(loadings)]
    return carried_out(BAR, law, VALUES[law.name], made, noise=NOISE, seed=seed)


def at_the_truth(law, tests, predictor=BAR, settings=SETTINGS):
    problem = LeastSquaresProblem.from_histories(law, tests, predictor, settings)
    x = problem.coordinates.u(theta(law))
    return problem, x, problem.linearised(x)


def effects_of(law, tests, predictor=BAR, settings=SETTINGS):
    problem, _, linear = at_the_truth(law, tests, predictor, settings)
    noise = NoiseModel({name: OutputNoise(sd) for name, sd in zip(problem.observations.outputs, [NOISE], strict=True)})
    effects = perturbations(problem, linear, noise, tests)
    return {e.kind: e for e in effects if not e.common}, problem, linear


# ---- drifts of the furnace ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("law", [NORTON_AT, HARDENING_AT], ids=["Norton", "strain hardening"])
@pytest.mark.parametrize("loading", [HELD, STEP], ids=["constant", "step"])
def test_the_clock_argument_is_a_simulation_with_a_program_of_temperature(law, loading):
    """A hundredth of the drift, simulated, times a hundred: a few per cent of the largest effect."""
    tests = bars(law, [loading])
    effects, problem, linear = effects_of(law, tests)
    up, down = (
        BAR.predict(law, theta(law)[None], tests, nuisances={DRIFT: np.array([[sign * 0.05]])}).values[0, 0, :, 0]
        for sign in (1.0, -1.0)
    )
    expected = (up - down) / 0.1 * USUAL_DRIFT
    found = effects[DRIFT].residual_change[0] / linear.residuals.offset_sensitivity[0]
    count = int(problem.observations.present[0].sum())
    expected_there = np.interp(problem.observations.times[0, :count], TIMES, expected)
    np.testing.assert_allclose(found[:count], expected_there, atol=0.04 * expected.max())
    assert expected.max() > 20 * NOISE


@pytest.mark.parametrize("law", [NORTON_AT, HARDENING_AT], ids=["Norton", "strain hardening"])
@pytest.mark.parametrize("noise", [1e-5, 1e-8])
def test_independent_drifts_move_the_rate_by_no_more_than_their_own_mean(law, noise):
    """However small the noise: a drift of 5 K heats a test by 2.5 K in the mean, and three tests average."""
    tests = bars(law, [constant_stress(s, "stress") for s in (70.0, 90.0, 110.0)])
    problem, _, linear = at_the_truth(law, tests)
    found = perturbations(problem, linear, NoiseModel({"strain": OutputNoise(noise)}), tests)
    drift = next(e for e in found if e.kind == DRIFT)
    assert 0.3 < drift.rate_change / (0.5 * USUAL_DRIFT * drift.per_kelvin / np.sqrt(3.0)) < 1.0


def test_a_drift_of_one_test_alone_is_no_cause_and_one_of_several_is_given_in_rate():
    """Rates that drift by 10, -8 and 6 % over tests at one temperature: kelvins are those of an assumed energy."""
    tests = bars(NORTON_AT, [constant_stress(s, "stress") for s in (70.0, 90.0, 110.0)])
    ahead = [1 + 0.5 * drift * TIMES / END for drift in (0.1, -0.08, 0.06)]
    drifted = [one.replace(outputs={"strain": one.outputs["strain"] * a}) for one, a in zip(tests, ahead, strict=True)]
    three, alone = (identify(NORTON, one, BAR, settings=SETTINGS).adequacy for one in (drifted, drifted[2:]))
    assert "(10 % of the rate, by an assumed activation energy)" in three.remedies[0].description
    assert (alone.rejects, [one for one in alone.remedies if one.kind == DRIFT]) == (True, [])


# ---- what an effect does to the rate ------------------------------------------------------------------------------


def test_the_change_of_the_rate_is_that_of_an_identification_with_the_offset():
    """Noise-free tests, identified as they are and with the offset in one of them; three tests in quadrature."""
    noise, values = 2e-5, {"A": 1e-15, "n": 4.0}
    clean = planted(NORTON, values, [(s, 1000.0) for s in (60.0, 70.0, 80.0)], seed=0)
    tests = [h.replace(standard_deviation={"strain": np.full(h.times.size, noise)}) for h in clean]
    fit = identify(NORTON, tests, Steady(), settings=SETTINGS)
    effect = next(e for e in fit.unmodelled if e.kind == "offset of strain")
    assert effect.size == pytest.approx(OFFSET_IN_NOISES * noise)
    rate, changes = fit.rate(fit.reference.stress)[0], []
    for k in range(3):
        shifted = [h.replace(outputs={"strain": h.outputs["strain"] + effect.size * (k == j)})
                   for j, h in enumerate(tests)]  # fmt: skip
        problem = fit.least_squares_problem
        moved = LeastSquaresProblem.from_histories(NORTON, shifted, Steady(), SETTINGS, fit.reference)
        end = replace(moved, covariance_factor=problem.covariance_factor).minimise(fit.x).x
        changes.append(np.log(replace(fit, u=end).rate(fit.reference.stress)[0] / rate))
    assert effect.rate_change == pytest.approx(np.sqrt(np.sum(np.square(changes))), rel=0.05)


def unequal_tests():
    """Five tests at equal ratios of stress, of which the middle one has a hundredth of the noise of the others."""
    stresses, noises = 60.0 * 1.1 ** np.arange(5.0), (1e-4, 1e-4, 1e-6, 1e-4, 1e-4)
    made = planted(NORTON, {"A": 1e-15, "n": 4.0}, [(float(s), 1000.0) for s in stresses], seed=0)
    rng = np.random.default_rng(3)
    return [
        h.replace(outputs={"strain": h.outputs["strain"] + sd * rng.normal(size=h.times.size)},
                  standard_deviation={"strain": np.full(h.times.size, sd)})
        for h, sd in zip(made, noises, strict=True)
    ]  # fmt: skip


def test_independent_errors_of_rates_average_out_as_in_least_squares_of_equal_weight():
    """Errors of ln rate of 0.05 amid five tests whose rates do not scatter: 0.05 / sqrt 5 at their mean ln stress.

    They are estimated as scatter of rates once they are there; the most precise test no longer decides alone. The same
    is found where the tests are identified with such errors, all combinations of signs of a two-level design.
    """
    tests, error = unequal_tests(), 0.05
    settings = replace(SETTINGS, nuisances=(Nuisance("rate"),))
    fit = identify(NORTON, tests, Steady(), settings=settings)
    assert fit.noise_model.rate < 1e-3
    problem, linear = fit.least_squares_problem, fit.linearised
    change = error * linear.residuals.log_rate_sensitivity
    noise = with_expected_scatter(problem, linear, fit.noise_model)
    to_rate = _log_rate_gradient(problem, fit.x)
    found = np.linalg.norm(value_changes(linear, noise, change) @ to_rate)
    assert found == pytest.approx(error / np.sqrt(5.0), rel=0.01)
    fixed = np.linalg.norm(value_changes(linear, fit.noise_model, change) @ to_rate)
    assert fixed > 1.4 * found
    signs = np.array([(a, b, c, a * b, a * c) for a in (1, -1) for b in (1, -1) for c in (1, -1)], float)
    stress = fit.reference.stress
    moved = []
    for row in signs:  # a test that creeps faster by a factor reaches each strain earlier by it
        faster = [h.replace(times=h.times * np.exp(-error * sign)) for h, sign in zip(tests, row, strict=True)]
        again = identify(NORTON, faster, Steady(), settings=settings)
        moved.append(np.log(again.rate(stress)[0] / fit.rate(stress)[0]))
    assert np.sqrt(np.mean(np.square(moved))) == pytest.approx(found, rel=0.25)


def test_values_of_frames_of_equal_weight_move_as_these_are_weighted():
    """weights="equal", against identifications with the offset in one test after the other; few frames weigh little."""
    tests = [
        planted(NORTON, {"A": 1e-15, "n": 4.0}, [(s, 1000.0)], seed=k, rate=0.2, noise=2e-5, frames=frames)[0]
        for k, (s, frames) in enumerate([(60.0, 120), (64.0, 12), (68.0, 120), (72.0, 12)])
    ]
    settings = replace(SETTINGS, weights="equal", nuisances=(Nuisance("rate"),))
    fit = identify(NORTON, tests, Steady(), settings=settings)
    effect = next(e for e in fit.unmodelled if e.kind == "offset of strain")
    stress, changes = fit.reference.stress, []
    for k in range(len(tests)):
        shifted = [h.replace(outputs={"strain": h.outputs["strain"] + effect.size * (k == j)})
                   for j, h in enumerate(tests)]  # fmt: skip
        again = identify(NORTON, shifted, Steady(), settings=settings)
        changes.append(np.log(again.rate(stress)[0] / fit.rate(stress)[0]))
    assert effect.rate_change == pytest.approx(np.linalg.norm(changes), rel=0.1)


# ---- lengths of the test piece ------------------------------------------------------------------------------------


def test_the_effect_of_thickness_is_that_of_other_simulations():
    """A dimple of half the mesh over 3 h, simulated 2 % thicker and thinner."""
    law, dimple = NORTON_AT, Bulge(refinement=0.5)
    blank = History("D1", np.linspace(900.0, 10800.0, 8), {}, PressureJump(8.0, 8.0, 9000.0), 1040.0, "bulge",
                    elastic=Elastic(100e3))  # fmt: skip
    run = dimple.predict(law, theta(law)[None], [blank])
    sd = {"amplitude": np.full(8, 1.5e-3)}
    test = blank.replace(outputs={"amplitude": run.of(0)[:, run.outputs.index("amplitude")]}, standard_deviation=sd)
    problem, _, linear = at_the_truth(law, [test], dimple)
    noise = NoiseModel({"amplitude": OutputNoise(1.5e-3)})
    effects = {e.kind: e for e in perturbations(problem, linear, noise, [test]) if not e.common}
    nominal = dimple.geometry.apex_thickness
    up, down = (
        dimple.replace(apex_thickness=nominal * factor).predict(law, theta(law)[None], [test])
        for factor in (1.02, 0.98)
    )
    expected = 0.5 * (up.of(0) - down.of(0))[:, up.outputs.index("amplitude")]
    found = (effects["thickness"].residual_change / linear.residuals.offset_sensitivity)[0]
    assert effects["thickness"].size == pytest.approx(0.02 * nominal)
    np.testing.assert_allclose(found, expected, atol=0.03 * np.abs(expected).max())


# ---- random effects and sentences ---------------------------------------------------------------------------------


def test_an_effect_in_the_covariance_is_a_rank_of_one_in_each_test():
    tests = bars(NORTON_AT, [constant_stress(s, "stress") for s in (70.0, 90.0)])
    effects, _, linear = effects_of(NORTON_AT, tests)
    noise = NoiseModel({"strain": OutputNoise(NOISE)})
    with_both = linear.with_effects(effects.values())
    columns = np.stack([e.residual_change for e in effects.values()], axis=-1)
    expected = CovarianceFactor.of_residuals(linear.residuals, noise).blocks + columns @ np.swapaxes(columns, 1, 2)
    found = CovarianceFactor.of_residuals(with_both.residuals, noise).inverse_times(expected)
    np.testing.assert_allclose(found, np.broadcast_to(np.eye(len(expected[0])), found.shape), atol=1e-5)
    again = with_both.with_effects([effects[DRIFT]])
    assert again.residuals.random_effect_sensitivities.shape[-1] == 3


# ---- nuisance plausibility -------------------------------------------------------------------------------------------

# Nuisances of implausible size: a planted jump of an output and a planted temperature weaken what is said of a law.


STRAIN_NOISE = {"amplitude": 2e-3, "width": 2e-2}


def fitted(jump, *nuisances, law=NORTON):
    """One law on three tests, of which the second has jumped by so many mm of amplitude at the start."""
    bars = planted(NORTON, {"A": 1e-15, "n": 4.0}, [(s, 1000.0) for s in (50.0, 70.0, 100.0)], seed=0, frames=40)
    tests = with_two_outputs(bars, STRAIN_NOISE, seed=1)
    moved = {**tests[1].outputs, "amplitude": tests[1].outputs["amplitude"] + jump}
    tests[1] = tests[1].replace(outputs=moved)
    settings = IdentificationSettings(
        starts=1, sobol_points=8, frames=60, weights="likelihood", nuisances=nuisances or (Nuisance("offset"),)
    )
    return identify(law, tests, TwoOutputs(), settings=settings), tests[1]


def test_a_law_that_needs_a_large_offset_explains_only_with_it():
    fit, test = fitted(0.3)
    share = 0.3 / test.outputs["amplitude"].max()
    assert share > 0.1  # else nothing is planted
    adequacy = fit.adequacy
    assert adequacy.explains
    assert not adequacy.explains_plausibly
    (named,) = adequacy.implausible
    assert (named.kind, named.owner, named.output, named.unit) == ("offset", test.name, "amplitude", "mm")
    assert named.value == pytest.approx(0.3, rel=0.03)
    assert named.standard_deviations == pytest.approx(0.3 / 2e-3, rel=0.03)
    assert named.share == pytest.approx(share, rel=0.03)
    assert f"only with an offset of 0.3 mm in amplitude of '{test.name}', {100 * share:.2g} %" in str(adequacy)
    (note,) = (n for n in fit.remarks if "offset of amplitude" in n and "the noise of a frame (0.002 mm)" in n)
    assert f"{named.standard_deviations:.2g} times" in note


@pytest.mark.parametrize("jump", [0.0, 0.008])
def test_a_small_offset_is_not_named(jump):
    adequacy = fitted(jump)[0].adequacy
    assert adequacy.explains_plausibly
    assert "only with" not in str(adequacy)


# ---- imposed motion errors -------------------------------------------------------------------------------------------

# Errors of the modulus and of held strains common to all relaxation tests, against identifications that have them.


E, A, N = 150e3, 2e-8 / 200.0**6, 6.0


def _relaxation(stiffness: float = E) -> list[ck.History]:
    """Of Norton's law from E strain on, ds/dt = -E A s^n in closed form; files that state another modulus."""
    times, rng, tests = np.geomspace(30.0, 1.4e5, 30), np.random.default_rng(5), []
    for k, strain in enumerate((0.0015, 0.0018, 0.0020)):
        first = E * np.log1p(strain)
        stress = (first ** (1 - N) + (N - 1) * E * A * times) ** (1 / (1 - N)) + 0.4 * rng.standard_normal(30)
        loading = ck.constant_strain(strain)
        elastic = ck.Elastic(E=stiffness)
        tests.append(ck.History(f"R{k}", times, {"stress": stress}, loading, 1073.15, "relaxation", elastic=elastic))
    return tests


def test_the_rate_moves_as_that_of_tests_with_these_errors():
    """Under a covariance that stays, by errors so small that their effect is linear."""
    share, how, ends = 0.001, {"weights": "likelihood", "nuisances": (), "starts": 1}, Tolerances(100, 1e-12)
    fit = ck.identify("norton", _relaxation(), usual_errors="none", **how)
    stiffer = _relaxation(E * (1 + share * USUAL_ERRORS["modulus"]))
    factor = 1 + share * USUAL_ERRORS["motion"]
    strained = [replace(h, loading=ck.constant_strain(h.loading.program().values[-1] * factor)) for h in _relaxation()]
    problem, rate = fit.least_squares_problem, log_rate(fit.coordinates, fit.reference.stress)
    for kind, altered in (("modulus", stiffer), ("motion", strained)):
        found = [
            replace(problem, histories=tuple(h), evaluations=EvaluationCache()) for h in (altered, problem.histories)
        ]
        with_error, without = (rate(one.minimise(fit.x, tolerances=ends).x) for one in found)
        included = ck.identify("norton", _relaxation(), usual_errors={kind: share * USUAL_ERRORS[kind]}, **how)
        assert included.error_sd(rate) == pytest.approx(abs(with_error - without), rel=0.02)


def test_a_nuisance_parameter_of_all_tests_stands_for_the_modulus():
    fit = ck.identify("norton", _relaxation(), starts=1, nuisances=[ck.Nuisance("modulus", scope="all", sd=0.02)])
    kinds = {e.kind for e in fit.unmodelled if e.common}
    assert "modulus" not in kinds
    assert "imposed strain" in kinds
