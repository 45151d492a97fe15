"""The equations of laws for a paper: set and numbered, every symbol with its meaning and unit, and as text to copy."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import sympy
from markupsafe import Markup

from creepkit.exporters.latex import equations_in_latex
from creepkit.exporters.law_description import comment_lines
from creepkit.exporters.mathml import expression_mathml, law_equations
from creepkit.language import CreepLaw, mean_stress, principal_stress, strain, stress, temperature, time
from creepkit.language.printing import expression_text, state_equations
from creepkit.language.symbols import GAS_CONSTANT
from creepkit.reports.html.elements import (
    Block,
    Formula,
    Paragraph,
    Table,
    Verbatim,
    number,
    printable,
    printable_lines,
    sentence,
)
from creepkit.reports.html.law_names import title_in_sentence

VARIABLES = (
    (stress, "von Mises stress, as its ratio to 1 MPa", "MPa"),
    (strain, "equivalent creep strain; its dotted form is the creep rate, 1/s", ""),
    (time, "time since the first loading, as its ratio to 1 s", "s"),
    (temperature, "temperature", "K"),
    (principal_stress, "largest principal stress", "MPa"),
    (mean_stress, "mean stress", "MPa"),
)
"""(symbol, meaning, unit) of what laws depend on."""


MOST_EQUATIONS = 20
"""Laws whose equations are set."""


def definition_blocks(laws: Iterable[CreepLaw]) -> list[Block]:
    """Equations, symbols and texts to copy of laws, numbered in their order."""
    shown = [*laws][:MOST_EQUATIONS]
    if not shown:
        return []
    blocks: list[Block] = [Paragraph("The equations of the laws in it:")]
    for k, law in enumerate(shown, start=1):
        blocks.append(Paragraph(f"Eq. ({k}): {sentence(title_in_sentence(law))}"))
        blocks += [Formula(Markup(equation)) for equation in law_equations(law)]
        blocks.append(_symbols(k, law))
    if any("=" in law.title for law in shown):
        blocks.append(Paragraph("A title that ends with a parameter and a value says that it was fixed there.", "note"))
    blocks.append(_variables(shown))
    latex = [
        line
        for k, law in enumerate(shown, start=1)
        for line in (*comment_lines([f"Eq. ({k}): {title_in_sentence(law)}"], "%"), *equations_in_latex(law))
    ]
    plain = [f"Eq. ({k}): {text}" for k, law in enumerate(shown, start=1) for text in _plain(law)]
    return [
        *blocks,
        Verbatim("The same equations in LaTeX", printable_lines("\n".join(latex))),
        Verbatim("The same equations as plain text", printable_lines("\n".join(plain))),
    ]


def _symbols(k: int, law: CreepLaw) -> Table:
    """The parameters and internal variables of a law."""
    rows = [
        (
            Markup(expression_mathml(symbol)),
            printable(law.table[str(symbol)].meaning, 160),
            "1" if param.unit == "1" else param.unit,
            f"{number(param.bounds[0], 3)} to {number(param.bounds[1], 3)}",
        )
        for symbol, param in law.params.items()
    ]
    for symbol, state in law.states.items():
        end = "" if state.limit is None else f"; the material ruptures where it reaches {state.limit:.10g}"
        meaning = f"internal variable, {state.initial:g} before loading{end}"
        rows.append((Markup(expression_mathml(symbol)), meaning, "1", "–"))
    columns = ("symbol", "meaning", "unit", "bounds of the search")
    return Table(f"Symbols of Eq. ({k})", columns, rows)


def _variables(laws: Sequence[CreepLaw]) -> Table:
    """What the laws depend on, with the gas constant where temperature is among it."""
    used = [one for one in VARIABLES if one[0] is strain or any(law.uses(one[0]) for law in laws)]
    rows = [(Markup(expression_mathml(symbol)), meaning, unit or "1") for symbol, meaning, unit in used]
    if any(law.uses(temperature) for law in laws):
        gas = Markup(expression_mathml(sympy.Symbol("R")))
        rows.append((gas, f"gas constant, {GAS_CONSTANT:g}", "J/(mol K)"))
    return Table("Symbols that these equations share", ("symbol", "meaning", "unit"), rows)


def _plain(law: CreepLaw) -> list[str]:
    """The equations of a law on lines of their own, in letters."""
    rate = " + ".join(expression_text(term) for term in law.terms.values())
    lines = [f"ε̇ = {rate}", *state_equations(law)]
    for word, letter in (("stress", "σ"), ("strain", "ε"), ("time", "t"), ("temperature", "T")):
        lines = [line.replace(word, letter) for line in lines]
    return [printable(line.replace("**", "^"), 400) for line in lines]
