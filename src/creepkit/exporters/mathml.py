"""MathML: a page of well-formed XHTML whose equations are presentation MathML, with values, notes and references.

Browsers show the file as it is; each <math> element carries its namespace and can be cut out.
"""

from __future__ import annotations

import html
import html.entities
import re
from collections.abc import Iterator, Sequence
from typing import Any

import sympy
from sympy.printing.mathml import MathMLPresentationPrinter

from creepkit.exporters.latex import latex_number
from creepkit.exporters.law_description import ParameterRow, note_lines, parameter_rows, printable_text, remarks
from creepkit.exporters.unit_conversion import convert_values
from creepkit.hookspecs import hookimpl
from creepkit.language.law import CreepLaw
from creepkit.language.printing import ArrheniusExponent, arrhenius_exponent
from creepkit.language.symbols import mean_stress, principal_stress, strain, stress, temperature, time
from creepkit.records import Exporter, LawWithValues

MATHML_NAMESPACE = "http://www.w3.org/1998/Math/MathML"


_VARIABLE_NAMES = {
    stress: ("σ", "e"),
    strain: ("ε", "cr"),
    time: ("t", ""),
    temperature: ("T", ""),
    principal_stress: ("σ", "1"),
    mean_stress: ("σ", "m"),
}


_XML_ENTITIES = ("amp", "lt", "gt", "quot", "apos")
"""The names of characters that XML knows itself."""


_STYLE = "table { border-collapse: collapse } td, th { border: 1px solid #999; padding: 0.2em 0.6em; text-align: left }"


class MathmlExporter:
    """A page with the law's equations as presentation MathML."""

    name = "mathml"
    title = "MathML in a page of XHTML, with a table of values, notes and references"
    suffix = ".xhtml"

    def text(self, source: LawWithValues) -> str:
        """Return the page."""
        law, converted_values, printer = source.law, convert_values(source), MathmlPrinter()
        title = _xml_escaped(source.title)
        lines = [
            '<?xml version="1.0" encoding="UTF-8"?>',
            '<html xmlns="http://www.w3.org/1999/xhtml" lang="en">',
            f'<head><meta charset="utf-8"/><title>{title}</title><style>{_STYLE}</style></head>',
            "<body>",
            f"<h1>{title}</h1>",
            *law_equations(law),
            "<table>",
            "<tr><th>Symbol</th><th>Meaning</th><th>Value</th><th>Unit</th></tr>",
            *(_html_row(row, printer) for row in parameter_rows(source, converted_values)),
            "</table>",
            *(f"<p>{_xml_escaped(sentence)}</p>" for sentence in remarks(source, converted_values)),
            *(f"<p>Valid where {_math_element(printer.doprint(relation))}.</p>" for relation in law.constraints),
            *_html_section("Notes", note_lines(source)),
            *_html_section("References", law.references),
            "</body>",
            "</html>",
        ]
        return "\n".join(lines) + "\n"


class Exponential(sympy.Function):  # type: ignore[misc]
    """exp, which sympy's printer takes for a denominator where its exponent is negative."""


class MathmlPrinter(MathMLPresentationPrinter):  # type: ignore[misc]
    """Print with numeric characters instead of names, symbols of the point as in papers, Arrhenius factors as such."""

    def __init__(self) -> None:
        super().__init__({"mul_symbol": None})
        # sympy writes its texts as they are, the sign < of a relation among them
        create_text_node = self.dom.createTextNode
        self.dom.createTextNode = lambda text: create_text_node(text.replace("<", "&lt;").replace(">", "&gt;"))

    def doprint(self, expr: sympy.Basic) -> str:
        """The expression as MathML without a root element."""
        try:
            kept = expr.replace(sympy.exp, Exponential)
        except ValueError:  # of a maximum, which sympy cannot compare with the exponential of a number
            kept = expr
        return re.sub(r"&(\w+);", _character_reference, str(super().doprint(kept)))

    def _print_Symbol(self, sym: Any, style: str = "plain") -> Any:
        if sym in _VARIABLE_NAMES:
            base, subscript = _VARIABLE_NAMES[sym]
            node = self._leaf("mi", base)
            return self._node("msub", node, self._leaf("mtext", subscript)) if subscript else node
        if sym.name.endswith("_inf"):
            stem = super()._print_Symbol(sympy.Symbol(sym.name.removesuffix("_inf")), style)
            return self._node("msub", stem, self._leaf("mi", "∞"))
        return super()._print_Symbol(sym, style)

    def _print_Exponential(self, expr: Any) -> Any:
        activations = {exponent: arrhenius_exponent(exponent) for exponent in sympy.Add.make_args(expr.args[0])}
        factors = [self._arrhenius(activation) for activation in activations.values() if activation]
        rest = sympy.Add(*(part for part, found in activations.items() if not found))
        if rest != 0:
            factors.append(self._exponential(self._print(rest)))
        return self._node("mrow", *factors)

    def _arrhenius(self, activation: ArrheniusExponent) -> Any:
        """exp[-(Q/R)(1/T - 1/T_ref)]."""
        is_negative = activation.Q.could_extract_minus_sign()
        energy = self._node("mfrac", self._print(-activation.Q if is_negative else activation.Q), self._leaf("mi", "R"))
        reference = self._node("mrow", self._leaf("mn", f"{activation.T_ref:g}"), self._leaf("mtext", "\u00a0K"))
        warm, at_reference = (self._node("mfrac", self._leaf("mn", "1"), T) for T in (self._leaf("mi", "T"), reference))
        opening, minus, closing = (self._leaf("mo", sign) for sign in "(−)")
        difference = self._node("mrow", opening, warm, minus, at_reference, closing)
        sign = [] if is_negative else [self._leaf("mo", "−")]
        return self._exponential(self._node("mrow", *sign, energy, difference))

    def _exponential(self, argument: Any) -> Any:
        opening, closing = self._leaf("mo", "["), self._leaf("mo", "]")
        return self._node("mrow", self._leaf("mi", "exp"), self._node("mrow", opening, argument, closing))

    def _node(self, tag: str, *children: Any) -> Any:
        node = self.dom.createElement(tag)
        for child in children:
            node.appendChild(child)
        return node

    def _leaf(self, tag: str, text: str) -> Any:
        return self._node(tag, self.dom.createTextNode(text))


