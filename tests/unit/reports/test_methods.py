"""The methods of a report: citations in order, what every material shares said once, and numbers from the records."""

from __future__ import annotations

import base64
import csv
import io
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import yaml

import creepkit as ck
from creepkit.inverse.identification import Identification
from creepkit.reports.contents import ReportContents, ReportGroup
from creepkit.reports.html import report_html
from creepkit.reports.html.citations import CITATIONS, References
from creepkit.reports.html.findings import findings_of
from creepkit.reports.html.methods import methods_text
from helpers.planted_bars import SPL, bars
from helpers.report_pages import ranking


def text_of(*groups: ReportGroup) -> str:
    contents = ReportContents("T", groups)
    return methods_text(contents, [one for one in map(findings_of, groups) if one is not None])


def test_numbers_of_citations_follow_the_text_and_not_the_order_of_the_calls() -> None:
    references = References()
    late, early = references.cite("bic"), references.cite("sobol", "levenberg")
    text, cited = references.numbered(f"a{early}, b{late}, c{references.cite('sobol', 'bic')}, d ⟦99⟧")
    assert text == "a [1, 2], b [3], c [1, 3], d ⟦99⟧"
    assert cited == [CITATIONS[key] for key in ("sobol", "levenberg", "bic")]


def test_references_are_numbered_in_order_of_citation() -> None:
    body, _, listed = text_of(ReportGroup("", ranking())).rpartition("\n\n")
    mentioned = [int(n) for group in re.findall(r"\[([0-9, ]+)\]", body) for n in group.split(", ")]
    assert list(dict.fromkeys(mentioned)) == list(range(1, len(listed.strip().splitlines()) + 1))


def test_creepkit_is_cited_as_its_citation_file_says() -> None:
    stated = yaml.safe_load((Path(__file__).parents[3] / "CITATION.cff").read_text())
    for part in (stated["authors"][0]["name"], stated["title"], str(stated["version"]), stated["license"]):
        assert part in CITATIONS["creepkit"]


def test_what_materials_share_is_said_once() -> None:
    """Two materials whose laws stand in another order and whose rates scatter by other sizes."""
    first = ranking()
    second = replace(first, laws=tuple(reversed(first.laws)))
    text = text_of(ReportGroup("A", first), ReportGroup("B", second))
    for words in ("bounds of the search", "Levenberg-Marquardt", "weight of a law is", "has a probability of at least"):
        assert text.count(words) == 1
    assert "Of A:" not in text


def test_the_specimen_says_how_it_is_simulated() -> None:
    bar = ck.specimen("uniaxial")
    text = text_of(ReportGroup("", ranking().best))
    assert f"{bar.tolerance:g}".replace("1e-05", "10⁻⁵") in text
    assert "order 4" in text
    bulge = ck.specimen("bulge").replace(refinement=2.0, apex_thickness=0.48)
    mesh = bulge.geometry.mesh(2.0)
    stated = bulge.model_text([])
    assert f"{len(mesh.elements)} quadrilaterals" in stated
    assert f"{len(mesh.nodes)} nodes" in stated
    assert "apex thickness 0.48 mm" in stated


def test_transforms_are_those_of_the_outputs_there_are() -> None:
    text = text_of(ReportGroup("", ranking().best))
    assert "arsinh" in text
    assert "linearly" not in text
    assert "orthogonal" not in text


@cache
def followed_to_rupture() -> Identification:
    law = ck.law("strain-hardening")
    tests = [
        history.replace(rupture_time=1.01 * float(history.times[-1]))
        for history in bars(law, SPL, [ck.constant_stress(s) for s in (40.0, 60.0)], seed=1, frames=20)
    ]
    return ck.identify(law, tests, starts=2)


def test_orthogonal_residuals_and_agreement_of_starts_are_stated() -> None:
    fit = followed_to_rupture()
    text = text_of(ReportGroup("", fit))
    assert "2 tests followed to the end have orthogonal residuals" in text
    ends, best = (int(fit.provenance[name]) for name in ("search_ends", "ends_at_best"))
    assert ends == 2
    assert f"{best} of {ends} ends of the search are the best minimum" in text


def test_one_start_is_flagged() -> None:
    assert any("the search ended once" in note for note in ranking().best.notes)
    assert not any("the search ended once" in note for note in followed_to_rupture().notes)


def test_the_covariance_among_the_downloads_is_that_of_the_estimates() -> None:
    """sd of ln A and n by differences of the intervals of a Gaussian posterior; correlation as the page has it."""
    fit = ranking().best
    page = report_html(ReportContents("T", (ReportGroup("", fit),)))
    (address,) = re.findall(r'href="data:text/plain;charset=utf-8;base64,([^"]*)" download="covariance.csv"', page)
    lines = base64.b64decode(address.replace("&#43;", "+")).decode().splitlines()
    rows = list(csv.DictReader(io.StringIO("\n".join(line for line in lines if not line.startswith("#")))))
    names = [row["parameter"] for row in rows]
    matrix = np.array([[float(row[name]) for name in names] for row in rows])
    sd = np.sqrt(np.diag(matrix))
    assert np.allclose(matrix / np.outer(sd, sd), fit.correlation().matrix, atol=1e-6)
    assert np.allclose(sd, fit.correlation().sd, rtol=1e-6)


def test_a_law_has_one_form_in_mathml_and_latex() -> None:
    """exp(-c s) is a factor in both, and no denominator in one of them."""
    import sympy

    from creepkit.exporters.latex import equations_in_latex
    from creepkit.exporters.mathml import law_equations
    from creepkit.language import CreepLaw, Param, parameters, strain, stress

    A, c = parameters("A c")
    rate = A * sympy.exp(strain * sympy.exp(-c * stress))
    params = {A: Param("a", unit="1/s", bounds=(1e-9, 1.0), scale="log"), c: Param("b", unit="1/MPa", bounds=(0, 1))}
    law = CreepLaw(name="x", terms={"x": rate}, params=params)
    (mathml,) = law_equations(law)
    assert "<mfrac>" not in mathml
    assert mathml.count("<mi>exp</mi>") == "\n".join(equations_in_latex(law)).count(r"\exp") == 2
