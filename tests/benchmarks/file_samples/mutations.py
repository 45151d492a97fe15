"""Mutations of files: of any bytes, and of tables of text in ways that change what they say."""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from file_samples.samples import ReaderSample

PIECES = [
    *(b"nan", b"inf", b"-", b"1e308", b"1e-320", b"-0.0", b"", b" ", b"#", b"# ", b":", b";", b'"', b"'", b"\n", b"\r"),
    *(b"\x00", b"\x0c", b"\xff", b"\xfe\xff", b"\xef\xbb\xbf", "\u2028".encode(), "\u0663".encode(), b"\t", b",,"),
    *(b"%", b"label ", b"geometry ", b"specimen: bulge", b"0 s 1 MPa", b"used", b"yes", b"=1+1", b"../x", b"9" * 400),
    *(b"[" * 300, b"{", b"}", b'{"a":', b"null", b"true", b"1_000", b"1,5", b"0x10", b"1e", b"stress_MPa", b"time_s"),
    b"\\u0000",
]


UNITS = (("_MPa", "_kPa"), ("_h", "_s"), ("_K", "_C"), ("_mm", "_um"), ("kN", "N"), ("_GPa", "_MPa"))
"""Pairs of units of one quantity."""


ENCODINGS = ("utf-16", "utf-16-be", "utf-32", "latin-1", "utf-8-sig")


@dataclass(frozen=True)
class Mutation:
    """A mutated file. kind : how. changed : whether it says something else, and must not be read as if it did not."""

    kind: str
    content: bytes
    changed: bool = False


def mutation(sample: ReaderSample, seed: int) -> Mutation:
    """One mutation of a sample, by seed; of a kind with a meaning in three of eight cases, where there are such."""
    draw = random.Random(f"{sample.name} {seed}")
    kinds = [kind for kind in MEANINGFUL if kind(sample, draw) is not None]
    if kinds and draw.random() < 0.375:
        for _ in range(10):
            result = draw.choice(kinds)(sample, draw)
            if result is not None and result.content != sample.files[sample.mutated]:
                return result
    return _bytes_changed(sample.files[sample.mutated], draw)


def _bytes_changed(content: bytes, draw: random.Random) -> Mutation:
    """Cuts, insertions, repetitions, swaps, other encodings: no meaning is known of the result."""
    done = []
    for _ in range(draw.choice((1, 1, 1, 2, 3, 6))):
        kind = draw.choice(("cut", "insert", "repeat", "swap", "flip", "truncate", "encode", "newlines", "lines"))
        content = _changed(content, kind, draw)
        done.append(kind)
    return Mutation("bytes: " + (done[0] if len(done) == 1 else "several"), content)


def _changed(content: bytes, kind: str, draw: random.Random) -> bytes:
    start = draw.randrange(len(content) + 1)
    end = min(start + draw.choice((1, 1, 2, 5, 20, 200)), len(content))
    if kind == "cut":
        return content[:start] + content[end:]
    if kind == "insert":
        return content[:start] + draw.choice((*PIECES, draw.randbytes(draw.randrange(1, 9)))) + content[start:]
    if kind == "repeat":
        return content[:start] + content[start:end] * draw.choice((2, 2, 3, 50)) + content[end:]
    if kind == "swap":
        return content[:start] + content[start:end][::-1] + content[end:]
    if kind == "flip":
        return content[:start] + bytes(byte ^ (1 << draw.randrange(8)) for byte in content[start:end]) + content[end:]
    if kind == "truncate":
        return content[:start]
    if kind == "encode":
        text = content.decode("utf-8", errors="replace")
        return text.encode(draw.choice(ENCODINGS), errors="replace")
    if kind == "newlines":
        return content.replace(b"\n", draw.choice((b"\r\n", b"\r", b"\n\n", b"", b"\x0b")))
    lines = content.split(b"\n")
    draw.shuffle(lines)
    return b"\n".join(lines)


Change = Callable[[ReaderSample, random.Random], Mutation | None]
MEANINGFUL: list[Change] = []
"""Mutations of which it is known what they say."""


def _of_cells(change: Callable[[list[list[str]], random.Random], tuple[str, list[list[str]], bool] | None]) -> None:
    """A mutation of a table: change(rows with the names first, draw) gives its kind, the new rows, and `changed`."""

    def mutated(sample: ReaderSample, draw: random.Random) -> Mutation | None:
        if not sample.delimiter:
            return None
        head, rows = _head_and_rows(sample)
        result = change(rows, draw)
        return None if result is None else Mutation(result[0], _joined(sample, head, result[1]), result[2])

    MEANINGFUL.append(mutated)


