"""Subroutine CREEP, compiled and driven through uniaxial histories as a finite element code drives it.

At constant stress in each increment the update is of second order (exact where the rate depends on stress and time
alone, of lower order at the start of a sum of hardening terms); in relaxation the codes' own step, with the stress at
its end, makes it first order.
"""

from itertools import pairwise

import numpy as np
import pytest

import creepkit as ck
from creepkit.exporters.creep_subroutine import ABAQUS_CREEP, CALCULIX_CREEP
from creepkit.language import CreepLaw, Param, State, mean_stress, parameters, states, strain, stress
from creepkit.records import LawWithValues, Program, Units
from helpers.compiled_fortran import Routine

BAR = ck.specimen("uniaxial").replace(tolerance=1e-11)
STEPS = ((0.0, 60.0), (3e4, 90.0), (5e4, 40.0))
END = 1.5e5

A, n, B, k, r, c, D = parameters("A n B k r c D")
omega, hard = states("omega hard")
RATE = Param("rate coefficient", bounds=(1e-40, 1e-3), unit="1/s", scale="log", off=0.0)
POWER = Param("exponent", bounds=(1, 8))

DAMAGE = CreepLaw(
    name="damage",
    terms={"power law": A * (stress / (1 - omega)) ** n},
    params={A: RATE, n: POWER, B: RATE, k: POWER, r: POWER},
    states={omega: State(0.0, B * stress**k / (1 - omega) ** r, limit=0.9)},
)
"""Kachanov (1958) and Rabotnov (1969), by the von Mises stress; at constant stress damage has a closed form."""

RECOVERY = CreepLaw(
    name="recovery",
    terms={"power law": A * (stress * hard) ** n},
    params={A: RATE, n: POWER, c: Param("softening", bounds=(0.1, 100)), D: RATE},
    states={hard: State(1.0, D * (c * strain - hard + 1.0))},
)
"""A state that does not start at zero."""

CASES = {
    "norton": (ck.law("norton"), {"A": 1e-16, "n": 4.0}),
    "strain hardening": (ck.law("strain-hardening"), {"A": 1e-18, "n": 4.0, "m": -0.6}),
    "time hardening": (ck.law("time-hardening"), {"A": 1e-14, "n": 4.0, "m": -0.6}),
    "sinh": (ck.law("hyperbolic-sine"), {"A": 1e-8, "n": 2.0, "B": 50.0}),
    "drifting exponent": (
        ck.law("drifting-exponent"),
        {"A": 1e-16, "n_0": 4.4, "n_inf": 4.3, "C": 1.29, "tau_d": 7800.0, "tau_r": 4700.0, "m": -0.3},
    ),
    "combined": (
        ck.law("combined"),
        {
            "A_1": 1e-9, "n_1": 2.0, "B": 50.0, "A_2": 1e-18, "n_2": 4.0, "m_1": -0.6,
            "A_3": 1e-14, "n_3": 4.0, "m_2": -0.6,
        },
    ),
    "logarithmic": (ck.law("logarithmic"), {"A": 1e-13, "n": 4.0, "e_0": 0.01}),
    "damage": (DAMAGE, {"A": 1e-16, "n": 4.0, "B": 5e-14, "k": 4.0, "r": 3.0}),
    "a state that starts at one": (RECOVERY, {"A": 1e-16, "n": 4.0, "c": 20.0, "D": 3e-5}),
}  # fmt: skip


SEVERAL_EXPONENTS = ("combined", "drifting exponent")
"""Laws that begin smoothly in no clock; the first increments decide their error, which falls between h and h^2."""


@pytest.fixture(scope="module")
def routines(tmp_path_factory, gfortran):
    """{name: compiled routine}."""
    folder = tmp_path_factory.mktemp("creep")
    made = {}

    def routine(name, exporter=ABAQUS_CREEP, **how):
        key = (name, exporter.name, *map(str, how.items()))
        if key not in made:
            law, values = CASES[name]
            place = folder / f"r{len(made)}"
            place.mkdir()
            text = exporter.text(LawWithValues(law, values, name="mine", **how))
            made[key] = Routine(gfortran, text, place, f"mine{len(made)}")
        return made[key]

    return routine


