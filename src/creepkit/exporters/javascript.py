"""JavaScript: an ES module without imports, with the rate, that of each term and of internal variables, by name.

Its `kernel` is what integrators call: the logarithm of the rate with all derivatives, in the order of
`kernels.interface`. The formulas are those of the other targets, with parameters that may be changed at every call.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from functools import cache
from importlib import resources
from typing import Any

import sympy

from creepkit.exporters.c import STABLE_FUNCTIONS, c_assignments, c_expression, stable_functions_in
from creepkit.exporters.law_code import CodeFunction, Identifiers, LawCode
from creepkit.exporters.law_description import comment_lines, heading, printable_text, refuse_conditions
from creepkit.hookspecs import hookimpl
from creepkit.kernels.kernel_functions import TARGET_FUNCTIONS
from creepkit.language.symbols import POINT_VARIABLES
from creepkit.records import Exporter, LawWithValues

_RESERVED_WORDS = """
abstract arguments async await boolean break byte case catch char class const continue debugger default delete do double
else enum eval export extends false final finally float for function get goto if implements import in instanceof int
interface let long native new null of package private protected public return set short static super switch
synchronized this throw throws transient true try typeof undefined using var void volatile while with yield
Array Float64Array Infinity Math NaN Number Object RangeError String globalThis isFinite isNaN window self document
"""
"""Of all editions of the language, and what the text or a page takes from its surroundings."""


_OWN_NAMES = """
law kernel values point out rates terms update leadingExponent exponents rate stateRates pointVariables ordered valuesOf
pointOf value other least fabs
"""
"""Names of the text itself."""


_MATH_FUNCTIONS = (
    "abs", "asinh", "atan", "cos", "cosh", "exp", "expm1", "log", "log1p", "pow", "sin", "sinh", "sqrt", "tanh",
)  # fmt: skip


JAVASCRIPT_RESERVED = frozenset(
    (*_RESERVED_WORDS.split(), *_OWN_NAMES.split(), *_MATH_FUNCTIONS, *TARGET_FUNCTIONS, *STABLE_FUNCTIONS)
)


EXPORTED_NAMES = ("law", "rate", "terms", "stateRates", "kernel")
"""What a module exports."""


_ERROR_FUNCTION = """\
function erf(value) {
  // its series of positive terms (Abramowitz and Stegun 7.1.6), and the continued fraction of the complement (7.1.14)
  const size = Math.abs(value);
  let result = 0.0;
  if (size < 3.0) {
    for (let k = 1, term = size; term > 1e-17 * result; k += 1) {
      result += term;
      term *= (2.0 * size * size) / (2.0 * k + 1.0);
    }
    result *= (2.0 / Math.sqrt(Math.PI)) * Math.exp(-size * size);
  } else if (size < 6.0) {
    let fraction = size;
    for (let k = 60; k > 0; k -= 1) fraction = size + (0.5 * k) / fraction;
    result = 1.0 - Math.exp(-size * size) / (Math.sqrt(Math.PI) * fraction);
  } else if (size >= 6.0) {
    result = 1.0;
  } else {
    result = NaN;
  }
  return value < 0.0 ? -result : result;
}"""


_ENTRIES = {"rates": "rate", "terms": "terms", "update": "update"}
"""{function of `kernel`: entry of the lowered law}."""


_LINE_LENGTH = 120


class JavaScriptExporter:
    """An ES module with `rate`, `terms` and `stateRates` by name, the values as defaults, and `kernel`."""

    serves = ("js",)
    name = "javascript"
    title = "JavaScript module with the rate, its terms and its derivatives"
    suffix = ".mjs"

    def text(self, source: LawWithValues) -> str:
        """Return the module's text; stress and time are converted on entry, rates on exit."""
        return f"{_JavaScriptLaw(source).text()}\nexport {{ {', '.join(EXPORTED_NAMES)} }};\n"


def law_expression(source: LawWithValues) -> str:
    """The same as one expression whose value has what a module exports, for a script of a page.

    Everything stays in it, what is switched off too. Nothing in it ends a script element.
    """
    refuse_conditions(source.law, "a page")
    body = _JavaScriptLaw(source, keeps_inactive=True).text()
    return f'(() => {{\n"use strict";\n{body}\nreturn Object.freeze({{ {", ".join(EXPORTED_NAMES)} }});\n}})()'


