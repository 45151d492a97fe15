"""The exported Python module runs alone and agrees with the law in 50 digits."""

import ast
import importlib.util
import math

import mpmath
import pytest
import sympy
from scipy.stats import qmc

from creepkit.errors import ExportError
from creepkit.export import export_text, write_text
from creepkit.export.python import PythonExporter
from creepkit.language import (
    CreepLaw,
    Param,
    State,
    activated,
    arrhenius,
    linear,
    mean_stress,
    parameters,
    states,
    stress,
    temperature,
)
from creepkit.language.symbols import POINT
from creepkit.laws.combined import COMBINED
from creepkit.laws.drifting_exponent import DRIFTING_EXPONENT
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.laws.time_hardening import TIME_HARDENING

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
PIECES = CreepLaw(
    name="pieces",
    terms={
        "threshold": A * sympy.Max(stress - 10, 0) ** n,
        "switch": A * sympy.Piecewise((stress, temperature > 1000), (stress**2, True)),
        "multiaxial": A * sympy.exp(-mean_stress / 50),
    },
    params={A: COEFFICIENT, n: Param("exponent", (1, 8))},
)
LAWS = [
    NORTON,
    STRAIN_HARDENING,
    TIME_HARDENING,
    HYPERBOLIC_SINE,
    DRIFTING_EXPONENT,
    COMBINED,
    DAMAGE,
    PIECES,
    COMBINED.times(arrhenius()),
    COMBINED.fix(A_3=0, n_1=2.5),
    NORTON.with_temperature(n=linear()),
    HYPERBOLIC_SINE.with_temperature(B=activated()).times(arrhenius()),
]
RANGES = {"stress": (1e-3, 2e3), "strain": (1e-12, 1.0), "time": (1e-3, 1e6), "temperature": (900.0, 1300.0)}
RANGES |= {"principal_stress": (1e-3, 2e3), "mean_stress": (1e-3, 700.0), "omega": (0.0, 0.9)}
TOLERANCE = {"hyperbolic-sine[B:activated]*arrhenius": 5e-12}
"""1e-12, but where B depends on T: the rate is sinh(x)^n with n x up to 800, which multiplies the last bits of B(T)."""
LOGARITHMIC = {"stress", "strain", "time", "principal_stress", "mean_stress"}


def module(law, folder, values=None, notes=()):
    path = write_text(law, values or law.center(), PythonExporter(), folder / "exported_law.py", notes)
    spec = importlib.util.spec_from_file_location("exported_law", path)
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    return loaded


def between(low, high, share, logarithmic):
    return low * (high / low) ** share if logarithmic else low + (high - low) * share


def sobol_points(law, count):
    """Points and values over the whole bounds, as (keywords of the point, values)."""
    point = [s.name for s in (*POINT, *law.states) if law.uses(s) or s == stress]
    for row in qmc.Sobol(len(point) + len(law.names), seed=3).random(count):
        shares = iter(row.tolist())
        where = {name: between(*RANGES[name], next(shares), name in LOGARITHMIC) for name in point}
        values = {name: between(*p.bounds, next(shares), p.scale == "log") for name, p in law.table.items()}
        yield where, values


def relative(value, exact):
    return abs((mpmath.mpf(value) - exact) / exact)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
def test_rate_agrees_with_50_digits_wherever_it_is_representable(law, tmp_path):
    rate = module(law, tmp_path).rate
    symbols = [*POINT, *law.states, *law.params]
    exact = sympy.lambdify(symbols, law.rate, "mpmath")
    compared = 0
    with mpmath.workdps(50):
        for where, values in sobol_points(law, 128):
            numbers = {**where, **values}
            truth = exact(*(mpmath.mpf(numbers.get(s.name, 0)) for s in symbols))
            if truth > 1.7e308:
                with pytest.raises(OverflowError):
                    rate(**where, **values)
            elif truth > 1e-290:
                compared += 1
                assert relative(rate(**where, **values), truth) < TOLERANCE.get(law.name, 1e-12), numbers
    assert compared > 20


def test_state_rates_agree_too(tmp_path):
    loaded = module(DAMAGE, tmp_path)
    assert loaded.INITIAL == {"omega": 0.05}
    assert loaded.LIMIT == {"omega": 0.99}
    found = loaded.state_rates(stress=144.0, omega=0.5, C=1e-8)
    assert found == {"omega": pytest.approx(1e-8 * 12 / 0.25, rel=1e-14)}


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
    assert loaded.rate(100, strain=0.01, time=100.0) == pytest.approx(alone.rate(100, time=100.0), rel=1e-13)
    assert loaded.rate(100, strain=0.01, time=100.0, A_3=0.0) == 0.0


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
    text = export_text(law, law.center(), PythonExporter(), ["n_1 = 4.5 +- 0.2", "700 to\n900 C"])
    imports = [node for node in ast.walk(ast.parse(text)) if isinstance(node, (ast.Import, ast.ImportFrom))]
    assert [node.module for node in imports] == ["math"]
    for line in (
        "# Stress in MPa (as a ratio to 1 MPa), time in s, temperature in K, rates in 1/s.",
        "#   Q = 475000.0 J/mol, activation energy",
        "# Source: Garofalo (1963), Trans. AIME 227, 351",
        "# Note: n_1 = 4.5 +- 0.2",
        "# Note: 700 to",
        "# 900 C",
        "        # strain hardening",
    ):
        assert line in text.splitlines()


def test_constraints_are_told():
    text = export_text(NORTON.with_temperature(n=linear()), {"A": 1e-16, "n": 5, "n_T": 0}, PythonExporter())
    assert "# Valid where n + n_T*(temperature - 1073.15) >= 0." in text


def test_nothing_in_a_note_becomes_code(tmp_path):
    notes = ['"""', "a\rraise SystemExit", "b\x0craise SystemExit", "c\u2028raise SystemExit", "d\x00e"]
    assert module(NORTON, tmp_path, notes=notes).rate(100) > 0


def test_words_of_python_and_math_may_name_parameters(tmp_path):
    names = parameters("exp lambda log max")
    exp, lambda_, log, largest = names
    law = CreepLaw(
        "odd",
        {"x": exp * sympy.exp(stress / lambda_) * sympy.Max(stress, largest) ** log},
        dict.fromkeys((exp,), COEFFICIENT) | dict.fromkeys((lambda_, log, largest), Param("number", (1, 8))),
    )
    loaded = module(law, tmp_path, {"exp": 1e-9, "lambda": 4.0, "log": 2.0, "max": 3.0})
    assert loaded.rate(8.0) == pytest.approx(1e-9 * math.exp(2) * 64, rel=1e-13)


def test_a_function_without_a_form_in_python_is_refused():
    law = CreepLaw("gamma", {"x": A * sympy.gamma(stress)}, {A: COEFFICIENT})
    with pytest.raises(ExportError, match="cannot be written as Python: law 'gamma', term 'x': the function gamma"):
        export_text(law, {"A": 1e-9}, PythonExporter())
