"""Sheets for people: Markdown, MathML and LaTeX hold the law, its values in the units asked for, notes and sources."""

import html.entities
import re
import xml.etree.ElementTree as ET

import pytest

from creepkit.errors import ExportError
from creepkit.exporters.documents import (
    MATHML_NAMESPACE,
    LatexExporter,
    MarkdownExporter,
    MathmlExporter,
    MathmlPrinter,
)
from creepkit.language import arrhenius, stress
from creepkit.laws.combined import COMBINED
from creepkit.laws.drifting_exponent import DRIFTING_EXPONENT
from creepkit.laws.norton import NORTON
from creepkit.records import LawWithValues, Units
from creepkit.registry import default_registry
from helpers.literature_laws import EQUATIONS

LAWS = {name: default_registry().law(name) for name in sorted(default_registry().laws())} | EQUATIONS
NOTES = ("n = 4.5 [4.4, 4.6]", "valid from 700 to 900 C\nand below 200 MPa", "a | b & <c> `d` $e$ _f_ *g* \x0b\x00")
ARRHENIUS = LawWithValues(NORTON.times(arrhenius(1073.15)), {"A": 1.2e-16, "n": 5.2, "Q": 4e5}, NOTES)
SHEETS = [MarkdownExporter(), MathmlExporter(), LatexExporter()]


def page(law, **more):
    """The page of MathML, parsed, and its <math> elements."""
    root = ET.fromstring(MathmlExporter().text(LawWithValues(law, law.center(), NOTES, **more)))
    return root, root.findall(f".//{{{MATHML_NAMESPACE}}}math")


def flat(element) -> str:
    """The characters of a formula in reading order, without the invisible product."""
    return re.sub(r"[\s\u2062]", "", "".join(element.itertext()))


# ---- MathML --------------------------------------------------------------------------------------------------------

ARITY = {"mfrac": 2, "msup": 2, "msub": 2, "mroot": 2, "mover": 2, "msubsup": 3}


def test_mathml_is_well_formed_and_every_element_has_its_children():
    for law in LAWS.values():
        check_mathml(law)


def check_mathml(law):
    root, found = page(law)
    assert root.tag == "{http://www.w3.org/1999/xhtml}html"
    assert len(found) == 1 + len(law.states) + 2 * (len(law.params) + len(law.states)) + len(law.constraints)
    for element in (e for one in found for e in one.iter()):
        tag = element.tag.removeprefix(f"{{{MATHML_NAMESPACE}}}")
        assert tag[0] == "m"
        assert tag not in ARITY or len(element) == ARITY[tag]
        assert bool((element.text or "").strip()) == (tag in ("mi", "mn", "mo", "mtext")) or not len(element)


@pytest.mark.parametrize("name", ["combined", "two regimes", "Liu-Murakami", "combined with temperature"])
def test_mathml_names_no_character_that_xml_does_not_know(name):
    law = LAWS[name]
    text = MathmlExporter().text(LawWithValues(law, law.center(), NOTES))
    assert {*re.findall(r"&(\w+);", text)} <= {"amp", "lt", "gt", "quot", "apos"}
    assert not any(
        f"&{known}" in text for known in html.entities.html5 if known in ("InvisibleTimes;", "ExponentialE;")
    )


def test_mathml_reads_as_the_equation():
    _, (rate, *_) = page(COMBINED)
    first, second, third = rate.findall(f".//{{{MATHML_NAMESPACE}}}mtr")
    assert flat(first) == "ε˙cr=A1sinh(σeB)n1"
    assert flat(second) == "+A2εcrm1σen2"
    assert flat(third) == "+A3σen3tm2"


def test_mathml_writes_arrhenius_factors_and_limits_as_papers_do():
    _, (rate, *_) = page(ARRHENIUS.law)
    assert flat(rate) == "ε˙cr=Aσenexp[−QR(1T−11073.15K)]"
    infinite = ET.fromstring(f"<x>{MathmlPrinter().doprint(DRIFTING_EXPONENT.symbol('n_inf'))}</x>")
    assert flat(infinite) == "n∞"
    assert MathmlPrinter().doprint(stress < 3).count("&lt;") == 1


