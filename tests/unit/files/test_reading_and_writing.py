"""Opening what a user hands over, and writing files whole or not at all."""

import os
import socket
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from creepkit.errors import ExportError, FitError, HistoryError
from creepkit.files.delimited_text import Dialect, decode_text, detect_dialect, parse_number, parse_numbers, split_line
from creepkit.files.reading import FileKind, check_readable, read_bytes, read_text
from creepkit.files.writing import RECORD, remove_temporary_files, replace_on_success, temporary_name, write_text
from helpers.mistakes import said_otherwise

NOTE = FileKind("a note", FitError, "give a note", maximum_bytes=100)


def refused(path):
    with pytest.raises(FitError) as caught:
        read_text(path, NOTE)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)
    with pytest.raises(FitError):
        read_bytes(path, NOTE)
    return str(caught.value)


def test_text_is_read_with_and_without_a_byte_order_mark(tmp_path):
    path = tmp_path / "note"
    for content in (b"\xc3\xa4\r\n", b"\xef\xbb\xbf\xc3\xa4\r\n"):
        path.write_bytes(content)
        assert read_text(path, NOTE) == "ä\r\n"


def test_what_is_no_regular_file_is_refused_without_waiting(tmp_path, monkeypatch):
    os.mkfifo(tmp_path / "pipe")
    assert "is no regular file" in refused(tmp_path / "pipe")
    assert "is a folder; give a note" in refused(tmp_path)
    with socket.socket(socket.AF_UNIX) as listener:
        monkeypatch.chdir(tmp_path)
        listener.bind("socket")  # a path of its own may be too long for a socket
        assert "cannot be read" in refused(tmp_path / "socket")
    assert "there is no such file" in refused(tmp_path / "none")
    with pytest.raises(FitError, match="is no regular file"):
        check_readable(tmp_path / "pipe", NOTE)


def test_a_large_file_is_refused_but_for_its_beginning_and_what_is_no_text_with_its_line(tmp_path):
    path = tmp_path / "note"
    path.write_bytes(b"x" * 101)
    assert "larger than 0.0001 MB, which a note never is" in refused(path)
    assert read_bytes(path, NOTE, first=3) == b"xxx"
    path.write_bytes(b"x" * 100)
    assert len(read_text(path, NOTE)) == 100
    path.write_bytes(b"one\ntwo \xff\n")
    with pytest.raises(FitError, match="note:2: byte 0xff is not text in UTF-8; give a note"):
        read_text(path, NOTE)


def test_a_failed_writing_leaves_what_was_there(tmp_path):
    path = write_text("old", tmp_path / "note", ExportError)

    def fail():
        with replace_on_success(path, ExportError) as temporary:
            temporary.write_bytes(b"half")
            raise OSError(28, "full")

    with pytest.raises(ExportError, match="No space left on device; free some space and start again"):
        fail()
    assert path.read_text() == "old"
    assert sorted(os.listdir(tmp_path)) == [RECORD, "note"]


def test_what_a_killed_process_left_is_removed(tmp_path):
    temporary_name(tmp_path / "note").touch()
    kept = temporary_name(tmp_path / "other")
    kept.touch()
    remove_temporary_files(tmp_path / "note")
    assert os.listdir(tmp_path) == [kept.name]


# ---- delimited text --------------------------------------------------------------------------------------------------

# Encodings, delimiters and decimal signs of text tables; what can be read in two ways is refused.


PATH = Path("x.csv")


def test_a_text_reads_the_same_in_every_encoding():
    text = "Größe;Temperatur / °C\n0,5;850\n"
    read = {one: decode_text(text.encode(one), PATH) for one in ("utf-8", "utf-8-sig", "utf-16", "cp1252", "latin-1")}
    assert set(read.values()) == {text}
    assert decode_text(b"\xff\xfea\0", PATH) == decode_text(b"\xfe\xff\0a", PATH) == "a"
    cases = (
        (b"time\n\x01\xff", "x.csv:2: byte 0x01 is not text in UTF-8 or Latin-1"),
        (b"t\0i\0m\0", "x.csv:1: byte 0x00 is not text"),
        (b"\xff\xfea\0\n\0\x00\xd8a\0", "x.csv:2: found bytes that are not text in UTF-16"),
        (b"\xef\xbb\xbftime\n\xff", "x.csv:2: found bytes that are not text in UTF-8"),
    )
    assert said_otherwise((partial(decode_text, content, PATH), text) for content, text in cases) == []


