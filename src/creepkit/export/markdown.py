"""Markdown: the equation in $$, a table of values with units, notes and references, as GitHub and Jupyter show them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from creepkit.export import sheet
from creepkit.export.conversion import converted
from creepkit.export.latex import number
from creepkit.language.printing import LawPrinter, equations_of
from creepkit.records import ValuedLaw


@dataclass(frozen=True)
class MarkdownExporter:
    """A section of a report."""

    name: str = "markdown"
    title: str = "Markdown with the equation, a table of values, notes and references"
    suffix: str = ".md"

    def text(self, source: ValuedLaw) -> str:
        """Return the section, under a heading of the first level."""
        law, numbers, printer = source.law, converted(source), LawPrinter(source.law)
        lines = [f"# {plain(source.title)}", "", "$$", r"\begin{aligned}"]
        lines.append(" \\\\\n".join(_equation(*pair) for pair in equations_of(law, printer)))
        lines += [r"\end{aligned}", "$$", "", "| Symbol | Meaning | Value | Unit |", "| --- | --- | --- | --- |"]
        lines += [_row(row, printer) for row in sheet.rows(source, numbers)]
        lines += ["", *(plain(sentence) for sentence in sheet.small_print(source, numbers))]
        lines += [f"Valid where ${printer.doprint(relation)}$." for relation in law.constraints]
        lines += _section("Notes", sheet.notes(source)) + _section("References", law.references)
        return "\n".join(lines) + "\n"


def plain(text: str) -> str:
    """Text with Markdown's signs made plain."""
    return re.sub(r"([\\`*_\[\]<>#|$~])", r"\\\1", " ".join(text.split()))


def _equation(left: str, summands: Sequence[str]) -> str:
    """One equation, a summand a row."""
    first, *rest = summands
    return " \\\\\n".join([f"{left} &= {first}", *(rf"&\quad + {summand}" for summand in rest)])


def _row(row: sheet.Row, printer: LawPrinter) -> str:
    symbol = f"{printer.doprint(row.symbol)}{'(0)' if row.start else ''}"
    return f"| ${symbol}$ | {plain(row.meaning)} | ${number(row.value)}$ | {plain(row.unit)} |"


def _section(title: str, items: Sequence[str]) -> list[str]:
    return ["", f"## {title}", "", *(f"- {plain(item)}" for item in items)] if items else []
