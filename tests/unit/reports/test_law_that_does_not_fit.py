"""A law that the tests reject: no rate, exponent or verdict is derived from it, and tests that lie apart are named."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from creepkit.inverse.identify import identify
from creepkit.inverse.settings import IdentificationSettings
from creepkit.laws.norton import NORTON
from creepkit.reports.contents import ReportContents, ReportGroup
from creepkit.reports.html import report_html
from creepkit.reports.identification_text import identification_comments
from creepkit.reports.tests_apart import tests_apart as far_tests
from helpers.steady_rate_predictor import Steady, planted

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification

STRESSES = (80.0, 90.0, 100.0, 110.0, 120.0, 130.0)
QUICK = IdentificationSettings(starts=2, sobol_points=16, frames=40)


@cache
def fit_of(*, minutes: bool) -> Identification:
    """Of tests of a power law; where asked, the times of one of them are in minutes and were taken for hours."""
    values = {"A": 1e-19, "n": 5.0}
    tests = planted(NORTON, values, [(s, 873.15) for s in STRESSES], seed=3, rate=0.03, noise=1e-5)
    tests[2] = tests[2].replace(times=tests[2].times * (60.0 if minutes else 1.0))
    return identify(NORTON, tests, Steady(), settings=QUICK)


def page_of(fit: Identification) -> str:
    return report_html(ReportContents("Title", groups=(ReportGroup("", fit),)))


def test_a_test_in_another_unit_of_time_lies_apart() -> None:
    fit = fit_of(minutes=True)
    assert fit.adequacy is not None
    assert fit.adequacy.rejects
    (first, *_) = far_tests(fit.tests)
    assert first.name == fit.histories[2].name
    assert first.rate_factor < 1 / 10


def test_tests_of_one_material_do_not() -> None:
    fit = fit_of(minutes=False)
    assert fit.adequacy is not None
    assert not fit.adequacy.rejects
    assert far_tests(fit.tests) == ()
    assert "a unit that was misread" not in str(fit)
    assert "the creep rate is" in str(fit)
    assert "d ln rate / d ln stress" in str(fit)
    assert "stress exponent" in page_of(fit)


def test_nothing_is_derived_from_a_law_that_does_not_fit() -> None:
    fit = fit_of(minutes=True)
    page, text, comments = page_of(fit), str(fit), identification_comments(fit)
    for words in ("d ln rate / d ln stress", "The tests determine every parameter", "given this law</th>"):
        assert words not in page
    assert "This law does not fit the tests" in page
    assert page.count("a unit that was misread is the usual cause") == 2  # findings and data
    assert "d ln rate / d ln stress" not in text
    assert "a unit that was misread" in text
    assert not [line for line in comments if line.endswith("determined")]
    assert [line for line in comments if line.endswith("if the law held, which the tests reject")]
