"""Number formats of spreadsheets: which of them scale a number to per cent, and which only show the sign."""

from pathlib import Path

import pytest

from creepkit.readers.number_formats import number_text
from creepkit.readers.spreadsheets import SPREADSHEET
from helpers.workbooks import workbook


@pytest.mark.parametrize(
    ("value", "number_format", "text"),
    [
        (0.005, "0.00%", "0.5%"),
        (0.5, '0.00" %"', "0.5%"),
        (0.5, r"0.00\%", "0.5%"),
        (0.5, r"0.00\ \%", "0.5%"),
        (0.5, '0.00" % of the gauge"', "0.5"),
        (0.5, "0.00_%", "0.5"),
        (0.5, "0.00*%", "0.5"),
        (0.5, "[$%]0.00", "0.5"),
        (0.5, "0.00;-0.00%", "0.5"),
        (-0.5, "0.00;-0.00%", "-50%"),
        (0.0, "0.00%;-0.00%;0.00", "0.0"),
        (0.0, "0.00%;-0.00", "0%"),
        (0.5, '0.00";%"', "0.5"),
        (0.5, "[<0.1]0.00%;0.00", "0.5"),
        (0.05, "[<0.1]0.00%;0.00", "5%"),
        (0.5, "[Red]0.00%", "50%"),
        (0.5, "General", "0.5"),
        (0.5, '0.00"%', "0.5%"),
    ],
)
def test_the_sign_that_scales(value: float, number_format: str, text: str):
    assert number_text(value, number_format) == text


@pytest.mark.parametrize("head", ["Strain (%)", "Strain"])
@pytest.mark.parametrize("number_format", ['0.00" %"', r"0.00\%", '0.00"%"'])
def test_a_sign_that_is_only_shown_does_not_scale(tmp_path: Path, head: str, number_format: str):
    rows = (["Stress (MPa)", 60], ["Temperature (C)", 850], ["Time (h)", head], [0, 0], [1, 0.5], [2, 0.9])

    def shaped(sheet):
        for k in (4, 5, 6):
            sheet.cell(k, 2).number_format = number_format

    (history,) = SPREADSHEET.read(workbook(tmp_path / "bar.xlsx", {"S": rows}, shaped))
    assert history.outputs["strain"] == pytest.approx([0.0, 0.005, 0.009])
