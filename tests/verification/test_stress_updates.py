"""Exported stress updates against an independent integration, closed forms and differences: every law that is there."""

import mpmath
import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import ExportError
from creepkit.exporters.user_materials import TARGETS, NumpyUpdate
from creepkit.language import CreepLaw, Param, State, parameters, states, stress
from creepkit.records import LawWithValues, Units
from creepkit.registry import default_registry
from helpers.stress_updates import (
    STEEL,
    CUpdate,
    FortranUpdate,
    NumpyUpdates,
    Path6,
    Point,
    centred,
    driven,
    random_path,
    reference,
    tangent_by_differences,
)

EXPORTERS = {target.name: target for target in TARGETS}
LAWS = {name: e.value for name, e in sorted(default_registry().laws().items()) if not e.value.back_stresses}
LOOSE = ("TOLERANCE = 0.001", "TOLERANCE = 1e9")
"""What an edit of the file makes of its tolerance, for one step in each increment."""


@pytest.fixture(scope="module")
def updates(tmp_path_factory, gcc):
    """{name of a law: compiled C}; an edit is (old, new) text."""
    folder, made = tmp_path_factory.mktemp("updates"), {}

    def update(source, edit=("", "")):
        key = f"u{len(made)}"
        index = (source.law.name, str(source.values), source.units, edit)
        if index not in made:
            text = EXPORTERS["c-update"].text(source.replace(name=key))
            assert edit[0] in text
            made[index] = CUpdate(gcc, text.replace(*edit), folder, key)
            assert made[index].warnings == ""
        return made[index]

    return update


def error(found, exact):
    return np.abs(found.stress - exact.stress).max() / np.abs(exact.stress).max()


@pytest.mark.parametrize("name", LAWS)
def test_every_law_follows_a_path_of_six_strains_and_temperature(name, updates):
    follow(name, updates, seeds=[0], pieces=2)


@pytest.mark.nightly
@pytest.mark.parametrize("name", LAWS)
def test_every_law_follows_fifty_paths(name, updates):
    follow(name, updates, seeds=range(1, 51), pieces=4)


def follow(name, updates, seeds, pieces):
    """Within 1e-4 at any increments and within 1e-6 at fine ones; the last tangent is the derivative."""
    source, count = centred(LAWS[name]), len(LAWS[name].conditions)
    update = updates(source)
    for seed in seeds:
        path, point = random_path(source, seed, pieces)
        exact = reference(source, path, point)
        assert error(driven(update, path, point, 4, count), exact) < 3e-4
        found = driven(update, path, point, 1500, count)
        assert error(found, exact) < 1e-6
        assert found.state == pytest.approx(exact.state, rel=1e-6)
        for increment in list(path.increments(3))[::3]:
            numeric, tangent = tangent_by_differences(update, point, increment, count)
            assert np.abs(numeric - tangent).max() < 1e-6 * np.abs(numeric).max()


def agrees_with_c(one, name, updates, components=6):
    """Stress, states and tangent along a path; what an update keeps to itself belongs to the path too."""
    source, count = centred(LAWS[name]), len(LAWS[name].conditions)
    path, point = random_path(source, 0, 2)
    if components == 4:
        point.stress[4:] = path.strains[:, 4:] = 0.0
    found, other = point.copy(), point.copy()
    for start, step, strain, kelvin in path.increments(5):
        outside = np.column_stack([kelvin, np.full((2, count), 0.05)])
        tangents = [
            update.advance(p, start, step, strain, outside) for update, p in ((one, found), (updates(source), other))
        ]
        assert found.stress == pytest.approx(other.stress, rel=1e-9, abs=1e-9)
        assert found.state == pytest.approx(other.state, rel=1e-9)
        shown = np.ix_(range(components), range(components))
        assert np.abs(tangents[0] - tangents[1])[shown].max() < 1e-9 * np.abs(tangents[1]).max()


