"""What holds in every language: names, units, notes, virgin material, large rates, and what is switched off."""

import ast
import importlib.util
import itertools
import math
import re
import warnings
from pathlib import Path

import mpmath
import numpy as np
import pytest
import sympy

import creepkit as ck
from creepkit.errors import ExportError
from creepkit.exporters.law_files import JsonExporter, read_valued_law
from creepkit.exporters.python import NumpyExporter, PythonExporter
from creepkit.exporters.unit_conversion import coefficient_unit, convert_values, degree
from creepkit.kernels import lower
from creepkit.kernels.multiprecision import MultiprecisionLaw
from creepkit.language import CreepLaw, Param, State, parameters, stress
from creepkit.laws.combined import COMBINED
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.laws.time_hardening import TIME_HARDENING
from creepkit.records import LawWithValues, Units
from helpers.export_cases import LAWS, TOLERANCE, disagreements, renamed
from helpers.exported_programs import LANGUAGES, program_text, rates
from helpers.literature_laws import EQUATIONS
from helpers.registered_laws import registered_laws

PROGRAMS = ("c", "javascript", "python", "numpy", "abaqus", "calculix", "mfront")
GROUPS = (
    "system exit __proto__ constructor lambda class double int",
    "subroutine end do if real statev props dtime",
    "this new delete template E I pi S",
    "N _ NULL M_PI linux errno self values",
    "stdin temp decra qtild call then format main",
    "import None True globalThis toString law kernel point",
    "log y0 printf x least slopes m_rate exp",
    "np errstate choose max é λ x0 await",
)
"""Words of languages, arguments of routines, macros and functions of libraries."""
STRESS, RATE = 100.0, 1e-9
COEFFICIENT = Param("rate coefficient", (1e-40, 1e-5), "1/s", "log", 0.0)


def symbols(group):
    return [sympy.Symbol(name, real=True) for name in group.split()]


def law_of(parameters, states):
    """A law whose rate and whose growth have a closed form of any number of names."""
    c = sympy.Symbol("c", real=True)
    exponent = stress / (300 + sum(k * s for k, s in enumerate(parameters, 1)))
    return CreepLaw(
        "m", {"creep": c * stress * sympy.exp(-exponent)},
        {c: Param("rate", (1e-40, 1e-5), "1/s", "log"), **{s: Param("number", (1, 8)) for s in parameters}},
        states={s: State(0.0, c * stress * k / (2 - s), "variable") for k, s in enumerate(states, 1)},
    )  # fmt: skip


def case(number, swapped):
    """A law of two groups of names, one as parameters, one as internal variables; a point; and its rates."""
    pair = [symbols(GROUPS[number]), symbols(GROUPS[number + 1])]
    parameters, states = pair[::-1] if swapped else pair
    values = [1.5 + 0.25 * k for k in range(len(parameters))]
    now = [0.05 + 0.01 * k for k in range(len(states))]
    total = 300 + sum(k * v for k, v in enumerate(values, 1))
    expected = [RATE * STRESS * math.exp(-STRESS / total)]
    expected += [RATE * STRESS * k / (2 - v) for k, v in enumerate(now, 1)]
    named = {"c": RATE, **{s.name: v for s, v in zip(parameters, values, strict=True)}}
    point = {"stress": STRESS, **{s.name: v for s, v in zip(states, now, strict=True)}}
    return LawWithValues(law_of(parameters, states), named), point, expected


CASES = [(number, swapped) for number in range(0, len(GROUPS), 2) for swapped in (False, True)]


@pytest.mark.parametrize("language", LANGUAGES)
def test_names_of_the_language_may_name_parameters_and_internal_variables(language, tmp_path):
    for one in CASES:
        source, point, expected = case(*one)
        assert rates(language, tmp_path, source, [point])[0] == pytest.approx(expected, rel=TOLERANCE), one


def test_a_name_that_a_language_keeps_is_renamed_openly():
    kept = {"c": "double log y0 printf slopes m_rate", "javascript": "await point kernel", "python": "exp lambda max"}
    kept |= {"numpy": "np exp errstate choose", "abaqus": "end do if", "mfront": "double template"}
    for target, words in kept.items():
        source = LawWithValues(law_of(symbols(words), []), {"c": RATE, **dict.fromkeys(words.split(), 2.0)})
        other = renamed(program_text(target, source))
        assert {*words.split()} <= {*other}, target
        assert not {*other.values()} & {*words.split()}, target


