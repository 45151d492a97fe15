"""Kernels of every target against arithmetic with 50 digits, straight from the author's expression.

Values and derivatives are compared relatively wherever float64 can hold them; the rate itself is compared in ln rate
everywhere. Where a result is a small difference of large parts no formula in float64 keeps ten digits; such a result is
accepted when its error is no more than the last bits of the inputs make.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np

from creepkit.arrays import Floats
from creepkit.kernels.interface import POINT_SIZE, call_entry
from creepkit.kernels.lowering import ArrayKernel, lower
from creepkit.kernels.multiprecision import MultiprecisionLaw
from creepkit.language.law import CreepLaw
from creepkit.testing.sample_points import LawSamples, point_text


@dataclass(frozen=True)
class KernelTable:
    """Rates of a kernel at sampled points.

    rows : (samples, 1 + S, 1 + 6 + S + P) value and derivatives of the rate and of each state rate, in 1/s.
    log_rates : (samples,) ln rate.
    """

    rows: Floats
    log_rates: Floats


def evaluate_numpy(law: CreepLaw, samples: LawSamples) -> KernelTable:
    """Evaluate the NumPy kernel."""
    return _kernel_table(lower(law, "numpy"), samples.arguments())


def evaluate_torch(law: CreepLaw, samples: LawSamples) -> KernelTable:
    """Evaluate the torch kernel."""
    import torch

    return _kernel_table(lower(law, "torch"), [torch.tensor(column) for column in samples.arguments()])


def evaluate_compiled(law: CreepLaw, samples: LawSamples) -> KernelTable:
    """Evaluate the compiled entries."""
    compiled = lower(law, "compiled")
    rows, width, count = 1 + compiled.states, POINT_SIZE + compiled.states, len(law.params)
    blocks, log_rates = [], []
    for point, theta in zip(samples.points, samples.theta, strict=True):
        out = call_entry(compiled, "sensitivity", point[None], theta)[0][0]
        to_point = out[rows : rows + rows * width].reshape(rows, width)
        to_theta = out[rows + rows * width :].reshape(rows, count)
        blocks.append(np.hstack([out[:rows, None], to_point, to_theta]))
        log_rates.append(call_entry(compiled, "update", point[None], theta)[0][0, 0])
    return KernelTable(np.array(blocks), np.array(log_rates))


def _kernel_table(kernel: ArrayKernel, arguments: Sequence[Any]) -> KernelTable:
    result = kernel.internal_derivatives(*arguments)
    values = [result.rate, *kernel.internal_rates(*arguments)[1:]]
    derivatives = [{**result.point, **result.params}, *result.state_rates.values()]
    rows = [[value, *of_value.values()] for value, of_value in zip(values, derivatives, strict=True)]
    columns = np.array([[np.asarray(column, float) for column in row] for row in rows])
    return KernelTable(np.moveaxis(columns, -1, 0), np.asarray(kernel.internal_log_rate(*arguments), float))


KERNEL_EVALUATORS = {"numpy": evaluate_numpy, "torch": evaluate_torch, "compiled": evaluate_compiled}
"""{target: function that evaluates it}."""


VALUE_TOLERANCE = 1e-12


DERIVATIVE_TOLERANCE = 1e-10


NEGLIGIBLE_RATE = 1e-100
"""Rates below this, 1/s, count as zero: what floors leave of a term that is exactly zero."""


_Rows = Sequence[Sequence[Any]]


_SMALLEST, _LARGEST = mpmath.mpf("2.3e-308"), mpmath.mpf("1.7e308")


_ROUNDING_FACTOR = 4.0
"""How many times the change from the last bit of every input an error may be where a result cancels."""


@dataclass(frozen=True, order=True)
class RelativeDifference:
    """The largest relative difference of one kind, and where it is: sample, row (rate or state), column."""

    size: float = 0.0
    sample: int = 0
    row: int = 0
    column: int = 0


class MultiprecisionReference:
    """A law at samples: rows[sample][1 + S][1 + 6 + S + P], numbers of 50 digits laid out as in Table."""

    def __init__(self, exact: MultiprecisionLaw, samples: LawSamples) -> None:
        self.exact, self.samples = exact, samples
        self.rows = [exact.values_and_derivatives(p, t) for p, t in zip(samples.points, samples.theta, strict=True)]
        self._high_precision_rows: dict[int, _Rows] = {}
        self._rounding_sensitivity: dict[int, _Rows] = {}

    def rows_at_high_precision(self, sample: int) -> _Rows:
        """The rows of one sample to twenty times the digits, where exp(-500) next to 1 still counts."""
        if sample not in self._high_precision_rows:
            more = MultiprecisionLaw(self.exact.law, 20 * self.exact.digits)
            self._high_precision_rows[sample] = more.values_and_derivatives(
                self.samples.points[sample], self.samples.theta[sample]
            )
        return self._high_precision_rows[sample]

    def rounding_sensitivity(self, sample: int) -> _Rows:
        """How much each number changes, in sum, when each input changes by its last bit."""
        if sample not in self._rounding_sensitivity:
            inputs = np.concatenate([self.samples.points[sample], self.samples.theta[sample]])
            split = self.samples.points.shape[1]
            perturbed = inputs * (1.0 + np.eye(inputs.size) * 2.0**-52)
            changed = [self.exact.values_and_derivatives(row[:split], row[split:]) for row in perturbed]
            self._rounding_sensitivity[sample] = [
                [sum(abs(rows[r][c] - exact) for rows in changed) for c, exact in enumerate(line)]
                for r, line in enumerate(self.rows[sample])
            ]
        return self._rounding_sensitivity[sample]

    def derivative_scale(self, sample: int, row: int, column: int) -> Any:
        """The size of a derivative that matters: the value over its input, or over 1 for an internal logarithm.

        A derivative that is a small difference, far below that size, changes nothing that is computed with it.
        """
        position, point = column - 1, self.samples.points[sample]
        is_log = position >= point.size and self.exact.law.log_scale[position - point.size]
        size = 1.0 if is_log else abs(float([*point, *self.samples.theta[sample]][position]))
        return abs(self.rows[sample][row][0]) / size if size > 0.0 else mpmath.mpf(0)

    def location_text(self, difference: RelativeDifference) -> str:
        """A place in words: which derivative of what, at which point."""
        exact, names = self.exact, [s.name for s in self.exact.variables]
        what = ["rate", *(f"rate of {s}" for s in exact.law.states)][difference.row]
        of = what if difference.column == 0 else f"d({what})/d({names[difference.column - 1]})"
        return f"{of} at {point_text(exact.law, self.samples.points[difference.sample])}"


def largest_differences(
    reference: MultiprecisionReference, table: KernelTable, allow_cancellation: bool = False
) -> tuple[RelativeDifference, RelativeDifference]:
    """Return the largest relative difference of values (ln rate among them) and of derivatives.

    allow_cancellation : leave out results that cancel, whose error is no more than the last bits of the inputs make.
    """
    worst = [RelativeDifference(), RelativeDifference()]
    for k, (rows, computed, log) in enumerate(zip(reference.rows, table.rows, table.log_rates, strict=True)):
        worst[0] = max(worst[0], RelativeDifference(_log_difference(rows[0][0], log), k))
        for difference in _differences(k, rows, computed):
            checked, kind = difference, int(difference.column > 0)
            if difference.size > (VALUE_TOLERANCE, DERIVATIVE_TOLERANCE)[kind]:
                checked = _recheck_difference(reference, table, difference, allow_cancellation)
            worst[kind] = max(worst[kind], checked)
    return worst[0], worst[1]


def _recheck_difference(
    reference: MultiprecisionReference, table: KernelTable, difference: RelativeDifference, allow_cancellation: bool
) -> RelativeDifference:
    """A difference beyond the tolerance, checked again with more digits and, if wanted, for cancellation."""
    k, row, column = difference.sample, difference.row, difference.column
    exact, computed = reference.rows_at_high_precision(k)[row][column], float(table.rows[k, row, column])
    if allow_cancellation and np.isfinite(computed):
        error = abs(mpmath.mpf(computed) - exact)
        negligible = _ROUNDING_FACTOR * reference.rounding_sensitivity(k)[row][column]
        if column > 0:
            negligible = max(negligible, VALUE_TOLERANCE * reference.derivative_scale(k, row, column))
        if error <= negligible:
            return RelativeDifference(0.0, k, row, column)
    return RelativeDifference(_relative_difference(exact, computed), k, row, column)


def _differences(sample: int, rows: Sequence[Sequence[Any]], computed: Any) -> Iterator[RelativeDifference]:
    for row, (exact, numbers) in enumerate(zip(rows, computed, strict=True)):
        if exact[0] == 0 and abs(numbers[0]) < NEGLIGIBLE_RATE:
            continue
        if abs(exact[0]) >= _LARGEST:
            continue
        for column, (a, b) in enumerate(zip(exact, numbers, strict=True)):
            if a == 0 or _SMALLEST < abs(a) < _LARGEST:
                yield RelativeDifference(_relative_difference(a, float(b)), sample, row, column)


def _log_difference(rate: Any, log: float) -> float:
    if rate <= 0:
        return 0.0 if rate == 0 and log < mpmath.log(NEGLIGIBLE_RATE) else np.inf
    exact = mpmath.log(rate)
    return float(abs(exact - mpmath.mpf(float(log))) / max(1, abs(exact))) if np.isfinite(log) else np.inf


def _relative_difference(exact: Any, computed: float) -> float:
    if not np.isfinite(computed):
        return np.inf
    if exact == 0:
        return 0.0 if abs(computed) < NEGLIGIBLE_RATE else np.inf
    return float(abs(mpmath.mpf(computed) / exact - 1))
