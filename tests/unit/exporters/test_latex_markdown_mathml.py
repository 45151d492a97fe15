"""Sheets for people: Markdown, MathML and LaTeX hold the law, its values in the units asked for, notes and sources."""

import itertools
import json
import re
import xml.etree.ElementTree as ET

import pytest

from creepkit import available
from creepkit.errors import CreepkitError, ExportError
from creepkit.exporters import documents
from creepkit.exporters.documents import LatexExporter, MarkdownExporter, MathmlExporter, MathmlPrinter
from creepkit.exporters.exporting import export
from creepkit.exporters.law_files import JsonExporter, read_valued_law
from creepkit.language import CreepLaw, Param, State, activated, arrhenius, linear, parameters, states, stress
from creepkit.laws.combined import COMBINED
from creepkit.laws.drifting_exponent import DRIFTING_EXPONENT
from creepkit.laws.norton import NORTON
from creepkit.records import LawWithValues, Units
from creepkit.registry import default_registry, kinds
from helpers.literature_laws import EQUATIONS

LAWS = {name: default_registry().law(name) for name in sorted(default_registry().laws())} | EQUATIONS
NOTES = ("n = 4.5 [4.4, 4.6]", "valid from 700 to 900 C\nand below 200 MPa", "a | b & <c> `d` $e$ _f_ *g* \x0b\x00")
ARRHENIUS = LawWithValues(NORTON.times(arrhenius(1073.15)), {"A": 1.2e-16, "n": 5.2, "Q": 4e5}, NOTES)
SHEETS = [MarkdownExporter(), MathmlExporter(), LatexExporter()]


def page(law, **more):
    """The page of MathML, parsed, and its <math> elements."""
    root = ET.fromstring(MathmlExporter().text(LawWithValues(law, law.center(), NOTES, **more)))
    return root, root.findall(f".//{{{documents.MATHML_NAMESPACE}}}math")


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
        tag = element.tag.removeprefix(f"{{{documents.MATHML_NAMESPACE}}}")
        assert tag[0] == "m"
        assert tag not in ARITY or len(element) == ARITY[tag]
        assert bool((element.text or "").strip()) == (tag in ("mi", "mn", "mo", "mtext")) or not len(element)


def test_mathml_reads_as_the_equation():
    _, (rate, *_) = page(COMBINED)
    first, second, third = rate.findall(f".//{{{documents.MATHML_NAMESPACE}}}mtr")
    assert flat(first) == "ε˙cr=A1[sinh(σeB)]n1"
    assert flat(second) == "+A2εcrm1σen2"
    assert flat(third) == "+A3σen3tm2"


def test_mathml_writes_arrhenius_factors_and_limits_as_papers_do():
    _, (rate, *_) = page(ARRHENIUS.law)
    assert flat(rate) == "ε˙cr=Aσenexp[−QR(1T−11073.15K)]"
    infinite = ET.fromstring(f"<x>{MathmlPrinter().doprint(DRIFTING_EXPONENT.symbol('n_inf'))}</x>")
    assert flat(infinite) == "n∞"
    assert MathmlPrinter().doprint(stress < 3).count("&lt;") == 1


# ---- Markdown ------------------------------------------------------------------------------------------------------


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


@pytest.mark.parametrize("exporter", SHEETS, ids=lambda e: e.name)
def test_a_law_that_no_numbers_convert_is_refused(exporter):
    law = EQUATIONS["exponent of time with temperature"]
    with pytest.raises(
        ExportError, match="no constants give it with stress is a ratio to 1 Pa.*export it in MPa and s"
    ):
        exporter.text(LawWithValues(law, law.center() | {"m_T": 9e-6}, units=Units("Pa", "h")))


# ---- law files -------------------------------------------------------------------------------------------------------

# Exporters: the JSON document comes back, LaTeX holds together, and files are written whole or not at all.


