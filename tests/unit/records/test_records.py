"""The nouns: programs, loadings, histories and nuisances, and what they refuse."""

from __future__ import annotations

from collections import Counter
from functools import partial

import numpy as np
import pytest

import creepkit as ck
from creepkit.instruments.column_heads import channel_unit
from creepkit.quality import check_data_quality
from creepkit.readers.history_csv import HISTORY_CSV, history_text
from creepkit.readers.vocabulary import unit_suffix
from creepkit.records import (
    History,
    Nuisance,
    Prediction,
    PressureJump,
    Program,
    RecordedLoading,
    StressSteps,
    constant_strain,
    constant_stress,
    kind_and_start,
    with_changed_history,
)
from creepkit.records.camera_format import LENGTH_UNITS, TIME_UNITS
from creepkit.records.quantities import LENGTH, STRESS, TEMPERATURE, TIME
from creepkit.records.recorded_programs import recorded_program
from creepkit.records.units import UNITS, celsius_text
from helpers.mistakes import said_otherwise

LOADINGS = [
    constant_stress(60.0),
    StressSteps(((0, 100), (3600, 120)), "stress"),
    PressureJump(8, 10, 14580),
    RecordedLoading(Program([0, 5], [0, 8]), "pressure"),
]


def history(**changes) -> History:
    made = History("a", [0.0, 1.0, 2.0], {"strain": [0.0, 0.1, 0.05]}, constant_stress(60.0), 1123.15)
    return made.replace(**changes)


def test_program_is_linear_between_its_points_and_holds_beyond_them():
    program = Program([0, 10, 30], [0, 5, 1])
    np.testing.assert_allclose(program.at([0, 2, 10, 25, 30, 99]), [0, 1, 5, 2, 1, 1])
    np.testing.assert_allclose(program.at([[5.0], [20.0]]), [[2.5], [3.0]])
    assert Program.constant(7).at(1e9) == 7


def test_program_jumps_at_a_repeated_time_to_the_later_value():
    program = Program.steps([(0, 100), (3600, 120), (7200, 80)])
    before = np.nextafter([3600, 7200], 0)
    np.testing.assert_allclose(program.at([0, *before, 3600, 7200, 1e6]), [100, 100, 120, 120, 80, 80])


def test_programs_compare_by_value_and_cannot_be_changed():
    one, two = Program([0, 1], [2, 3]), Program(np.array([0.0, 1.0]), np.array([2.0, 3.0]))
    assert one == two
    assert hash(one) == hash(two)
    assert one != Program([0, 1], [2, 4])
    assert one != "program"
    with pytest.raises(ValueError, match="read-only"):
        one.values[0] = 1.0


def test_programs_of_the_loadings():
    np.testing.assert_allclose(LOADINGS[1].program().at([0, 3599, 3600]), [100, 100, 120])
    # 5 s ramps: half of 8 MPa after 2.5 s, half way from 8 to 10 MPa 2.5 s after the jump
    np.testing.assert_allclose(LOADINGS[2].program().at([0, 2.5, 5, 14580, 14582.5, 2e4]), [0, 4, 8, 8, 9, 10])
    np.testing.assert_allclose(LOADINGS[3].program().at([2.5, 9]), [4, 8])


def test_what_makes_no_sense_is_refused():
    cases = (
        (lambda: Program([0, 1], [1]), "as many values as times, found 1 and 2"),
        (lambda: Program([1, 2], [1, 1]), "must start at 0 and never decrease"),
        (lambda: Program([0, 2, 1], [1, 1, 1]), "must start at 0 and never decrease"),
        (lambda: Program([0, 1], [1, np.nan]), "finite numbers only"),
        (lambda: history(times=[]), "history 'a': no frames"),
        (lambda: history(times=[0, 1, 1]), "history 'a': time does not increase at frame 3"),
        (lambda: history(times=[-1, 0, 1]), "history 'a': times must be finite and start at or after 0 s"),
        (lambda: history(outputs={"strain": [0.0]}), "history 'a': output 'strain' has 1 values for 3 times"),
        (lambda: history(temperature=-5.0), "history 'a': a temperature of -5 K is not above 0"),
        (lambda: history(times=[], source="x.csv"), "^x.csv: no frames"),
        (lambda: StressSteps(()), "must start at time 0"),
        (lambda: StressSteps(((0, 100), (0, 120))), "follow one another in time"),
        (lambda: constant_stress(-1e6), r"from -1e5 to 1e5 MPa in every step, found \[-1000000.0\]"),
        (lambda: constant_stress(1.0, "force"), "'force'; allowed is 'load' or 'stress'"),
        (lambda: PressureJump(8, 10, 5), "Tj after the first ramp"),
        (lambda: PressureJump(0, 10, 50), "above zero"),
        (lambda: Nuisance("offset", sd=0.0), "allowed is a number above 0 or None"),
        (lambda: Nuisance("offset", bounds=(1.0, 0.0)), "are reversed"),
        (lambda: Nuisance("temprature step", start=10.0), "'temprature step' is not known; did you mean 'temperature"),
        (lambda: Nuisance("rate step"), "start is 0 s; say when it begins, such as start=3600"),
        (lambda: Nuisance("thickness", start=5.0), "'thickness' has no start; only temperature step, rate step, load"),
        (lambda: Nuisance("rate step", "tests", start=5.0), "is 'tests'; allowed is 'test', 'alloy' or 'all'"),
        (lambda: with_changed_history(history(loading=constant_strain(0.002)), {"load step@400": 0.1}),
         "a load step changes a stress or a pressure, and strain is prescribed here"),
    )  # fmt: skip
    assert said_otherwise(cases) == []


