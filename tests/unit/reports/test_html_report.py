"""The page of a report: structure, text alternatives, files within it, and names that must stay text."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from xml.etree.ElementTree import Element

import html5lib
import numpy as np
import pytest
import sympy

import creepkit as ck
from creepkit.errors import HistoryError, ReportError
from creepkit.exporters.documents import equations_in_latex, law_equations
from creepkit.inverse.identify import identify
from creepkit.inverse.nuisance_parameters import Perturbation
from creepkit.inverse.selection.discrimination import under_common_covariance
from creepkit.inverse.selection.ranking import Ranking, rank
from creepkit.inverse.settings import IdentificationSettings
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from creepkit.records import Histories
from creepkit.reports.advice import cautions, next_step
from creepkit.reports.answer import interval_digits, key_figures
from creepkit.reports.blocks import typeset
from creepkit.reports.compared_values import judged_readings
from creepkit.reports.contents import ReportContents, ReportGroup, StageFailure
from creepkit.reports.html import report_html
from creepkit.reports.rate_panels import plate_figure
from creepkit.reports.verdicts import combined_change_text
from helpers.rate_tables import whole_life_table
from helpers.report_pages import contents, ranking
from helpers.steady_rate_predictor import Steady, planted

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
        ("A = 4.2e-05 +- 1e-06, to -3", "A = 4.2\xa0×\xa010⁻⁵ ± 10⁻⁶, to −3"),
        (
            "from 3e-05 1/s at 40 MPa, 980 °C for 5 hours",
            "from 3\xa0×\xa010⁻⁵\xa01/s at 40\xa0MPa, 980\xa0°C for 5 hours",
        ),
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
    assert len(figures) == 5  # two panels of the answer, the tests one by one, laws compared, forecast
    assert all(float(e.get("viewBox").split()[2]) < 300 for e in figures[:2])  # as narrow as a telephone, 1/72 inch
    for figure in figures:
        title, description = (next(e for e in figure if tag(e) == kind) for kind in ("title", "desc"))
        assert figure.get("role") == "img"
        assert figure.get("aria-labelledby") == f"{title.get('id')} {description.get('id')}"
        assert len(title.text or "") > 5
        assert len(description.text or "") > 40
        assert any(tag(e) == "text" and e.text for e in figure.iter())  # letters, not outlines of letters


def test_a_sentence_has_25_words_at_most() -> None:
    """A colon and a semicolon end one as well; references of the methods text are none."""
    texts = [
        line
        for e in elements(parsed(page_of(False)))
        if tag(e) in ("p", "li", "figcaption", "caption", "dd") or "prose" in e.get("class", "")
        for line in "".join(e.itertext()).splitlines()
        if not line.startswith("[")
    ]
    sentences = [one for text in texts for one in re.split(r"(?<=[.;:?!])\s", text)]
    assert len(sentences) > 100
    assert [one for one in sentences if len(one.split()) > 25] == []


def test_every_table_has_a_caption_and_heads(page: str) -> None:
    for table in (e for e in elements(parsed(page)) if tag(e) == "table"):
        assert "".join(table[0].itertext()).strip()
        assert tag(table[0]) == "caption"
        heads = [e for e in table.iter() if tag(e) == "th"]
        assert {e.get("scope") for e in heads} == {"col", "row"}
        rows = [len(row) for row in table.iter() if tag(row) == "tr"]
        assert len(set(rows)) == 1


def test_hostile_names_are_shown_as_text() -> None:
    html = page_of(True)
    words = "\n".join(e.text or "" for e in elements(parsed(html)) if tag(e) not in ("script", "style"))
    assert "<script>alert(1)</script>" in words
    assert "onerror=alert(1)>]]></style></svg><!--" in words
    assert "{{ 7 * 7 }} &amp;" in words
    assert not {"\u202e", "\x07", "\x00"} & set(html)
    assert max(map(len, words.splitlines())) < 5000
    names = [e.get("download", "") for e in elements(parsed(html)) if tag(e) == "a" and e.get("download")]
    assert {bool(re.fullmatch(r"[A-Za-z0-9_-][A-Za-z0-9._-]*", name)) for name in names} == {True}


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


# ---- notebook --------------------------------------------------------------------------------------------------------

# Records in a notebook: one line of repr, HTML without scripts, tables of pandas that read back.


def test_a_record_is_one_line_and_a_cell_of_html() -> None:
    found = ranking()
    fit = found.best
    tests = Histories(fit.histories)
    records = [found, fit, tests[0], fit.forecast(tests[0]), fit.predict(tests), tests, fit.correlation()]
    assert [repr(one) for one in records if len(repr(one)) > 300 or "\n" in repr(one)] == []
    shown = (found, fit, fit.law, tests[0], fit.forecast(tests[0]), tests, ck.specimen("bulge"))
    cells = [one._repr_html_() for one in shown]
    for cell in cells:
        html5lib.HTMLParser(strict=True).parseFragment(cell)
        assert "<script" not in cell
    assert "strain hardening" in cells[1].lower().replace("-", " ")
    assert all("<svg" in cell for cell in (*cells[:2], *cells[3:6]))


def test_the_answer_has_a_dozen_lines_of_a_hundred_characters() -> None:
    damaged = ck.identify("kachanov-rabotnov", whole_life_table(np.random.default_rng(1)), starts=1)  # seven parameters
    for answer in (str(ranking()), str(ranking().best), str(damaged)):
        lines = answer.splitlines()
        assert len(lines) <= 12
        assert max(map(len, lines)) <= 100
    assert len(ranking().best.headline.split()) <= 25


def test_tables_hold_the_numbers() -> None:
    fit = ranking().best
    table = fit.to_dataframe()
    assert table.loc["n", "value"] == fit.values["n"]
    assert list(ranking().to_dataframe().index) == [one.fit.law.name for one in ranking().laws]
    test = fit.histories[0]
    frame = test.to_dataframe()
    np.testing.assert_array_equal(frame["time_s"], test.times)
    np.testing.assert_array_equal(frame["strain"], test.outputs["strain"])
    again = ck.History.from_dataframe(frame, stress_MPa=50, temperature_C=800, name="bar")
    np.testing.assert_array_equal(again.outputs["strain"], test.outputs["strain"])
    assert (again.condition, again.name) == ("800 °C, 50 MPa", "bar")
    with pytest.raises(HistoryError, match="stress_MPa"):
        ck.History.from_dataframe(frame, temperature_C=800)
    assert len(Histories([test, again]).to_dataframe()) == 2 * len(frame)
    forecast = fit.forecast(test).to_dataframe()
    assert (forecast.low <= forecast.value).all()
    assert (forecast.value <= forecast.high).all()


def test_a_picture_is_drawn_into_axes_that_are_given() -> None:
    from matplotlib.figure import Figure

    fit = ranking().best
    for record in (ranking(), fit, fit.histories[0], Histories(fit.histories), fit.forecast(fit.histories[0])):
        axes = Figure().subplots()
        assert record.plot(ax=axes) is axes.figure, record
        assert axes.lines or axes.images, record
        assert record.plot().axes[0].has_data(), record
    with pytest.raises(ReportError, match="ax=ax"):
        fit.plot(axes)


def test_key_figures_are_those_of_the_law() -> None:
    """Of a power law with Arrhenius's factor the exponent is n, the energy Q; the map has its rate in %/h."""
    law = ck.law("norton").times(ck.arrhenius(T_ref=1073.15))
    tests = planted(law, {"A": 1e-16, "n": 5.2, "Q": 3.5e5}, [(s, T) for s in (40, 60) for T in (1050, 1100)], seed=5)
    fit = ck.identify(law, tests, Steady(), starts=1)
    figures = {one.name: one for one in key_figures(fit)}
    np.testing.assert_allclose(figures["stress exponent"].value, fit.values["n"], rtol=1e-6)
    np.testing.assert_allclose(figures["activation energy"].value, fit.values["Q"] / 1e3, rtol=1e-4)
    rate = 3.6e5 * float(fit.rate(fit.reference.stress)[0])
    np.testing.assert_allclose(figures["creep rate"].value, rate, rtol=1e-9)
    (axes,) = plate_figure([("a", fit), ("b", fit)]).axes
    assert {float(line.get_xdata()[0]) for line in axes.lines if line.get_marker() == "o"} == {rate}