@pytest.mark.parametrize("name", LAWS)
def test_fortran_and_numpy_take_the_steps_of_c(name, updates, tmp_path, gfortran):
    source = centred(LAWS[name])
    routine = FortranUpdate(gfortran, EXPORTERS["abaqus-umat"].text(source), tmp_path, "abaqus-umat")
    assert routine.warnings == ""
    agrees_with_c(routine, name, updates)
    agrees_with_c(NumpyUpdates(NumpyUpdate().text(source)), name, updates)


@pytest.mark.parametrize("target", ["abaqus-umat", "calculix-umat", "ansys-usermat", "ls-dyna-umat"])
@pytest.mark.parametrize("components", [6, 4])
def test_what_each_code_calls(target, components, updates, tmp_path, gfortran):
    """Its order of shear stresses, its temperatures, and the components of plane strain and axisymmetry."""
    if (target, components) == ("ls-dyna-umat", 4):
        components = 6
    text = EXPORTERS[target].text(centred(LAWS["kachanov-rabotnov"]))
    routine = FortranUpdate(gfortran, text, tmp_path, target, components)
    assert routine.warnings == ""
    agrees_with_c(routine, "kachanov-rabotnov", updates, components)


@pytest.mark.parametrize("name", ["norton", "strain-hardening", "kachanov-rabotnov", "theta-projection"])
def test_one_step_in_each_increment_is_of_second_order(name, updates):
    source = centred(LAWS[name])
    path, point = random_path(source, 3, 1)
    exact = reference(source, path, point)
    errors = [error(driven(updates(source, LOOSE), path, point, n), exact) for n in (64, 128, 256)]
    assert np.log2(errors[1] / errors[2]) == pytest.approx(2.0, abs=0.15)


def relaxed(m, count, updates, *, units=None, scale=(1.0, 1.0)):
    """Von Mises stress, MPa, of rate 1e-14 q^4 p^m in pure shear at 200 MPa, held for 1e5 s from a virgin state."""
    law, values = ("strain-hardening", {"m": m}) if m else ("norton", {})
    source = LawWithValues(
        ck.law(law), {"A": 1e-14, "n": 4.0, **values}, elastic=ck.Elastic(150e3), units=units or Units()
    )
    shear = np.array([0.0, 0, 0, 200.0 / np.sqrt(3.0), 0, 0]) / scale[0]
    held = Path6(np.array([0.0, 1e5]) / scale[1], np.zeros((2, 6)), np.full(2, 1000.0))
    found = driven(updates(source), held, Point(shear, np.zeros(1)), count)
    return np.sqrt(3.0) * found.stress[3] * scale[0]


def relaxed_exactly(m):
    """The same, where 3 G p = 200 MPa - q and the time to p is the integral of dp over the rate, in 50 digits."""
    with mpmath.workdps(50):
        shear3 = 3 * mpmath.mpf(150000) / (2 * (1 + mpmath.mpf(0.3)))

        def logarithm(p):
            time_to = mpmath.quad(lambda x: x**-m / (mpmath.mpf("1e-14") * (200 - shear3 * x) ** 4), [0, p / 9, p])
            return mpmath.log(time_to / 100_000)

        return float(200 - shear3 * mpmath.findroot(logarithm, (1e-5, 1.15e-3), solver="ridder", tol=1e-30))


@pytest.mark.parametrize("m", [0.0, -0.5])
def test_relaxation_from_a_virgin_state_is_the_closed_form(m, updates):
    exact = relaxed_exactly(m)
    assert relaxed(m, 1, updates) == pytest.approx(exact, rel=3e-4)
    assert relaxed(m, 8000, updates) == pytest.approx(exact, rel=1e-6)
    other = relaxed(m, 1, updates, units=Units("Pa", "h"), scale=(1e-6, 3600.0))
    assert other == pytest.approx(relaxed(m, 1, updates), rel=1e-9)


