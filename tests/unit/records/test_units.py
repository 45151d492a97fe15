"""Units as files spell them: factors by their definitions, and no spelling of two units."""

from __future__ import annotations

from collections import Counter

import pytest

from creepkit.cameras.reading import TIME_UNITS
from creepkit.instruments.column_heads import channel_unit
from creepkit.readers.vocabulary import unit_suffix
from creepkit.records.camera_format import LENGTH_UNITS
from creepkit.records.quantities import LENGTH, STRESS, TEMPERATURE, TIME
from creepkit.records.units import UNITS, celsius_text, hours_number, time_text

POUND_FORCE, INCH = 0.45359237 * 9.80665, 25.4
"""N and mm, by their definitions."""


@pytest.mark.parametrize(
    ("symbol", "factor"),
    [
        ("psi", POUND_FORCE / INCH**2),
        ("ksi", 1e3 * POUND_FORCE / INCH**2),
        ("lbf", POUND_FORCE),
        ("atm", 101325e-6),
        ("Torr", 101325e-6 / 760),
        ("year", 365.25 * 24 * 3600),
    ],
)
def test_factors_are_those_of_the_definitions(symbol: str, factor: float):
    assert UNITS[symbol].conversion.factor == pytest.approx(factor, rel=1e-12)


@pytest.mark.parametrize(
    ("number", "unit", "kelvin"), [(212.0, "F", 373.15), (-40.0, "F", 233.15), (-40.0, "C", 233.15)]
)
def test_temperatures_have_their_offsets(number: float, unit: str, kelvin: float):
    conversion = UNITS[unit].conversion
    assert conversion.factor * number + conversion.offset == pytest.approx(kelvin, abs=1e-9)


def test_no_spelling_means_two_units():
    written = Counter(text for symbol, unit in UNITS.items() for text in (symbol, *unit.spellings))
    assert [text for text, count in written.items() if count > 1] == []


@pytest.mark.parametrize("symbol", [s for s, unit in UNITS.items() if unit.quantity in ("time", "length")])
def test_readers_cameras_and_instruments_agree(symbol: str):
    unit = UNITS[symbol]
    for text in (symbol, *unit.spellings):
        factor = unit.conversion.factor
        for known in (LENGTH_UNITS, TIME_UNITS):
            assert known.get(text, factor) == factor
        channel, suffix = channel_unit(text), unit_suffix(text)
        assert channel is None or channel.factor == factor
        for kind in (LENGTH, TIME):
            assert suffix not in kind.units or kind.units[suffix].factor == factor


@pytest.mark.parametrize("text", ["n/mm2", "N/mm²", "MPA", "psi", "Kelvin", "°C", "deg F", "Fahrenheit"])
def test_instruments_and_tables_take_the_same_spellings(text: str):
    channel, suffix = channel_unit(text), unit_suffix(text)
    assert channel is not None
    assert suffix is not None
    conversion = (STRESS if suffix in STRESS.units else TEMPERATURE).units[suffix]
    assert (channel.factor, channel.offset) == (conversion.factor, conversion.offset)


def test_temperatures_are_written_in_degrees_of_celsius():
    """The ice point is 273.15 K; one temperature has one text, and 550 °C does not round to two numbers of kelvin."""
    assert celsius_text(823.15) == "550 °C"
    assert celsius_text(273.15) == celsius_text(273.1499) == "0 °C"
    assert celsius_text(872.92, 893.15) == "599.8 to 620 °C"
    assert celsius_text(872.92, 893.15, digits=0) == "600 to 620 °C"
    assert celsius_text(872.92, 873.15, digits=0) == "600 °C"


def test_times_are_written_in_hours():
    assert (time_text(599.0), time_text(3600.0)) == ("599 s", "1 h")
    assert [hours_number(s) for s in (5.4e6, float("inf"), float("nan"))] == ["1500", "later", "?"]
