"""Parity: every target against 50-digit arithmetic, straight from the author's expression.

Values and derivatives are compared relatively wherever float64 can hold them (and the rate, which derivatives are
multiples of); the rate itself is compared in ln rate everywhere. Where a result is a small difference of large parts,
no formula in float64 can keep ten digits of it; such a result is told from a wrong one by its error, which is no more
than the last bits of the inputs make.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np

from creepkit.kernels.exact import Exact
from creepkit.language.symbols import POINT
from creepkit.testing.sampling import Samples
from creepkit.testing.tables import Table

VALUE_TOLERANCE = 1e-12
DERIVATIVE_TOLERANCE = 1e-10
NO_RATE = 1e-100
"""Rates below this, 1/s, count as zero: what floors leave of a term that is exactly zero."""

_Rows = Sequence[Sequence[Any]]

_SMALLEST, _LARGEST = mpmath.mpf("2.3e-308"), mpmath.mpf("1.7e308")
_LAST_BITS = 4.0
"""How many times the change from the last bit of every input an error may be where a result cancels."""


@dataclass(frozen=True)
class Difference:
    """The largest relative difference of one kind, and where it is: sample, row (rate or state), column."""

    size: float = 0.0
    sample: int = 0
    row: int = 0
    column: int = 0


class Truth:
    """A law at samples: rows[sample][1 + S][1 + 6 + S + P], numbers of 50 digits laid out as in Table."""

    def __init__(self, exact: Exact, drawn: Samples) -> None:
        self.exact, self.drawn = exact, drawn
        self.rows = [exact.rows(p, t) for p, t in zip(drawn.points, drawn.theta, strict=True)]
        self._sharp: dict[int, _Rows] = {}
        self._last_bits: dict[int, _Rows] = {}

    def sharp(self, sample: int) -> _Rows:
        """The rows of one sample to twenty times the digits, where exp(-500) next to 1 still counts."""
        if sample not in self._sharp:
            more = Exact(self.exact.law, 20 * self.exact.digits)
            self._sharp[sample] = more.rows(self.drawn.points[sample], self.drawn.theta[sample])
        return self._sharp[sample]

    def last_bits(self, sample: int) -> _Rows:
        """How much each number changes, in sum, when each input changes by its last bit."""
        if sample not in self._last_bits:
            inputs = np.concatenate([self.drawn.points[sample], self.drawn.theta[sample]])
            split = self.drawn.points.shape[1]
            moved = inputs * (1.0 + np.eye(inputs.size) * 2.0**-52)
            changed = [self.exact.rows(row[:split], row[split:]) for row in moved]
            self._last_bits[sample] = [
                [sum(abs(rows[r][c] - exact) for rows in changed) for c, exact in enumerate(line)]
                for r, line in enumerate(self.rows[sample])
            ]
        return self._last_bits[sample]

    def at(self, where: Difference) -> str:
        """A place in words: which derivative of what, at which point."""
        exact, names = self.exact, [s.name for s in self.exact.variables]
        what = ["rate", *(f"rate of {s}" for s in exact.law.states)][where.row]
        of = what if where.column == 0 else f"d({what})/d({names[where.column - 1]})"
        point = self.drawn.points[where.sample]
        used = [k for k, s in enumerate((*POINT, *exact.law.states)) if exact.law.uses(s)]
        return f"{of} at {', '.join(f'{names[k]} {point[k]:.4g}' for k in used)}"


def worst(truth: Truth, table: Table, forgive: bool = False) -> tuple[Difference, Difference]:
    """Return the largest relative difference of values (ln rate among them) and of derivatives.

    forgive : leave out results that cancel, whose error is no more than the last bits of the inputs make.
    """
    values = derivatives = Difference()
    for k, (rows, got, log) in enumerate(zip(truth.rows, table.rows, table.logs, strict=True)):
        values = max(values, Difference(_log_difference(rows[0][0], log), k), key=_size)
        for seen in _differences(k, rows, got):
            limit = VALUE_TOLERANCE if seen.column == 0 else DERIVATIVE_TOLERANCE
            found = seen if seen.size <= limit else _judged(truth, table, seen, forgive)
            if found.column == 0:
                values = max(values, found, key=_size)
            else:
                derivatives = max(derivatives, found, key=_size)
    return values, derivatives


def _judged(truth: Truth, table: Table, where: Difference, forgive: bool) -> Difference:
    """A difference beyond the tolerance, looked at again with more digits and, if so wished, for cancellation."""
    k, row, column = where.sample, where.row, where.column
    exact, got = truth.sharp(k)[row][column], float(table.rows[k, row, column])
    if forgive and abs(mpmath.mpf(got) - exact) <= _LAST_BITS * truth.last_bits(k)[row][column]:
        return Difference(0.0, k, row, column)
    return Difference(_relative(exact, got), k, row, column)


def _differences(sample: int, rows: Sequence[Sequence[Any]], got: Any) -> Iterator[Difference]:
    for row, (true, numbers) in enumerate(zip(rows, got, strict=True)):
        if true[0] == 0 and abs(numbers[0]) < NO_RATE:
            continue
        if abs(true[0]) >= _LARGEST:
            continue
        for column, (a, b) in enumerate(zip(true, numbers, strict=True)):
            if a == 0 or _SMALLEST < abs(a) < _LARGEST:
                yield Difference(_relative(a, float(b)), sample, row, column)


def _log_difference(rate: Any, log: float) -> float:
    if rate <= 0:
        return 0.0 if rate == 0 and log < mpmath.log(NO_RATE) else np.inf
    exact = mpmath.log(rate)
    return float(abs(exact - mpmath.mpf(float(log))) / max(1, abs(exact))) if np.isfinite(log) else np.inf


def _relative(true: Any, got: float) -> float:
    if not np.isfinite(got):
        return np.inf
    if true == 0:
        return 0.0 if abs(got) < NO_RATE else np.inf
    return float(abs(mpmath.mpf(got) / true - 1))


def _size(difference: Difference) -> float:
    return difference.size