def _character_reference(match: re.Match[str]) -> str:
    """A character by number where XML does not know its name."""
    if match[1] in _XML_ENTITIES:
        return match[0]
    return "".join(f"&#x{ord(c):X};" for c in html.entities.html5[f"{match[1]};"])


# ---- the page ------------------------------------------------------------------------------------------------------


def law_equations(law: CreepLaw) -> Iterator[str]:
    """A display for the rate of strain, a summand a row, and one for each internal variable: <math> elements."""
    printer = MathmlPrinter()
    yield _equation_block(_with_dot(printer.doprint(strain)), [printer.doprint(term) for term in law.terms.values()])
    for symbol, state in law.states.items():
        yield _equation_block(_with_dot(printer.doprint(symbol)), [printer.doprint(state.rate)])


def expression_mathml(expression: sympy.Basic) -> str:
    """An expression as a <math> element."""
    return _math_element(f"<mrow>{MathmlPrinter().doprint(expression)}</mrow>")


def _with_dot(name: str) -> str:
    """The name of a rate: a dot over the letter, not over its index."""
    if name.startswith("<msub><mi>"):
        letter, _, rest = name.removeprefix("<msub>").partition("</mi>")
        return f"<msub><mover>{letter}</mi><mo>&#x2D9;</mo></mover>{rest}"
    return f"<mover>{name}<mo>&#x2D9;</mo></mover>"


def _equation_block(left: str, summands: Sequence[str]) -> str:
    signs = ["=", *["+"] * (len(summands) - 1)]
    names = [left, *["<mrow/>"] * (len(summands) - 1)]
    rows = [
        f'<mtr><mtd style="text-align: right">{name}</mtd><mtd><mo>{sign}</mo></mtd>'
        f'<mtd style="text-align: left">{summand}</mtd></mtr>'
        for name, sign, summand in zip(names, signs, summands, strict=True)
    ]
    return _math_element(f'<mtable displaystyle="true">{"".join(rows)}</mtable>', ' display="block"')


def _math_element(content: str, attributes: str = "") -> str:
    return f'<math xmlns="{MATHML_NAMESPACE}"{attributes}>{content}</math>'


def _html_row(row: ParameterRow, printer: MathmlPrinter) -> str:
    initial = "<mo>(</mo><mn>0</mn><mo>)</mo>" if row.is_initial else ""
    symbol = _math_element(f"<mrow>{printer.doprint(row.symbol)}{initial}</mrow>")
    cells = (symbol, _xml_escaped(row.meaning), _math_element(_mathml_number(row.value)), _xml_escaped(row.unit))
    return f"<tr>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>"


def _mathml_number(value: float) -> str:
    """A number as 4.2 x 10^5."""
    mantissa, _, exponent = latex_number(value).partition(r" \times 10^{")
    sign, magnitude = ("<mo>−</mo>", mantissa[1:]) if mantissa.startswith("-") else ("", mantissa)
    if not exponent:
        return f"<mrow>{sign}<mn>{magnitude}</mn></mrow>"
    power = exponent.rstrip("}").replace("-", "−")
    return f"<mrow>{sign}<mn>{magnitude}</mn><mo>×</mo><msup><mn>10</mn><mn>{power}</mn></msup></mrow>"


def _html_section(title: str, items: Sequence[str]) -> list[str]:
    return (
        [f"<h2>{title}</h2>", "<ul>", *(f"<li>{_xml_escaped(item)}</li>" for item in items), "</ul>"] if items else []
    )


def _xml_escaped(text: str) -> str:
    """Text for XML, which allows no control characters."""
    return html.escape(printable_text(text))


@hookimpl
def creepkit_exporters() -> list[Exporter]:
    """The exporter of this module."""
    return [MathmlExporter()]