def test_kernels_take_every_name_texts_hold_them_and_json_gives_the_law_back():
    for one in CASES:
        source, point, expected = case(*one)
        kernel, states = lower(source.law), {s.name: point[s.name] for s in source.law.states}
        grown = kernel.state_rates(source.values, stress=STRESS, **states)
        found = [kernel.rate(source.values, stress=STRESS, **states), *(grown[name] for name in states)]
        assert [float(rate) for rate in found] == pytest.approx(expected, rel=TOLERANCE)
        assert read_valued_law(JsonExporter().text(source)).law == source.law
        for target in ("latex", "markdown", "mathml"):
            assert not re.search(r"[\x00-\x09\x0b-\x1f]", program_text(target, source))


@pytest.mark.parametrize("language", ["c", "javascript", "python", "numpy"])
def test_units_are_converted_on_entry_and_rates_on_exit(language, tmp_path):
    """With stress in Pa and time in h, rates are per hour: 3600 of those per second."""
    law = LAWS["foreign Kachanov-Rabotnov"] + TIME_HARDENING
    point = {"stress": 120.0, "strain": 0.01, "time": 7.2e4, "temperature": 1000.0, "omega": 0.3}
    point |= {"principal_stress": 90.0, "mean_stress": 40.0}
    other = point | {"stress": 1.2e8, "principal_stress": 9e7, "mean_stress": 4e7, "time": 20.0}
    source = LawWithValues(law, law.center())
    if language in ("python", "numpy"):  # whose arguments are those that the law uses
        point, other = ({k: v for k, v in p.items() if k not in ("temperature", "mean_stress")} for p in (point, other))
    assert "Stress in Pa, time in h, rates in 1/h" in " ".join(
        program_text(language, source.replace(units=Units("Pa", "h"))).split()
    )
    plain = rates(language, tmp_path, source, [point])
    found = rates(language, tmp_path, source.replace(units=Units("Pa", "h")), [other])
    np.testing.assert_allclose(found, 3600 * plain, rtol=1e-13)


NOTES = (
    "*/ broken", "/* nested", "*/*/ twice", "trigraph ??/", "trigraph ???/", "back\\", "line\n*/ two", '"""', "d\x00e",
    "a\rraise SystemExit", "b\x0craise SystemExit", "c\u2028raise SystemExit", "`${alert(1)}`", "</script>", "<!--",
    "x\n      call abort()", "x & \n     & call abort()", "\x00\u2028*/",
)  # fmt: skip


@pytest.mark.parametrize("language", LANGUAGES)
def test_nothing_in_a_note_becomes_code(language, tmp_path):
    source = LawWithValues(NORTON, {"A": 1e-16, "n": 5.0}, NOTES)
    assert rates(language, tmp_path, source, [{"stress": 100.0}]) == pytest.approx(1e-6, rel=1e-12)
    assert "??" not in program_text("c", source)


@pytest.mark.parametrize("language", ["c", "fortran", "javascript", "python", "numpy"])
def test_virgin_and_unloaded_material_has_finite_rates(language, tmp_path):
    points = [{"stress": 100.0}, {"stress": 0.0, "strain": 0.01, "time": 1.0}, {"stress": 0.0}]
    assert np.isfinite(rates(language, tmp_path, LawWithValues(COMBINED, COMBINED.center()), points)).all()


@pytest.mark.parametrize("language", ["c", "javascript", "numpy", "python"])
def test_beyond_doubles_the_rate_is_infinite_or_an_error(language, tmp_path):
    """Beyond x = 710 sinh(x) has no double, and A sinh(x) does: ln rate = ln A + x - ln 2."""
    law = LAWS["registered hyperbolic-sine"]
    found = rates(language, tmp_path, LawWithValues(law, {"A": 1e-40, "n": 1.0, "B": 1.0}), [{"stress": 750.0}])
    assert math.log(found[0, 0]) == pytest.approx(math.log(1e-40) + 750 - math.log(2), rel=1e-14)
    source = LawWithValues(law, {"A": 1e-5, "n": 8.0, "B": 1.0})
    if language == "python":
        with pytest.raises(OverflowError):
            rates(language, tmp_path, source, [{"stress": 2000.0}])
        return
    with warnings.catch_warnings(action="error"):
        assert rates(language, tmp_path, source, [{"stress": 2000.0}]) == np.inf


