"""Which library is loaded, and what is said of one that does not fit."""

from __future__ import annotations

import random
import struct
from pathlib import Path

import numpy as np
import pytest

from creepkit import core
from creepkit.cameras.text_files import FrameText
from creepkit.errors import CreepkitError, HistoryError
from creepkit.files.delimited_text import ERROR_VALUES


@pytest.fixture
def not_loaded_yet():
    """As in a new process."""
    core.library.cache_clear()
    yield
    core.library.cache_clear()


def test_a_library_of_other_sources_is_refused(monkeypatch, not_loaded_yet):
    monkeypatch.setattr(core, "INTERFACE_VERSION", 0)
    with pytest.raises(CreepkitError, match=r"has interface \d+, but this Python code needs 0 .*; run 'make core'"):
        core.library()


def test_every_width_of_vectors_up_to_the_processors_can_be_chosen(monkeypatch, not_loaded_yet):
    monkeypatch.delenv("CREEPKIT_LANES", raising=False)
    most = core.library().creepkit_core_lanes()
    assert most in (2, 4, 8)
    for lanes in (2, 4, 8):
        core.library.cache_clear()
        monkeypatch.setenv("CREEPKIT_LANES", str(lanes))
        if lanes <= most:
            assert core.library().creepkit_core_lanes() == lanes
        else:
            with pytest.raises(CreepkitError, match=f"CREEPKIT_LANES is '{lanes}', but .* {most} numbers at most"):
                core.library()


# ---- number table ----------------------------------------------------------------------------------------------------

# Numbers of a text table are those that Python reads, to the last bit.


def read(rows: bytes, delimiter: str = ",", columns: int = 1) -> np.ndarray:
    names = tuple(f"c{k}" for k in range(columns))
    return FrameText(Path("table.csv"), rows, delimiter, names, lambda: 1).numbers(range(columns))


def numbers_as_text(count: int) -> list[str]:
    """Short and long ones, those halfway between two doubles, and the ends of the range."""
    generator = random.Random(3)
    words = ["0", "-0.0", "0e400", "5e-324", "2.2250738585072011e-308", "1.7976931348623157e308", "9007199254740993"]
    words += ["9007199254740992.5", "1" * 400, "0." + "0" * 300 + "1", "123456789012345678901234567890", "+.5", "7."]
    for _ in range(count):
        bits = generator.getrandbits(64)
        value = struct.unpack("d", struct.pack("Q", bits))[0]
        halfway = 2 * (generator.getrandbits(53) | 1 << 52) + 1
        words += [f"{halfway}{generator.choice(['', 'e3', 'e-3', '.0', '.00000'])}"]
        words += [
            f"{generator.gauss(0, 10):.{generator.randrange(20)}e}",
            f"{generator.gauss(0, 1):.{generator.randrange(18)}f}",
        ]
        words += [repr(value)] if np.isfinite(value) else []
    return words


def test_numbers_are_rounded_to_the_nearest() -> None:
    words = numbers_as_text(3000)
    found = read("\n".join(words).encode())[:, 0]
    expected = np.array([float(word) for word in words])
    assert [word for word, a, b in zip(words, found, expected, strict=True) if a != b] == []
    commas = read("\n".join(words).replace(".", ",").encode(), ";")[:, 0]
    np.testing.assert_array_equal(commas, expected)


@pytest.mark.parametrize("word", ERROR_VALUES)
def test_a_row_that_begins_with_an_error_of_a_spreadsheet_is_no_remark(word: str) -> None:
    with pytest.raises(HistoryError, match="table.csv:2: "):
        read(f"1,2\n{word},3\n# a remark\n4,5\n".encode(), ",", 2)


def test_fortran_exponents_blank_lines_and_remarks() -> None:
    rows = b'  1.5D-3  2 \r\n\r\n# a remark\r\n\t"3"   -4E+2\r\n'
    assert read(rows, " ", 2).tolist() == [[0.0015, 2.0], [3.0, -400.0]]
