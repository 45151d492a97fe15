"""Text with delimiters, as any program writes it: its encoding, its delimiter, its decimal sign, its numbers.

Nothing is guessed: what could be read in two ways is refused in one sentence. All takes a time linear in the text.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import CreepkitError, HistoryError, quoted
from creepkit.files.time_stamps import is_clock_time

ERROR_VALUES = ("#REF!", "#DIV/0!", "#N/A", "#VALUE!", "#NAME?", "#NUM!", "#NULL!", "#SPILL!", "#CALC!", "#####")
"""What spreadsheets write for a value that could not be computed or shown; no remark begins so."""


MISSING_VALUES = frozenset(("n.a.", "n.a", "n/a", "na", "n. a.", "n.b.", "n. b.", "n.d.", "k.a.", "k. a."))
"""What stands for a value that was not measured or not stated, in small letters, beside rows of dashes; nan is a number
that was lost."""


_BYTE_ORDER_MARKS = ((b"\xef\xbb\xbf", "utf-8"), (b"\xff\xfe", "utf-16-le"), (b"\xfe\xff", "utf-16-be"))


_CONTROL_BYTES = bytes(sorted({*range(32), 127} - {9, 10, 12, 13}))
"""Bytes of no text: all control characters but tab, line feed, form feed and carriage return."""


_SAMPLE_LINES, _SAMPLE_CHARACTERS = 200, 4000
"""Lines, and characters of each, that decide on the delimiter; on the decimal sign all lines decide."""


class AmbiguousNumber(HistoryError):
    """A number with one comma before three digits where no other tells what the comma is; number : as it is written."""

    number: str


@dataclass(frozen=True)
class Dialect:
    r"""How a table is written as text.

    delimiter : "," ";" "\t" "|", or " " for runs of blanks and tabs. decimal : "." or ",".
    """

    delimiter: str = ","
    decimal: str = "."

    def __str__(self) -> str:
        return f"{_DELIMITER_NAMES[self.delimiter]}, decimal {'point' if self.decimal == '.' else 'comma'}"


_DELIMITER_NAMES = {"\t": "tabs", ";": "semicolons", "|": "bars", ",": "commas", " ": "blanks"}
"""Delimiters, in the order in which they are preferred where a sample speaks for two alike."""


NUMBERS = {
    sign: re.compile(rf"[+-]?(?:\d+(?:{re.escape(sign)}\d*)?|{re.escape(sign)}\d+)(?:[eEdD][+-]?\d+)?", re.ASCII)
    for sign in ".,"
}
"""A number by decimal sign. Every digit can be matched in one way only, so that a long row of digits costs no more."""


_GROUPED = re.compile(r"[+-]?\d+(?:[.,'’  \s]\d+)+(?:[eEdD][+-]?\d+)?", re.ASCII)
"""Digits in groups, with several separators or with one that is no decimal sign."""


_WITH_UNIT = re.compile(r"[+-]?\d[\d.,]* ?[^\W\d_].{0,10}|[+-]?\d[\d.,]* ?°[CFK]")
"""A value with its unit, `120 MPa`: neither a number nor a mangled one."""


_THOUSANDS_LIKE = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}", re.ASCII)
"""Three digits behind one comma: a number below 1000 with a decimal comma, or a larger one with a separator."""


_PADDED = re.compile(r"^[+-]?0\d+$", re.ASCII | re.MULTILINE)
"""A whole number that begins with 0, as 0123 does where the sign of 0.123 was lost."""


_PART_CHARACTERS = 4_000_000
"""Of a text whose lines are taken apart at once."""


_PLAIN_CHARACTERS = frozenset("0123456789+-.eE")


def decode_text(content: bytes, path: Path, error: type[CreepkitError] = HistoryError) -> str:
    """The text of a file in UTF-8 (with or without byte order mark), UTF-16 with one, else in Windows Latin (cp1252).

    error : what is raised for bytes that are no text, with their line.
    """
    mark, encoding = next(((m, e) for m, e in _BYTE_ORDER_MARKS if content.startswith(m)), (b"", "utf-8"))
    try:
        text = content[len(mark) :].decode(encoding)
    except UnicodeDecodeError as problem:
        if encoding == "utf-8" and not mark:
            return _decode_western(content, path, error)
        line = problem.object[: problem.start].decode(encoding, errors="replace").count("\n") + 1
        raise error(f"{path}:{line}: found bytes that are not text in {encoding.upper()}; save it in UTF-8") from None
    if not text.isascii() or content.translate(None, _ASCII_OF_TEXT):
        refuse_unprintable(text, lambda k: f"{path}:{text[:k].count(chr(10)) + 1}", error)
    if "\0" in text:
        line = text[: text.index("\0")].count("\n") + 1
        raise error(f"{path}:{line}: byte 0x00 is not text; save the table as text in UTF-8")
    return text


UNPRINTABLE = re.compile("[\x01-\x08\x0b\x0e-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
"""Characters that steer a terminal, break lines or turn the direction of writing."""


_ASCII_OF_TEXT = bytes(k for k in range(128) if not UNPRINTABLE.match(chr(k)))


def refuse_unprintable(text: str, locate: Callable[[int], str], error: type[CreepkitError] = HistoryError) -> None:
    """Raise an error for a text that would steer the terminal on which it is shown; locate : the place of character k.

    Blanks of any width, tabs and form feeds are allowed.
    """
    if found := UNPRINTABLE.search(text):
        raise error(
            f"{locate(found.start())}: the character U+{ord(found[0]):04X} cannot be printed; remove it from the text"
        )


def _decode_western(content: bytes, path: Path, error: type[CreepkitError]) -> str:
    """Text in cp1252, the Latin-1 of Windows; bytes that mean nothing there, and control characters, are no text."""
    foreign = content.translate(None, bytes(set(range(256)) - set(_CONTROL_BYTES)))
    try:
        if not foreign:
            text = content.decode("cp1252")
            refuse_unprintable(text, lambda k: f"{path}:{text[:k].count(chr(10)) + 1}", error)
            return text
        start = content.index(foreign[:1])
    except UnicodeDecodeError as problem:
        start = problem.start
    line = content[:start].count(b"\n") + 1
    raise error(f"{path}:{line}: byte 0x{content[start]:02x} is not text in UTF-8 or Latin-1; save it as CSV in UTF-8")


def text_lines(text: str) -> list[str]:
    """The lines of a text as an editor counts them (str.splitlines also breaks at form feeds and the like)."""
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def detect_dialect(lines: Iterable[str], location: str = "", decimal: str | None = None) -> Dialect:
    """The dialect of the lines of a table: its line of names and its rows, without comments.

    decimal : the decimal sign, where it is known. AmbiguousNumber, beginning with `location`, where `1,234` may be 1234
    as well as 1.234, and no other number tells.
    """
    filled = (line for line in lines if line and not line.isspace())
    sample = list(islice(filled, _SAMPLE_LINES))
    delimiter = _delimiter([line[:_SAMPLE_CHARACTERS] for line in sample])
    place = f"{location}: " if location else ""
    return Dialect(delimiter, decimal or _decimal(chain(sample, filled), delimiter, place))


def split_line(line: str, dialect: Dialect, location: str = "") -> list[str]:
    """The cells of one line, without the blanks around them; HistoryError for a stray quote."""
    if '"' not in line:
        return line.split() if dialect.delimiter == " " else [cell.strip() for cell in line.split(dialect.delimiter)]
    if dialect.delimiter == " ":
        text = " ".join(line.split())
    else:
        text = re.sub(rf'" +{re.escape(dialect.delimiter)}', f'"{dialect.delimiter}', line.strip(" "))
    try:
        reader = csv.reader([text], delimiter=dialect.delimiter, skipinitialspace=True, strict=True)
        return [cell.strip() for cell in next(reader)]
    except csv.Error as error:
        place = f"{location}: " if location else ""
        raise HistoryError(f"{place}not a line of a CSV table ({error}); look for stray quotes") from None


def split_lines(
    numbered: Iterable[tuple[int, str]], dialect: Dialect, path: Path
) -> Iterator[tuple[int, str, list[str]]]:
    """The number and the text of each line, and its cells as `split_line` takes them apart, at a lower cost a line."""
    delimiter = None if dialect.delimiter == " " else dialect.delimiter
    for number, line in numbered:
        if '"' in line:
            cells = split_line(line, dialect, f"{path}:{number}")
        else:
            cells = line.split() if delimiter is None else [*map(str.strip, line.split(delimiter))]
        yield number, line, cells


_UNCERTAINTY = re.compile(
    r"(?P<value>\d(?:\s*(?P<unit>[^\W\d_]\w{0,3}|°\s*[CFK]|%))?)\s*(?:±|\+/-)\s*\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?"
    r"(?:\s*(?P=unit))?"
)
"""What stands behind a value for its uncertainty, 120 ± 1 or 120 MPa ± 1 MPa."""


def without_uncertainty(text: str) -> str:
    """A text in which values stand without their uncertainties."""
    return _UNCERTAINTY.sub(r"\g<value>", text) if "±" in text or "+/-" in text else text


def parse_number(text: str, dialect: Dialect, location: str, name: str) -> float:
    """A cell as a number; `name` and `location` say in the HistoryError what it was meant to be, and where it stands.

    An exponent may be written E or D. NaN, infinities, digits in groups and whole numbers such as 0123 are no numbers.
    """
    is_written_well = NUMBERS[dialect.decimal].fullmatch(text) and not _PADDED.match(text)
    value = float_of(text) if is_written_well else math.nan
    if not math.isfinite(value):
        raise HistoryError(f"{location}: '{name}' is {_why_no_number(text, dialect)}")
    return value


def parse_numbers(
    cells: Sequence[str], dialect: Dialect, locate: Callable[[int], str], name: str, missing: Collection[str] = ()
) -> Floats:
    """Cells of one column as numbers.

    locate : the place of cell k, for the HistoryError. missing : texts that stand for a lost value; they become NaN.
    """
    if dialect.decimal == "." and set("".join(cells)) <= _PLAIN_CHARACTERS and not _PADDED.search("\n".join(cells)):
        try:
            values = np.array([float(cell) for cell in cells])
        except ValueError:
            pass  # which of them, and why, is found below
        else:
            if np.isfinite(values).all():
                return values
    lost, matches = frozenset(missing), NUMBERS[dialect.decimal].fullmatch
    values = np.full(len(cells), np.nan)
    for k, cell in enumerate(cells):
        if cell in lost:
            continue
        if matches(cell) and not _PADDED.match(cell):
            values[k] = float_of(cell)
        if not math.isfinite(values[k]):
            raise HistoryError(f"{locate(k)}: '{name}' is {_why_no_number(cell, dialect)}")
    return values


def parts_of_lines(text: str, start: int = 0) -> Iterator[str]:
    """The lines of a text from character `start` on, some megabytes at a time, for what is made of them takes more."""
    while start < len(text):
        end = text.find("\n", start + _PART_CHARACTERS)
        end = len(text) if end < 0 else end
        yield text[start:end]
        start = end + 1


def is_missing(text: str) -> bool:
    """Whether a cell is empty, or holds a mark of what was not measured or not stated."""
    return not text or (len(text) <= 5 and text.casefold() in MISSING_VALUES) or not text.strip("-–—_")


def is_number(text: str, dialect: Dialect) -> bool:
    """Whether a cell is a number."""
    return NUMBERS[dialect.decimal].fullmatch(text) is not None


def float_of(text: str) -> float:
    """The number of a text with either decimal sign, its exponent behind E or, as Fortran writes it, D."""
    return float(text.replace(",", ".").replace("D", "E").replace("d", "e"))


def _why_no_number(text: str, dialect: Dialect) -> str:
    shown = quoted(text)
    if not text:
        return "empty; write a finite number such as 1.5e-3, or leave the row out"
    if is_missing(text):
        return f"'{shown}', and a value is needed here; write a finite number such as 1.5e-3, or leave the row out"
    if _PADDED.match(text):
        return f"'{shown}', which begins with 0, as where a decimal sign is lost; write it without"
    if NUMBERS[dialect.decimal].fullmatch(text):
        return f"'{shown}', too large a number; write a finite number such as 1.5e-3"
    other = "," if dialect.decimal == "." else "."
    if NUMBERS[other].fullmatch(text):
        sign, words = ("comma", "decimal points") if other == "," else ("point", "decimal commas")
        return f"'{shown}' with a {sign}, while the table has {words}; write all numbers alike, without separators"
    if _GROUPED.fullmatch(text):
        return f"'{shown}', with digits in groups; write the number without separators between thousands"
    return f"'{shown}'; write a finite number such as 1.5e-3"


def _delimiter(sample: Sequence[str]) -> str:
    """The delimiter by which most cells are numbers and fewest are mangled ones; else by which lines are alike."""
    drawn = all(line.strip()[:1] == "|" == line.strip()[-1:] for line in sample)
    scores = {delimiter: _score(sample, delimiter) for delimiter in _DELIMITER_NAMES}
    return max(scores, key=lambda delimiter: (drawn and delimiter == "|", scores[delimiter]))


def _score(sample: Sequence[str], delimiter: str) -> tuple[bool, int, int]:
    """Whether it is there, numbers less mangled ones, and lines of the commonest number of cells, for a delimiter."""
    numbers = 0
    counts: dict[int, int] = {}
    for line in sample:
        cells = _unquoted_cells(line, delimiter)
        if len(cells) < 2 or (delimiter == " " and "\t" in line.strip()):  # which tabs take apart
            continue
        counts[len(cells)] = counts.get(len(cells), 0) + 1
        for cell in (without_uncertainty(cell).rstrip("% ") for cell in cells):
            if cell and (cell[0] in "+-.," or "0" <= cell[0] <= "9"):
                is_numeric = NUMBERS["."].fullmatch(cell) or (delimiter != "," and NUMBERS[","].fullmatch(cell))
                numbers += 1 if is_numeric or is_clock_time(cell) else 0 if _WITH_UNIT.fullmatch(cell) else -2
    return bool(counts), numbers, 0 if delimiter == " " else max(counts.values(), default=0)


def _unquoted_cells(line: str, delimiter: str) -> list[str]:
    """Cells of a line of a sample, where those in quotes count as words: their commas belong to them."""
    text = re.sub(r'"[^"]*"', "quoted", line) if '"' in line else line
    return text.split() if delimiter == " " else [cell.strip() for cell in text.split(delimiter)]


def _decimal(lines: Iterable[str], delimiter: str, place: str) -> str:
    """The decimal sign of most numbers in the lines; '.' where none has a fraction.

    Numbers with the other sign are refused where they are read, so that a text such as '617.2' does no harm here.
    """
    commas, points, doubtful = 0, 0, ""
    for number, line in enumerate(lines):
        if number >= _SAMPLE_LINES and (commas or points):
            break
        if "," not in line and "." not in line:
            continue
        for cell in (without_uncertainty(cell).rstrip("% ") for cell in _possible_numbers(line, delimiter)):
            if "," in cell and NUMBERS[","].fullmatch(cell):
                if _THOUSANDS_LIKE.fullmatch(cell):
                    doubtful = doubtful or cell
                else:
                    commas += 1
            elif "." in cell and NUMBERS["."].fullmatch(cell):
                points += 1
    if doubtful and not commas and not points:
        error = AmbiguousNumber(f"{place}{two_readings(doubtful)}; write decimal points and no separators")
        error.number = doubtful
        raise error
    return "," if commas > points else "."


def two_readings(number: str) -> str:
    """What a number with one comma before three digits may be."""
    return f"'{number}' may be {number.replace(',', '.')} or {number.replace(',', '')}"


def _possible_numbers(line: str, delimiter: str) -> list[str]:
    if '"' not in line:
        return _unquoted_cells(line, delimiter)
    try:
        return split_line(line, Dialect(delimiter))
    except HistoryError:  # told with its line by who reads the cells
        return []
