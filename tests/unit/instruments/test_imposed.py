"""What was imposed on one specimen: programs on the clock of its frames, with a stated error."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import HistoryError
from creepkit.records import Channel, ClockAlignment, InstrumentRecord, Program

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


def test_records_are_cut_and_thinned_and_gaps_are_found() -> None:
    one = record()
    part = one.between(490.0, 600.0)
    assert part.times[[0, -1]].tolist() == [490.0, 600.0]
    program = one.program("D1: P", 0.01)
    np.testing.assert_allclose(program.at(TIMES), LOAD.at(TIMES), atol=0.01)
    rows = np.delete(np.arange(TIMES.size), slice(1000, 1100))
    cut = InstrumentRecord("cut", TIMES[rows], {"P": Channel("P", "pressure", LOAD.at(TIMES[rows]))})
    assert cut.gaps.tolist() == [[999.0, 1100.0]]
    with pytest.raises(HistoryError, match="no row from 5000 to 6000 s"):
        one.between(5000.0, 6000.0)


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
