"""Files that were cut within their last number, and honest files without a last line end."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.files.delimited_text import Dialect
from creepkit.readers.cut_files import cut_number
from helpers.command_line import creepkit

BARS = sorted(ck.example_data("planted creep curves").glob("*.csv"))


def _kinds(path):
    return [flag.kind for flag in ck.check_data_quality(ck.read_histories([path]))]


@pytest.mark.parametrize("path", BARS[:3], ids=lambda path: path.stem)
def test_a_file_cut_at_each_place_of_its_last_number(path, tmp_path):
    """What is left is a number of the same beginning: three digits less are always noticed."""
    text = path.read_text().rstrip("\n")
    last = text.rpartition(",")[2]
    cut = tmp_path / path.name
    for lost in range(3, len(last)):
        cut.write_text(text[:-lost])
        assert "cut" in _kinds(cut), text[-30:-lost]
    for whole in (text, text + "\n", text[:-4] + "\n"):  # with a line end what stands there is what was written
        cut.write_text(whole)
        assert "cut" not in _kinds(cut)


FORMS = {
    "fixed": lambda x: f"{x:.4f}",
    "shortest": lambda x: repr(float(np.round(x, 6))),
    "four significant": lambda x: f"{x:.4g}",
    "exponents": lambda x: f"{x:.3e}",
    "coarse": lambda x: f"{x:.1f}",
    "whole": lambda x: f"{1e4 * x:.0f}",
}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("rows", [6, 10, 25, 60])
def test_honest_files_without_a_last_line_end_are_left_alone(form, rows):
    """Curves of any number of rows and magnitude, in the forms in which programs write numbers."""
    rng, named, trials = np.random.default_rng(0), 0, 1000
    for _ in range(trials):
        times = np.sort(10.0 ** rng.uniform(0, 4, rows))
        values = (
            10.0 ** rng.uniform(-3, 1.5) * (times / times[-1]) ** rng.uniform(0.3, 1.5) * rng.lognormal(0, 0.01, rows)
        )
        lines = [f"{t:.1f},{FORMS[form](x)}" for t, x in zip(times, values, strict=True)]
        named += cut_number("time_h,strain_pct\n" + "\n".join(lines), Dialect()) is not None
    assert named <= 0.005 * trials


def test_decimal_commas_and_one_column_a_test(tmp_path):
    """The note is that of the test whose column is the last."""
    rows = [f"{k}\t0,{1000 + 17 * k}\t0,{2000 + 19 * k}" for k in range(30)]
    path = tmp_path / "two.txt"
    path.write_text(
        "# specimen: uniaxial\n# stress_MPa: 100\n# temperature_C: 750\n# includes_elastic: no\n"
        "Time (h)\tA1 strain (%)\tB2 strain (%)\n" + "\n".join(rows)[:-2]
    )
    flags = ck.check_data_quality(ck.read_histories([path]))
    assert [flag.tests for flag in flags if flag.kind == "cut"] == [("B2",)]


@pytest.mark.parametrize("lost", [0, 4, 5, 6])
def test_the_last_test_of_a_table_of_rates(lost, tmp_path):
    """A rate that lost its exponent lies millions of times from the others; it is said whence it may come."""
    rows = [f"A{k},{90 + k},750,{2.1e-6 * 1.03**k:.3e}" for k in range(30)]
    path = tmp_path / "rates.csv"
    text = "test,stress_MPa,temperature_C,min creep rate (1/h)\n" + "\n".join(rows)
    path.write_text(text[: len(text) - lost])
    *others, last = ck.read_histories([path])
    assumed = [history.labels["assumed"] for history in others]
    assert not any("is whole" in one for one in assumed)
    written = path.read_text().rpartition(",")[2]
    assert (f"{written} in line 31 is whole" in last.labels["assumed"]) == (lost > 0)
    said = " ".join(creepkit("read", str(path)).stdout.split())
    assert ("fewer digits than the numbers above have" in said) == (lost > 0)


@pytest.mark.parametrize("form", ["fixed", "exponents"])
def test_forms_of_one_length_show_each_digit_that_is_lost(form):
    lines = [f"{k},{FORMS[form](0.5 + 0.013 * k)}" for k in range(50)]
    text = "time_h,strain_pct\n" + "\n".join(lines)
    assert cut_number(text, Dialect()) is None
    for lost in (1, 2, 3):
        found = cut_number(text[:-lost], Dialect())
        assert (found.line, found.column, found.text) == (51, 1, lines[-1].split(",")[1][:-lost])
