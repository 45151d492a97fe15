"""Encodings, delimiters and decimal signs of text tables; what can be read in two ways is refused."""

import time
from pathlib import Path

import numpy as np
import pytest

from creepkit.errors import HistoryError
from creepkit.files.delimited_text import Dialect, decode_text, detect_dialect, parse_number, parse_numbers, split_line

PATH = Path("x.csv")


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252", "latin-1"])
def test_a_text_reads_the_same_in_every_encoding(encoding: str):
    text = "Größe;Temperatur / °C\n0,5;850\n"
    assert decode_text(text.encode(encoding), PATH) == text


def test_utf_16_of_both_byte_orders():
    assert decode_text(b"\xff\xfea\0", PATH) == decode_text(b"\xfe\xff\0a", PATH) == "a"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"time\n\x01\xff", "x.csv:2: byte 0x01 is not text in UTF-8 or Latin-1"),
        (b"time\n\n\x81\xff", "x.csv:3: byte 0x81 is not text"),
        (b"t\0i\0m\0", "x.csv:1: byte 0x00 is not text"),
        (b"\xff\xfea\0\n\0\x00\xd8a\0", "x.csv:2: found bytes that are not text in UTF-16"),
        (b"\xef\xbb\xbftime\n\xff", "x.csv:2: found bytes that are not text in UTF-8"),
    ],
)
def test_what_is_no_text_is_told_with_its_line(content: bytes, message: str):
    with pytest.raises(HistoryError, match=message):
        decode_text(content, PATH)


@pytest.mark.parametrize(
    ("lines", "delimiter", "decimal"),
    [
        (["time_s,strain", "0,0", "1.5,2e-3"], ",", "."),
        (["time_s;strain", "0;0", "1,5;2,5E-3"], ";", ","),
        (["time_s;strain", "0;0", "1.5;2.5E-3"], ";", "."),
        (["time_s\tstrain", "0\t0", "1,5\t2,5"], "\t", ","),
        (["time_s strain", "0   0", "1,5 2,5"], " ", ","),
        (["  time_s   strain", "  0 0.5"], " ", "."),
        (["time_s|strain", "0|0.5"], "|", "."),
        (["time_s, strain", "0, 0.5", "1, 2"], ",", "."),
        (['"time_s","strain"', '"0,5","1,25"'], ",", ","),
        (["test;state", "a, b;ruptured"], ";", "."),
        (["key,time_s,strain", "a b,1,2"], ",", "."),
        (["Time (h);Strain, total (%)", "0;0", "1;0,51"], ";", ","),
        (["t;e", "1,000;0,000", "1,500;0,001"], ";", ","),
        (["heat;stress_MPa;rate_1/s", "617.2;100,5;1,5D-8", "617.3;120,5;2,5D-8", "617.4;1;2,0D-7"], ";", ","),
        (["date;time_h", "2024-01-01 12:00:00;0,5", "2024-01-01 12:30:00;1,0"], ";", ","),
    ],
)
def test_dialects(lines: list[str], delimiter: str, decimal: str):
    assert detect_dialect(lines) == Dialect(delimiter, decimal)


def test_a_comma_before_three_digits_is_asked_for():
    lines = ["time_s;rate", "1,234;2", "2,345;3"]
    with pytest.raises(HistoryError, match=r"x.csv: '1,234' may be 1.234 or 1234; write decimal points, or '# decimal"):
        detect_dialect(lines, "x.csv")
    assert detect_dialect(lines, decimal=",") == Dialect(";", ",")


def test_cells():
    assert split_line(' 1 ; "a;b" ;', Dialect(";")) == ["1", "a;b", ""]
    assert split_line("  1\t 2  ", Dialect(" ")) == ["1", "2"]
    assert split_line('"a b"  2', Dialect(" ")) == ["a b", "2"]
    with pytest.raises(HistoryError, match="x.csv:4: not a line of a CSV table .*; look for stray quotes"):
        split_line('0,"1', Dialect(), "x.csv:4")


@pytest.mark.parametrize(
    ("text", "decimal", "value"),
    [("1,5E-3", ",", 1.5e-3), ("-1.5d+3", ".", -1500.0), (",5", ",", 0.5), ("3.", ".", 3.0), ("+7", ",", 7.0)],
)
def test_numbers(text: str, decimal: str, value: float):
    dialect = Dialect(";", decimal)
    assert parse_number(text, dialect, "x.csv:1", "strain") == value
    assert parse_numbers([text, "1"], dialect, str, "strain").tolist() == [value, 1.0]


@pytest.mark.parametrize(
    ("text", "decimal", "message"),
    [
        ("1,5", ".", "x:2: 'strain' is '1,5' with a comma, while the table has decimal points"),
        ("1.234", ",", "x:2: 'strain' is '1.234' with a point, while the table has decimal commas"),
        ("1.234,5", ",", "x:2: 'strain' is '1.234,5', with digits in groups"),
        ("1,234,567.8", ".", "with digits in groups"),
        ("1 234.5", ".", "with digits in groups"),
        ("", ".", "x:2: 'strain' is empty"),
        ("nan", ".", "x:2: 'strain' is 'nan'; write a finite number"),
        ("1e999", ".", "x:2: 'strain' is '1e999', too large a number"),
        ("1_000", ".", "x:2: 'strain' is '1_000'"),
        ("٣", ".", "x:2: 'strain' is '٣'"),
        ("0x1p3", ".", "x:2: 'strain' is '0x1p3'"),
    ],
)
def test_what_is_no_number(text: str, decimal: str, message: str):
    dialect = Dialect(";", decimal)
    with pytest.raises(HistoryError, match=message):
        parse_number(text, dialect, "x:2", "strain")
    with pytest.raises(HistoryError, match=message):
        parse_numbers(["1", text], dialect, lambda k: f"x:{k + 1}", "strain")


def test_lost_values_become_nan():
    values = parse_numbers(["1,5", "", "NaN"], Dialect(";", ","), str, "sigma", missing=("", "NaN"))
    assert values[0] == 1.5
    assert np.isnan(values[1:]).all()


@pytest.mark.parametrize(
    "line", ["1" * 200_000 + "x", "," * 200_000, "1,2 " * 50_000, '"' * 99_999, "1,1." * 50_000, "1 " * 100_000 + "x"]
)
def test_hostile_lines_cost_linear_time(line: str):
    start = time.process_time()
    dialect = detect_dialect(["time_s,strain", *[line] * 3], decimal=".")
    for cell in (line, line[: len(line) // 2]):
        with pytest.raises(HistoryError):
            parse_number(cell, dialect, "x:1", "strain")
    # A quadratic search of 200,000 characters takes minutes, so that any computer tells.
    assert time.process_time() - start < 5.0
