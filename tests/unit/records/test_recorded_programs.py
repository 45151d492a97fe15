"""Records of load and temperature: what was recorded is simulated, what was stated is kept, noise is not followed."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.quality import check_data_quality
from creepkit.readers.history_csv import HISTORY_CSV, history_text
from creepkit.records import Program, RecordedLoading
from creepkit.records.recorded_programs import recorded_program

TIMES = 60.0 * np.arange(1, 241)
NORTON = {"A": 1e-16, "n": 5.0}


def written(tmp_path, head, columns):
    """The history of a file with these columns beside a strain of zero."""
    names = ",".join(("time_s", "strain", *columns))
    rows = zip(TIMES, np.zeros(TIMES.size), *columns.values(), strict=True)
    lines = [",".join(f"{float(x)!r}" for x in row) for row in rows]
    path = tmp_path / "x.csv"
    path.write_text("\n".join([*(f"# {line}" for line in head), names, *lines]) + "\n", encoding="utf-8")
    (history,) = HISTORY_CSV.read(path)
    return history


def test_piecewise_linear_records_are_exact():
    corners = Program(np.array([0.0, 3600.0, 7200.0, 14400.0]), np.array([1000.0, 1010.0, 1010.0, 980.0]))
    times = 60.0 * np.arange(0, 241)
    program = recorded_program(times, corners.at(times), 0.25)
    assert program.times.size == 4
    np.testing.assert_allclose(program.at(times), corners.at(times), atol=1e-9)


def test_a_curved_record_is_followed_within_the_tolerance():
    values = 1000.0 + 20.0 * np.exp(-TIMES / 3000.0)
    program = recorded_program(TIMES, values, 0.25)
    assert program.times.size < 20
    assert np.abs(program.at(TIMES) - values).max() <= 0.25


def test_noise_is_averaged_and_a_step_is_kept():
    rng = np.random.default_rng(1)
    clean = np.where(TIMES > 8250.0, 990.0, 1000.0)
    program = recorded_program(TIMES, clean + 0.5 * rng.standard_normal(TIMES.size), 0.25)
    assert program.times.size < 12
    away = np.abs(TIMES - 8250.0) > 300.0
    assert np.abs(program.at(TIMES) - clean)[away].max() < 0.75  # 1.5 standard deviations of a single reading
    assert np.abs((program.at(TIMES) - clean).mean()) < 0.1


def test_a_recorded_temperature_is_simulated(tmp_path):
    """Arrhenius creep under a furnace that falls by 10 K has the closed form of two rates."""
    celsius = np.where(TIMES > 7200.0, 790.0, 800.0)
    history = written(
        tmp_path, ["stress_MPa: 100", "control: stress", "temperature_C: 800"], {"temperature_C": celsius}
    )
    assert isinstance(history.temperature, Program)
    assert history.stated["temperature"] == Program.constant(1073.15)
    law = ck.law("norton").times(ck.arrhenius(T_ref=1073.15))
    values = {**NORTON, "Q": 400e3}
    strain = [
        ck.simulate(
            law, "uniaxial", values, loading=history.loading, times=[7200.0, 14400.0], temperature=temperature
        ).outputs["strain"]
        for temperature in (history.temperature, 1073.15)
    ]
    factor = np.exp(-400e3 / 8.314462618 * (1 / 1063.15 - 1 / 1073.15))
    rate = NORTON["A"] * 100.0 ** NORTON["n"]
    np.testing.assert_allclose(strain[1], [7200.0 * rate, 14400.0 * rate], rtol=1e-6)
    np.testing.assert_allclose(np.diff(strain[0]), 7200.0 * rate * factor, rtol=5e-3)  # the step is a ramp of 60 s


@pytest.mark.parametrize(
    "head", [["pressure_MPa: 8"], ["pressure_1_MPa: 8", "pressure_2_MPa: 8", "jump_time_h: 1", "ramp_s: 5"]]
)
def test_a_recorded_pressure_is_used_and_what_was_stated_is_kept(tmp_path, head):
    pressure = np.where(TIMES > 7200.0, 7.5, 8.0)
    names = "time_s,amplitude_mm,pressure_MPa"
    rows = [f"{t},{0.1 + 1e-6 * t},{p}" for t, p in zip(TIMES, pressure, strict=True)]
    path = tmp_path / "x.csv"
    path.write_text("\n".join([*(f"# {x}" for x in head), "# temperature_C: 800", names, *rows]), encoding="utf-8")
    (history,) = HISTORY_CSV.read(path)
    assert isinstance(history.loading, RecordedLoading)
    assert history.loading.program().at([3600.0, 14400.0]).tolist() == [8.0, 7.5]
    assert history.stated["pressure"].at(3600.0) == 8.0
    (flag,) = (f for f in check_data_quality([history]) if f.kind == "record")
    assert flag.time == 7260.0
    assert "by -0.5 MPa" in flag.reason


def test_a_record_off_the_stated_temperature_is_a_finding(tmp_path):
    celsius = np.where(TIMES > 7200.0, 790.0, 800.0)
    head = ["stress_MPa: 100", "temperature_C: 800"]
    history = written(tmp_path, head, {"temperature_C": celsius})
    (flag,) = (f for f in check_data_quality([history]) if f.kind == "record")
    assert (flag.time, flag.temperature_steps["x"]) == (7260.0, pytest.approx(-10.0))
    assert flag.rate_factors["x"] == pytest.approx(np.exp(-400e3 / 8.314462618 * (1 / 1063.15 - 1 / 1073.15)))
    close = written(tmp_path, head, {"temperature_C": 800.0 + 1.5 * np.sin(TIMES / 1000.0)})
    assert not [f for f in check_data_quality([close]) if f.kind == "record"]


def test_what_was_stated_survives_writing(tmp_path):
    history = written(tmp_path, ["stress_MPa: 100", "temperature_C: 800"], {"temperature_C": 790.0 + TIMES / 3600.0})
    path = tmp_path / "again.csv"
    path.write_text(history_text(history), encoding="utf-8")
    (again,) = HISTORY_CSV.read(path)
    assert again.stated == history.stated
    assert again.temperature == history.temperature
