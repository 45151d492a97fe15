"""Records of data loggers: what is written in many ways is read as one thing; what may mean two is asked for."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import CreepkitError, HistoryError
from creepkit.records import Channel, ClockAlignment, InstrumentRecord, Program
from helpers.instrument_samples import samples
from helpers.paths import SHARED, needs_shared_data

FILES = samples()
PSI = 0.45359237 * 9.80665 / 0.0254**2 * 1e-6
"""MPa, from the definitions of pound, standard gravity and inch."""


def written(folder: Path, content: bytes | str, name: str = "x.csv") -> Path:
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def table(stamps: list[str], head: str = "time") -> str:
    return "\n".join([f"{head},p_barg", *(f"{stamp},{k}" for k, stamp in enumerate(stamps))]) + "\n"


def test_the_record_of_the_rig(tmp_path: Path) -> None:
    record = ck.read_record(written(tmp_path, FILES["plate.csv"]), time_zone="America/Chicago")
    assert record.start == pytest.approx(1755561082.947365, abs=1e-6)  # 2025-08-18 23:51:22.947365 UTC
    np.testing.assert_allclose(np.diff(record.times), 0.1, atol=1e-9)
    pressure, temperature = record.channel("D1: Press."), record.channel("D1: Temp.")
    assert (pressure.quantity, pressure.reference, pressure.written_unit) == ("pressure", "gauge", "PSIG")
    assert pressure.values[-1] == pytest.approx(1.015e3 * PSI, rel=1e-9)  # 70 bar, written with four digits
    assert temperature.values[0] == pytest.approx(777.3 + 273.15)
    assert record.channel("Thermocouple1").quantity == "number"


@pytest.mark.parametrize(
    ("name", "span", "channel", "value"),
    [
        ("elapsed.csv", 78.0, "pressure", 7.0),
        ("midnight.txt", 39.0, "P1", 139 * PSI),
        ("iso.csv", 39.0, "Pressure", 39.0),
        ("unix.csv", 7.8, "p", 53.7 * PSI),
        ("german.csv", 39.0, "Druck", 3.95),
        ("dropouts.csv", 1170.0, "P", 7.8),
        ("units_below.csv", 39.0, "Pressure", 7.0),
        ("us_dates.csv", 39.0, "P", 39 * PSI),
        ("blanks.txt", 39.0, "p", 3.9),
        ("western.txt", 39.0, "P1", 139 * PSI),
        ("utf16.csv", 78.0, "pressure", 7.0),
        ("mark.csv", 39.0, "Pressure", 39.0),
    ],
)
def test_other_loggers(tmp_path: Path, name: str, span: float, channel: str, value: float) -> None:
    record = ck.read_record(written(tmp_path, FILES[name], name))
    assert np.ptp(record.times) == pytest.approx(span, abs=1e-6)
    assert record.channel(channel).values[-1] == pytest.approx(value, rel=1e-9)


def test_lost_readings_are_marked_and_counted(tmp_path: Path) -> None:
    record = ck.read_record(written(tmp_path, FILES["dropouts.csv"]))
    assert np.isnan(record.channel("P").values).nonzero()[0].tolist() == [5]
    assert np.isnan(record.channel("TC1").values).nonzero()[0].tolist() == [7, 8]
    assert record.notes == ("P: 1 of 40 readings are missing", "TC1: 2 of 40 readings are missing")


@pytest.mark.parametrize(
    ("stamps", "start"),
    [
        (["2025-08-18T18:51:00Z", "2025-08-18T18:52:00Z"], 1755543060.0),
        (["2025-08-18 18:51:00+02:00", "2025-08-18 18:52:00+02:00"], 1755535860.0),
        (["1755543060", "1755543120"], 1755543060.0),
        (["1755543060000", "1755543120000"], 1755543060.0),
    ],
)
def test_absolute_times(tmp_path: Path, stamps: list[str], start: float) -> None:
    record = ck.read_record(written(tmp_path, table(stamps)))
    assert record.start == start
    assert record.times.tolist() == [0.0, 60.0]


@pytest.mark.parametrize(("order", "day"), [("month first", "2025-03-04"), ("day first", "2025-04-03")])
def test_a_date_that_may_be_two_is_asked_for(tmp_path: Path, order: str, day: str) -> None:
    path = written(tmp_path, table(["3/4/2025 00:00:00", "3/4/2025 00:01:00"]))
    with pytest.raises(HistoryError, match="x.csv:2: the date '3/4/2025' may have the month or the day first"):
        ck.read_record(path)
    record = ck.read_record(path, date_order=order, time_zone="+00:00")
    assert record.start == np.datetime64(day).astype("datetime64[s]").astype(float)


def test_clocks_that_are_put_back_for_winter(tmp_path: Path) -> None:
    stamps = [f"2025-11-02 {hour}:{minute:02d}:00" for hour in ("00", "01", "01", "02") for minute in (0, 30)]
    path = written(tmp_path, table(stamps))
    with pytest.raises(HistoryError, match=r"x.csv:6: time falls by 1800 s; .*state time_zone"):
        ck.read_record(path)
    record = ck.read_record(path, time_zone="America/Chicago")
    np.testing.assert_array_equal(np.diff(record.times), 1800.0)


def test_absolute_pressures_become_gauge_only_by_a_stated_ambient_pressure(tmp_path: Path) -> None:
    path = written(tmp_path, "time_s,p_bara\n0,1.013\n1,11.013\n")
    assert ck.read_record(path).channel("p").reference == "absolute"
    channel = ck.read_record(path, ambient_pressure=0.1013).channel("p")
    assert channel.reference == "gauge"
    np.testing.assert_allclose(channel.values, [0.0, 1.0], atol=1e-12)


def test_channels_are_left_out_on_reading(tmp_path: Path) -> None:
    part = ck.read_record(written(tmp_path, FILES["plate.csv"]), channels=["D1: Press."])
    assert [*part.channels] == ["D1: Press."]


def test_files_of_several_parts_are_read_as_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from creepkit.instruments import record_tables

    path = written(tmp_path, FILES["plate.csv"].replace(b"\n", b"\r\n"))
    whole = ck.read_record(path)
    for size in (700, 1023, 1500):
        monkeypatch.setattr(record_tables, "PART_CHARACTERS", size)
        parts = ck.read_record(path)
        np.testing.assert_array_equal(parts.times, whole.times)
        np.testing.assert_array_equal(parts.channel("D1: Temp.").values, whole.channel("D1: Temp.").values)


@pytest.mark.parametrize(
    ("content", "options", "message"),
    [
        ("", {}, "the file is empty"),
        ("time_s,p_bar\n", {}, ":1: no row of readings"),
        ("1,2\n3,4\n", {}, ":1: the rows begin here, with 2 columns, and no line above names as many"),
        ("p_bar,T_C\n1,2\n", {}, ":1: no column of time among p_bar, T_C"),
        ("time,p_bar\n0,1\n1,2\n", {}, ":1: the unit of 'time' is not stated"),
        ("time_s,p_bar\n0,1\n1,x\n", {}, ":3, column 2: 'p_bar' is 'x'"),
        ("time_s,p_bar\n0,1\n1,2,3\n2,3\n", {}, ":3: number of cells 3, of names 2"),
        ("time_s,p_bar\n1,1\n0,2\n", {}, ":3: time falls by 1 s"),
        ("time,p_bar\n10:00:00,1\n9:00:00,2\n", {}, ":3: time falls by 3600 s"),
        ("time,p_bar\n10:00:00,1\n10:61:00,2\n", {}, ":3, column 1: time is '10:61:00'"),
        ("time_s,p_bar,p_bar\n1,1,2\n", {}, ":1: the channel 'p' stands there twice"),
        ("time_s,p_bar\n0,1\n", {"chanels": ["p"]}, "have no 'chanels'; did you mean 'channels'"),
        ("time_s,p_bar\n0,1\n", {"channels": ["q"]}, ":1: there is no channel 'q'; known: p"),
        ("time_s,p_bar\n0,1\n", {"format": "tabel"}, "no instrument format is called 'tabel'; did you mean 'table'"),
        ("time_s,p\nh,bar\n0,1\n1,2\n", {}, ":1: 'time_s' has the unit s, the row of units says h"),
        ("time,p [psi]\ns,bar\n0,1\n1,2\n", {}, ":1: 'p [psi]' has the unit psi, the row of units says bar"),
        ("time_s,p [psig]\ns,psia\n0,1\n1,2\n", {}, ":1: 'p [psig]' has the unit psig, the row of units says psia"),
        ("time_s,P abs [bar]\n0,1\n", {"pressure_reference": "gauge"}, ":1: 'P abs' is called absolute, while press"),
        ("time_s,P abs [psig]\n0,1\n", {}, ":1: 'P abs' is called absolute, while its unit psig says gauge"),
        ("time [mm:ss],p\n00:00,1\n00:30,2\n", {}, ":1: 'time [mm:ss]' is in mm:ss, and its first cell is a time of a"),
        ("time (min:s),p\n59:00,1\n59:10,2\n", {}, ":1: 'time (min:s)' is in min:s, and its first cell is a time"),
        ("time_s,p\n10:00:00,1\n10:00:01,2\n", {}, ":1: 'time_s' is in s, and its first cell is a time of a clock"),
        ("time (d),p\n45887.5,1\n45887.6,2\n", {}, ":2: time begins at 45887.5 d, which is no time since the start"),
        ("time,p\n3838300000,1\n3838300001,2\n", {}, ":2: time begins at 3838300000 s, which is no time since the"),
        ("time_s;p_bar;T_C\n0;1.000;800,5\n1;1.001;800,5\n", {}, ":2: 'a reading' is '800,5' with a comma, while"),
        ('time_s,p_bar,T_C\n0,"1,000",800.5\n1,"1,001",8.5\n', {}, ":2: 'a reading' is '1,000' with a comma, while"),
        ("time,p\n25-08-18 10:00,1\n", {}, ":2: the date '25-08-18' may have the day or the year first"),
        ("time,p\n2025-02-30 10:00,1\n", {}, ":2: '2025-02-30' is no date"),
        ("time,p\n2025-02-20 10:00,1\n", {"time_zone": "Mars"}, "time_zone is 'Mars'"),
    ],
)
def test_what_cannot_be_read_is_said_in_one_sentence(
    tmp_path: Path, content: str, options: dict[str, object], message: str
) -> None:
    with pytest.raises(CreepkitError) as caught:
        ck.read_record(written(tmp_path, content), **options)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("names", "reference"),
    [
        ("P abs [bar]", "absolute"),
        ("P [bar abs]", "absolute"),
        ("Pabs (psi)", "absolute"),
        ("gauge pressure_bar", "gauge"),
        ("P [bar]", ""),
        ("Absorber [bar]", ""),
    ],
)
def test_whether_a_pressure_is_absolute_stands_in_its_unit_or_its_name(
    tmp_path: Path, names: str, reference: str
) -> None:
    (channel,) = ck.read_record(written(tmp_path, f"time_s,{names}\n0,1\n1,2\n")).channels.values()
    assert (channel.quantity, channel.reference) == ("pressure", reference)


@needs_shared_data
def test_the_record_of_dimple_d1() -> None:
    record = ck.read_record(SHARED / "cameras/dabi_static/D1_record.csv")
    assert record.times.size == 1421
    assert record.interval == pytest.approx(0.1, abs=1e-6)
    assert sum(c.reference == "gauge" for c in record.channels.values()) == 26
    assert sum(c.quantity == "temperature" for c in record.channels.values()) == 25
    first = ck.read_record(SHARED / "dabi/log/dimple_D1_log.csv")
    assert first.times.size > 300


def test_units_that_are_nearly_known_are_not_taken_in_silence(tmp_path: Path) -> None:
    for head in ("P_mPa", "P [mPa]", "P mPag"):
        with pytest.raises(
            HistoryError, match=r"is MPag? in other capitals; write MPag? into the head if that is meant"
        ):
            ck.read_record(written(tmp_path, f"time_s,{head}\n0,1\n1,2\n2,3\n".encode()))
    table = b"time_s,T_c,p [psgi],valve,V (rpm),T_set,p_in_mbar\n" + b"".join(b"%d,1,2,3,4,5,6\n" % k for k in range(4))
    record = ck.read_record(written(tmp_path, table))
    assert [channel.quantity for channel in record.channels.values()] == [*["number"] * 5, "pressure"]
    text = str(record)
    assert "p: numbers in 'psgi', which is not converted" in text
    assert "V: numbers in 'rpm', which is not converted" in text
    assert not any(note.startswith(("valve", "T_set")) for note in record.notes)


# ---- imposed ---------------------------------------------------------------------------------------------------------

# What was imposed on one specimen: programs on the clock of its frames, with a stated error.


TIMES = np.arange(0.0, 4000.0, 1.0)
LOAD = Program(np.array([0.0, 500, 520, 4000]), np.array([0.0, 0, 8, 8]))
FURNACE = Program(np.array([0.0, 2500, 2600, 4000]), np.array([1050.0, 1050, 1040, 1040]))
FRAMES = np.arange(100.0, 3500.0, 100.0)


def record(noise: float = 0.0, reference: str = "gauge", *, quantity: str = "temperature") -> InstrumentRecord:
    rng = np.random.default_rng(3)
    load = LOAD.at(TIMES) + noise * rng.standard_normal(TIMES.size)
    furnace = FURNACE.at(TIMES) + 10 * noise * rng.standard_normal(TIMES.size)
    channels = [Channel("D1: P", "pressure", load, reference), Channel("D1: T", quantity, furnace)]
    patterns = {"pressure": "{}: P", "temperature": "{}: T"}
    return InstrumentRecord("test", TIMES, {one.name: one for one in channels}, channel_patterns=patterns)


def test_programs_are_on_the_clock_of_the_history_which_starts_with_the_first_ramp() -> None:
    found = ck.imposed(record(), "D1", FRAMES, ClockAlignment.stated(50.0))
    assert found.time_zero == pytest.approx(450.0, abs=1.5)  # 500 s of the record, which is 50 s ahead
    seen = np.arange(0.0, 3000.0, 10.0)
    np.testing.assert_allclose(found.load.at(seen), LOAD.at(seen + found.time_zero + 50.0), atol=0.1)
    np.testing.assert_allclose(found.temperature.at(seen), FURNACE.at(seen + found.time_zero + 50.0), atol=0.25)
    assert found.load.times.size < 8
    assert found.load_error <= 0.002 * 8.0


def test_noise_is_not_followed_and_its_size_is_stated() -> None:
    found = ck.imposed(record(noise=0.05), "D1", FRAMES, ClockAlignment.stated(0.0))
    assert found.load_noise == pytest.approx(0.05, rel=0.15)
    assert found.temperature_noise == pytest.approx(0.5, rel=0.15)
    held = np.arange(100.0, 2900.0, 10.0)
    np.testing.assert_allclose(found.load.at(held), 8.0, atol=0.1)
    assert found.load.times.size < 60


def test_a_record_in_the_zone_of_the_frames_needs_no_alignment() -> None:
    known = InstrumentRecord("test", TIMES, record().channels, 1.7e9, record().channel_patterns)
    assert ck.imposed(known, "D1", FRAMES + 1.7e9).time_zero == pytest.approx(1.7e9 + 500.0, abs=1.5)
    with pytest.raises(HistoryError, match="not known to agree"):
        ck.imposed(record(), "D1", FRAMES)


def test_records_are_thinned_and_gaps_are_found() -> None:
    one = record()
    program = one.program("D1: P", 0.01)
    np.testing.assert_allclose(program.at(TIMES), LOAD.at(TIMES), atol=0.01)
    rows = np.delete(np.arange(TIMES.size), slice(1000, 1100))
    cut = InstrumentRecord("cut", TIMES[rows], {"P": Channel("P", "pressure", LOAD.at(TIMES[rows]))})
    assert cut.gaps.tolist() == [[999.0, 1100.0]]


def test_the_error_of_the_lag_counts_where_an_output_changes() -> None:
    """All lags within +-9 s are as likely: 9 / 3^0.5 s times the rate of the output, in a ramp and in a hold."""
    shifts = np.linspace(-9.0, 9.0, 2001)
    known = ClockAlignment(0.0, 0.0, lags=shifts, probability=np.full(shifts.size, 1.0 / shifts.size))
    load = Program(np.array([0.0, 100, 200, 1000]), np.array([1.0, 1, 6, 6]))
    one = ck.imposed(record(), "D1", FRAMES, ClockAlignment.stated(0.0))
    times = np.arange(5.0, 900.0, 10.0)
    response, creep = 0.02, 3e-5
    found = dataclasses.replace(one, load=load, alignment=known).lag_error(
        times, response * load.at(times) + creep * times
    )
    spread, ramp = 9.0 / 3.0**0.5, (times > 109) & (times < 191)
    hold = (times < 81) | (times > 219)
    np.testing.assert_allclose(found[ramp], spread * (response * 0.05 + creep), rtol=0.03)
    np.testing.assert_allclose(found[hold], spread * creep, rtol=0.05)
    assert not one.lag_error(times, times).any()  # of a lag that is stated
