"""The exported Python module runs alone and agrees with the law in 50 digits."""

import ast
import importlib.util
import math

import numpy as np
import pytest
import sympy

from creepkit.errors import ExportError
from creepkit.exporters.python import PythonExporter
from creepkit.language import CreepLaw, Param, State, arrhenius, linear, parameters, states, stress
from creepkit.laws.combined import COMBINED
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.laws.time_hardening import TIME_HARDENING
from creepkit.records import LawWithValues, Units
from helpers.export_cases import LAWS, TOLERANCE, case, renamed

A, n, C = parameters("A n C")
(omega,) = states("omega")
COEFFICIENT = Param("rate coefficient", (1e-40, 1e-5), "1/s", "log", 0.0)
DAMAGE = CreepLaw(
    name="damage",
    title='Power law with "damage"',
    terms={"creep": A * (stress / (1 - omega)) ** n},
    params={A: COEFFICIENT, n: Param("exponent", (1, 8)), C: Param("damage coefficient", (1e-12, 1e-6), "1/s", "log")},
    states={omega: State(0.05, C * sympy.sqrt(stress) / (1 - omega) ** 2, meaning="damage", limit=0.99)},
)


def module(law, folder, values=None, notes=(), **more):
    source = LawWithValues(law, values or law.center(), notes, **more)
    path = folder / "exported_law.py"
    path.write_text((PythonExporter()).text(source), encoding="utf-8")
    spec = importlib.util.spec_from_file_location("exported_law", path)
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    return loaded


def worst_of(name, folder):
    """The largest difference from 50 digits, in words and as a number; a rate beyond doubles must raise."""
    judged, law = case(name), LAWS[name]
    loaded, other = module(law, folder, judged.sets[0]), renamed((folder / "exported_law.py").read_text())
    rows = np.array([[[float(row[0])] for row in rows] for rows in judged.truth.rows])
    for k, values in enumerate(judged.sets):
        given = {other.get(symbol, symbol): value for symbol, value in (judged.named(k) | values).items()}
        if judged.truth.rows[k][0][0] > 1.7e308:
            with pytest.raises(OverflowError):
                loaded.rate(**given)
            continue
        rows[k, 0, 0] = loaded.rate(**given)
        if law.states:
            rows[k, 1:, 0] = [*loaded.state_rates(**given).values()]
    return judged.worst(rows, judged.logs(rows[:, 0, 0]))


def test_every_law_agrees_with_50_digits_wherever_its_rate_is_representable(tmp_path):
    judged = [worst_of(name, tmp_path) for name in LAWS]
    bad = [told for told, size in judged if not size < TOLERANCE]
    assert not bad, "\n".join(bad)


def test_state_rates_agree_too(tmp_path):
    loaded = module(DAMAGE, tmp_path)
    assert loaded.INITIAL == {"omega": 0.05}
    assert loaded.LIMIT == {"omega": 0.99}
    found = loaded.state_rates(stress=144.0, omega=0.5, C=1e-8)
    assert found == {"omega": pytest.approx(1e-8 * 12 / 0.25, rel=1e-14)}


def test_units_are_converted_on_entry_and_rates_on_exit(tmp_path):
    """A rate of 1e-9/s is 3.6e-6/h; 144 MPa are 1.44e8 Pa and 7200 s are 2 h."""
    law = DAMAGE + TIME_HARDENING
    plain = module(law, tmp_path)
    point = {"omega": 0.5}
    expected, grown = plain.rate(144.0, time=7200.0, **point), plain.state_rates(144.0, time=7200.0, **point)
    other = module(law, tmp_path, units=Units("Pa", "h"))
    assert other.rate(1.44e8, time=2.0, **point) == pytest.approx(3600 * expected, rel=1e-13)
    assert other.state_rates(1.44e8, time=2.0, **point)["omega"] == pytest.approx(3600 * grown["omega"], rel=1e-13)
    assert "stress : von Mises stress, Pa" in other.rate.__doc__
    assert "1/h" in other.rate.__doc__


def test_what_is_off_is_left_out_and_told(tmp_path):
    module(COMBINED, tmp_path, {**COMBINED.center(), "A_1": 0.0, "m_1": 0.0})
    text = (tmp_path / "exported_law.py").read_text()
    assert "# Note: switched off and left out: A_1 = 0, m_1 = 0" in text.splitlines()
    assert "sinh" not in text.replace("combined: Combined", "")


def test_values_are_the_defaults(tmp_path):
    loaded = module(NORTON, tmp_path, {"A": 1e-16, "n": 5.2})
    assert loaded.rate(80) == pytest.approx(1e-16 * 80**5.2, rel=1e-13)
    assert loaded.rate(80, n=4) == pytest.approx(1e-16 * 80**4, rel=1e-13)


def test_the_sine_does_not_overflow_where_the_rate_is_representable(tmp_path):
    """Beyond x = 710 sinh(x) has no double; A sinh(x) does: ln rate = ln A + x - ln 2."""
    loaded = module(HYPERBOLIC_SINE, tmp_path, {"A": 1e-40, "n": 1, "B": 1.0})
    with pytest.raises(OverflowError):
        math.sinh(750.0)
    assert math.log(loaded.rate(750.0)) == pytest.approx(math.log(1e-40) + 750 - math.log(2), rel=1e-14)