def test_history_keeps_its_own_copies():
    times = np.array([0.0, 1.0, 2.0])
    made = history(times=times)
    times[0] = -1.0
    assert made.times[0] == 0.0
    assert history(standard_deviation={"strain": 1e-5}).standard_deviation["strain"].tolist() == [1e-5] * 3
    with pytest.raises(ValueError, match="read-only"):
        made.outputs["strain"][0] = 1.0
    with pytest.raises(TypeError):
        made.labels["heat"] = "X7"


def test_history_marks_frames_from_the_first_one_beyond_a_limit():
    cut = history().up_to("strain", 0.06)
    assert cut.used.tolist() == [True, False, False]
    assert history().up_to("strain", 0.2).used.all()
    assert history(used=[True, False, True]).up_to("strain", 0.06).used.tolist() == [True, False, True]


def test_prediction_gives_the_frames_of_one_test():
    padded = np.arange(2 * 2 * 3 * 1, dtype=float).reshape(2, 2, 3, 1)
    prediction = Prediction(padded, ("strain",), np.array([3, 2]), np.zeros((2, 2), int), np.ones((2, 2)))
    assert prediction.of(1, candidate=1)[:, 0].tolist() == [9.0, 10.0]


# ---- units -----------------------------------------------------------------------------------------------------------

# Units as files spell them: factors by their definitions, and no spelling of two units.


POUND_FORCE, INCH = 0.45359237 * 9.80665, 25.4
"""N and mm, by their definitions."""


def test_factors_and_offsets_are_those_of_the_definitions():
    year, kelvin = 365.25 * 24 * 3600, UNITS["F"].conversion
    found = [UNITS[symbol].conversion.factor for symbol in ("psi", "lbf", "atm", "Torr", "year")]
    definitions = [POUND_FORCE / INCH**2, POUND_FORCE, 101325e-6, 101325e-6 / 760, year]
    assert found == pytest.approx(definitions, rel=1e-12)
    assert [kelvin.factor * F + kelvin.offset for F in (212.0, -40.0)] == pytest.approx([373.15, 233.15], abs=1e-9)


def test_no_spelling_means_two_units_and_readers_cameras_and_instruments_agree():
    written = Counter(text for symbol, unit in UNITS.items() for text in (symbol, *unit.spellings))
    assert [text for text, count in written.items() if count > 1] == []
    for symbol in (s for s, unit in UNITS.items() if unit.quantity in ("time", "length")):
        unit = UNITS[symbol]
        for text in (symbol, *unit.spellings):
            factor = unit.conversion.factor
            channel, suffix = channel_unit(text), unit_suffix(text)
            known = [LENGTH_UNITS.get(text), TIME_UNITS.get(text), channel and channel.factor]
            known += [kind.units[suffix].factor for kind in (LENGTH, TIME) if suffix in kind.units]
            assert {one for one in known if one is not None} <= {factor}, text
    for text in ("n/mm2", "N/mm²", "MPA", "psi", "Kelvin", "°C", "deg F", "Fahrenheit"):
        channel, suffix = channel_unit(text), unit_suffix(text)
        conversion = (STRESS if suffix in STRESS.units else TEMPERATURE).units[suffix]
        assert (channel.factor, channel.offset) == (conversion.factor, conversion.offset), text


def test_temperatures_are_written_in_degrees_of_celsius_and_times_in_hours():
    """The ice point is 273.15 K; one temperature has one text, and 550 °C does not round to two numbers of kelvin."""
    assert celsius_text(823.15) == "550 °C"
    assert celsius_text(273.15) == celsius_text(273.1499) == "0 °C"
    assert celsius_text(872.92, 893.15) == "599.8 to 620 °C"
    assert celsius_text(872.92, 893.15, digits=0) == "600 to 620 °C"
    assert celsius_text(872.92, 873.15, digits=0) == "600 °C"


# ---- recorded programs -----------------------------------------------------------------------------------------------

# Records of load and temperature: what was recorded is simulated, what was stated is kept, noise is not followed.


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
    assert flag.time == 7260.0
    assert "by -10 K" in flag.reason
    close = written(tmp_path, head, {"temperature_C": 800.0 + 1.5 * np.sin(TIMES / 1000.0)})
    assert not [f for f in check_data_quality([close]) if f.kind == "record"]