@pytest.mark.parametrize("count", [1, 7, 60])
def test_damage_under_stretching_fades_away_with_the_stress_and_ends_at_its_limit(count, updates):
    """Kachanov's damage in a bar that is stretched at its rate at 100 MPa, elastic strain apart.

    Its stress is 100 MPa (1 - v)^(1/4), so that the share of life v = 1 - exp(-t/life), life = 1/(B 100^chi).
    """
    values = dict(A=1e-12, n=3.0, B=6e-14, chi=4.0, phi=3.0, alpha=0.0, m=0.0)
    source = LawWithValues(LAWS["kachanov-rabotnov"], values, elastic=ck.Elastic(150e3))
    life, pull = 1.0 / (6e-14 * 100.0**4), 100.0 * np.array([2.0, -1.0, -1.0, 0, 0, 0]) / 3.0
    for lives in (1.5, 30.0):
        pulled = lives * life * 1e-6 * np.array([1.0, -0.5, -0.5, 0, 0, 0])
        path = Path6(np.array([0.0, lives * life]), np.array([np.zeros(6), pulled]), np.full(2, 1000.0))
        found = driven(updates(source), path, Point(pull, np.zeros(2)), count)
        assert found.state[0] == pytest.approx(pulled[0], rel=1e-2)
        assert found.state[1] == pytest.approx(min(1 - np.exp(-lives), 0.99999999), rel=1e-3)
        assert found.stress[0] == pytest.approx(200.0 / 3.0 * np.exp(-lives / 4), rel=1e-2, abs=1.0)


def test_a_state_that_falls_ends_at_its_limit_whatever_names_a_law_has(updates, tmp_path, gfortran):
    """w' = -NY w from 1 to its limit at 0.1: exp(-NY t); the names are those of the algorithm, or of functions."""
    A, NY, x, kelvin = parameters("A NY x kelvin")
    (stage,) = states("stage")
    rate, number = Param("rate", (1e-30, 1e-3), "1/s", "log"), Param("number", (0.5, 8))
    law = CreepLaw(
        name="update",
        terms={"law": A * stress**x * kelvin / stage},
        params={A: rate, NY: rate, x: number, kelvin: number},
        states={stage: State(1.0, -NY * stage, limit=0.1)},
    )
    source = LawWithValues(law, dict(A=1e-20, NY=1e-4, x=3.0, kelvin=1.0), elastic=STEEL)
    routine = FortranUpdate(gfortran, EXPORTERS["abaqus-umat"].text(source), tmp_path, "abaqus-umat")
    assert routine.warnings == ""
    for update in (updates(source), routine, NumpyUpdates(NumpyUpdate().text(source))):
        for end, expected in ((1e4, np.exp(-1.0)), (1e5, 0.1)):
            still = Path6(np.array([0.0, end]), np.zeros((2, 6)), np.full(2, 900.0))
            found = driven(update, still, Point(np.array([50.0, 0, 0, 0, 0, 0]), np.zeros(2)), 2)
            assert 1.0 + found.state[1] == pytest.approx(expected, rel=1e-3)


def test_no_time_is_elastic(updates):
    source = centred(LAWS["norton"])
    still = Path6(np.zeros(2), np.array([np.zeros(6), [1e-3, 0, 0, 0, 0, 0]]), np.full(2, 900.0))
    elastic = STEEL.at(900.0)
    found = driven(updates(source), still, Point(np.zeros(6), np.zeros(1)), 1)
    lame = elastic.E * elastic.nu / (1 + elastic.nu) / (1 - 2 * elastic.nu)
    assert found.stress == pytest.approx([1e-3 * (lame + elastic.E / (1 + elastic.nu)), *[1e-3 * lame] * 2, 0, 0, 0])


def test_elasticity_has_to_be_given():
    for target in (*TARGETS, NumpyUpdate()):
        with pytest.raises(ExportError, match=r"'[\w-]+' writes the elasticity too; give elastic=Elastic\(E=150e3\)"):
            target.text(LawWithValues(ck.law("norton"), {"A": 1e-16, "n": 4.0}))
