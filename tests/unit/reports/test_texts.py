"""Records print as text: what their methods import stands in layers above."""

import ast
import re
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from creepkit.inverse.selection import rank
from creepkit.inverse.uncertainty.correlation import Correlation
from creepkit.laws.norton import NORTON
from creepkit.reports import words, words_of_methods
from creepkit.reports.blocks import Answer
from creepkit.reports.wording import say
from helpers.log_rate_predictor import known_scatter, measured

RECORDS = [Correlation(("ln A", "n"), np.array([[1.0, -0.5], [-0.5, 1.0]]), np.ones(2))]


def test_records_print_as_text() -> None:
    values = {"A": float(np.exp(-15.0 - 4.0 * np.log(50.0))), "n": 4.0}
    fit = known_scatter(NORTON, measured(NORTON, values, (30.0, 50.0, 80.0), sd=0.2, seed=3), 0.2)
    ranking = rank([fit])
    texts = [str(record) for record in (*RECORDS, fit, ranking, ranking.model_average, fit.correlation())]
    assert [text for text in texts if not text.strip() or "object at" in text] == []


@pytest.mark.parametrize("module", [words, words_of_methods])
def test_every_text_is_short_and_says_when_it_is_said(module: ModuleType) -> None:
    text = Path(str(module.__file__)).read_text(encoding="utf-8")
    lines, tables = text.splitlines(), [one for one in ast.walk(ast.parse(text)) if isinstance(one, ast.Dict)]
    keys = [key for table in tables for key in table.keys if key is not None]
    assert [lines[key.lineno - 1] for key in keys if not lines[key.lineno - 2].startswith("    # ")] == []
    texts = [ast.literal_eval(value) for table in tables for value in table.values]
    assert [one for text in texts for one in re.split("[;:.] |[<>]", text) if len(one.split()) > 25] == []


def test_a_part_of_a_text_stands_where_all_of_its_values_are_known() -> None:
    assert say(
        "{one.real:.1f}< of {names:and}><, {p:p}>< ({more} more)>", one=2j, names=["a", "b"], p=0.02, more=0
    ) == ("0.0 of a and b, p = 0.02")
    assert say("as it is< of {names:and}><, {p:p}>", names=[], p=float("nan")) == "as it is"
    assert say("{text}", text="a < b > {c}") == "a < b > {c}"


def test_a_figure_holds_at_a_condition_or_over_all_tests() -> None:
    figures = [
        ("stress exponent", "over all tests, 60–250 MPa", "9 [8, 10]", ""),
        ("creep rate", "80 MPa", "2 %/h", ""),
    ]
    lines = str(Answer("norton", "27 tests", figures=figures)).splitlines()
    assert "  stress exponent over all tests, 60–250 MPa: 9 [8, 10]" in lines
    assert "  creep rate at 80 MPa: 2 %/h" in lines