# ---- statements ------------------------------------------------------------------------------------------------------

# Sentences and cells that state what the tests say: their numbers against rankings, bounds and closed forms.


SETTINGS = IdentificationSettings(starts=2, sobol_points=16, nuisances=())


@cache
def ranking_by(weights: str, *, wide: bool) -> Ranking:
    """Of a hyperbolic sine, over a range of stress in which a power law is another law, or in which it is not."""
    stresses = (20.0, 40.0, 80.0, 120.0) if wide else (60.0, 60.5, 61.0, 61.5)
    values = {"A": 1e-9, "B": 33.0, "n": 2.0}
    tests = planted(HYPERBOLIC_SINE, values, [(s, 1000.0) for s in stresses], seed=2, noise=3e-4)
    settings = replace(SETTINGS, weights=weights)
    return rank([identify(law, tests, Steady(), settings=settings) for law in (NORTON, HYPERBOLIC_SINE)])


def test_a_law_that_the_search_holds_says_so_first() -> None:
    """An exponent of 9.5, of a search that ends at 8; one that goes on to 16 finds it and says nothing."""
    tests = planted(NORTON, {"A": 1e-26, "n": 9.5}, [(s, 1000.0) for s in (60.0, 80.0, 120.0)], seed=2, noise=3e-4)
    held = identify(NORTON.with_bounds(n=(1.0, 8.0)), tests, Steady(), settings=SETTINGS)
    assert cautions(held)[0].endswith("n = 8, the upper bound of its search; to go on, write bounds = { n = [1, 16] }")
    wide = NORTON.with_bounds(A=(1e-40, 1e-5), n=(1.0, 16.0))
    found = identify(wide, tests, Steady(), settings=SETTINGS)
    assert found.values["n"] == pytest.approx(9.5, rel=0.02)
    assert not any("held" in one for one in cautions(found))
    lost = replace(found, converged=False)
    assert next_step(lost).startswith("repeat the search with more starts (--starts 4, or starts in a study)")