A, n, k_max = parameters("A n k_max")
(omega,) = states("omega")
DAMAGE = CreepLaw(
    name="damage",
    title="Power law with damage",
    terms={"creep": A * (stress / (1 - omega)) ** n},
    params={A: Param("rate coefficient & more", (1e-40, 1e-5), "1/s", "log", 0.0), n: Param("50 % exponent_x", (1, 8))},
    states={omega: State(0.05, A * stress**n, meaning="damage", limit=0.99)},
)
FILE_LAWS = [
    NORTON,
    COMBINED,
    DRIFTING_EXPONENT,
    DAMAGE,
    COMBINED.times(arrhenius()),
    NORTON.with_temperature(n=linear(), A=activated(1100.0)).times(arrhenius()),
    NORTON.times(arrhenius(Q=4e5)),
]
FILE_NOTES = ("intervals: n = 4.5 +- 0.1 (95 %)", "valid from 700 to 900 C\nand 20 to 200 MPa")


def text_of(law, values, exporter, notes=(), **more):
    return exporter.text(LawWithValues(law, values, notes, **more))


FOR_PEOPLE = [available("exporters")[name] for name in ("latex", "markdown", "mathml", "json", "python")]


def test_what_has_no_limits_writes_every_law_with_its_notes():
    for law, exporter in itertools.product(FILE_LAWS, FOR_PEOPLE):
        text = text_of(law, law.center(), exporter, FILE_NOTES)
        assert text.endswith("\n"), (law.name, exporter.name)
        assert "valid from 700 to 900 C" in text, (law.name, exporter.name)


# ---- JSON ----------------------------------------------------------------------------------------------------------


def test_json_comes_back_equal():
    registered = default_registry().values(kinds.LAWS)
    for law in (*FILE_LAWS, *registered):
        values = {name: value * 1.0000000000000002 for name, value in law.center().items()}
        covered = {"stress": (20.0, 80.0), "temperature": (1000.0, 1100.0)}
        source = LawWithValues(law, values, FILE_NOTES, ranges=covered)
        back = read_valued_law(JsonExporter().text(source))
        assert back == source, law.name


def _json(**changes):
    document = json.loads(text_of(NORTON, {"A": 1e-16, "n": 5}, JsonExporter()))
    return json.dumps({**document, **changes})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "mine.json, line 1: not JSON"),
        (_json(version=1), "in version 1 of the format; this one reads version 3: export the law again"),
        (_json(ranges={"temperature": [1100, 900]}), "ranges.temperature is 1100 to 900; the lower number comes first"),
        (_json(gas_constant=8.31), "'gas_constant' is 8.31; creepkit reads 8.314462618 alone"),
        (_json(units={"stress": "Pa", "time": "s", "temperature": "K", "energy": "J/mol"}), "'units' is .*'Pa'"),
    ],
)
def test_a_bad_document_is_one_sentence(text, message):
    with pytest.raises(CreepkitError, match=message) as error:
        read_valued_law(text, "mine.json")
    assert "\n" not in str(error.value)


# ---- LaTeX ---------------------------------------------------------------------------------------------------------


def test_latex_escapes_text():
    text = text_of(DAMAGE, {"A": 1e-16, "n": 5}, LatexExporter())
    assert r"& rate coefficient \& more &" in text
    assert r"50 \% exponent\_x" in text
    assert r"$\omega(0)$ & damage & $0.05$" in text


# ---- files ---------------------------------------------------------------------------------------------------------

VALUED = LawWithValues(NORTON, {"A": 1e-16, "n": 5}, FILE_NOTES)


def test_a_refused_export_leaves_the_old_file(tmp_path):
    path = tmp_path / "norton.json"
    path.write_text("old")
    with pytest.raises(ExportError, match="JSON holds a law in MPa and s"):
        export(VALUED.replace(units=Units("Pa")), "json", to=path, force=True)
    assert path.read_text() == "old"


def test_latex_tells_references_and_keeps_each_comment_a_comment():
    text = LatexExporter().text(VALUED.replace(notes=("one\u2028\\input{two}",)))
    assert f"% Source: {NORTON.references[0]}" in text
    assert "\n% \\input{two}" in text
