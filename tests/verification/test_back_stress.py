"""Bars with a back stress against closed forms, differences, and scipy's integration of the signed equations.

c' = A |s - X|^n sign(s - X),    X' = C c' - gamma X |c'| - r X
"""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import creepkit as ck
from creepkit.errors import ExportError, LawError, SolveError
from creepkit.language import CreepLaw, Param, State, parameters, principal_stress, states, stress
from creepkit.language.law_codec import law_from_json, law_to_json
from creepkit.records import PointLoading
from creepkit.records.loading import constant_load, load_steps

LAW = ck.law("armstrong-frederick")
VALUES = {"A": 2e-13, "n": 4.0, "C": 2e4, "gamma": 300.0, "r": 3e-5}
E = 1.5e5
HOLDS = load_steps("stress", [(0, 120), (4000, 30), (8000, -110), (12000, 100), (16000, 0)], 60.0)
"""Tension, a dip below the back stress, reversals with holds, and a rest in which X falls by recovery alone."""
STRAINS = ck.StrainSteps(((0, 1.5e-3), (4000, -1e-3), (8000, 1.2e-3), (12000, 4e-4)), ramp=100.0)
TIMES = [30.0, 60, 200, 1000, 4000, 4030, 4100, 5000, 8000, 8020, 8060, 9000, 12000, 12500, 16000, 16050, 17000, 30000]
LOADINGS = {"load": HOLDS, "strain": STRAINS}


def tight(specimen, tolerance=1e-10):
    return ck.specimen(specimen).replace(tolerance=tolerance, max_steps=20_000)


def run(values, loading, times, kind="load", law=LAW, tolerance=1e-10):
    specimen, more = ("uniaxial", {}) if kind == "load" else ("relaxation", {"elastic": ck.Elastic(E)})
    return ck.simulate(law, tight(specimen, tolerance), values, loading=loading, times=times, temperature=900.0, **more)


def integrated(values, program, kind):
    """Axial creep strain, X and equivalent creep strain at TIMES, by Radau's method with the signed equations."""
    A, n, C, gamma, r = (values[name] for name in ("A", "n", "C", "gamma", "r"))

    def slope(t, y, begin, end, low, high):
        driving = low + (high - low) * (t - begin) / (end - begin)
        effective = (driving * np.exp(y[0]) if kind == "load" else E * (driving - y[0])) - y[1]
        rate = A * abs(effective) ** n * np.sign(effective)
        return [rate, C * rate - gamma * y[1] * abs(rate) - r * y[1], abs(rate)]

    y, found = np.zeros(3), {}
    options = {"method": "Radau", "rtol": 1e-10, "atol": [1e-15, 1e-9, 1e-15]}
    knots = [*zip(program.times, program.values, strict=True), (TIMES[-1], program.values[-1])]
    for (begin, low), (end, high) in pairwise(knots):
        marks = sorted({t for t in TIMES if begin < t <= end} | {end})
        piece = solve_ivp(slope, (begin, end), y, t_eval=marks, args=(begin, end, low, high), **options)
        found |= dict(zip(piece.t, piece.y.T, strict=True))
        y = piece.y[:, -1]
    return np.array([found[t] for t in TIMES]).T


def test_the_back_stress_of_a_bar_under_tension_and_reversal_is_that_of_armstrong_and_frederick():
    """X = C/gamma (1 - exp(-gamma p)) up to p_1, then C/gamma ((2 - exp(-gamma p_1)) exp(-gamma (p - p_1)) - 1)."""
    values = VALUES | {"r": 0.0}
    steps = ck.StressSteps(((0.0, 150.0), (5000.0, -150.0)), control="stress")
    found = run(values, steps, np.linspace(100.0, 10000.0, 100))
    gamma, limit, path, x = 300.0, values["C"] / 300.0, found.equivalent_strain, found.states["X"]
    pulled = found.times <= 5000.0
    assert x[pulled] == pytest.approx(limit * (1 - np.exp(-gamma * path[pulled])), rel=1e-8)
    p_1 = path[pulled][-1]
    pressed = limit * ((2 - np.exp(-gamma * p_1)) * np.exp(-gamma * (path[~pulled] - p_1)) - 1)
    assert x[~pulled] == pytest.approx(pressed, abs=1e-8 * limit)
    assert found.outputs["strain"][~pulled] == pytest.approx(2 * p_1 - path[~pulled], rel=1e-9)


def test_a_linear_flow_of_a_dashpot_against_a_spring_runs_out_as_an_exponential():
    """n = 1, no recovery: c = s/C (1 - exp(-A C t)), creep that ends and comes back when the load is taken off."""
    values, times = VALUES | {"A": 1e-7, "n": 1.0, "gamma": 0.0, "r": 0.0}, np.array([10.0, 2e3, 2e4, 2.01e4, 4e4])
    found = run(values, ck.StressSteps(((0.0, 100.0), (2e4, 0.0)), control="stress"), times)
    passed, largest = values["A"] * values["C"] * times, 100.0 / values["C"]
    closed = largest * np.where(times <= 2e4, 1 - np.exp(-passed), np.exp(passed[2] - passed))
    assert found.outputs["strain"] == pytest.approx(closed, abs=1e-8 * largest)