def marched(routine, increments, *, stress_unit=1.0, time_unit=1.0, steps=STEPS, warm=None):
    """Creep strain and states at the end of stepped stresses, in so many equal increments a step."""
    creep, inner = 0.0, np.zeros(10)
    starts = [start for start, _ in steps]
    for (start, load), end in zip(steps, [*starts[1:], END], strict=True):
        times = np.linspace(start, end, increments + 1) / time_unit
        for before, after in pairwise(times):
            kelvin = (1000.0, 1000.0) if warm is None else tuple(np.interp([before, after], *warm))
            found, _ = routine.creep(load / stress_unit, creep, after, after - before, warm=kelvin, states=inner)
            creep += found[0]
    return creep, inner


def reference(law, values, loading=None, temperature=1000.0):
    loading = loading or ck.StressSteps(STEPS, control="stress")
    run = ck.simulate(law, BAR, values, loading=loading, times=[END], temperature=temperature)
    return run.outputs["strain"][-1]


@pytest.mark.parametrize("name", CASES)
def test_stepped_stress_agrees_with_the_integrator_to_the_order_of_the_step(name, routines):
    law, values = CASES[name]
    exact = reference(law, values)
    errors = [abs(marched(routines(name), count)[0] / exact - 1) for count in (32, 64, 128)]
    assert errors[-1] < 2e-5
    if errors[-1] > 1e-9 and name not in SEVERAL_EXPONENTS:
        assert np.log2(errors[1] / errors[2]) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("name", CASES)
def test_one_increment_for_each_stress_is_within_a_percent(name, routines):
    """Steps in which a rate changes much are halved inside, for codes that see no reason to."""
    law, values = CASES[name]
    assert marched(routines(name), 1)[0] == pytest.approx(reference(law, values), rel=1e-2)


@pytest.mark.parametrize("name", ["norton", "time hardening", "sinh"])
def test_one_increment_a_step_is_exact_where_the_rate_depends_on_stress_and_time_alone(name, routines):
    law, values = CASES[name]
    assert marched(routines(name), 1)[0] == pytest.approx(reference(law, values), rel=1e-9)


def test_the_first_increment_of_strain_hardening_is_the_closed_form_from_zero_strain(routines):
    _, v = CASES["strain hardening"]
    found, _ = routines("strain hardening").creep(60.0, 0.0, 3e4, 3e4)
    closed = ((1 - v["m"]) * v["A"] * 60.0 ** v["n"] * 3e4) ** (1 / (1 - v["m"]))
    assert found[0] == pytest.approx(closed, rel=1e-10)


@pytest.mark.parametrize("late", [1.0, 1e4])
def test_creep_that_begins_late_is_the_same_closed_form(late, routines):
    """As in a step after a static one, whose time the total time counts."""
    _, v = CASES["strain hardening"]
    found, _ = routines("strain hardening").creep(60.0, 0.0, late + 100.0, 100.0)
    closed = ((1 - v["m"]) * v["A"] * 60.0 ** v["n"] * 100.0) ** (1 / (1 - v["m"]))
    assert found[0] == pytest.approx(closed, rel=1e-10)


def test_damage_follows_its_closed_form_and_stays_at_its_limit(routines):
    _, v = CASES["damage"]
    life = 1 / ((v["r"] + 1) * v["B"] * 60.0 ** v["k"])
    inner, creep = np.zeros(10), 0.0
    for before, after in pairwise(np.linspace(0.0, 0.9 * life, 201)):
        creep += routines("damage").creep(60.0, creep, after, after - before, states=inner)[0][0]
    assert inner[0] == pytest.approx(1 - 0.1 ** (1 / (v["r"] + 1)), rel=1e-4)
    found, _ = routines("damage").creep(60.0, creep, 2 * life, 1.1 * life, states=inner)
    assert inner[0] == 0.9
    assert np.isfinite(found).all()
    assert found[0] > 0