def test_what_was_stated_survives_writing(tmp_path):
    history = written(tmp_path, ["stress_MPa: 100", "temperature_C: 800"], {"temperature_C": 790.0 + TIMES / 3600.0})
    path = tmp_path / "again.csv"
    path.write_text(history_text(history), encoding="utf-8")
    (again,) = HISTORY_CSV.read(path)
    assert again.stated == history.stated
    assert again.temperature == history.temperature


# ---- nuisance programs -----------------------------------------------------------------------------------------------

# What the rig did, as programs of a history: values at chosen times, jumps that stay jumps, keys, refusals.


FRAMES = np.array([10.0, 500.0, 1000.0])


def rig_history(loading=None, temperature=1000.0, **fields):
    return History("one", FRAMES, {}, loading or constant_stress(50.0), temperature, **fields)


def test_a_step_is_a_ramp_of_five_seconds_and_a_drift_reaches_its_value_at_the_last_used_frame():
    program = with_changed_history(rig_history(), {"temperature step@400": -12.0}).temperature_program()
    np.testing.assert_allclose(program.at([0, 400, 402.5, 405, 900]), [1000, 1000, 994, 988, 988])
    cut = rig_history(used=np.array([True, True, False]))
    program = with_changed_history(cut, {"temperature drift": 5.0}).temperature_program()
    np.testing.assert_allclose(program.at([0, 250, 500, 1000]), [1000, 1002.5, 1005, 1005])


def test_steps_add_to_one_another_and_to_what_was_recorded():
    """A recorded jump at 300 s stays one: 1000 K before it, 1010 K at it."""
    recorded = rig_history(temperature=Program(np.array([0.0, 300.0, 300.0]), np.array([1000.0, 1000.0, 1010.0])))
    values = {"temperature step@200": 2.0, "temperature step@600": -3.0}
    program = with_changed_history(recorded, values).temperature_program()
    np.testing.assert_allclose(program.at([100, 250, 299.999, 300, 700]), [1000, 1002, 1002, 1012, 1009])


def test_a_load_step_scales_a_stress_and_keeps_its_control():
    loaded = with_changed_history(
        rig_history(StressSteps(((0.0, 40.0), (700.0, 60.0)), "stress")), {"load step@400": 0.1}
    ).loading
    assert isinstance(loaded, RecordedLoading)
    assert (loaded.quantity, loaded.control) == ("stress", "stress")
    np.testing.assert_allclose(loaded.program().at([100, 402.5, 500, 700]), [40, 42, 44, 66])


@pytest.mark.parametrize("start", [8250.0, 0.1, 1e7 / 3])
def test_keys_name_kind_and_start(start):
    kind, found = kind_and_start(Nuisance("rate step", start=start).key)
    assert kind == "rate step"
    assert found == pytest.approx(start, rel=1e-14)
    assert Nuisance("thickness").key == "thickness"


# ---- history selection -----------------------------------------------------------------------------------------------

# Subsets of tests by label: what matches, and what an error names.


TWO_TIMES = np.array([1.0, 2.0])


def bar(name: str, stress: float, temperature: float, **labels: str) -> ck.History:
    alloy = labels.pop("alloy", "")
    outputs = {"strain": 1e-3 * TWO_TIMES}
    return ck.History(name, TWO_TIMES, outputs, ck.constant_stress(stress), temperature, alloy=alloy, labels=labels)


TESTS = [
    bar("a1", 50, 1073.15, alloy="X", heat="7"),
    bar("a2", 80, 1073.15, alloy="X", heat="8"),
    bar("b1", 80, 1123.15, alloy="Y"),
]


def test_tests_are_selected_by_label() -> None:
    for labels, names in (
        ({}, ["a1", "a2", "b1"]),
        ({"name": "a*"}, ["a1", "a2"]),
        ({"name": ["b1", "a1"]}, ["a1", "b1"]),
        ({"temperature": 1073}, ["a1", "a2"]),
        ({"temperature": "1123.15"}, ["b1"]),
        ({"stress": 80, "alloy": "X"}, ["a2"]),
        ({"heat": 7}, ["a1"]),
        ({"specimen": "uniaxial"}, ["a1", "a2", "b1"]),
    ):
        assert [history.name for history in ck.select_tests(TESTS, **labels)] == names


def test_an_error_names_the_labels_that_exist() -> None:
    cases = (
        ({"temprature": 1073}, r"no test has a label 'temprature'; did you mean 'temperature'\?"),
        ({"temperature": 1100}, "no test has temperature=1100; there are 1073.15, 1123.15"),
        ({"temperature": "hot"}, "temperature=hot is not a number; write one, as in temperature=1073.15"),
        ({"alloy": "Z"}, "no test has alloy=Z; there are X, Y"),
        ({"alloy": "Y", "stress": 50}, "no test has alloy=Y and stress=50 at once"),
        ({"pressure": 8}, r"no test has a label 'pressure'; did you mean 'stress'\?"),
    )
    assert said_otherwise((partial(ck.select_tests, TESTS, **labels), text) for labels, text in cases) == []
