"""The page of a report: structure, text alternatives, files within it, and names that must stay text."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from xml.etree.ElementTree import Element

import html5lib
import pytest

import creepkit as ck
from creepkit.errors import ReportError
from creepkit.reports.blocks import typeset
from creepkit.reports.contents import ReportContents, ReportGroup, StageFailure
from creepkit.reports.html import report_html
from helpers.report_pages import contents, ranking

TAGS = """
html head meta title style body a header h1 h2 h3 h4 p nav ol ul li main section div table caption thead tbody
tr th td details summary dl dt dd b figure figcaption pre code span footer script math mrow mi mn mo mtext
msub msup msubsup mfrac mfenced mtable mtr mtd mover mstyle msqrt mroot noscript svg desc g path text tspan
use defs clipPath rect image
"""
"""Elements that a page may have."""


def parsed(html: str) -> Element:
    """The page by a parser that accepts no error of syntax."""
    return html5lib.HTMLParser(strict=True, namespaceHTMLElements=False).parse(html)


def tag(element: Element) -> str:
    return re.sub(r"\{[^}]*\}", "", str(element.tag))


def elements(root: Element) -> list[Element]:
    return [element for element in root.iter() if isinstance(element.tag, str)]


@cache
def page_of(hostile: bool) -> str:
    return report_html(contents(hostile))


@pytest.fixture(scope="module", params=[False, True], ids=["plain names", "hostile names"])
def page(request: pytest.FixtureRequest) -> str:
    return page_of(request.param)


def test_it_is_html_of_known_elements_alone(page: str) -> None:
    found = elements(parsed(page))
    assert {tag(e) for e in found} <= set(TAGS.split())
    assert not [name for e in found for name in e.attrib if str(name).startswith("on")]
    assert [e.get("type") for e in found if tag(e) == "script"] == ["application/zip"]  # data: none is run


def test_no_script_may_run(page: str) -> None:
    (policy,) = (e.get("content") for e in elements(parsed(page)) if e.get("http-equiv") == "Content-Security-Policy")
    assert "default-src 'none'" in policy
    assert "script-src" not in policy


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("A = 4.2e-05 +- 1e-06, to -3", "A = 4.2 × 10⁻⁵ ± 10⁻⁶, to −3"),
        ("-0.31 [-0.4, inf]", "−0.31 [−0.4, ∞]"),
        ("Vh5205_C-89 at 1.5e3x, 2e-3-b", "Vh5205_C-89 at 1.5e3x, 2e-3-b"),
    ],
)
def test_numbers_are_printed_and_names_stay(text: str, shown: str) -> None:
    assert typeset(text) == shown


def test_it_loads_nothing(page: str) -> None:
    for element in elements(parsed(page)):
        for name, value in element.attrib.items():
            if str(name).endswith(("href", "src")):
                assert value.startswith(("#", "data:"))
            assert "url(" not in value.replace("url(#", "")
    assert not re.search(r"@import|url\(\s*['\"]?(?!#)", page[: page.index("<body>")])


def test_identifiers_are_unique_and_found(page: str) -> None:
    found = elements(parsed(page))
    identifiers = [e.get("id") for e in found if e.get("id")]
    assert len(identifiers) == len(set(identifiers))
    references = [v[1:] for e in found for k, v in e.attrib.items() if str(k).endswith("href") and v.startswith("#")]
    references += [word for e in found for word in e.get("aria-labelledby", "").split()]
    references += [name for e in found for v in e.attrib.values() for name in re.findall(r"url\(#([^)]*)\)", v)]
    assert set(references) <= set(identifiers)


def test_every_figure_has_words_for_those_who_do_not_see_it(page: str) -> None:
    figures = [e for e in elements(parsed(page)) if tag(e) == "svg" and e.get("aria-hidden") is None]
    assert len(figures) == 4  # the answer, the tests one by one, laws compared, forecast
    for figure in figures:
        title, description = (next(e for e in figure if tag(e) == kind) for kind in ("title", "desc"))
        assert figure.get("role") == "img"
        assert figure.get("aria-labelledby") == f"{title.get('id')} {description.get('id')}"
        assert len(title.text or "") > 5
        assert len(description.text or "") > 40
        assert any(tag(e) == "text" and e.text for e in figure.iter())  # letters, not outlines of letters


def test_every_table_has_a_caption_and_heads(page: str) -> None:
    for table in (e for e in elements(parsed(page)) if tag(e) == "table"):
        assert "".join(table[0].itertext()).strip()
        assert tag(table[0]) == "caption"
        heads = [e for e in table.iter() if tag(e) == "th"]
        assert {e.get("scope") for e in heads} == {"col", "row"}
        rows = [len(row) for row in table.iter() if tag(row) == "tr"]
        assert len(set(rows)) == 1


def test_the_same_contents_are_the_same_page() -> None:
    assert report_html(contents()) == page_of(False)


def test_hostile_names_are_shown_as_text() -> None:
    html = page_of(True)
    words = "\n".join(e.text or "" for e in elements(parsed(html)) if tag(e) not in ("script", "style"))
    assert "<script>alert(1)</script>" in words
    assert "onerror=alert(1)>]]></style></svg><!--" in words
    assert "{{ 7 * 7 }} &amp;" in words
    assert "\u202e" not in html
    assert "\x07" not in html
    assert "\x00" not in html
    assert max(map(len, words.splitlines())) < 5000
    names = [e.get("download", "") for e in elements(parsed(html)) if tag(e) == "a" and e.get("download")]
    assert names
    assert all(re.fullmatch(r"[A-Za-z0-9_-][A-Za-z0-9._-]*", name) for name in names)


def test_what_failed_is_said_and_the_rest_is_there() -> None:
    laws_alone = replace(ranking().best, histories=(), predictor=None)  # as from a file: nothing is drawn
    groups = (ReportGroup("good", laws_alone), ReportGroup("bad", None, (), "no frames are left"))
    html = report_html(ReportContents("T", groups, failures=(StageFailure("forecast", "no test 'x'"),)))
    first = html[: html.index('id="values"')]
    assert "This report is not complete. Failed: forecast, identification of bad." in first
    last = html[html.index('id="missing"') :]
    assert "No frames are left." in last
    assert "strain-hardening" in first.lower().replace(" ", "-")
    assert "<svg" not in html


# ---- ck.report -------------------------------------------------------------------------------------------------------


def test_the_verb_takes_results_and_keeps_existing_files(tmp_path: Path) -> None:
    path = ck.report(ranking(), tmp_path / "page.html", title="Bars & rods")
    html = path.read_text(encoding="utf-8")
    assert "<title>Bars &amp; rods</title>" in html
    assert 'download="strain-hardening_law.f"' in html
    path.write_text(html + "<!-- a remark by hand -->", encoding="utf-8")
    with pytest.raises(ReportError, match="creepkit did not write it"):
        ck.report(ranking(), path)
    with pytest.raises(ck.errors.CreepkitError, match=r"source of report\(\) is 3"):
        ck.report(3, tmp_path / "other.html")
    with pytest.raises(ReportError, match="nothing to report"):
        ck.report([], tmp_path / "other.html")


def test_identifications_of_the_same_tests_are_ranked() -> None:
    from creepkit.reports.report import report_contents

    fits = [one.fit for one in ranking().laws]
    (group,) = report_contents(fits).groups
    assert {r.fit.law.name for r in group.result.laws} == {"norton", "strain-hardening"}
