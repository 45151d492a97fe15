"""LaTeX, Markdown and MathML: the equation, a table of values with units, and Arrhenius' law in both of its forms.

LaTeX needs amsmath. Markdown holds the equation between $$, as GitHub and Jupyter show it, with notes and references.

MathML: a page of well-formed XHTML whose equations are presentation MathML, with values, notes and references.

Browsers show the file as it is; each <math> element carries its namespace and can be cut out.
"""

from __future__ import annotations

import html
import html.entities
import math
import re
from collections.abc import Iterator, Sequence
from typing import Any

import mpmath
import sympy
from sympy.printing.mathml import MathMLPresentationPrinter

from creepkit.exporters.law_description import (
    ParameterRow,
    comment_lines,
    note_lines,
    parameter_rows,
    printable_text,
    remarks,
)
from creepkit.exporters.unit_conversion import ConvertedValues, convert_values
from creepkit.hookspecs import hookimpl
from creepkit.language.law import CreepLaw
from creepkit.language.printing import ArrheniusExponent, LatexLawPrinter, ReadableSums, latex_equations
from creepkit.language.symbols import mean_stress, principal_stress, strain, stress, temperature, time
from creepkit.records import Exporter, LawWithValues

_LATEX_ESCAPES = {
    "\\": r"\textbackslash{}",
    "{": r"\{",
    "}": r"\}",
    "$": r"\$",
    "&": r"\&",
    "#": r"\#",
    "%": r"\%",
    "_": r"\_",
    "^": r"\textasciicircum{}",
    "~": r"\textasciitilde{}",
}


class LatexExporter:
    """Equation and table of values for a paper."""

    serves = ("tex",)
    name = "latex"
    title = "LaTeX equation and table of values"
    suffix = ".tex"

    def text(self, source: LawWithValues) -> str:
        """Return an align environment and a tabular; notes and references become comments."""
        law, converted_values, printer = source.law, convert_values(source), LatexLawPrinter(source.law)
        comments_text = (source.title, *source.notes, *(f"Source: {reference}" for reference in law.references))
        lines = comment_lines(comments_text, "%")
        lines += equations_in_latex(law, printer)
        lines += [rf"Valid where ${printer.doprint(relation)}$." for relation in law.constraints]
        lines += _value_table(source, converted_values, printer)
        lines += [latex_escaped(sentence) for sentence in remarks(source, converted_values)]
        return "\n".join(lines) + "\n"


def equations_in_latex(law: CreepLaw, printer: LatexLawPrinter | None = None) -> list[str]:
    """The lines of an align environment with the rate of strain and those of internal variables."""
    equations = latex_equations(law, printer or LatexLawPrinter(law))
    return _align_environment([row for left, right in equations for row in _equation_rows(left, right)])


def _equation_rows(left: str, summands: Sequence[str]) -> list[str]:
    """One equation, a summand a row."""
    first, *rest = summands
    return [f"{left} &= {first}", *(rf"&\quad + {summand}" for summand in rest)]


def _align_environment(rows: Sequence[str]) -> list[str]:
    return [r"\begin{align*}", " \\\\\n".join(f"  {row}" for row in rows), r"\end{align*}"]


def _value_table(source: LawWithValues, converted_values: ConvertedValues, printer: LatexLawPrinter) -> list[str]:
    rows = []
    for row in parameter_rows(source, converted_values):
        symbol, value = f"${_row_symbol(row, printer)}$", f"${latex_number(row.value)}$"
        rows.append(rf"  {symbol} & {latex_escaped(row.meaning)} & {value} & {latex_unit(row.unit)} \\")
    heads = r"  Symbol & Meaning & Value & Unit \\"
    return [r"\begin{tabular}{llll}", r"  \hline", heads, r"  \hline", *rows, r"  \hline", r"\end{tabular}"]


def _row_symbol(row: ParameterRow, printer: LatexLawPrinter) -> str:
    return f"{printer.doprint(row.symbol)}{'(0)' if row.is_initial else ''}"


def latex_escaped(text: str) -> str:
    """Text with LaTeX's special characters made plain."""
    return "".join(_LATEX_ESCAPES.get(c, c) for c in text)


def latex_unit(text: str) -> str:
    """A unit for the table, where there is one."""
    return "" if not text else f"${_upright_unit(text)}$"


def latex_number(value: float | mpmath.mpf, digits: int = 6) -> str:
    r"""A number of any size as 4.2 \times 10^{5}."""
    mantissa, _, exponent = mpmath.nstr(mpmath.mpf(value), digits, strip_zeros=True).partition("e")
    mantissa = mantissa.removesuffix(".0")
    return rf"{mantissa} \times 10^{{{int(exponent)}}}" if exponent else mantissa


