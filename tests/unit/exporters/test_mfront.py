"""The exported MFront file keeps the grammar, and its @Integrator, compiled on its own, gives our numbers.

MFront itself is not run here. The law's statements are compiled as they stand in the file and compared with 50 digits;
the whole block runs on the tensors of tfel_stub.hxx, where its Jacobian is that of its residuals.
"""

import ctypes
import dataclasses
import re

import numpy as np
import pytest
import sympy

from creepkit.errors import ExportError
from creepkit.language import CreepLaw, Elastic, Param, State, parameters, states, stress, temperature
from creepkit.language.symbols import POINT_VARIABLES
from creepkit.laws.combined import COMBINED
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.laws.time_hardening import TIME_HARDENING
from creepkit.records import Units
from helpers.export_cases import LAWS, disagreements, labelled_values, renamed
from helpers.mfront_integrator import ELASTIC, Block, compile_cpp, declared, exported, scalar_function

# ---- the law's statements against 50 digits ------------------------------------------------------------------------


def test_every_law_agrees_with_50_digits(tmp_path, gxx):
    """The derivatives to time and temperature, which are known at t + theta dt, are not in the file."""
    given = labelled_values().items()
    functions = [scalar_function(label, one.law, exported(one.law, one.values)) for label, one in given]
    start = "#include <cmath>\nusing namespace std;\nusing real = double;"
    library = compile_cpp(gxx, tmp_path, "\n".join([start, *functions]))

    def evaluate(_, judged):
        shape = (1 + len(judged.law.states), 1 + len(POINT_VARIABLES) + len(judged.law.states))
        rows = np.zeros((len(judged.sets), *shape))
        for k, (point, label) in enumerate(zip(judged.drawn.points, judged.labels, strict=True)):
            x, out = (ctypes.c_double * point.size)(*point), (ctypes.c_double * (shape[0] * shape[1]))()
            getattr(library, label)(x, out)
            rows[k] = np.reshape(out, shape)
            for row, true in zip(rows[k], judged.truth.rows[k], strict=True):
                row[[3, 4]] = [float(true[3]), float(true[4])]
        return rows, judged.logs(rows[:, 0, 0])

    assert disagreements(evaluate) == []


# ---- the whole block on tensors ------------------------------------------------------------------------------------


SKEW = np.array([8e-4, -3e-4, 1e-4, 2e-4, -1e-4, 3e-4])
"""An elastic strain with six components and three distinct principal stresses."""


@pytest.mark.parametrize(
    "name", ["registered combined", "multiaxial", "foreign Liu-Murakami", "foreign Kachanov-Rabotnov"]
)
@pytest.mark.parametrize("units", [Units(), Units("Pa", "h")], ids=["MPa s", "Pa h"])
def test_the_jacobian_is_that_of_the_residuals(name, units, tmp_path, gxx):
    """Against central differences of the residuals, whose error is some 1e-9 of the largest entry of a row."""
    law = LAWS[name]
    values = {n: 1e-14 if p.unit == "1/s" else p.center for n, p in law.table.items()}
    values |= {"A": 1e-8} if name == "multiaxial" else {}
    block = Block(gxx, tmp_path, law, values, units)
    state = np.array([0.01, *[0.3] * len(block.states)])
    unknown = np.array([1e-5, -2e-5, 1e-5, 3e-5, -1e-5, 2e-5, 1e-4, *[1e-3] * len(block.states)])
    place = {"eel": SKEW, "state": state, "dt": 200.0 / units.seconds, "elapsed": 1e4 / units.seconds}
    _, jacobian = block(unknown, **place)
    columns = []
    for k, width in enumerate([1e-9] * 6 + [1e-7] + [1e-6] * len(block.states)):
        shift = width * np.eye(block.size)[k]
        up, down = (block(unknown + sign * shift, **place)[0] for sign in (1, -1))
        columns.append((up - down) / (2 * width))
    difference = np.abs(np.array(columns).T - jacobian)
    assert (difference <= 2e-6 * np.abs(jacobian).max(axis=1, keepdims=True)).all()
    assert np.abs(jacobian[6, :6]).max() > 1e-6


def test_relaxation_follows_the_closed_form_to_second_order(tmp_path, gxx):
    """Norton at constant strain: s^(1-n) = s_0^(1-n) + 3 G A (n - 1) t for the von Mises stress s, G = E/(2 (1+nu))."""
    A, n, seconds = 1e-20, 5.0, 2e6
    block = Block(gxx, tmp_path, NORTON, {"A": A, "n": n})
    shear = ELASTIC.E / 2 / 1.3
    start = 2 * shear * 1e-3 * np.sqrt(3)  # pure shear: eel_12 = 1e-3, in the basis of 2^(1/2) eel_12
    exact = (start ** (1 - n) + 3 * shear * A * (n - 1) * seconds) ** (1 / (1 - n))
    assert exact < 0.5 * start
    errors = []
    for steps in (50, 100):
        eel, state = np.array([0, 0, 0, 1e-3 * np.sqrt(2), 0, 0]), np.zeros(1)
        for _ in range(steps):
            eel, state, _ = block.step(eel, state, seconds / steps)
        errors.append(2 * shear * eel[3] / np.sqrt(2) * np.sqrt(3) / exact - 1)
    assert abs(errors[1]) < 1e-3
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