def test_laws_of_equal_weights_are_compared_at_their_optima_under_the_common_covariance() -> None:
    """No other values of a law have a smaller chi-square there: those of the identification itself have none."""
    fits = [one.fit for one in ranking_by("equal", wide=True).laws]
    at_optimum = under_common_covariance(fits).chi_square
    problem = fits[0].least_squares_problem
    for fit, least in zip(fits, at_optimum, strict=True):
        own = fit.least_squares_problem
        for u in (fit.x, fit.x + 1e-3, fit.x - 1e-3):
            assert least <= float((problem.whiten(own.residuals(u).values) ** 2).sum()) * (1.0 + 1e-6)


# ---- intervals ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "half", "digits"), [(2.09e-6, 1e-9, 5), (3.32, 0.05, 3), (3.32, 2.0, 3), (1.0, 1e-12, 7), (0.0, 1.0, 3)]
)
def test_ends_of_an_interval_differ_from_its_value_as_printed(value: float, half: float, digits: int) -> None:
    assert interval_digits(value, value - half, value + half) == digits
    if half > 1e-6 * abs(value):
        assert f"{value:.{digits}g}" != f"{value + half:.{digits}g}"


def test_what_an_interval_does_not_include_adds_in_quadrature() -> None:
    effects = [Perturbation("offset of strain", 1e-4, "", 0.04), Perturbation("thickness", 0.01, "mm", 0.03)]
    assert combined_change_text(effects) == "5 %"
    assert combined_change_text([replace(effects[0], rate_change=0.7)]) == "a factor of 2"
    assert combined_change_text([]) == ""


# ---- equations ------------------------------------------------------------------------------------------------------


def test_a_law_has_one_form_in_mathml_and_latex() -> None:
    """exp(-c s) is a factor in both, and no denominator in one of them."""
    A, c = ck.parameters("A c")
    rate = A * sympy.exp(ck.strain * sympy.exp(-c * ck.stress))
    params = {A: ck.Param("a", (1e-9, 1.0), "1/s", "log"), c: ck.Param("b", (0, 1), "1/MPa")}
    law = ck.CreepLaw(name="x", terms={"x": rate}, params=params)
    (mathml,) = law_equations(law)
    assert "<mfrac>" not in mathml
    assert mathml.count("<mi>exp</mi>") == "\n".join(equations_in_latex(law)).count(r"\exp") == 2


# ---- chi-square of a test --------------------------------------------------------------------------------------------


def test_the_terminal_and_the_report_state_one_chi_square_of_a_test() -> None:
    """Norton bars at a held strain: 1/s^(n-1) grows by (n-1) E A t; one relaxes faster than the law says."""
    times = np.geomspace(36.0, 3.6e5, 30)
    tests = []
    for k, (strain, factor) in enumerate(((0.001, 1.0), (0.0012, 1.0), (0.0014, 1.4), (0.0016, 0.8))):
        noise = 0.3 * np.random.default_rng(k).normal(size=times.size)
        stress = ((1.5e5 * strain) ** -4.0 + 4.0 * 1.5e5 * factor * 1e-18 * times) ** -0.25 + noise
        held = ck.constant_strain(strain)
        elastic = ck.Elastic(1.5e5, 0.3)
        tests.append(
            ck.History(
                f"bar {k}", times, {"stress": stress}, held, 1000.0, "relaxation", elastic=elastic,
                standard_deviation={"stress": np.full(times.size, 0.3)},
            )
        )  # fmt: skip
    fit = ck.identify("norton", tests, starts=1)
    readings = judged_readings(fit)
    assert readings is not None
    rows = [line.split() for line in fit.details().splitlines() if line.startswith("  bar ")]
    # name in two words, condition in five ("727 °C, 0.1 % strain"), error, chi2
    assert [float(row[8]) for row in rows] == [
        pytest.approx(readings.chi_square(k), rel=6e-3) for k in range(len(tests))
    ]
    assert fit.tests[2].outputs[0].errors.chi_square > 2.0 * readings.chi_square(2)
