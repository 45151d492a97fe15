"""Parameters and internal variables by the names of keywords, arguments, macros and functions of the targets."""

import ctypes
import math
import re

import numpy as np
import pytest
import sympy

from creepkit.exporters.c import CExporter
from creepkit.exporters.creep_subroutine import AbaqusCreepSubroutine
from creepkit.exporters.javascript import JavaScriptExporter
from creepkit.exporters.latex import LatexExporter, MarkdownExporter
from creepkit.exporters.law_files import JsonExporter, read_valued_law
from creepkit.exporters.mathml import MathmlExporter
from creepkit.exporters.python import NumpyExporter, PythonExporter
from creepkit.kernels import lower
from creepkit.language import CreepLaw, Param, State, stress
from creepkit.records import LawWithValues
from helpers.compilers import shared_library
from helpers.export_cases import TOLERANCE, renamed
from helpers.javascript import run_in_node

GROUPS = (
    "system exit __proto__ constructor lambda class double int",
    "subroutine end do if real statev props dtime",
    "this new delete template E I pi S",
    "N _ NULL M_PI linux errno self values",
    "stdin temp decra qtild call then format main",
    "import None True globalThis toString law kernel point",
)
STRESS, RATE = 100.0, 1e-9
WITHOUT_WARNING = ("-Wall", "-Wextra", "-Werror")


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
    """A law of two groups of names, one as parameters, one as internal variables; and its rates."""
    pair = [symbols(GROUPS[number]), symbols(GROUPS[number - 1])]
    parameters, states = pair[::-1] if swapped else pair
    values = [1.5 + 0.25 * k for k in range(len(parameters))]
    now = [0.05 + 0.01 * k for k in range(len(states))]
    total = 300 + sum(k * v for k, v in enumerate(values, 1))
    rates = [RATE * STRESS * math.exp(-STRESS / total)]
    rates += [RATE * STRESS * k / (2 - v) for k, v in enumerate(now, 1)]
    law = law_of(parameters, states)
    named = {"c": RATE, **{s.name: v for s, v in zip(parameters, values, strict=True)}}
    return LawWithValues(law, named), {s.name: v for s, v in zip(states, now, strict=True)}, rates


CASES = [(number, swapped) for number in range(0, len(GROUPS), 2) for swapped in (False, True)]


def test_kernels_take_every_name():
    for one in CASES:
        source, states, rates = case(*one)
        kernel = lower(source.law)
        assert float(kernel.rate(source.values, stress=STRESS, **states)) == pytest.approx(rates[0], rel=TOLERANCE)
        found = kernel.state_rates(source.values, stress=STRESS, **states)
        assert [float(found[name]) for name in states] == pytest.approx(rates[1:], rel=TOLERANCE)


@pytest.mark.parametrize("language", [("gcc", "-std=c99"), ("gcc",), ("g++", "-x", "c++")], ids=" ".join)
def test_c_and_cpp(language, tmp_path, request):
    compiler = request.getfixturevalue("gxx" if language[0] == "g++" else "gcc")
    for k, one in enumerate(CASES):
        source, states, rates = case(*one)
        count = len(states)
        text = CExporter().text(source)
        if language[0] == "g++":
            text = f'extern "C" {{\n{text}\n}}\n'
        file = tmp_path / f"law{k}.c"
        file.write_text(text, encoding="utf-8")
        command = [compiler, *language[1:], *WITHOUT_WARNING, file, "-lm"]
        library = shared_library(command, tmp_path / f"law{k}.so")[0]
        library.m_rate.restype = ctypes.c_double
        point = [ctypes.c_double(v) for v in (STRESS, *states.values())]
        assert library.m_rate(*point) == pytest.approx(rates[0], rel=TOLERANCE)
        found, slopes = (ctypes.c_double * count)(), (ctypes.c_double * (count * (1 + count)))()
        library.m_state_rates(*point, found, slopes)
        assert list(found) == pytest.approx(rates[1:], rel=TOLERANCE)


def test_fortran(tmp_path, gfortran):
    (tmp_path / "ABA_PARAM.INC").write_text("      implicit real*8(a-h,o-z)\n      parameter (nprecd=2)\n")
    for k, one in enumerate(CASES):
        source, states, rates = case(*one)
        file = tmp_path / f"law{k}.f"
        file.write_text(AbaqusCreepSubroutine().text(source), encoding="utf-8")
        library = shared_library([gfortran, file], tmp_path / f"law{k}.so")[0]
        x = np.array([STRESS, 0.0, 0.0, 1000.0, STRESS, STRESS / 3, *states.values()])
        out = np.zeros(len(rates) * (1 + len(x)))
        library.m_law_(*(a.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for a in (x, out)))
        assert [math.exp(out[0]), *out[1 : len(rates)]] == pytest.approx(rates, rel=TOLERANCE)


@pytest.mark.parametrize("exporter", [PythonExporter(), NumpyExporter()], ids=["python", "numpy"])
def test_python(exporter):
    for one in CASES:
        source, states, rates = case(*one)
        text = exporter.text(source)
        other, module = renamed(text), {}
        exec(compile(text, "law.py", "exec"), module)
        point = {other.get(name, name): value for name, value in states.items()}
        assert module["rate"](STRESS, **point) == pytest.approx(rates[0], rel=TOLERANCE)
        assert [*module["state_rates"](STRESS, **point).values()] == pytest.approx(rates[1:], rel=TOLERANCE)


PROGRAM = """
async function main(cases) {
  return Promise.all(cases.map(async ({ file, names, values }) => {
    const { rate, stateRates } = await import(file);
    const point = Object.fromEntries([["stress", 100.0], ...names.map((name, k) => [name, values[k]])]);
    const found = stateRates(point);
    return [rate(point), ...names.map((name) => found[name])];
  }));
}
"""


def test_javascript(tmp_path):
    drawn = [case(*one) for one in CASES]
    files = {f"law{k}.mjs": JavaScriptExporter().text(source) for k, (source, _, _) in enumerate(drawn)}
    given = [
        {"file": f"./{name}", "names": [*states], "values": [*states.values()]}
        for name, (_, states, _) in zip(files, drawn, strict=True)
    ]
    for found, (_, _, rates) in zip(run_in_node(tmp_path, PROGRAM, given, files), drawn, strict=True):
        assert found == pytest.approx(rates, rel=TOLERANCE)


def test_texts_hold_every_name_and_json_gives_the_law_back():
    for one in CASES:
        source, _, _ = case(*one)
        assert read_valued_law(JsonExporter().text(source)).law == source.law
        for exporter in (LatexExporter(), MarkdownExporter(), MathmlExporter()):
            assert not re.search(r"[\x00-\x09\x0b-\x1f]", exporter.text(source))


def test_names_of_arguments_can_be_fixed():
    law = law_of(symbols("self values bounds forms"), [])
    fixed = law.fix(self=2.0, values=3.0)
    assert fixed.names == ("c", "bounds", "forms")
    assert law.with_bounds(self=(2.0, 3.0)).table["self"].bounds == (2.0, 3.0)