def test_an_increment_in_which_the_midpoint_rule_overshoots_is_given_back_until_it_is_short(tmp_path, gxx):
    """Relaxation from 450 MPa in increments of 720 s, as above; whole ones would end at 21 MPa for 54."""
    A, n = 1e-17, 5.0
    block, shear = Block(gxx, tmp_path, NORTON, {"A": A, "n": n}), ELASTIC.E / 2 / 1.3
    eel, state, left, dt = np.array([0, 0, 0, 450 / shear / np.sqrt(6), 0, 0]), np.zeros(1), 7200.0, 720.0
    assert block.step(eel, state, dt) is None
    while left > 0:
        dt = min(dt, left)
        if (found := block.step(eel, state, dt)) is None:
            dt /= 2
        else:
            eel, state, left, dt = *found[:2], left - dt, 720.0
    exact = (450 ** (1 - n) + 3 * shear * A * (n - 1) * 7200) ** (1 / (1 - n))
    assert 2 * shear * eel[3] * np.sqrt(3 / 2) == pytest.approx(exact, rel=0.01)


def test_an_increment_of_400_converges_to_the_stress_of_that_rate(tmp_path, gxx):
    """Isochoric, s = (rate/A)^(1/n) but for an elastic share of 4e-6; the residual rounds far above epsilon."""
    block = Block(gxx, tmp_path, NORTON, {"A": 1e-14, "n": 4.0})
    deto = 400.0 * np.array([1, -0.5, -0.5, 0, 0, 0])
    eel, _, _ = block.step(np.zeros(6), np.zeros(1), 1e7, guess=1e-6, deto=deto, theta=1.0)
    assert ELASTIC.E / 1.3 * 1.5 * eel[0] == pytest.approx((400 / 1e7 / 1e-14) ** 0.25, rel=1e-5)


@pytest.mark.parametrize("m", [-0.3, -0.6, -0.9])
def test_the_first_increment_from_zero_strain_converges(m, tmp_path, gxx):
    """dp = dt A s^n (dp/2)^m at a stress that hardly relaxes: dp = (dt A s^n 2^-m)^(1/(1-m))."""
    block = Block(gxx, tmp_path, STRAIN_HARDENING, {"A": 1e-22, "n": 5.0, "m": m})
    eel = np.array([0, 0, 0, 1e-3 * np.sqrt(2), 0, 0])
    stress_ = ELASTIC.E / 1.3 * 1e-3 * np.sqrt(3)
    _, state, iterations = block.step(eel, np.zeros(1), 60.0, guess=1e-6)
    assert state[0] == pytest.approx((60 * 1e-22 * stress_**5 * 2**-m) ** (1 / (1 - m)), rel=0.05)
    assert iterations < 40


def test_a_power_of_time_is_integrated_over_equal_increments_from_zero(tmp_path, gxx):
    """At a stress that hardly relaxes p = A s^n t^(1+m)/(1+m); the middle of an increment would be 4 % low."""
    block = Block(gxx, tmp_path, TIME_HARDENING, {"A": 1e-23, "n": 5.0, "m": -0.6})
    eel, state, dt = np.array([0, 0, 0, 1e-3 * np.sqrt(2), 0, 0]), np.zeros(1), 720.0
    held = ELASTIC.E / 1.3 * 1e-3 * np.sqrt(3)
    for k in range(50):
        _, state, _ = block.step(eel, state, dt, elapsed=k * dt)
    assert state[0] == pytest.approx(1e-23 * held**5 * (50 * dt) ** 0.4 / 0.4, rel=1e-5)


# ---- the grammar ---------------------------------------------------------------------------------------------------

STATEMENT = re.compile(
    r"@DSL Implicit;|@Behaviour [A-Za-z_]\w*;|@Brick StandardElasticity;|@Algorithm NewtonRaphson;"
    r"|@(Theta|Epsilon|IterMax) [\d.e-]+;|@ModellingHypotheses \{\"\.\+\"\};"
    r"|@ElasticMaterialProperties \{([\d.e+-]+|\"[^\"]+\"), ([\d.e+-]+|\"[^\"]+\")\};"
    r"|@Parameter \w+ = -?[\d.]+(e[+-]?\d+)?;|@(MaterialProperty|StateVariable|AuxiliaryStateVariable) \w+ \w+;"
    r"|@PhysicalBounds \w+ in \]\*:[\d.e+-]+\];|@Bounds \w+ in \[[\d.e+-]+:[\d.e+-]+\];"
    r"|\w+\.set(Glossary|Entry)Name\(\"\w+\"\);"
)


