"""The methods of a report: citations in order, what every material shares said once, and numbers from the records."""

from __future__ import annotations

import base64
import csv
import io
import re

import numpy as np

from creepkit.reports.contents import ReportContents, ReportGroup
from creepkit.reports.html import report_html
from helpers.report_pages import ranking


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
