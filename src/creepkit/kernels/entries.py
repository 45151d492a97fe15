"""The entries of a kernel as symbols: which numbers each of rate, update and sensitivity puts out."""

from __future__ import annotations

from dataclasses import dataclass

import sympy

from creepkit.kernels.logform import TINY, Floored, LogFloor, LogForm, log_form
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import POINT


@dataclass(frozen=True)
class Entry:
    """One function to be printed.

    inputs : every symbol it may read, the point, the states, then theta.
    steps : common subexpressions, in order.
    outputs : expressions in the order of the compiled interface.
    """

    name: str
    inputs: tuple[sympy.Symbol, ...]
    steps: tuple[tuple[sympy.Symbol, sympy.Expr], ...]
    outputs: tuple[sympy.Expr, ...]

    @property
    def read(self) -> set[sympy.Symbol]:
        """The inputs that matter."""
        expressions = [*self.outputs, *(e for _, e in self.steps)]
        return set().union(*(e.free_symbols for e in expressions)) & set(self.inputs)


@dataclass(frozen=True)
class Lowered:
    """A law as entries, ready for a printer."""

    law: CreepLaw
    form: LogForm
    rate: Entry
    log_rate: Entry
    update: Entry
    sensitivity: Entry


def entries(law: CreepLaw) -> Lowered:
    """Lower a law to its entries; the layout of `update` and `sensitivity` is that of kernels.interface."""
    form = log_form(law)
    point = (*POINT, *law.states)
    rate = sympy.Add(*(sympy.exp(term) for term in form.terms))
    log_rate, weights = _log_sum(form.terms)
    slopes = [[sympy.diff(term, v) for v in (*point, *form.theta)] for term in form.terms]

    def along(factors: tuple[sympy.Expr, ...], start: int, stop: int) -> list[sympy.Expr]:
        columns = range(start, stop)
        return [sympy.Add(*(f * s[k] for f, s in zip(factors, slopes, strict=True))) for k in columns]

    size, whole = len(point), len(point) + len(form.theta)
    exponentials = tuple(sympy.exp(term) for term in form.terms)
    inner = [[sympy.diff(g, v) for v in (*point, *form.theta)] for g in form.state_rates]
    to_point = [d for row in inner for d in row[:size]]
    to_theta = [d for row in inner for d in row[size:]]
    values = form.state_rates
    return Lowered(
        law,
        form,
        _entry("rate", point, form, [rate, *values]),
        _entry("log_rate", point, form, [log_rate, *values]),
        _entry("update", point, form, [log_rate, *values, *along(weights, 0, size), *to_point]),
        _entry(
            "sensitivity",
            point,
            form,
            [rate, *values, *along(exponentials, 0, size), *to_point, *along(exponentials, size, whole), *to_theta],
        ),
    )


def _log_sum(terms: tuple[sympy.Expr, ...]) -> tuple[sympy.Expr, tuple[sympy.Expr, ...]]:
    """ln of the sum of exponentials, and each term's share; finite even when every term is off."""
    if len(terms) == 1:
        return terms[0], (sympy.S.One,)
    largest = sympy.Max(*terms, sympy.Float(-1e300), evaluate=False)
    scaled = [sympy.exp(sympy.Add(term, -largest, evaluate=False)) for term in terms]
    total = sympy.Add(*scaled)
    shares = tuple(s / Floored(total, sympy.Float(TINY)) for s in scaled)
    return largest + LogFloor(total, sympy.Float(TINY)), shares


def _entry(name: str, point: tuple[sympy.Symbol, ...], form: LogForm, outputs: list[sympy.Expr]) -> Entry:
    inputs = (*point, *form.theta)
    fresh = sympy.numbered_symbols("x", exclude=inputs, real=True)
    steps, results = sympy.cse(outputs, symbols=fresh, order="none")
    return Entry(name, inputs, tuple(steps), tuple(results))