def test_a_state_that_falls_ends_at_its_limit(tmp_path, gfortran):
    """w' = -B w from 1 to 0.1 and rate = A s^n/w: the strain is A s^n (exp(B t) - 1)/B until then."""
    falls = {omega: State(1.0, -B * omega, limit=0.1)}
    law = CreepLaw(
        name="falls", terms={"term": A * stress**n / omega}, params={A: RATE, B: RATE, n: POWER}, states=falls
    )
    text = ABAQUS_CREEP.text(LawWithValues(law, {"A": 1e-16, "B": 1e-4, "n": 4.0}))
    routine, inner = Routine(gfortran, text, tmp_path, "falls"), np.zeros(10)
    found, _ = routine.creep(60.0, 0.0, 5e3, 5e3, states=inner)
    assert found[0] == pytest.approx(1e-16 * 60.0**4 * np.expm1(0.5) / 1e-4, rel=5e-3)
    assert 1.0 + inner[0] == pytest.approx(np.exp(-0.5), rel=5e-3)
    routine.creep(60.0, found[0], 1e5, 9.5e4, states=inner)
    assert 1.0 + inner[0] == pytest.approx(0.1, rel=1e-12)


@pytest.mark.parametrize("folds", [1.0, 5.0, 40.0, 1e6])
def test_a_state_that_feeds_its_own_growth_never_runs_backwards(folds, tmp_path, gfortran):
    """q' = B (q + c) and rate = q': from q = 0 the strain is c (exp(B t) - 1), at least c B t in any increment."""
    law = CreepLaw(
        "growth", {"term": B * (omega + c)}, {B: RATE, c: POWER}, states={omega: State(0.0, B * (omega + c))}
    )
    routine, inner = (
        Routine(gfortran, ABAQUS_CREEP.text(LawWithValues(law, {"B": 1e-4, "c": 1e-3})), tmp_path, "growth"),
        np.zeros(10),
    )
    found, _ = routine.creep(60.0, 0.0, folds / 1e-4, folds / 1e-4, states=inner)
    assert found[0] >= min(1e-3 * folds, 1.0)
    assert inner[0] >= 0.0
    assert np.isfinite(found).all()


def test_states_start_at_their_initial_value_from_a_fresh_statev(routines):
    inner = np.zeros(10)
    routines("a state that starts at one").creep(60.0, 0.0, 1.0, 1.0, states=inner)
    assert abs(inner[0]) < 1e-6


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("creep", [0.0, 0.004])
def test_the_derivatives_are_those_of_the_update(name, creep, routines):
    routine, start = routines(name), np.full(10, 0.05)

    def increment(load, pressure=0.0):
        return routine.creep(load, creep, 2.5e4, 8e3, states=start.copy(), pressure=pressure)[0]

    step = 1e-4
    numeric = (increment(70.0 + step)[0] - increment(70.0 - step)[0]) / (2 * step)
    found = increment(70.0)
    assert found[4] == pytest.approx(numeric, rel=1e-6)
    assert (found[1:4] == 0.0).all()


def test_the_derivative_to_the_pressure(tmp_path, gfortran):
    law = CreepLaw("mean", {"term": A * (stress + 0.5 * mean_stress) ** n}, {A: RATE, n: POWER})
    text = ABAQUS_CREEP.text(LawWithValues(law, {"A": 1e-16, "n": 4.0}, units=Units("Pa", "h")))
    routine = Routine(gfortran, text, tmp_path, "mean")
    found = [routine.creep(70e6, 0.0, 2.0, 2.0, pressure=p)[0] for p in (-30e6, -30e6 + 1e3, -30e6 - 1e3)]
    assert found[0][0] == pytest.approx(1e-16 * 85.0**4 * 7200.0, rel=1e-12)
    assert found[0][3] == pytest.approx((found[1][0] - found[2][0]) / 2e3, rel=1e-6)


@pytest.mark.parametrize("name", ["norton", "drifting exponent", "damage"])
def test_pascal_and_hours_give_the_same_strain(name, routines):
    plain, _ = marched(routines(name), 20)
    other, _ = marched(routines(name, units=Units("Pa", "h")), 20, stress_unit=1e-6, time_unit=3600.0)
    assert other == pytest.approx(plain, rel=1e-10)


