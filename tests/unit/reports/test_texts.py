"""Records print as text: what their methods import stands in layers above."""

import numpy as np

from creepkit.inverse.selection import rank
from creepkit.inverse.uncertainty.correlation import Correlation
from creepkit.laws.norton import NORTON
from creepkit.reports import words
from helpers.log_rate_predictor import known_scatter, measured
from helpers.paths import ROOT

RECORDS = [Correlation(("ln A", "n"), np.array([[1.0, -0.5], [-0.5, 1.0]]), np.ones(2))]


def test_records_print_as_text() -> None:
    values = {"A": float(np.exp(-15.0 - 4.0 * np.log(50.0))), "n": 4.0}
    fit = known_scatter(NORTON, measured(NORTON, values, (30.0, 50.0, 80.0), sd=0.2, seed=3), 0.2)
    ranking = rank([fit])
    texts = [str(record) for record in (*RECORDS, fit, ranking, ranking.model_average, fit.correlation())]
    assert [text for text in texts if not text.strip() or "object at" in text] == []
    samples = fit.sample(draws=20)
    np.testing.assert_array_equal(samples.to_dataframe()["n"], samples.values["n"])


def test_the_page_of_findings_has_every_text_of_an_answer() -> None:
    """So that who edits a text sees when it is said, and who reads the page reads what is said now."""
    page = (ROOT / "docs" / "concepts" / "findings.md").read_text(encoding="utf-8")
    rows = [line.split(" | ") for line in page.splitlines() if line.startswith("| ") and "what is said" not in line]
    tables = (words.HEADLINES, words.TRUTHS, words.CAUTIONS, words.NEXT, words.TRY)
    said = [row[0][2:] for row in rows if len(row) == 2 and row[0] != "| ---"]
    assert said == [text for table in tables for text in table.values()]
