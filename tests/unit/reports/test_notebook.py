"""Records in a notebook: one line of repr, HTML without scripts, tables of pandas that read back."""

from __future__ import annotations

import html5lib
import numpy as np

import creepkit as ck
from creepkit.reports.answer import key_figures
from creepkit.reports.rate_panels import plate_figure
from helpers.report_pages import ranking
from helpers.steady_rate_predictor import Steady, planted


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
