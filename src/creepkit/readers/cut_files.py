"""Text files that may have been cut within their last number, as by a transfer that broke off or a full disk.

Such a file ends without a line end, as many honest ones do. What tells it is the form of its last number: digits are
lacking that the numbers above it in its column have.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from creepkit.arrays import Ints
from creepkit.errors import HistoryError
from creepkit.files.delimited_text import Dialect, split_line

_ROWS, _FEWEST_ROWS = 40, 12
"""Rows above the last that are looked at, and the fewest that show a form."""


_CHARACTERS = 65_536
"""That these rows take at most."""


@dataclass(frozen=True)
class CutNumber:
    """The last number of a file that may have been cut in it. line, column : where it stands, the column from 0."""

    text: str
    line: int
    column: int

    def __str__(self) -> str:
        return (
            f"the file may have been cut within its last number, {self.text} in line {self.line}, which has fewer "
            "digits than those above it, and no line end behind it"
        )


def cut_number(text: str, dialect: Dialect) -> CutNumber | None:
    """The last number of a text of lines where it may have been cut; None where nothing speaks for that.

    Numbers that are written by their shortest form lack their last digit in a tenth of all cases, and two in a
    hundredth. So it must have fewer digits than each of those above it, by three where these differ: of honest files
    without a last line end fewer than five in a thousand are named, and a cut that is not named changes little.
    """
    last = text.rpartition("\n")[2]
    if not last or not (last[-1].isdecimal() or last[-1] in (dialect.decimal, "e", "E", "-", "+")):
        return None
    above = text[max(0, len(text) - len(last) - _CHARACTERS) : len(text) - len(last)].split("\n")[-_ROWS - 1 : -1]
    try:
        cells = split_line(last, dialect)
        column = len(cells) - 1
        others = [row[column] for line in above if len(row := split_line(line, dialect)) == len(cells)]
    except HistoryError:
        return None
    counts = _digits([cells[column], *others], dialect.decimal)
    if counts and all(_lacks_digits(int(count[0]), count[1:]) for count in counts):
        return CutNumber(cells[column], text.count("\n") + 1, column)
    return None


def _lacks_digits(own: int, others: Ints) -> bool:
    """Whether a number has fewer digits than all others, and too few for chance."""
    if others.size < _FEWEST_ROWS or others.min() <= own:
        return False
    lacking, alike = float(np.median(others)) - own, others.min() == others.max()
    return lacking >= 3 or (alike and others.size * lacking >= _ROWS)


def _digits(cells: Sequence[str], decimal: str) -> list[Ints]:
    """How many digits each cell has, the first cell's first; [] where most have another form.

    Of numbers with exponents it is twice the length of the exponent, for each of its digits counts; of others the
    digits behind the decimal sign or those that are significant, whichever differ much less, else both. Zeros have a
    form of their own, and are left out.
    """
    number = re.compile(rf"[+-]?(\d*)(?:{re.escape(decimal)}(\d*))?(?:[eEdD]([+-]?\d*))?", re.ASCII)
    found = [number.fullmatch(cell) for cell in cells]
    first = found[0]
    kept = [one for one in found[1:] if one is not None and (one[1] + (one[2] or "")).strip("0")]
    if first is not None and kept and all(one[3] is not None for one in kept):
        return [np.array([-1 if one[3] is None else 2 * len(one[3]) for one in (first, *kept)])]
    kept = [one for one in kept if one[3] is None]  # small numbers alone may have exponents
    if first is None or first[3] is not None or not kept or 2 * len(kept) < len(cells) - 1:
        return []
    decimals = np.array([len(one[2] or "") for one in (first, *kept)])
    significant = np.array([len((one[1] + (one[2] or "")).lstrip("0")) for one in (first, *kept)])
    spread, spread_of_significant = np.std(decimals[1:]), np.std(significant[1:])
    if max(spread, spread_of_significant) > 2 * min(spread, spread_of_significant):
        return [decimals if spread < spread_of_significant else significant]
    return [decimals, significant]