def test_dialects():
    cases = (
        (["time_s,strain", "0,0", "1.5,2e-3"], ",", "."),
        (["time_s;strain", "0;0", "1,5;2,5E-3"], ";", ","),
        (["time_s\tstrain", "0\t0", "1,5\t2,5"], "\t", ","),
        (["time_s strain", "0   0", "1,5 2,5"], " ", ","),
        (["  time_s   strain", "  0 0.5"], " ", "."),
        (["time_s|strain", "0|0.5"], "|", "."),
        (["time_s, strain", "0, 0.5", "1, 2"], ",", "."),
        (['"time_s","strain"', '"0,5","1,25"'], ",", ","),
        (["test;state", "a, b;ruptured"], ";", "."),
        (["Time (h);Strain, total (%)", "0;0", "1;0,51"], ";", ","),
        (["t;e", "1,000;0,000", "1,500;0,001"], ";", ","),
        (["heat;stress_MPa;rate_1/s", "617.2;100,5;1,5D-8", "617.3;120,5;2,5D-8", "617.4;1;2,0D-7"], ";", ","),
        (["date;time_h", "2024-01-01 12:00:00;0,5", "2024-01-01 12:30:00;1,0"], ";", ","),
    )
    found = [(lines, detect_dialect(lines), Dialect(*expected)) for lines, *expected in cases]
    assert [one for one in found if one[1] != one[2]] == []


def test_a_comma_before_three_digits_is_asked_for():
    lines = ["time_s;rate", "1,234;2", "2,345;3"]
    with pytest.raises(HistoryError, match=r"x.csv: '1,234' may be 1.234 or 1234; write decimal points"):
        detect_dialect(lines, "x.csv")
    assert detect_dialect(lines, decimal=",") == Dialect(";", ",")


def test_cells():
    assert split_line(' 1 ; "a;b" ;', Dialect(";")) == ["1", "a;b", ""]
    assert split_line("  1\t 2  ", Dialect(" ")) == ["1", "2"]
    assert split_line('"a b"  2', Dialect(" ")) == ["a b", "2"]
    with pytest.raises(HistoryError, match="x.csv:4: not a line of a CSV table .*; look for stray quotes"):
        split_line('0,"1', Dialect(), "x.csv:4")


def test_numbers_and_lost_values():
    for text, decimal, value in (
        ("1,5E-3", ",", 1.5e-3), ("-1.5d+3", ".", -1500.0), (",5", ",", 0.5), ("3.", ".", 3.0), ("+7", ",", 7.0),
    ):  # fmt: skip
        dialect = Dialect(";", decimal)
        assert parse_number(text, dialect, "x.csv:1", "strain") == value
        assert parse_numbers([text, "1"], dialect, str, "strain").tolist() == [value, 1.0]
    values = parse_numbers(["1,5", "", "NaN"], Dialect(";", ","), str, "sigma", missing=("", "NaN"))
    assert values[0] == 1.5
    assert np.isnan(values[1:]).all()


def test_what_is_no_number():
    for text, decimal, message in (
        ("1,5", ".", "x:2: 'strain' is '1,5' with a comma, while the table has decimal points"),
        ("1.234", ",", "x:2: 'strain' is '1.234' with a point, while the table has decimal commas"),
        ("1.234,5", ",", "x:2: 'strain' is '1.234,5', with digits in groups"),
        ("1 234.5", ".", "with digits in groups"),
        ("", ".", "x:2: 'strain' is empty"),
        ("nan", ".", "x:2: 'strain' is 'nan'; write a finite number"),
        ("1e999", ".", "x:2: 'strain' is '1e999', too large a number"),
        ("01233", ",", "x:2: 'strain' is '01233', which begins with 0, as where a decimal sign is lost"),
        ("1_000", ".", "x:2: 'strain' is '1_000'"),
        ("٣", ".", "x:2: 'strain' is '٣'"),
    ):
        dialect = Dialect(";", decimal)
        one = partial(parse_number, text, dialect, "x:2", "strain")
        many = partial(parse_numbers, ["1", text], dialect, lambda k: f"x:{k + 1}", "strain")
        assert said_otherwise([(one, message), (many, message)], HistoryError) == []


def test_hostile_lines_cost_linear_time():
    start = time.process_time()
    for line in ("1" * 200_000 + "x", "," * 200_000, "1,2 " * 50_000, '"' * 99_999, "1,1." * 50_000):
        dialect = detect_dialect(["time_s,strain", *[line] * 3], decimal=".")
        with pytest.raises(HistoryError):
            parse_number(line, dialect, "x:1", "strain")
    # A quadratic search of 200,000 characters takes minutes, so that any computer tells.
    assert time.process_time() - start < 10.0
