"""Bars in tension and compression against closed forms, differences, and scipy's integration of the same equations."""

from itertools import pairwise

import numpy as np
import pytest
import sympy
from scipy.integrate import solve_ivp

import creepkit as ck
from creepkit.language import CreepLaw, Param, mean_stress, principal_stress, stress
from creepkit.language.symbols import POINT_VARIABLES
from creepkit.records import Program, RecordedLoading, Status
from creepkit.studies.proposal import DataSummary
from helpers.kachanov_law import A, kachanov, n

NORTON = {"A": 1e-14, "n": 4.0}
E = 1.5e5
CASES = {
    "norton": (ck.law("norton"), NORTON),
    "strain hardening": (ck.law("strain-hardening"), {"A": 1e-17, "n": 4.0, "m": -0.6}),
    "sinh": (ck.law("hyperbolic-sine"), {"A": 1e-7, "n": 2.0, "B": 50.0}),
    "damage": (kachanov(stress, limit=0.9), {"A": 1e-14, "n": 4.0, "C": 1e-13, "v": 4.0}),
}
CYCLES = RecordedLoading(
    Program(
        np.array([0.0, 100, 1000, 1200, 2000, 2200, 3000, 3100, 4000]),
        np.array([0.0, 100, 100, -110, -110, 90, 90, 0, 0]),
    ),
    "stress",
    "load",
)
"""Ramps through zero between holds in tension and compression, and a rest."""
STRAIN_CYCLES = ck.StrainSteps(((0, 1e-3), (1000, -1e-3), (2000, 1.2e-3), (3000.0, 0.0)), ramp=200.0)
TIMES = [50.0, 500, 1000, 1090, 1500, 2000, 2150, 2500, 3000, 3050, 4000]


def tight(specimen, tolerance=1e-10):
    return ck.specimen(specimen).replace(tolerance=tolerance)


def run(law, values, loading, times, specimen="uniaxial", **more):
    return ck.simulate(law, tight(specimen), values, loading=loading, times=times, temperature=1000.0, **more)


def test_what_creeps_at_a_stress_creeps_back_at_its_opposite_and_the_equivalent_strain_doubles():
    there_and_back = ck.StressSteps(((0.0, 100.0), (1000.0, -100.0)), control="stress")
    found = run("norton", NORTON, there_and_back, [500.0, 1000, 1500, 2000])
    crept = NORTON["A"] * 100.0 ** NORTON["n"] * 1000.0
    assert found.outputs["strain"] == pytest.approx(crept * np.array([0.5, 1, 0.5, 0]), abs=1e-12 * crept)
    assert found.equivalent_strain == pytest.approx(crept * np.array([0.5, 1, 1.5, 2]), rel=1e-12)


def test_a_load_that_is_reversed_undoes_what_it_did_to_the_section():
    """c' = r exp(n c) in tension and -r exp(n c) in compression: exp(-n c) falls and rises by n r t."""
    rate, end = NORTON["A"] * 100.0 ** NORTON["n"], 1e5
    found = run("norton", NORTON, ck.StressSteps(((0.0, 100.0), (end, -100.0))), [end, 1.5 * end, 3 * end])
    closed = [-np.log(1 - 4 * rate * lasted) / 4 for lasted in (end, 0.5 * end, -end)]
    assert found.outputs["strain"] == pytest.approx(closed, rel=1e-7)


def test_compression_alone_thickens_a_bar():
    rate = NORTON["A"] * 100.0 ** NORTON["n"]
    found = run("norton", NORTON, ck.constant_stress(-100.0), [1e5, 1e6])
    closed = [-np.log(1 + 4 * rate * t) / 4 for t in (1e5, 1e6)]
    assert found.outputs["strain"] == pytest.approx(closed, rel=1e-7)


@pytest.mark.parametrize("name", CASES)
def test_relaxation_from_compression_mirrors_that_from_tension(name):
    law, values = CASES[name]
    pulled, pressed = (
        run(law, values, ck.constant_strain(e), TIMES, "relaxation", elastic=ck.Elastic(E)) for e in (1e-3, -1e-3)
    )
    np.testing.assert_array_equal(pulled.outputs["stress"], -pressed.outputs["stress"])
    np.testing.assert_array_equal(pulled.equivalent_strain, pressed.equivalent_strain)


