"""The key `noise_correlation` of a history file: read, written, refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import creepkit as ck

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
