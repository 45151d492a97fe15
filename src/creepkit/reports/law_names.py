"""Laws by their titles in sentences, and their equations for a paper, set and as text to copy."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import sympy

from creepkit.exporters.documents import equations_in_latex, expression_mathml
from creepkit.exporters.law_description import comment_lines
from creepkit.language import mean_stress, principal_stress, strain, stress, temperature, time
from creepkit.language.symbols import GAS_CONSTANT
from creepkit.reports.answer import equations, symbols_of
from creepkit.reports.blocks import Block, Formula, Paragraph, Rich, Table, Verbatim, number, printable, printable_lines

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.language import CreepLaw


LONGEST_TITLE = 160
"""Characters of a title within a sentence."""


COMMON_WORD = re.compile(
    r"(a|combined|creep|double|exponential|generali[sz]ed|hyperbolic|linear|logarithmic|modified|power|primary|secondary"
    r"|steady|strain|sum|tertiary|the|threshold|time)\b",
    re.IGNORECASE,
)
"""At the beginning of a title, small within a sentence; other words may be names of people."""


DEPENDENCE = re.compile(r" with [\w-]+ temperature dependence\b")
"""In the title of a law with temperature, which its equation shows."""


FIXED = re.compile(r" with \w+=[\w.+-]+(, \w+=[\w.+-]+)*(?= \+ |$)")
"""At the end of a term: what was fixed, which the name beside its equation says."""


def title_in_sentence(law: CreepLaw) -> str:
    """The title of a law within a sentence: without abbreviations in brackets, and what follows a colon.

    The name of a law that has no title.
    """
    title = DEPENDENCE.sub("", printable(law.title or law.name, LONGEST_TITLE))
    parts = [part.partition(": ")[0] for part in re.sub(r"\s*\([A-Z]{2,4}\)", "", title).split(" + ")]
    return " + ".join(f"{one[:1].lower()}{one[1:]}" if COMMON_WORD.match(one) else one for one in parts)


class LawNames:
    """Names of laws in a text, replaced by titles."""

    def __init__(self, fits: Iterable[Identification]) -> None:
        titles = {fit.law.name: FIXED.sub("", title_in_sentence(fit.law)) for fit in fits}
        shared = Counter(titles.values())
        self.titles = {  # of two of one title the name says which is meant
            name: title if shared[title] == 1 else f"{title} ({name})"
            for name, title in titles.items()
            if title != name
        }
        names = "|".join(map(re.escape, sorted(self.titles, key=len, reverse=True)))
        self._pattern = re.compile(rf"(?<![\w*+-])(?:{names or '(?!)'})(?![\w*+(-])")

    def in_text(self, text: str) -> str:
        """The text with titles in place of names; longer words that begin or end with a name stay as they are."""
        return self._pattern.sub(lambda name: self.titles[name[0]], text)


# ---- equations -------------------------------------------------------------------------------------------------------


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
        blocks.append(Paragraph(f"Eq. ({k}): {title_in_sentence(law)}"))
        blocks += map(Formula, equations(law))
        blocks.append(symbols_table(f"Symbols of Eq. ({k})", law))
    if any("=" in law.title for law in shown):
        blocks.append(Paragraph("A title that ends with a parameter and a value says that it was fixed there.", "note"))
    blocks.append(_variables(shown))
    latex = [
        line
        for k, law in enumerate(shown, start=1)
        for line in (*comment_lines([f"Eq. ({k}): {title_in_sentence(law)}"], "%"), *equations_in_latex(law))
    ]
    return [*blocks, Verbatim("The same equations in LaTeX", printable_lines("\n".join(latex)))]


def symbols_table(caption: str, law: CreepLaw) -> Table:
    """The parameters and internal variables of a law."""
    symbols = symbols_of(law)
    rows = [
        (symbols[name], param.meaning, param.unit, f"{number(param.bounds[0], 3)} to {number(param.bounds[1], 3)}")
        for name, param in law.table.items()
    ]
    for symbol, state in law.states.items():
        end = "" if state.limit is None else f"; the material ruptures where it reaches {state.limit:.10g}"
        meaning = f"internal variable, {state.initial:g} before loading{end}"
        rows.append((_symbol(symbol), meaning, "1", "–"))
    columns = ("symbol", "meaning", "unit", "bounds of the search")
    return Table(caption, columns, rows)


def _symbol(symbol: sympy.Symbol) -> Rich:
    return Rich(str(symbol), expression_mathml(symbol))


def _variables(laws: Sequence[CreepLaw]) -> Table:
    """What the laws depend on, with the gas constant where temperature is among it."""
    used = [one for one in VARIABLES if one[0] is strain or any(law.uses(one[0]) for law in laws)]
    rows = [(_symbol(symbol), meaning, unit or "1") for symbol, meaning, unit in used]
    if any(law.uses(temperature) for law in laws):
        gas = _symbol(sympy.Symbol("R"))
        rows.append((gas, f"gas constant, {GAS_CONSTANT:g}", "J/(mol K)"))
    return Table("Symbols that these equations share", ("symbol", "meaning", "unit"), rows)