class _JavaScriptLaw:
    """One law as JavaScript."""

    def __init__(self, source: LawWithValues, *, keeps_inactive: bool = False) -> None:
        self.code = LawCode(source, Identifiers(JAVASCRIPT_RESERVED), keeps_inactive=keeps_inactive)
        self.source, self.law = self.code.source, self.code.law

    def text(self) -> str:
        """The text up to what sets a module apart from an expression."""
        kernel = self._kernel()
        called = {name: STABLE_FUNCTIONS[name] for name in stable_functions_in(kernel)}
        functions = [f"const {name} = ({', '.join(inputs)}) => {result};" for name, (inputs, result) in called.items()]
        if any("erf(" in line for line in kernel):
            functions.append(_ERROR_FUNCTION)
        code = "\n".join([*functions, *kernel])
        used = sorted(name for name in {*_MATH_FUNCTIONS} - {"abs"} if re.search(rf"\b{name}\(", code))
        imports = [f"const {{ {', '.join(used)} }} = Math;"] if used else []
        imports += ["const fabs = Math.abs;"] if "fabs(" in code else []
        blocks = [
            "\n".join(self._header(kernel)),
            *(["\n".join(imports)] if imports else []),
            f"const law = Object.freeze({script_safe_json(self._description(), indent=2)});",
            *functions,
            "\n".join(kernel),
            _template(),
        ]
        return "\n\n".join(blocks)

    def _header(self, kernel: Sequence[str]) -> list[str]:
        mentions_floors = any("log_floor" in line or "floored" in line for line in kernel)
        lines = [
            *heading(self.source, mentions_floors=mentions_floors),
            *self.code.renaming_notes(),
            "Points and parameters are objects by the names of the law: rate({stress: 100}, {}). In `kernel` they are",
            "arrays, in MPa and s: stress, strain, time, temperature, largest principal and mean stress, states and",
            "conditions.",
            "A result beyond 1.8e308 is Infinity.",
        ]
        return comment_lines(map(_comment_safe, lines), "//", _LINE_LENGTH)

    def _description(self) -> dict[str, Any]:
        """The constant `law`."""
        law, units = self.law, self.source.units
        parameters = zip(law.table.items(), self.source.values.values(), strict=True)
        return {
            "name": self.source.name or law.name,
            "title": self.source.title,
            "units": {"stress": units.stress, "time": units.time, "temperature": "K"},
            "megapascals": units.megapascals,
            "seconds": units.seconds,
            "variables": [s.name for s in POINT_VARIABLES if law.uses(s)],
            "terms": [*law.terms],
            "parameters": [
                {"name": name, "value": value, "unit": p.unit, "meaning": p.meaning, "scale": p.scale}
                for (name, p), value in parameters
            ],
            "states": [
                {"name": s.name, "initial": z.initial, "limit": z.limit, "unit": z.unit, "meaning": z.meaning}
                for s, z in law.states.items()
            ],
            "conditions": [{"name": one.name, "unit": one.unit} for one in law.conditions],
        }

    # ---- functions -------------------------------------------------------------------------------------------------

    def _kernel(self) -> list[str]:
        """The function that makes the law's functions for given values of the parameters."""
        code = self.code
        places = {symbol: f"point[{k}]" for k, symbol in enumerate((*code.point, *code.states, *code.conditions))}
        closures = {name: _closure(name, code.function(entry), places) for name, entry in _ENTRIES.items()}
        labels = [f"// {_comment_safe(printable_text(label))}" for label in self.law.terms]
        return [
            "/** Functions of the law at values of its parameters, in their order; "
            f"points have {len(places)} numbers. */",
            "function kernel(values) {",
            *([f"  const [{', '.join(map(str, code.parameters))}] = values;"] if code.parameters else []),
            *(f"  const {ln} = log({symbol});" for ln, symbol in code.logarithms.items()),
            "",
            "  // rate, then rates of internal variables",
            *closures["rates"],
            "",
            "  // the rate of each term:",
            *(f"  {label}" for label in labels),
            *closures["terms"],
            "",
            "  // ln of the rate, rates of internal variables, then the derivatives of each to the point, row by row",
            *closures["update"],
            "",
            "  // exponent of time in strain ~ t^b as t -> 0+ from a virgin state at constant stress",
            *self._leading_exponent(),
            "",
            "  return { rates, terms, update, leadingExponent };",
            "}",
        ]

    def _leading_exponent(self) -> list[str]:
        exponents = []
        for (time, strain), coefficients in self.code.leading_exponents():
            active = " && ".join(f"{symbol} !== 0.0" for symbol in coefficients) or "true"
            pair = f"{c_expression(time)}, {c_expression(strain)}"
            exponents.append(f"    [{active}, {pair}],")
        return [
            "  const exponents = [",
            *exponents,
            "  ].filter((e) => e[0]).map((e) => (1.0 + e[1]) / (1.0 - Math.min(e[2], 1.0 - 1e-12)));",
            "  const leadingExponent = exponents.length > 0 ? Math.min(...exponents) : 1.0;",
        ]


def _closure(name: str, function: CodeFunction, places: dict[sympy.Symbol, str]) -> list[str]:
    """A function of `point` that writes into `out`; what depends on the parameters alone is worked out once."""
    varying: set[sympy.Basic] = {*function.inputs}
    constants: list[tuple[sympy.Symbol, sympy.Expr]] = []
    steps: list[tuple[sympy.Symbol, sympy.Expr]] = []
    for symbol, expression in function.assignments:
        varies = not varying.isdisjoint(expression.free_symbols)
        varying |= {symbol} if varies else set()
        (steps if varies else constants).append((symbol, expression))
    return [
        f"  let {name};",
        "  {",
        *(f"    {line}" for line in c_assignments(constants, "const")),
        f"    {name} = (point, out) => {{",
        *(f"      const {symbol} = {places[symbol]};" for symbol in function.inputs),
        *(f"      {line}" for line in c_assignments(steps, "const")),
        *(f"      out[{k}] = {c_expression(output)};" for k, output in enumerate(function.outputs)),
        "    };",
        "  }",
    ]


def _comment_safe(text: str) -> str:
    """Text in which no comment and no script element ends."""
    return text.replace("*/", "* /").replace("</", "< /").replace("<!--", "< !--")


def script_safe_json(value: Any, indent: int | None = None) -> str:
    """A value as JSON that ends no script element of a page, and holds no other than ASCII characters."""
    text = json.dumps(value, allow_nan=False, indent=indent)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


@cache
def _template() -> str:
    text = resources.files("creepkit.exporters").joinpath("templates", "javascript.js").read_text(encoding="utf-8")
    return text.strip()


@hookimpl
def creepkit_exporters() -> list[Exporter]:
    """The exporter of this module."""
    return [JavaScriptExporter()]
