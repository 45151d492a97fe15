"""The exported Python modules, of numbers and of arrays, run alone and agree with the law in 50 digits."""

import ast
import importlib.util
import itertools

import numpy as np
import pytest
import sympy

from creepkit.exporters.python import NumpyExporter, PythonExporter
from creepkit.language import CreepLaw, Param, State, arrhenius, parameters, states, stress
from creepkit.laws.combined import COMBINED
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.records import LawWithValues
from helpers.export_cases import LAWS, disagreements, renamed

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


def module(law, folder, values=None, notes=(), exporter=None, **more):
    """The exported module, loaded; of one number at a time unless another exporter is given."""
    source = LawWithValues(law, values or law.center(), notes, **more)
    path = folder / "exported_law.py"
    path.write_text((exporter or PythonExporter()).text(source), encoding="utf-8")
    spec = importlib.util.spec_from_file_location("exported_law", path)
    loaded = importlib.util.module_from_spec(spec)
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


def test_arguments_and_parameters_broadcast(tmp_path):
    loaded, plain = module(COMBINED, tmp_path, exporter=NumpyExporter()), module(COMBINED, tmp_path)
    stresses, strains, exponents = np.array([80.0, 120.0]), np.array([1e-3, 1e-2, 1e-1]), np.array([3.0, 4.0, 5.0, 6.0])
    found = loaded.rate(stresses[:, None, None], strain=strains[:, None], time=3600.0, n_1=exponents)
    expected = [[[plain.rate(s, strain=e, time=3600.0, n_1=k) for k in exponents] for e in strains] for s in stresses]
    assert found.shape == (2, 3, 4)
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_modules_need_math_or_numpy_alone():
    """The error function, which NumPy lacks, comes from the standard library."""
    for law, exporter in itertools.product(LAWS.values(), (PythonExporter(), NumpyExporter())):
        text = exporter.text(LawWithValues(law, law.center()))
        imports = [node for node in ast.walk(ast.parse(text)) if isinstance(node, (ast.Import, ast.ImportFrom))]
        modules = {getattr(node, "module", None) or node.names[0].name for node in imports}
        needed = {"math"} if exporter.name == "python" else {"numpy"} | ({"math"} if "erf" in text else set())
        assert modules == needed, (law.name, exporter.name)


def test_state_rates_agree_too(tmp_path):
    loaded = module(DAMAGE, tmp_path)
    assert loaded.INITIAL == {"omega": 0.05}
    assert loaded.LIMIT == {"omega": 0.99}
    found = loaded.state_rates(stress=144.0, omega=0.5, C=1e-8)
    assert found == {"omega": pytest.approx(1e-8 * 12 / 0.25, rel=1e-14)}


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


def test_the_module_says_what_it_is():
    law = COMBINED.times(arrhenius())
    source = LawWithValues(law, law.center(), ["n_1 = 4.5 +- 0.2", "700 to\n900 C"])
    text = PythonExporter().text(source)
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
