"""Markdown: the equation in $$, a table of values with units, notes and references, as GitHub and Jupyter show them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from creepkit.export import sheet
from creepkit.export.conversion import convert_values
from creepkit.export.latex import latex_number
from creepkit.language.printing import LatexLawPrinter, latex_equations
from creepkit.records import LawWithValues


@dataclass(frozen=True)
class MarkdownExporter:
    """A section of a report."""

    name: str = "markdown"
    title: str = "Markdown with the equation, a table of values, notes and references"
    suffix: str = ".md"

    def text(self, source: LawWithValues) -> str:
        """Return the section, under a heading of the first level."""
        law, converted_values, printer = source.law, convert_values(source), LatexLawPrinter(source.law)
        lines = [f"# {markdown_escaped(source.title)}", "", "$$", r"\begin{aligned}"]
        lines.append(" \\\\\n".join(_aligned_equation(*pair) for pair in latex_equations(law, printer)))
        lines += [r"\end{aligned}", "$$", "", "| Symbol | Meaning | Value | Unit |", "| --- | --- | --- | --- |"]
        lines += [_markdown_row(row, printer) for row in sheet.parameter_rows(source, converted_values)]
        lines += ["", *(markdown_escaped(sentence) for sentence in sheet.remarks(source, converted_values))]
        lines += [f"Valid where ${printer.doprint(relation)}$." for relation in law.constraints]
        lines += _markdown_section("Notes", sheet.note_lines(source)) + _markdown_section("References", law.references)
        return "\n".join(lines) + "\n"


def markdown_escaped(text: str) -> str:
    """Text with Markdown's signs made plain."""
    return re.sub(r"([\\`*_\[\]<>#|$~])", r"\\\1", " ".join(text.split()))


def _aligned_equation(left: str, summands: Sequence[str]) -> str:
    """One equation, a summand a row."""
    first, *rest = summands
    return " \\\\\n".join([f"{left} &= {first}", *(rf"&\quad + {summand}" for summand in rest)])


def _markdown_row(row: sheet.ParameterRow, printer: LatexLawPrinter) -> str:
    symbol = f"{printer.doprint(row.symbol)}{'(0)' if row.is_initial else ''}"
    return f"| ${symbol}$ | {markdown_escaped(row.meaning)} | ${latex_number(row.value)}$ | {markdown_escaped(row.unit)} |"


def _markdown_section(title: str, items: Sequence[str]) -> list[str]:
    return ["", f"## {title}", "", *(f"- {markdown_escaped(item)}" for item in items)] if items else []