def bare(text):
    """The text without comments."""
    return re.sub(r"//.*", "", text)


BLOCKS = r"Predictor|Integrator|AdditionalConvergenceChecks|APosteriori\w+Factor|UpdateAuxiliaryStateVariables"


def outside(text):
    """What stands outside of code blocks."""
    rest = re.sub(rf"^@({BLOCKS}) \{{\n.*?^\}}", "", bare(text), flags=re.MULTILINE | re.DOTALL)
    return re.sub(r"^@Description\{ \"[^\"\\]*\" \}$", "", rest, flags=re.MULTILINE)


def test_every_file_keeps_the_grammar():
    for law in LAWS.values():
        text = exported(law, units=Units("Pa", "h"))
        for line in filter(None, map(str.strip, outside(text).splitlines())):
            assert STATEMENT.fullmatch(line), line
        for opening, closing in ("()", "{}", "[]"):
            code = re.sub(r"@(Physical)?Bounds.*", "", bare(text))
            assert code.count(opening) == code.count(closing)
        code = re.search(r"^@Integrator \{\n(.*?)^\}", bare(text), re.MULTILINE | re.DOTALL)[1]
        assert all(line.endswith(";") for line in filter(None, map(str.strip, code.splitlines())))
        used = {*re.findall(r"\w+", code)}
        assert {*declared(text, "Parameter"), *declared(text, "AuxiliaryStateVariable")} <= used
        assert {f"{sign}{variable}" for variable in declared(text, "StateVariable") for sign in "df"} <= used


def test_moduli_are_properties_unless_they_are_known():
    assert "@MaterialProperty stress young;" in exported(NORTON)
    text = exported(NORTON, elastic=Elastic(150e3 - 60.5 * temperature, 0.3), units=Units("Pa"))
    assert '@ElasticMaterialProperties {"150000000000.0 - 60500000.0*T", 0.3};' in text
    with pytest.raises(ExportError, match="no formula of MFront"):
        exported(NORTON, elastic=Elastic(150e3 * sympy.tanh(temperature), 0.3))


def test_time_is_counted_where_a_law_reads_it():
    assert "elapsed" not in exported(NORTON)
    text = exported(COMBINED)
    assert "@AuxiliaryStateVariable real elapsed;" in text
    assert text.endswith("@UpdateAuxiliaryStateVariables {\n  elapsed += dt;\n}\n")


def test_an_internal_variable_that_does_not_start_at_zero_is_held_less_its_start():
    A, C = parameters("A C")
    (left,) = states("left")
    coefficient = Param("rate coefficient", (1e-40, 1e-5), "1/s", "log", 0.0)
    rates = {left: State(1.0, -C * stress * left, meaning="ductility that is left", limit=0.05)}
    text = exported(CreepLaw("ductile", {"x": A * stress / left}, dict.fromkeys((A, C), coefficient), states=rates))
    assert "// left holds the internal variable less its start, 1.0, and starts at 0." in text.splitlines()
    assert "  const real left_now = 1.0 + left + theta * dleft;" in text.splitlines()
    assert "// the material has failed where left reaches -0.95" in text.splitlines()


def test_names_that_mfront_keeps_are_renamed_openly():
    words = parameters("T theta stress_now seq mu domega")
    (omega,) = states("omega")
    law = CreepLaw(
        "odd",
        {"x": words[0] * sympy.exp(-stress / sum(words[1:])) * (1 + omega)},
        {words[0]: Param("rate coefficient", (1e-40, 1e-5), "1/s", "log")}
        | dict.fromkeys(words[1:], Param("number", (1, 8))),
        states={omega: State(0.0, words[0] * stress)},
    )
    text = exported(law)
    other = renamed(text)
    assert {*other} == {word.name for word in words}
    assert {*declared(text, "Parameter")} == {*other.values()}
    assert not {*other.values()} & {"T", "theta", "stress_now", "seq", "mu", "domega"}


def test_nothing_in_a_note_or_a_title_becomes_code():
    params = {symbol: dataclasses.replace(param, meaning="back\\") for symbol, param in NORTON.params.items()}
    law = dataclasses.replace(NORTON.rename("norton", 'odd " title \\ } */'), params=params)
    text = exported(law, notes=["first\n@Theta 1;", "back\\ ", "}"])
    assert not [line for line in text.splitlines() if line.rstrip().endswith("\\")], "the next line would be a comment"
    assert text.count("\n@Theta") == 1
    assert all(STATEMENT.fullmatch(line) for line in filter(None, map(str.strip, outside(text).splitlines())))
