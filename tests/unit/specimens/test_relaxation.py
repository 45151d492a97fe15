"""Relaxation: closed forms, exact sensitivities, endings, planted values alone and together with creep, files."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import SolveError
from creepkit.language import wachtman
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.readers.history_csv import write_history
from creepkit.records import History, Program, RecordedLoading, Status, StrainSteps
from creepkit.specimens.relaxation import Relaxation
from creepkit.specimens.uniaxial import Uniaxial

E, START, N = 1.6e5, 180.0, 5.0
A = 1e-3 / (E * START ** (N - 1))
VALUES = {"A": A, "n": N}
TIMES = np.geomspace(1.0, 1e6, 40)
TIGHT = Relaxation(tolerance=1e-9)


def relaxed(start, times, n=N, rate=A):
    """Norton: sigma = [s0^(1-n) + (n-1) E A t]^(-1/(n-1))."""
    return (start ** (1 - n) + (n - 1) * E * rate * np.asarray(times)) ** (-1 / (n - 1))


def held(strain=START / E, times=TIMES, **changes) -> History:
    given = {"loading": ck.constant_strain(strain), "temperature": 1000.0, "elastic": ck.Elastic(E), **changes}
    return History(f"{given['loading']}", times, {}, specimen="relaxation", **given)


def stress(*histories, values=VALUES, law=NORTON, **more):
    return TIGHT.predict(law, law.to_internal(values), histories, **more)


def test_norton_relaxes_as_its_closed_form_does_and_so_do_its_derivatives():
    found = stress(held(), values={"A": np.array([A, 2 * A, 0.0]), "n": N}, sensitivities=True)
    np.testing.assert_allclose(found.of(0)[:, 0], relaxed(START, TIMES), rtol=1e-8)
    np.testing.assert_allclose(found.of(0, 1)[:, 0], relaxed(START, TIMES, rate=2 * A), rtol=1e-8)
    np.testing.assert_allclose(found.of(0, 2)[:, 0], START, rtol=1e-15)
    by_log_A = -E * A * TIMES * relaxed(START, TIMES) ** N
    steps = [relaxed(START, TIMES, n=N + s) for s in (-2e-4, -1e-4, 1e-4, 2e-4)]
    by_n = (8 * (steps[2] - steps[1]) - (steps[3] - steps[0])) / 12e-4
    assert found.jacobian is not None
    np.testing.assert_allclose(found.jacobian[0, 0, :, 0, 0], by_log_A, rtol=1e-6)
    np.testing.assert_allclose(found.jacobian[0, 0, :, 0, 1], by_n, rtol=1e-5, atol=1e-6 * np.abs(by_n).max())


def test_a_step_of_strain_adds_its_elastic_stress_and_relaxation_begins_anew():
    later = 1e4 + np.array([0.0, 10.0, 1e3, 1e5])
    plan = held(times=np.concatenate([[100.0], later]), loading=StrainSteps(((0, START / E), (1e4, 1.5 * START / E))))
    reached = relaxed(START, 1e4) + 0.5 * START
    expected = np.concatenate([[relaxed(START, 100.0)], relaxed(reached, later - 1e4)])
    np.testing.assert_allclose(stress(plan).of(0)[:, 0], expected, rtol=1e-7)


def test_a_step_of_temperature_changes_the_rate():
    """At twice the rate the clock runs twice as fast: sigma depends on the integral of A dt alone."""
    law = NORTON.times(ck.arrhenius(T_ref=1000.0))
    Q = np.log(2.0) * 8.314462618 / (1 / 1000 - 1 / 1050)
    plan = held(temperature=Program.steps([(0.0, 1000.0), (1e3, 1050.0)]))
    aged = np.where(TIMES < 1e3, TIMES, 1e3 + 2 * (TIMES - 1e3))
    found = stress(plan, law=law, values={**VALUES, "Q": Q}).of(0)[:, 0]
    np.testing.assert_allclose(found, relaxed(START, aged), rtol=1e-7)


def test_a_ramp_of_strain_ends_in_steady_creep():
    """At a constant rate e' of strain the stress tends to (e'/A)^(1/n)."""
    rate = A * 150.0**N
    ramp = RecordedLoading(Program([0.0, 2e6], [0.0, 2e6 * rate]), "strain")
    assert stress(held(loading=ramp, times=[2e6])).of(0)[-1, 0] == pytest.approx(150.0, rel=1e-6)


def test_strain_hardening_relaxes_as_quadrature_says():
    """t(sigma) = int dsigma' / (E f(sigma', (s0 - sigma')/E)), by Gauss-Legendre in ln of the strain."""
    values = {"A": 1e-15, "n": 4.0, "m": -0.5}
    p = 1e-4
    nodes, weights = np.polynomial.legendre.leggauss(60)
    strains = p * (0.5 * (nodes + 1)) ** 2  # dp = 2 sqrt(p) dx, which takes the root off p^0.5
    rates = values["A"] * (START - E * strains) ** values["n"] * strains ** values["m"]
    time = float(0.5 * weights @ (2 * p * 0.5 * (nodes + 1) / rates))
    found = stress(held(times=[time]), law=STRAIN_HARDENING, values=values).of(0)[0, 0]
    assert found == pytest.approx(START - E * p, rel=1e-7)


def test_an_engineering_strain_is_taken_as_its_logarithm():
    plan = held(0.01, times=[0.0], strain_measure="engineering")
    assert stress(plan).of(0)[0, 0] == pytest.approx(E * np.log(1.01), rel=1e-12)


def test_temperature_and_modulus_may_be_off():
    law = NORTON.times(ck.arrhenius(T_ref=1000.0))
    values = {**VALUES, "Q": 3e5}
    nuisances = {"temperature": np.array([[4.0]]), "modulus": np.array([[0.1]])}
    found = stress(held(), law=law, values=values, nuisances=nuisances, sensitivities=True)
    same = stress(held(temperature=1004.0, elastic=ck.Elastic(1.1 * E)), law=law, values=values)
    np.testing.assert_allclose(found.values, same.values, rtol=1e-10)
    first = found.nuisance_jacobian["modulus"][0, 0, 0, 0]
    assert first == pytest.approx(START, rel=0.02), "at first stress is E times strain"


def test_a_strain_that_falls_below_what_crept_presses_the_bar():
    """By Norton's law each sign relaxes as s^(1 - n) grows by (n - 1) E A t."""
    down, held = StrainSteps(((0, START / E), (1e4, 0.1 * START / E))), (VALUES["n"] - 1) * E * VALUES["A"]
    run = ck.simulate(NORTON, TIGHT, VALUES, loading=down, times=[0.0, 1e4, 2e4], elastic=ck.Elastic(E))
    power = 1 - VALUES["n"]
    before = (START**power + held * 1e4) ** (1 / power)
    pressed = 0.9 * START - before
    assert run.status is Status.COMPLETE
    assert pressed > 0
    assert run.outputs["stress"][[0, 2]] == pytest.approx([START, -((pressed**power + held * 1e4) ** (1 / power))])


def noisy(plan, specimen, output, noise, rng):
    clean = specimen.predict(NORTON, NORTON.to_internal(VALUES), [plan]).of(0)[:, 0]
    return plan.replace(outputs={output: clean + rng.normal(0, noise, clean.size)})


def test_planted_values_are_found_from_relaxation_and_creep_together():
    """Each kind of test says its own: relaxation the low stresses, creep the high ones."""
    rng = np.random.default_rng(2)
    relaxing = [noisy(held(s / E), TIGHT, "stress", 1.0, rng) for s in (120.0, 180.0)]
    bars = []
    for level in (150.0, 220.0):
        times = np.geomspace(1e-3, 1.0, 30) * 0.01 / (A * level**N)
        bar = History(f"creep {level:g}", times, {}, ck.constant_stress(level, "stress"), 1000.0)
        bars.append(noisy(bar, Uniaxial(), "strain", 1e-5, rng))
    fit = ck.identify("norton", [*relaxing, *bars], starts=2)
    assert all(e.low <= VALUES[e.name] <= e.high for e in fit.estimates)
    assert set(fit.errors) == {"stress", "strain"}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"loading": ck.constant_stress(100.0)}, "loaded by strain, found stress; use StrainSteps or constant_strain"),
        ({"elastic": None}, "under prescribed strain needs elastic data; state Young's modulus: "),
        (
            {"elastic": ck.Elastic(wachtman(2e5, 60.0, 300.0)), "temperature": Program.steps([(0, 900), (9, 1000)])},
            "the modulus changes from .* with the temperature of the test",
        ),
    ],
)
def test_what_cannot_be_relaxed_is_said(changes, said):
    with pytest.raises(SolveError, match=said):
        stress(held(**changes))


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: StrainSteps(((1.0, 0.1),)), "must start at time 0"),
        (lambda: ck.constant_strain(2.0), r"from -0.99 to 1 in every step, found \[2.0\]"),
        (
            lambda: StrainSteps(((0, 0.1), (5, 0.2)), ramp=6.0),
            "ramp is 6 s; it must not be negative nor outlast a step",
        ),
    ],
)
def test_strains_that_make_no_sense_are_refused(make, said):
    with pytest.raises(SolveError, match=said):
        make()


def test_a_history_of_relaxation_survives_its_file(tmp_path):
    loading = StrainSteps(((0, 1e-3), (600, 1.2e-3)))
    run = ck.simulate(NORTON, TIGHT, VALUES, loading=loading, times=[0, 100, 900], elastic=ck.Elastic(E))
    (again,) = ck.read_histories(write_history(run, tmp_path / "held.csv"))
    assert (again.specimen, again.loading, again.elastic) == ("relaxation", loading, ck.Elastic(E))
    assert again.outputs["stress"].tolist() == run.outputs["stress"].tolist()
    assert again.condition == "20 °C, 0.1 to 0.12 % strain"
