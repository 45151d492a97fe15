"""The exported C compiles without a warning and agrees with 50 digits: rates, derivatives, internal variables."""

import ctypes
import math
import re

import numpy as np
import pytest
import sympy

from creepkit.exporters.c import CExporter
from creepkit.exporters.javascript import JavaScriptExporter, law_expression
from creepkit.language import CreepLaw, Param, State, parameters, states, stress
from creepkit.language.symbols import POINT_VARIABLES
from creepkit.laws.combined import COMBINED
from creepkit.laws.norton import NORTON
from creepkit.records import LawWithValues
from helpers.compilers import shared_library
from helpers.export_cases import LAWS, case, disagreements, labelled_values
from helpers.javascript import run_in_node

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic")


def compile_c(gcc, folder, sources):
    """The exported sources as one library, all in one call of the compiler without a warning."""
    for k, source in enumerate(sources):
        (folder / f"law{k}.c").write_text(CExporter().text(source), encoding="utf-8")
    files = sorted(folder.glob("law*.c"))
    return shared_library([gcc, *STRICT, "-O1", *files, "-lm"], folder / "laws.so")[0]


class Compiled:
    """One law in a library."""

    def __init__(self, library, name, law):
        self.used = [k for k, s in enumerate(POINT_VARIABLES) if s == stress or law.uses(s)]
        self.used += [len(POINT_VARIABLES) + k for k in range(len(law.states))]
        self.states, self.size = len(law.states), len(POINT_VARIABLES) + len(law.states)
        self.entries = {end: getattr(library, f"{name}_{end}", None) for end in ("rate", "log_rate", "state_rates")}
        self.entries["rate"].restype = self.entries["log_rate"].restype = ctypes.c_double

    def arguments(self, point):
        return [ctypes.c_double(point[k]) for k in self.used]

    def rate(self, point):
        return self.entries["rate"](*self.arguments(point))

    def log_rate(self, point):
        """ln rate, and its derivatives to the variables used."""
        slopes = (ctypes.c_double * len(self.used))()
        return self.entries["log_rate"](*self.arguments(point), slopes), list(slopes)

    def state_rates(self, point):
        """Rates, and rows of derivatives."""
        rates, slopes = (ctypes.c_double * self.states)(), (ctypes.c_double * (self.states * len(self.used)))()
        self.entries["state_rates"](*self.arguments(point), rates, slopes)
        return list(rates), np.array(slopes).reshape(self.states, -1)

    def rows(self, point):
        """Value and derivatives of the rate and of each state's rate, and ln rate."""
        rows = np.zeros((1 + self.states, 1 + self.size))
        log, slopes = self.log_rate(point)
        rows[0, 0] = self.rate(point)
        with np.errstate(over="ignore", invalid="ignore"):  # a rate that no double holds is judged by its logarithm
            rows[0, [1 + k for k in self.used]] = rows[0, 0] * np.array(slopes)
        if self.states:
            rates, slopes = self.state_rates(point)
            rows[1:, 0] = rates
            rows[1:, [1 + k for k in self.used]] = slopes
        return rows, log


def test_every_law_agrees_with_50_digits(tmp_path, gcc):
    library = compile_c(gcc, tmp_path, labelled_values().values())

    def evaluate(_, judged):
        pairs = zip(judged.labels, judged.drawn.points, strict=True)
        found = [Compiled(library, label, judged.law).rows(point) for label, point in pairs]
        return np.array([rows for rows, _ in found]), np.array([log for _, log in found])

    assert disagreements(evaluate) == []


# ---- what the text holds -------------------------------------------------------------------------------------------


# ---- what the compiled file does -----------------------------------------------------------------------------------


def test_internal_variables_start_and_end_as_the_law_says(tmp_path, gcc):
    law = LAWS["foreign Kachanov-Rabotnov"]
    library = compile_c(gcc, tmp_path, [LawWithValues(law, law.center(), name="damage")])
    assert ctypes.c_double.in_dll(library, "damage_initial").value == 0.0
    assert ctypes.c_double.in_dll(library, "damage_limit").value == 0.99


