"""Files that were cut within their last number, and honest files without a last line end."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.files.delimited_text import Dialect
from creepkit.readers.cut_files import cut_number

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