def test_mathml_tells_values_and_text_as_text():
    root, _ = page(NORTON)
    rows = [["".join(cell.itertext()) for cell in row] for row in root.iter("{http://www.w3.org/1999/xhtml}tr")]
    assert rows == [
        ["Symbol", "Meaning", "Value", "Unit"],
        ["A", "rate coefficient", "3.16228×10−23", "1/s"],
        ["n", "stress exponent", "4.5", ""],
    ]
    items = [item.text for item in root.iter("{http://www.w3.org/1999/xhtml}li")]
    assert items[:3] == ["n = 4.5 [4.4, 4.6]", "valid from 700 to 900 C", "and below 200 MPa"]
    assert "a | b & <c> `d` $e$ _f_ *g*" in items


# ---- Markdown ------------------------------------------------------------------------------------------------------


def test_markdown_has_one_table_whose_rows_have_four_cells():
    for law in LAWS.values():
        check_markdown(law)


def check_markdown(law):
    text = MarkdownExporter().text(LawWithValues(law, law.center(), NOTES))
    assert text.count("$$") == 2
    before, equation, after = text.split("$$")
    assert before.startswith("# ")
    assert equation.count("{") == equation.count("}")
    assert equation.count("&=") == 1 + len(law.states)
    assert equation.count(r"&\quad +") == len(law.terms) - 1
    table = [line for line in after.splitlines() if line.startswith("|")]
    assert all(len(re.split(r"(?<!\\)\|", line)) == 6 for line in table)
    assert len(table) == 2 + len(law.params) + len(law.states)
    told = [line.replace("\\", "") for line in after.splitlines() if line.startswith("- ")]
    assert told[-len(law.references) :] == [f"- {reference}" for reference in law.references]


def test_markdown_makes_nothing_of_notes():
    text = MarkdownExporter().text(ARRHENIUS)
    assert r"- a \| b & \<c\> \`d\` \$e\$ \_f\_ \*g\*" in text
    assert r"- n = 4.5 \[4.4, 4.6\]" in text
    assert "| $A$ | rate coefficient | $1.2 \\times 10^{-16}$ | 1/s |" in text
    assert r"\exp\!\left[-\frac{Q}{R}\left(\frac{1}{T} - \frac{1}{1073.15\,\mathrm{K}}\right)\right]" in text


# ---- units ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("exporter", SHEETS, ids=lambda e: e.name)
def test_values_are_told_in_the_units_asked_for_with_the_reference(exporter):
    """A' = 3600 A (1e-6)^n for stress as a ratio to 1 Pa and rates per hour; 1.2e-16 at n = 5.2 gives 2.7257e-44."""
    text = exporter.text(ARRHENIUS.replace(units=Units("Pa", "h")))
    assert 3600 * 1.2e-16 * 1e-6**5.2 == pytest.approx(2.7257e-44, rel=1e-4)
    assert re.search(r"2\.7257\d?", text)
    assert "-44" in text.replace("−", "-")
    assert "stress is a ratio to 1 Pa, time to 1 h, rates are per h" in text
    assert "1.2 " not in text
    assert "J/(mol K)" in text


def test_latex_converts_the_coefficient_without_reference_temperature_too():
    """A_inf = A exp(Q/(R T_ref)): 2.7257e-44/h times e^44.829."""
    text = LatexExporter().text(ARRHENIUS.replace(units=Units("Pa", "h")))
    shown = re.search(r"= ([\d.]+) \\times 10\^\{(.+?)\} \\; \\mathrm\{h\}\^\{-1\}", text)
    found = float(shown[1]) * 10.0 ** int(shown[2])
    assert found == pytest.approx(
        3600 * 1.2e-16 * 1e-6**5.2 * 2.718281828459045 ** (4e5 / (8.314462618 * 1073.15)), rel=1e-5
    )


@pytest.mark.parametrize("exporter", SHEETS, ids=lambda e: e.name)
def test_native_units_leave_values_as_they_are(exporter):
    assert "1.2" in exporter.text(ARRHENIUS)


@pytest.mark.parametrize("exporter", SHEETS, ids=lambda e: e.name)
def test_a_law_that_no_numbers_convert_is_refused(exporter):
    law = EQUATIONS["exponent of time with temperature"]
    with pytest.raises(
        ExportError, match="no constants give it with stress is a ratio to 1 Pa.*export it in MPa and s"
    ):
        exporter.text(LawWithValues(law, law.center() | {"m_T": 9e-6}, units=Units("Pa", "h")))


def test_a_law_that_fails_says_when():
    law = EQUATIONS["Kachanov-Rabotnov"]
    assert "The material has failed when omega reaches 0.99." in MarkdownExporter().text(
        LawWithValues(law, law.center())
    )
