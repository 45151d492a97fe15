"""Records in a notebook: one line of repr, HTML without scripts, tables of pandas that read back."""

from __future__ import annotations

import html5lib
import numpy as np

import creepkit as ck
from helpers.report_pages import ranking


def test_a_record_is_one_line_and_a_cell_of_html() -> None:
    found = ranking()
    fit = found.best
    for record in (found, fit, fit.histories[0], fit.forecast(fit.histories[0])):
        assert len(repr(record).splitlines()) == 1
        assert len(repr(record)) < 300
    cells = [one._repr_html_() for one in (found, fit, fit.law, fit.histories[0], fit.forecast(fit.histories[0]))]
    for cell in cells:
        html5lib.HTMLParser(strict=True).parseFragment(cell)
        assert "<script" not in cell
    assert "strain hardening" in cells[1].lower().replace("-", " ")


def test_the_answer_has_a_dozen_lines_of_a_hundred_characters() -> None:
    for answer in (str(ranking()), str(ranking().best)):
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
    again = ck.History.from_dataframe(frame, test.name, test.loading, test.temperature)
    np.testing.assert_array_equal(again.times, test.times)
    np.testing.assert_array_equal(again.outputs["strain"], test.outputs["strain"])
    forecast = fit.forecast(test).to_dataframe()
    assert (forecast.low <= forecast.value).all()
    assert (forecast.value <= forecast.high).all()


def test_a_bulge_test_keeps_its_outputs_by_name() -> None:
    """Columns carry units, amplitude_mm; names of outputs do not."""
    bulge = ck.read_histories(ck.example_data("planted bulge test"))[0]
    frame = bulge.to_dataframe()
    again = ck.History.from_dataframe(frame, "again", bulge.loading, bulge.temperature, specimen=bulge.specimen)
    assert set(again.outputs) == set(bulge.outputs)
