"""The key `noise_correlation` of a history file: read, written, refused."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import HistoryError

HEAD = "# specimen: bulge\n# pressure_1_MPa: 8\n# pressure_2_MPa: 8\n# jump_time_h: 1\n# temperature_C: 780\n"
FRAMES = "time_h,amplitude_mm,width_mm,shape,amplitude_sd_mm\n1,0.05,3.7,2.0,0.001\n2,0.08,3.6,2.1,0.001\n"


def read(folder: Path, text: str) -> ck.History:
    path = folder / "test.csv"
    path.write_text(f"{HEAD}# noise_correlation: {text}\n{FRAMES}")
    return ck.read_histories(path)[0]


def test_it_is_read_in_any_order_and_written(tmp_path: Path) -> None:
    test = read(tmp_path, "amplitude width -0.31;shape   amplitude 0.2")
    assert test.noise_correlation == {("amplitude", "width"): -0.31, ("amplitude", "shape"): 0.2}
    assert test.labels == {}
    written = ck.write_history(test, tmp_path / "again.csv")
    assert "# noise_correlation: amplitude width -0.31; amplitude shape 0.2\n" in written.read_text()
    assert ck.read_histories(written)[0].noise_correlation == test.noise_correlation


def test_every_digit_survives(tmp_path: Path) -> None:
    rho = float(np.random.default_rng(1).uniform(-1, 1))
    test = read(tmp_path, "amplitude width 0.5").replace(noise_correlation={("amplitude", "width"): rho})
    again = ck.read_histories(ck.write_history(test, tmp_path / "again.csv"))[0]
    assert again.noise_correlation == {("amplitude", "width"): rho}


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("amplitude width", "holds 'amplitude width'; write two outputs and a number"),
        ("amplitude width 0.3 0.2", "holds 'amplitude width 0.3 0.2'; write two"),
        ("amplitude width 0.3;", "holds ''; write two outputs"),
        ("amplitude widht 0.3", "names 'widht', which is no column; did you mean 'width'"),
        ("amplitude strain 0.3", "names 'strain', which is no column"),
        ("amplitude amplitude 0.3", "amplitude correlates with itself; give each pair"),
        ("amplitude width 0.3; width amplitude 0.2", "width and amplitude are given twice"),
        ("amplitude width 1", "amplitude width is 1; allowed is between -1 and 1"),
        ("amplitude width -30 %", "holds 'amplitude width -30 %'"),
        ("amplitude width x", "'x'; write a finite number"),
        ("amplitude width nan", "'nan'; write a finite number"),
        ("amplitude width 0.9; amplitude shape 0.9; width shape -0.9", "cannot all hold"),
    ],
)
def test_others_are_refused_with_file_and_line(tmp_path: Path, text: str, reason: str) -> None:
    with pytest.raises(HistoryError, match=rf"^{re.escape(str(tmp_path))}/test.csv:6: .*{re.escape(reason)}"):
        read(tmp_path, text)