def test_strain_hardening_goes_on_under_reversal():
    law, v = CASES["strain hardening"]
    found = run(law, v, ck.StressSteps(((0.0, 100.0), (1000.0, -100.0)), control="stress"), [1000.0, 2000, 4000])
    path = ((1 - v["m"]) * v["A"] * 100.0 ** v["n"] * found.times) ** (1 / (1 - v["m"]))
    assert found.equivalent_strain == pytest.approx(path, rel=1e-8)
    assert found.outputs["strain"] == pytest.approx(2 * path[0] - path, rel=1e-7)


def test_compression_has_no_largest_principal_stress_and_a_mean_stress_below_zero():
    rate = A * (stress + 0.25 * principal_stress + 0.3 * mean_stress) ** n
    coefficient = Param("rate coefficient", bounds=(1e-40, 1e-3), unit="1/s", scale="log")
    law = CreepLaw("signs", {"term": rate}, {A: coefficient, n: Param("exponent", bounds=(1, 8))})
    steps = ck.StressSteps(((0.0, 100.0), (1000.0, -100.0)), control="stress")
    found = run(law, NORTON, steps, [1000.0, 2000])
    pulled, pressed = (NORTON["A"] * (100.0 * factor) ** 4 * 1000.0 for factor in (1.35, 0.9))
    assert found.outputs["strain"] == pytest.approx([pulled, pulled - pressed], rel=1e-9)


@pytest.mark.parametrize("name", ["norton", "strain hardening", "sinh", "damage"])
@pytest.mark.parametrize("kind", ["load", "strain"])
def test_cycles_with_holds_agree_with_scipy(name, kind):
    law, values = CASES[name]
    loading = CYCLES if kind == "load" else STRAIN_CYCLES
    specimen, more = ("uniaxial", {}) if kind == "load" else ("relaxation", {"elastic": ck.Elastic(E)})
    found = run(law, values, loading, TIMES, specimen, **more)
    assert found.status is Status.COMPLETE
    creep, path, inner = integrated(law, values, loading.program(), kind)
    if kind == "load":
        assert found.outputs["strain"] == pytest.approx(creep, abs=1e-7 * np.abs(creep).max())
    else:
        sizes = E * (loading.program().at(TIMES) - creep)
        assert found.outputs["stress"] == pytest.approx(sizes, abs=1e-7 * np.abs(sizes).max())
    assert found.equivalent_strain == pytest.approx(path, rel=1e-7)
    for j, state in enumerate(found.states.values()):
        assert state == pytest.approx(inner[j], rel=1e-7)


def integrated(law, values, program, kind):
    """Axial and equivalent creep strain and states at TIMES, each straight piece by Radau's method."""
    inner = [*law.states]
    replaced = {symbol: values[symbol.name] for symbol in law.params}
    rates = [sum(law.terms.values()), *(state.rate for state in law.states.values())]
    evaluate = sympy.lambdify([*POINT_VARIABLES, *inner], [sympy.sympify(e).subs(replaced) for e in rates])

    def slope(t, y, begin, end, low, high):
        driving = low + (high - low) * (t - begin) / (end - begin)
        sigma = driving * np.exp(y[0]) if kind == "load" else E * (driving - y[0])
        size = abs(sigma)
        rate, *growth = evaluate(size, max(y[1], 1e-30), t, 1000.0, max(sigma, 0.0), sigma / 3, *y[2:])
        return [np.sign(sigma) * rate, rate, *growth]

    y, found = np.array([0.0, 1e-16, *(s.initial for s in law.states.values())]), {}
    knots = [*zip(program.times, program.values, strict=True), (max(TIMES) + 1.0, program.values[-1])]
    for (begin, low), (end, high) in pairwise(knots):
        marks = sorted({t for t in TIMES if begin < t <= end} | {end})
        piece = solve_ivp(slope, (begin, end), y, "Radau", marks, args=(begin, end, low, high), rtol=1e-10, atol=1e-16)
        found |= dict(zip(piece.t, piece.y.T, strict=True))
        y = piece.y[:, -1]
    rows = np.array([found[t] for t in TIMES]).T
    return rows[0], rows[1], rows[2:]


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("kind", ["load", "strain"])
def test_sensitivities_are_those_of_the_prediction(name, kind):
    law, values = CASES[name]
    specimen, loading = ("uniaxial", CYCLES) if kind == "load" else ("relaxation", STRAIN_CYCLES)
    plan = ck.History("bar", np.array(TIMES), {}, loading, 1000.0, specimen, elastic=ck.Elastic(E))
    theta = np.asarray(law.to_internal(law.values(values))).reshape(1, -1)
    found = tight(specimen).predict(law, theta, [plan], sensitivities=True).jacobian[0, 0, :, 0]
    step = 1e-5 * np.eye(theta.size)
    moved = [
        tight(specimen).predict(law, np.concatenate([theta + one, theta - one]), [plan]).values[:, 0, :, 0]
        for one in step
    ]
    numeric = np.stack([(up - down) / 2e-5 for up, down in moved], axis=1)
    assert np.abs(found - numeric).max(axis=0) == pytest.approx(np.zeros(theta.size), abs=1e-6 * np.abs(numeric).max())