def test_temperature_steps_agree_with_the_integrator(tmp_path, gfortran):
    law, values = ck.law("norton").times(ck.arrhenius(T_ref=1000.0)), {"A": 1e-16, "n": 4.0, "Q": 3e5}
    routine = Routine(gfortran, ABAQUS_CREEP.text(LawWithValues(law, values)), tmp_path, "warm")
    ramp = (np.array([0.0, 2e4, 2.2e4, END]), np.array([1000.0, 1000.0, 1080.0, 1080.0]))
    exact = reference(law, values, temperature=Program(*ramp))
    errors = [abs(marched(routine, count, warm=ramp)[0] / exact - 1) for count in (150, 300, 600)]
    assert errors[-1] < 2e-4
    assert errors[0] > errors[1] > errors[2]


@pytest.mark.parametrize("name", ["norton", "strain hardening", "damage"])
def test_relaxation_is_of_first_order_with_the_stress_at_the_end(name, routines):
    law, values = CASES[name]
    E, total = 1.5e5, 6e-4
    bar = ck.specimen("relaxation").replace(tolerance=1e-10)
    run = ck.simulate(
        law,
        bar,
        values,
        loading=ck.StrainSteps(((0.0, total),)),
        times=[1e5],
        elastic=ck.Elastic(E=E),
        temperature=1000.0,
    )
    exact = run.outputs["stress"][-1]
    found = [relaxed(routines(name), E, total, count) for count in (200, 400, 800)]
    orders = np.log2(np.abs(np.array(found[:-1]) - exact) / np.abs(np.array(found[1:]) - exact))
    assert orders[-1] == pytest.approx(1.0, abs=0.2)
    assert found[-1] == pytest.approx(exact, rel=3e-3)


def relaxed(routine, E, total, count):
    """Stress of a bar after 1e5 s at constant strain, with the stress at the end of every increment."""
    creep, inner, load = 0.0, np.zeros(10), E * total
    for before, after in pairwise(1e5 * np.linspace(0.0, 1.0, count + 1) ** 2):
        q = load
        for _ in range(50):
            trial = inner.copy()
            found, _ = routine.creep(q, creep, after, after - before, states=trial)
            change = (E * (total - creep - found[0]) - q) / (1 + E * found[4])
            q = max(q + change, 1e-6)
            if abs(change) < 1e-9:
                break
        creep, inner, load = creep + found[0], trial, q
    return load


def test_calculix_is_given_the_stress_for_an_increment_where_elasticity_is_anisotropic(routines):
    routine = routines("combined", CALCULIX_CREEP)
    forward, _ = routine.creep(73.0, 0.01, 2e4, 4e3)
    back, q = routine.creep(0.0, 0.01, 2e4, 4e3, lend=3, wanted=forward[0])
    assert q == pytest.approx(73.0, rel=1e-9)
    assert back[4] == pytest.approx(forward[4], rel=1e-6)


@pytest.mark.parametrize("name", ["damage", "a state that starts at one"])
def test_calculix_routines_keep_states_themselves_through_iterations_and_cutbacks(name, routines, tmp_path, gfortran):
    """Against Abaqus' STATEV: an iteration at another stress and a step that fails must leave nothing behind."""
    law, values = CASES[name]
    routine = Routine(gfortran, CALCULIX_CREEP.text(LawWithValues(law, values, name="mine")), tmp_path, "fresh")
    inner, creep = np.zeros(10), 0.0
    for before, after in pairwise(np.linspace(0.0, 3e4, 11)):
        routine.creep(95.0, creep, before + 4 * (after - before), 4 * (after - before))  # cut back
        routine.creep(80.0, creep, after, after - before)  # an iteration
        found, _ = routine.creep(60.0, creep, after, after - before)
        told, _ = routines(name).creep(60.0, creep, after, after - before, states=inner)
        assert found[0] == pytest.approx(told[0], rel=1e-13)
        creep += told[0]
    assert creep > 1e-5


@pytest.mark.parametrize("name", CASES)
def test_no_stress_gives_no_creep(name, routines):
    found, _ = routines(name).creep(0.0, 0.0, 1e3, 1e3)
    assert np.isfinite(found).all()
    assert 0 <= found[0] < 1e-25