def test_what_is_off_is_left_out_and_told_and_a_law_that_is_off_or_has_no_code_is_refused():
    (A,) = parameters("A")
    gamma = CreepLaw("gamma", {"x": A * sympy.gamma(stress)}, {A: COEFFICIENT})
    for target in PROGRAMS:
        text = program_text(target, LawWithValues(COMBINED, {**COMBINED.center(), "A_1": 0.0, "m_1": 0.0}))
        comments = [line for line in text.splitlines() if re.match(r"\s*(!|#|//|\*|/\*)", line)]
        assert any("Note: switched off and left out: A_1 = 0, m_1 = 0" in line for line in comments), target
        assert "log_sinh(" not in "".join(line for line in text.splitlines() if line not in comments), target
        with pytest.raises(ExportError, match="nothing to export"):
            program_text(target, LawWithValues(NORTON, {"A": 0.0, "n": 5.0}))
        with pytest.raises(ExportError, match="cannot be written as .*law 'gamma', term 'x': the function gamma"):
            program_text(target, LawWithValues(gamma, {"A": 1e-9}))


# ---- unit conversion -------------------------------------------------------------------------------------------------

# Degrees of rates, units of rate coefficients and converted values, against the factor by which rates change.


x, y, power, a = sympy.symbols("x y n a", positive=True)
SCALED = [
    3 * x**power * y**-2,
    (x**2 + a * x * y) ** power,
    sympy.exp(x / y) * x,
    x ** (power + sympy.exp(-x / y)),
    sympy.Piecewise((x, x > y), (2 * y, True)),
    sympy.Heaviside(x - y) * x * y,
    sympy.Max(x - y, 0) ** power,
    sympy.Integer(4),
]
UNITS = Units("Pa", "h")


def test_a_rate_changes_by_that_power_of_the_factor_and_others_have_none():
    at = {x: 1.3, y: 0.7, power: 3.2, a: 2.0}
    for expression in SCALED:
        found = degree(expression, {x: 1, y: 1})
        assert found is not None, expression
        ratio = expression.subs({x: 1.7 * x, y: 1.7 * y}, simultaneous=True).subs(at) / expression.subs(at)
        assert float(ratio) == pytest.approx(1.7 ** float(found.subs(at)), rel=1e-12), expression
    for expression in (x + x**2, sympy.exp(x), 1 + x, power**x, sympy.sin(x * y)):
        assert degree(expression, {x: 1, y: 1}) is None, expression


@pytest.mark.parametrize(
    ("law", "name", "unit"),
    [
        (ck.law("norton"), "A", "MPa^-n s^-1"),
        (ck.law("time-hardening"), "A", "MPa^-n s^-(m + 1)"),
        (ck.law("combined"), "A_3", "MPa^-n_3 s^-(m_2 + 1)"),
        (ck.law("norton").fix(n=4.0), "A", "MPa^-4 s^-1"),
        (ck.law("norton").times(ck.arrhenius()), "A", "MPa^-n s^-1"),
        (ck.law("hyperbolic-sine"), "A", ""),  # sinh of a stress over a stress: 1/s
        (ck.law("norton").with_temperature(n=ck.linear()), "A", ""),  # none: the exponent differs with temperature
    ],
)
def test_the_unit_of_a_rate_coefficient(law, name, unit):
    assert coefficient_unit(law, name) == unit
    if name == "A" and unit == "MPa^-n s^-1":
        head = " ".join(ck.export(LawWithValues(law, law.center()), "abaqus").replace("!", " ").split())
        assert f"({unit} for stress in MPa and time in s)" in head