def test_a_coefficient_of_zero_switches_its_term_off(tmp_path):
    loaded = module(COMBINED, tmp_path, {**COMBINED.center(), "A_1": 0.0, "A_2": 0.0})
    alone = module(COMBINED.only("time hardening"), tmp_path)
    assert loaded.rate(100, time=100.0) == pytest.approx(alone.rate(100, time=100.0), rel=1e-13)
    assert loaded.rate(100, time=100.0, A_3=0.0) == 0.0


def test_virgin_material_has_a_finite_rate(tmp_path):
    assert math.isfinite(module(COMBINED, tmp_path).rate(100, strain=0.0, time=0.0))
    assert module(NORTON, tmp_path).rate(0.0) < 1e-100


def test_what_the_law_uses_must_be_given_and_the_rest_may_be(tmp_path):
    loaded = module(STRAIN_HARDENING, tmp_path)
    with pytest.raises(TypeError, match="strain"):
        loaded.rate(100)
    assert loaded.rate(100, strain=0.01, time=5.0, temperature=900.0) == loaded.rate(100, strain=0.01)


def test_branches_are_taken_lazily(tmp_path):
    A_, B_ = parameters("A B")
    guarded = CreepLaw(
        "guarded",
        {"x": A_ * (1 + sympy.Piecewise((1 / (stress - B_), stress > B_), (0, True)))},
        {A_: COEFFICIENT, B_: Param("threshold", (1, 10), "MPa")},
    )
    loaded = module(guarded, tmp_path, {"A": 1e-9, "B": 5.0})
    assert loaded.rate(5.0) == pytest.approx(1e-9, rel=1e-13)
    assert loaded.rate(7.0) == pytest.approx(1.5e-9, rel=1e-13)


def test_the_module_needs_math_alone_and_says_what_it_is():
    law = COMBINED.times(arrhenius())
    source = LawWithValues(law, law.center(), ["n_1 = 4.5 +- 0.2", "700 to\n900 C"])
    text = PythonExporter().text(source)
    imports = [node for node in ast.walk(ast.parse(text)) if isinstance(node, (ast.Import, ast.ImportFrom))]
    assert [node.module for node in imports] == ["math"]
    for line in (
        "# Stress in MPa, time in s, rates in 1/s, temperature in K (R = 8.314462618 J/(mol K)). "
        "stress is a ratio to 1 MPa, time to 1 s, rates are per s.",
        "#   Q = 475000.0 J/mol, activation energy",
        "# Source: Garofalo (1963), Trans. AIME 227, 351",
        "# Note: n_1 = 4.5 +- 0.2",
        "# Note: 700 to",
        "# 900 C",
        "        # strain hardening",
    ):
        assert line in text.splitlines()


def test_constraints_are_told():
    text = PythonExporter().text(LawWithValues(NORTON.with_temperature(n=linear()), {"A": 1e-16, "n": 5, "n_T": 1e-9}))
    assert "# Valid where n + n_T*(temperature - 1073.15) >= 0." in text


def test_nothing_in_a_note_becomes_code(tmp_path):
    notes = ['"""', "a\rraise SystemExit", "b\x0craise SystemExit", "c\u2028raise SystemExit", "d\x00e"]
    assert module(NORTON, tmp_path, notes=notes).rate(100) > 0


@pytest.mark.parametrize("meaning", ["\"\"\"'''", "back\\", "\\x", '"""; raise SystemExit; """'])
def test_nothing_in_a_meaning_becomes_code(meaning, tmp_path):
    (omega,) = states("omega")
    A, n = NORTON.params
    law = CreepLaw(
        "odd", {"term": A * stress**n}, NORTON.params, states={omega: State(0.0, A * stress, meaning=meaning)}
    )
    assert module(law, tmp_path).rate(100, omega=0) > 0


def test_words_of_python_and_math_may_name_parameters(tmp_path):
    names = parameters("exp lambda log max")
    exp, lambda_, log, largest = names
    law = CreepLaw(
        "odd",
        {"x": exp * sympy.exp(stress / lambda_) * sympy.Max(stress, largest) ** log},
        dict.fromkeys((exp,), COEFFICIENT) | dict.fromkeys((lambda_, log, largest), Param("number", (1, 8))),
    )
    loaded = module(law, tmp_path, {"exp": 1e-9, "lambda": 4.0, "log": 2.0, "max": 3.0})
    assert renamed((tmp_path / "exported_law.py").read_text()) == {name.name: f"{name}_2" for name in names}
    assert loaded.rate(8.0) == pytest.approx(1e-9 * math.exp(2) * 64, rel=1e-13)


def test_a_function_without_a_form_in_python_is_refused():
    law = CreepLaw("gamma", {"x": A * sympy.gamma(stress)}, {A: COEFFICIENT})
    with pytest.raises(ExportError, match="cannot be written as Python: law 'gamma', term 'x': the function gamma"):
        PythonExporter().text(LawWithValues(law, {"A": 1e-9}))