# ---- javascript ------------------------------------------------------------------------------------------------------

# The exported JavaScript runs in node without a module beside it and agrees with 50 digits: rates and derivatives.


COEFFICIENT = Param("rate coefficient", (1e-40, 1e-5), "1/s", "log", 0.0)

EVALUATE = """
async function main(cases) {
  return Promise.all(cases.map(async ({ file, sets, points, width }) => {
    const { law, kernel } = await import(file);
    const size = 1 + law.states.length;
    return points.map((point, k) => {
      const { rates, terms, update } = kernel(sets[k]);
      const found = { rates: new Float64Array(size), terms: new Float64Array(law.terms.length),
                      update: new Float64Array(size * (1 + width)) };
      rates(point, found.rates);
      terms(point, found.terms);
      update(point, found.update);
      return found;
    });
  }));
}
"""

CALL = """
async function main({ file, calls }) {
  const module = await import(file);
  return calls.map(([name, ...given]) => {
    try { return module[name](...given); } catch (error) { return String(error); }
  });
}
"""


def called(folder, source, *calls):
    """What functions of an exported module return: calls are (name, arguments ...)."""
    text = JavaScriptExporter().text(source)
    return run_in_node(folder, CALL, {"file": "./law.mjs", "calls": calls}, {"law.mjs": text})


def test_every_law_in_javascript_agrees_with_50_digits(tmp_path):
    cases, files = [], {}
    for name in LAWS:
        judged, file = case(name), f"{case(name).labels[0]}.mjs"
        files[file] = JavaScriptExporter().text(LawWithValues(judged.law, judged.sets[0]))
        sets, points = [[*values.values()] for values in judged.sets], judged.drawn.points
        cases.append({"file": f"./{file}", "sets": sets, "points": points.tolist(), "width": points.shape[1]})
    results = dict(zip(LAWS, run_in_node(tmp_path, EVALUATE, cases, files), strict=True))

    def evaluate(name, judged):
        parts = ("rates", "terms", "update")
        rates, terms, update = (np.array([each[part] for each in results[name]], float) for part in parts)
        samples, size, width = len(rates), rates.shape[1], judged.drawn.points.shape[1]
        slopes = update[:, size:].reshape(samples, size, width)
        with np.errstate(over="ignore", invalid="ignore"):  # a rate that no double holds is judged by its logarithm
            slopes[:, 0] *= rates[:, :1]
        np.testing.assert_allclose(terms.sum(axis=1), rates[:, 0], rtol=1e-12, err_msg=name)
        np.testing.assert_allclose(update[:, 1:size], rates[:, 1:], rtol=1e-12, err_msg=name)
        return np.concatenate([rates[:, :, None], slopes], axis=2), update[:, 0]

    assert disagreements(evaluate) == []


# ---- what the module does ------------------------------------------------------------------------------------------


def test_values_are_the_defaults_and_can_be_changed(tmp_path):
    source = LawWithValues(NORTON, {"A": 1e-16, "n": 5.2})
    found = called(
        tmp_path, source,
        ("rate", {"stress": 80}), ("rate", {"stress": 80}, {"n": 4}), ("terms", {"stress": 80}, {"A": 0}),
    )  # fmt: skip
    assert found[:2] == [pytest.approx(1e-16 * 80**5.2, rel=1e-13), pytest.approx(1e-16 * 80**4, rel=1e-13)]
    assert found[2] == {"power law": 0.0}


def test_wrong_names_and_missing_variables_are_one_sentence(tmp_path):
    source = LawWithValues(NORTON, {"A": 1e-16, "n": 5.2})
    found = called(tmp_path, source, ("rate", {"stress": 80}, {"m": 4}), ("rate", {"strain": 0.1}), ("rate", {"T": 1}))
    assert found == [
        "RangeError: no parameter 'm'; allowed are A, n",
        "RangeError: the law needs a stress",
        "RangeError: no variable 'T'; allowed are stress, strain, time, temperature, principal_stress, mean_stress",
    ]