def _head_and_rows(sample: ReaderSample) -> tuple[list[str], list[list[str]]]:
    """The lines of the head, and the cells of names and rows."""
    lines = sample.files[sample.mutated].decode().rstrip("\n").split("\n")
    head = [line for line in lines if line.startswith("#")]
    return head, [line.split(sample.delimiter) for line in lines[len(head) :]]


def _joined(sample: ReaderSample, head: list[str], rows: list[list[str]]) -> bytes:
    return "\n".join([*head, *(sample.delimiter.join(row) for row in rows)]).encode() + b"\n"


@_of_cells
def _column_twice(rows, draw):
    """The second time with other numbers."""
    k = draw.randrange(len(rows[0]))
    return "column twice", [[*row, row[k] if n == 0 else row[k] + "1"] for n, row in enumerate(rows)], True


@_of_cells
def _decimal_sign(rows, draw):
    """Decimal commas, or the points left out, in one column, one row or all."""
    new = draw.choice((",", "", " ", "'"))
    column, row = draw.choice((None, draw.randrange(len(rows[0])))), draw.choice((None, draw.randrange(1, len(rows))))
    changed = [
        [c.replace(".", new) if n and row in (None, n) and column in (None, k) else c for k, c in enumerate(cells)]
        for n, cells in enumerate(rows)
    ]
    return "decimal sign", changed, new != ""


def _of_words(kind: str, choices: Callable[[ReaderSample], Sequence[tuple[str, str]]]) -> None:
    """A mutation that replaces one of some texts where it stands first."""

    def mutated(sample: ReaderSample, draw: random.Random) -> Mutation | None:
        if not (pairs := choices(sample)):
            return None
        before, after = draw.choice(pairs)
        return Mutation(kind, sample.files[sample.mutated].decode().replace(before, after, 1).encode(), changed=True)

    MEANINGFUL.append(mutated)


_of_words("unit removed", lambda sample: sample.without_unit)
_of_words("name misspelt", lambda sample: sample.misspelt)


@_of_cells
def _no_number(rows, draw):
    n, k = draw.randrange(1, len(rows)), draw.randrange(len(rows[0]))
    rows[n][k] = draw.choice(("nan", "NaN", "inf", "-inf", "", "#N/A", "---", "1.2.3", "1e", "0x1F", "1_0", "n.a."))
    return "no number in a cell", rows, True


def _time_column(rows: list[list[str]]) -> int | None:
    """The first column of times of a table of three rows or more."""
    times = [k for k, name in enumerate(rows[0]) if name.startswith("time")]
    return times[0] if times and len(rows) >= 4 else None


@_of_cells
def _time_not_increasing(rows, draw):
    if _time_column(rows) is None:
        return None
    n = draw.randrange(1, len(rows) - 1)
    rows[n], rows[n + 1] = rows[n + 1], rows[n]
    return "rows in another order", rows, True


@_of_cells
def _line_cut(rows, draw):
    """A row that ends amid its columns, or has one more."""
    n = draw.randrange(1, len(rows))
    rows[n] = rows[n][: draw.randrange(1, len(rows[n]))] if draw.random() < 0.7 else [*rows[n], "1.5"]
    return "row cut amid its columns", rows, True


@_of_cells
def _time_changed(rows, draw):
    """A time that stands in two rows, with other values in the second; or one below zero."""
    if (k := _time_column(rows)) is None:
        return None
    n = draw.randrange(2, len(rows))
    if draw.random() < 0.5:
        rows[n][k] = rows[n - 1][k]
        return "time twice", rows, True
    rows[n][k] = "-" + rows[n][k].lstrip("-")
    return "time below zero", rows, True


@_of_cells
def _names_missing(rows, draw):
    return "names missing", rows[1:], True


@MEANINGFUL.append
def _cut_in_last_row(sample: ReaderSample, draw: random.Random) -> Mutation | None:
    """A file that ends amid its last row; amid its last number, nothing but the missing line end says so."""
    if not sample.delimiter:
        return None
    head, rows = _head_and_rows(sample)
    last = sample.delimiter.join(rows[-1])
    start = draw.randrange(1, len(last))
    amid = sample.delimiter in last[start:]
    content = _joined(sample, head, rows[:-1]) + last[:start].encode()
    return Mutation("cut amid the last row" if amid else "cut in the last cell", content, changed=amid)


@MEANINGFUL.append
def _other_unit(sample: ReaderSample, draw: random.Random) -> Mutation | None:
    """Another unit of the same quantity, with the numbers of the former: no reader can tell."""
    text = sample.files[sample.mutated].decode("utf-8", "replace") if sample.delimiter else ""
    choices = [(a, b) for pair in UNITS for a, b in (pair, pair[::-1]) if a in text]
    if not choices:
        return None
    before, after = draw.choice(choices)
    return Mutation("other unit", text.replace(before, after, 1).encode())


_of_words("key repeated", lambda sample: [(text, text + text) for text in sample.repeated])