def test_converted_values_give_the_same_rates():
    """At 300 MPa, above the threshold of laws that have one, and at 40 MPa."""
    bad, converted = [], 0
    for name, law in (registered_laws() | EQUATIONS).items():
        source = LawWithValues(law, law.center(), units=UNITS)
        try:
            values = convert_values(source).values
        except ExportError:
            continue
        exact, converted = MultiprecisionLaw(law), converted + 1
        states = np.array([state.initial + 0.1 for state in law.states.values()])
        scales = np.array([1e6 if symbol in law.back_stresses else 1.0 for symbol in law.states])
        factors = [*(3600.0 for _ in law.terms), *(3600.0 * scales)]
        for s, strain, time in ((300.0, 1e-3, 7.2e4), (40.0, 0.02, 3.6e6)):
            native = [s, strain, time, 1073.0, s, s / 3, *states]
            other = [1e6 * s, strain, time / 3600, 1073.0, 1e6 * s, 1e6 * s / 3, *(scales * states)]
            triples = zip(
                factors,
                exact.term_and_state_rates(native, [*source.values.values()]),
                exact.term_and_state_rates(other, [values[power] for power in law.names]),
                strict=True,
            )
            bad += [f"{name}: {b} for {a}" for f, a, b in triples if abs(b - f * a) > 1e-10 * mpmath.mpf(f) * abs(a)]
    assert not bad, "\n".join(bad)
    assert converted > 20


# ---- python ----------------------------------------------------------------------------------------------------------

# The exported Python modules, of numbers and of arrays, run alone and agree with the law in 50 digits.


def module(law, folder, values=None, notes=(), exporter=None, **more):
    """The exported module, loaded; of one number at a time unless another exporter is given."""
    text = (exporter or PythonExporter()).text(LawWithValues(law, values or law.center(), notes, **more))
    (path := folder / "exported_law.py").write_text(text, encoding="utf-8")
    Path(importlib.util.cache_from_source(str(path))).unlink(missing_ok=True)  # of a text as long, a second ago
    loaded = importlib.util.module_from_spec(spec := importlib.util.spec_from_file_location("exported_law", path))
    spec.loader.exec_module(loaded)
    return loaded


def test_every_law_agrees_with_50_digits_wherever_its_rate_is_representable(tmp_path):
    """A rate beyond doubles must raise."""

    def evaluate(name, judged):
        law = LAWS[name]
        loaded, other = module(law, tmp_path, judged.sets[0]), renamed((tmp_path / "exported_law.py").read_text())
        rows = np.array([[[float(row[0])] for row in rows] for rows in judged.truth.rows])
        for k, values in enumerate(judged.sets):
            given = {other.get(symbol, symbol): value for symbol, value in (judged.named(k) | values).items()}
            if judged.truth.rows[k][0][0] > 1.7e308:
                with pytest.raises(OverflowError):
                    loaded.rate(**given)
                continue
            rows[k, 0, 0] = loaded.rate(**given)
            rows[k, 1:, 0] = [*loaded.state_rates(**given).values()] if law.states else []
        return rows, judged.logs(rows[:, 0, 0])

    assert disagreements(evaluate) == []


def test_every_law_agrees_with_50_digits_in_whole_arrays(tmp_path):
    def evaluate(name, judged):
        loaded = module(LAWS[name], tmp_path, judged.sets[0], exporter=NumpyExporter())
        other = renamed((tmp_path / "exported_law.py").read_text())
        rows = [judged.named(k) | values for k, values in enumerate(judged.sets)]
        given = {other.get(symbol, symbol): np.array([row[symbol] for row in rows]) for symbol in rows[0]}
        grown = loaded.state_rates(**given).values() if judged.law.states else []
        columns = [np.broadcast_to(column, len(rows)) for column in (loaded.rate(**given), *grown)]
        return np.stack(columns, axis=1)[:, :, None], judged.logs(columns[0])

    assert disagreements(evaluate) == []


def test_modules_need_math_or_numpy_alone():
    """The error function, which NumPy lacks, comes from the standard library."""
    for law, exporter in itertools.product(LAWS.values(), (PythonExporter(), NumpyExporter())):
        text = exporter.text(LawWithValues(law, law.center()))
        imports = [node for node in ast.walk(ast.parse(text)) if isinstance(node, (ast.Import, ast.ImportFrom))]
        modules = {getattr(node, "module", None) or node.names[0].name for node in imports}
        needed = {"math"} if exporter.name == "python" else {"numpy"} | ({"math"} if "erf" in text else set())
        assert modules == needed, (law.name, exporter.name)


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