def test_the_error_function_has_its_digits(tmp_path):
    """Values of DLMF 7.2 to 15 digits, from Python's math, on both sides of where the series ends."""
    (A,) = parameters("A")
    law = CreepLaw("error", {"x": A * (1 + sympy.erf(stress - 10)) / 2}, {A: COEFFICIENT})
    places = [-3.5, -2.0, -0.3, 0.0, 1e-8, 0.7, 1.9, 2.9, 3.1, 5.9, 6.5]
    found = called(tmp_path, LawWithValues(law, {"A": 1e-5}), *(("rate", {"stress": 10 + x}) for x in places))
    expected = [1e-5 * (1 + math.erf((10 + x) - 10)) / 2 for x in places]
    assert found == [pytest.approx(value, rel=1e-10, abs=2e-21) for value in expected]


# ---- what the text holds -------------------------------------------------------------------------------------------


def test_a_module_needs_nothing_but_itself():
    text = JavaScriptExporter().text(LawWithValues(COMBINED, COMBINED.center()))
    assert not re.search(r"\b(import|require|eval|Function|document|window)\b\s*\(", text)
    assert text.endswith("export { law, rate, terms, stateRates, kernel };\n")


HOSTILE = (
    "</script><script>alert(1)</script>", "<!-- <script>", "*/ broken /*", "line\n*/ two", "\x00\u2028alert(1)//",
    "back\\", "`${alert(1)}`", "'quotes\"",
)  # fmt: skip


def hostile_law():
    """A law whose names are words of the language, or of an object, and whose texts try to end what they stand in."""
    words = parameters("await __proto__ constructor point out kernel Math é λ x0 toString")
    (state,) = states("prototype")
    return CreepLaw(
        "</script> `${1}` 'law'",
        {"</script> __proto__": words[0] * sympy.exp(-stress / sum(words[1:]))},
        {words[0]: COEFFICIENT, **{w: Param("</script> */ number", (1, 8)) for w in words[1:]}},
        states={state: State(0.0, words[0] * stress, "</script> */")},
        title="</script><b>",
    )


def test_hostile_names_are_renamed_openly_and_hostile_texts_stay_texts(tmp_path):
    law = hostile_law()
    values = dict.fromkeys(law.names, 2.0) | {"await": 1e-9}
    source = LawWithValues(law, values, HOSTILE)
    found = called(
        tmp_path, source, ("rate", {"stress": 10.0, "prototype": 0.1}), ("terms", {"stress": 10.0}),
        ("stateRates", {"stress": 10.0}),
    )  # fmt: skip
    expected = 1e-9 * math.exp(-10.0 / 20.0)
    assert found[0] == pytest.approx(expected)
    assert found[1] == {"</script> __proto__": pytest.approx(expected)}
    assert found[2] == {"prototype": pytest.approx(1e-8)}
    text = JavaScriptExporter().text(source)
    for name in ("await", "point", "kernel", "Math"):
        assert f"// '{name}' is called {name}_2 here" in text
    assert "// 'λ' is called" in text
    for each in (text, law_expression(source)):
        assert "</script" not in each.lower()
        assert "<!--" not in each


def test_the_expression_for_a_page_keeps_what_is_switched_off(tmp_path):
    source = LawWithValues(COMBINED, {**COMBINED.center(), "A_1": 0.0})
    program = """
    const { law, rate } = (0, eval)(await readFile("law.txt", "utf8"));
    async function main(point) { return [rate(point), rate(point, { A_1: 1e-9 }), law.parameters.length]; }
    """
    point = {"stress": 100.0, "time": 100.0, "strain": 0.01}
    found = run_in_node(tmp_path, program, point, {"law.txt": law_expression(source)})
    added = 1e-9 * math.sinh(100.0 / source.values["B"]) ** source.values["n_1"]
    assert found[1] - found[0] == pytest.approx(added, rel=1e-10)
    assert found[2] == len(COMBINED.params)