def test_planted_values_are_found_in_reversed_tests_within_their_intervals():
    values, inside = {"A": 2e-14, "n": 4.0}, 0
    for seed in range(4):
        rng, tests = np.random.default_rng(seed), []
        for level in (80.0, 110.0, 140.0):
            steps = ((0.0, level), (3600.0, -level), (7200.0, 1.1 * level), (10800.0, -0.8 * level))
            loading, times = ck.StressSteps(steps, control="stress"), np.linspace(200.0, 14400.0, 60)
            strain = run("norton", values, loading, times).outputs["strain"]
            noise = np.full(times.size, 0.01 * np.abs(strain).max())
            noisy = {"strain": strain + noise * rng.normal(size=times.size)}
            stated = {"strain": noise} if seed < 2 else {}
            tests.append(ck.History(f"{level:g}", times, noisy, loading, 1000.0, standard_deviation=stated))
        fit = ck.identify("norton", tests)
        assert fit.values["n"] == pytest.approx(4.0, rel=0.02)
        assert fit.adequacy.explains
        inside += sum(e.low <= values[e.name] <= e.high for e in fit.estimates)
    assert inside >= 7
    assert "±64–154 MPa" in fit.headline
    assert "12 levels of load, -140 to 154 MPa" in DataSummary.of(tests).lines[0]


def test_pressed_bars_have_the_law_of_the_same_bars_pulled():
    rng, times = np.random.default_rng(4), np.linspace(200.0, 14400.0, 40)
    readings = {s: 1e-14 * s**4 * times + 1e-5 * rng.normal(size=times.size) for s in (80.0, 110.0, 140.0)}

    def fitted(sign):
        tests = [
            ck.History(f"{s:g}", times, {"strain": sign * e}, ck.StressSteps(((0.0, sign * s),), control="stress"), 1e3)
            for s, e in readings.items()
        ]
        return ck.identify("norton", tests)

    pulled, pressed = fitted(1.0), fitted(-1.0)
    assert pressed.values == pytest.approx(pulled.values, rel=1e-4)
    assert pressed.rms == pytest.approx(pulled.rms, rel=1e-3)
    assert pressed.values["n"] == pytest.approx(4.0, abs=0.03)
    assert pressed.adequacy.explains


def test_files_keep_the_signs_of_stress_and_strain(tmp_path):
    steps = ck.StressSteps(((0.0, 100.0), (1000.0, -100.0), (2000.0, -20.0)), control="stress")
    strain = run("norton", NORTON, steps, TIMES).outputs["strain"] - 1e-5
    history = ck.History("bar", np.array(TIMES), {"strain": strain}, steps, 1000.0)
    ck.write_history(history, tmp_path / "bar.csv")
    columns = zip(TIMES, strain, steps.program().at(TIMES), strict=True)
    lines = ["# temperature_K: 1000", "# control: stress", "time_s,strain_1,stress_MPa"]
    (tmp_path / "column.csv").write_text("\n".join([*lines, *(f"{t},{float(e)!r},{s}" for t, e, s in columns)]) + "\n")
    for name in ("bar.csv", "column.csv"):
        (found,) = ck.read_histories(tmp_path / name)
        assert found.outputs["strain"].tolist() == strain.tolist()
        assert found.loading.program().at(TIMES) == pytest.approx(steps.program().at(TIMES))
    assert found._repr_html_()
    (tmp_path / "shortening.csv").write_text(
        "# temperature_C: 700\n# stress_MPa: -60\ntime_h,strain_pct\n1,0.1\n2,0.2\n"
    )
    (pressed,) = ck.read_histories(tmp_path / "shortening.csv")
    assert pressed.outputs["strain"] == pytest.approx([-1e-3, -2e-3])
    assert "shortening is a negative strain" in pressed.labels["assumed"]