def _upright_unit(text: str) -> str:
    numerator, _, denominator = text.partition("/")
    if numerator == "1" and re.fullmatch(r"\w+", denominator):
        return rf"\mathrm{{{latex_escaped(denominator)}}}^{{-1}}"
    return rf"\mathrm{{{latex_escaped(text)}}}".replace(" ", r"\,")


class MarkdownExporter:
    """A section of a report."""

    serves = ("md",)
    name = "markdown"
    title = "Markdown with the equation, a table of values, notes and references"
    suffix = ".md"

    def text(self, source: LawWithValues) -> str:
        """Return the section, under a heading of the first level."""
        law, converted_values, printer = source.law, convert_values(source), LatexLawPrinter(source.law)
        lines = [f"# {markdown_escaped(source.title)}", "", "$$", r"\begin{aligned}"]
        rows = [row for left, right in latex_equations(law, printer) for row in _equation_rows(left, right)]
        lines.append(" \\\\\n".join(rows))
        lines += [r"\end{aligned}", "$$", "", "| Symbol | Meaning | Value | Unit |", "| --- | --- | --- | --- |"]
        lines += [_markdown_row(row, printer) for row in parameter_rows(source, converted_values)]
        lines += ["", *(markdown_escaped(sentence) for sentence in remarks(source, converted_values))]
        lines += [f"Valid where ${printer.doprint(relation)}$." for relation in law.constraints]
        lines += _markdown_section("Notes", note_lines(source))
        lines += _markdown_section("References", law.references)
        return "\n".join(lines) + "\n"


def markdown_escaped(text: str) -> str:
    """Text with Markdown's signs made plain."""
    return re.sub(r"([\\`*_\[\]<>#|$~])", r"\\\1", " ".join(text.split()))


def _markdown_row(row: ParameterRow, printer: LatexLawPrinter) -> str:
    cells = (f"${_row_symbol(row, printer)}$", markdown_escaped(row.meaning), f"${latex_number(row.value)}$")
    return f"| {' | '.join(cells)} | {markdown_escaped(row.unit)} |"


def _markdown_section(title: str, items: Sequence[str]) -> list[str]:
    return ["", f"## {title}", "", *(f"- {markdown_escaped(item)}" for item in items)] if items else []


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


class MathmlPrinter(ReadableSums, MathMLPresentationPrinter):  # type: ignore[misc]
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
        text = re.sub(r"&(\w+);", _character_reference, str(super().doprint(kept)))
        text = text.replace("<mo>-</mo>", "<mo>&#x2212;</mo>")  # a minus, where a hyphen is as short as one
        return text.replace("<mo>&#x2062;</mo>", '<mo rspace="0.17em">&#x2062;</mo>')  # b exp, and not bexp

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
        factors, rest = self._factors(expr.args[0])
        if rest != 0:
            factors.append(self._exponential(self._print(rest)))
        return self._node("mrow", *factors)

    def _print_Pow(self, expr: Any) -> Any:
        """[sinh(x)]^n, which sympy prints as sinh(x)^n."""
        if not isinstance(expr.base, sympy.functions.elementary.hyperbolic.HyperbolicFunction):
            return super()._print_Pow(expr)
        opening, closing = self._leaf("mo", "["), self._leaf("mo", "]")
        return self._node("msup", self._node("mrow", opening, self._print(expr.base), closing), self._print(expr.exp))

    def _arrhenius_factor(self, activation: ArrheniusExponent) -> Any:
        """exp[-(Q/R)(1/T - 1/T_ref)], or exp[-Q/(R T)]."""
        sign = [self._leaf("mo", "−")] if activation.sign else []
        below = [self._leaf("mi", symbol) for symbol in ("R" if math.isfinite(activation.T_ref) else "RT")]
        energy = self._node("mfrac", self._print(activation.energy), self._node("mrow", *below))
        if len(below) > 1:
            return self._exponential(self._node("mrow", *sign, energy))
        reference = self._node("mrow", self._leaf("mn", f"{activation.T_ref:g}"), self._leaf("mtext", "\u00a0K"))
        warm, at_reference = (self._node("mfrac", self._leaf("mn", "1"), T) for T in (self._leaf("mi", "T"), reference))
        opening, minus, closing = (self._leaf("mo", sign) for sign in "(−)")
        difference = self._node("mrow", opening, warm, minus, at_reference, closing)
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
    """The exporters of this module."""
    return [LatexExporter(), MarkdownExporter(), MathmlExporter()]