@pytest.mark.parametrize("n", [1.0, 4.0, 8.0])
@pytest.mark.parametrize("kind", LOADINGS)
def test_dips_reversals_and_rests_agree_with_scipy(kind, n):
    values = VALUES | {"n": n, "A": VALUES["A"] * 60.0 ** (4.0 - n)}
    found = run(values, LOADINGS[kind], TIMES, kind)
    creep, x, path = integrated(values, LOADINGS[kind].program(), kind)
    assert found.creep_strain == pytest.approx(creep, abs=1e-7 * np.abs(creep).max())
    assert found.equivalent_strain == pytest.approx(path, rel=1e-7)
    assert found.states["X"] == pytest.approx(x, abs=1e-7 * np.abs(x).max())
    coarse = run(values, LOADINGS[kind], TIMES, kind, tolerance=1e-5)
    assert coarse.creep_strain == pytest.approx(creep, abs=1e-3 * np.abs(creep).max())


@pytest.mark.parametrize("kind", LOADINGS)
def test_sensitivities_are_those_of_the_prediction(kind):
    specimen = "uniaxial" if kind == "load" else "relaxation"
    plan = ck.History("bar", np.array(TIMES), {}, LOADINGS[kind], 900.0, specimen, elastic=ck.Elastic(E))
    theta = np.asarray(LAW.to_internal(LAW.values(VALUES))).reshape(1, -1)
    bar = tight(specimen, 1e-11)
    found = bar.predict(LAW, theta, [plan], sensitivities=True).jacobian[0, 0, :, 0]
    for p, step in enumerate(np.diag(1e-3 * np.where(LAW.log_scale, 1.0, np.abs(theta[0])))):
        near = np.concatenate([theta + step, theta - step, theta + 2 * step, theta - 2 * step])
        up, down, further, back = bar.predict(LAW, near, [plan]).values[:, 0, :, 0]
        numeric = (8 * (up - down) - (further - back)) / (12 * step[p])
        assert found[:, p] == pytest.approx(numeric, abs=1e-6 * np.abs(numeric).max())


def measured(seed, levels, law=LAW, values=VALUES):
    """Tests of two stresses, the first of them again at the end, with noise of 0.5 % of the largest strain."""
    rng, tests = np.random.default_rng(seed), []
    for first, second in levels:
        loading = ck.StressSteps(((0.0, first), (6000.0, second), (12000.0, first)), control="stress")
        times = np.concatenate([start + np.geomspace(20.0, 6000.0, 15) for start in (0.0, 6000.0, 12000.0)])
        strain = run(values, loading, times, law=law).outputs["strain"]
        noise = np.full(times.size, 0.005 * np.abs(strain).max())
        strain = {"strain": strain + noise * rng.normal(size=times.size)}
        tests.append(ck.History(f"{first:g}", times, strain, loading, 900.0, standard_deviation={"strain": noise}))
    return tests


def test_planted_values_are_found_from_tests_that_dip_and_reverse_within_their_intervals():
    inside = 0
    for seed in range(3):
        fit = ck.identify(LAW, measured(seed, ((120.0, 40.0), (150.0, -120.0), (100.0, 130.0), (135.0, 20.0))))
        assert fit.adequacy.explains
        assert fit.values["n"] == pytest.approx(VALUES["n"], rel=0.1)
        inside += sum(e.low <= VALUES[e.name] <= e.high for e in fit.estimates)
    assert inside >= 13


A, X = *parameters("A"), *states("X")


def law_of(term, rate, **more):
    coefficient = Param("rate coefficient", bounds=(1e-40, 1e-3), unit="1/s", scale="log")
    return CreepLaw("other", {"flow": term}, {A: coefficient}, states={X: State(0.0, rate, "X", "MPa", **more)})


def test_what_a_back_stress_cannot_be_is_refused_in_a_sentence():
    flow = A * (stress - X)
    with pytest.raises(LawError, match=r"term 'flow': stress stands beside .* takes stress as stress - X alone"):
        law_of(A * stress, flow - X, kind="back stress")
    with pytest.raises(LawError, match=r"rate of state 'X': principal_stress stands beside"):
        law_of(flow, A * principal_stress, kind="back stress")
    with pytest.raises(LawError, match="a back stress has unit"):
        law_of(flow, flow - X, kind="back stress", limit=3.0)
    assert law_of(flow, flow - X, kind="back stress").fingerprint != law_of(flow, flow - X).fingerprint


LOADS = {"bulge": constant_load("pressure", 2.0), "point": PointLoading(stress={"11": 50.0})}
LOADS |= dict.fromkeys(("three-point-bend", "notched-bar"), constant_load("force", 20.0))


@pytest.mark.parametrize("name", LOADS)
def test_other_specimens_refuse_a_back_stress(name):
    more = {"loading": LOADS[name], "times": [10.0, 100.0], "temperature": 900.0, "elastic": ck.Elastic(E)}
    with pytest.raises(SolveError, match="back stress, whose direction bars alone follow: use the specimen uniaxial"):
        ck.simulate(LAW, name, VALUES, **more)


def test_codes_refuse_a_back_stress_and_files_keep_it():
    for target in ("abaqus", "mfront", "c", "javascript", "ansys"):
        with pytest.raises(ExportError, match="has a back stress"):
            ck.export(LAW, target, VALUES)
    assert "along the flow" in ck.export(LAW, "python", VALUES)
    assert law_from_json(law_to_json(LAW)).back_stresses == LAW.back_stresses


def test_a_back_stress_is_proposed_where_bars_turn_or_recover_and_told_from_hardening():
    dips, values = ((120.0, 40.0), (150.0, 50.0), (100.0, 10.0), (135.0, 20.0)), {"A": 1e-17, "n": 4.0, "m": -0.6}
    tests = measured(0, dips)
    assert LAW not in ck.candidates(measured(0, dips, ck.law("strain-hardening"), values))
    assert ck.select(ck.candidates(tests), tests, sums=True).best.law == LAW
