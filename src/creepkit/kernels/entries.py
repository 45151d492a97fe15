"""The entries of a kernel as symbols: which numbers each of rate, update and sensitivity puts out.

Steps carry the author's words where there are any: `ln_stress`, `B = exp(ln_B)`, `strain_hardening` for the term of
that name; what else is common to several results is called x0, x1 ...
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import sympy

from creepkit.kernels.exponentials import paired_everywhere
from creepkit.kernels.logform import FLOOR, log_form
from creepkit.kernels.naming import Names
from creepkit.kernels.stable_functions import Floored, LogFloor
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import POINT

NOTHING = sympy.Float(-1e30)
"""ln of the rate of a law whose terms are all off: finite, in single precision too."""

Steps = Mapping[sympy.Symbol, sympy.Expr]


@dataclass(frozen=True)
class Entry:
    """One function to be printed.

    inputs : every symbol it may read, the point, the states, then theta.
    constants : named subexpressions of theta alone, each after those it needs.
    steps : named subexpressions of the point too, likewise.
    outputs : expressions in the order of the compiled interface.
    """

    name: str
    inputs: tuple[sympy.Symbol, ...]
    constants: tuple[tuple[sympy.Symbol, sympy.Expr], ...]
    steps: tuple[tuple[sympy.Symbol, sympy.Expr], ...]
    outputs: tuple[sympy.Expr, ...]

    @property
    def read(self) -> set[sympy.Symbol]:
        """The inputs that matter."""
        expressions = [*self.outputs, *(e for _, e in (*self.constants, *self.steps))]
        return set().union(*(e.free_symbols for e in expressions)) & set(self.inputs)


class Lowered:
    """A law as entries, ready for a printer, each made when it is first asked for.

    form is in the author's symbols, entries are in printable ones; the layout of `update` and `sensitivity` is that of
    kernels.interface.
    """

    def __init__(self, law: CreepLaw) -> None:
        self.law, self.form = law, log_form(law)
        self.names = Names(law, self.form)
        self._terms = {symbol: sympy.exp(ln) for symbol, ln in zip(self.names.terms, self.form.terms, strict=True)}
        self._log_rate, self._weights, self._shares = _log_sum(self.names, self.form.terms)
        point = (*POINT, *law.states)
        self._size, self._variables = len(point), (*point, *self.form.theta)

    @cached_property
    def rate(self) -> Entry:
        """Rates: of creep, then of each state."""
        return _entry("rate", self.names, self._terms, self._rates)

    @cached_property
    def log_rate(self) -> Entry:
        """ln of the rate of creep, then rates of states."""
        return _entry("log_rate", self.names, self._shares, self._log_rates)

    @cached_property
    def update(self) -> Entry:
        """The same, then derivatives to the point and the states."""
        outputs = [*self._log_rates, *self._along(self._weights, 0, self._size)]
        return _entry("update", self.names, self._shares, outputs)

    @cached_property
    def sensitivity(self) -> Entry:
        """Rates, their derivatives to the point and the states, then to theta."""
        slopes = self._to_everything([*self._terms])
        return _entry("sensitivity", self.names, self._terms, [*self._rates, *slopes])

    @cached_property
    def log_sensitivity(self) -> Entry:
        """The same of ln of the rate."""
        slopes = self._to_everything(self._weights)
        return _entry("log_sensitivity", self.names, self._shares, [*self._log_rates, *slopes])

    @property
    def _rates(self) -> list[sympy.Expr]:
        return [sympy.Add(*self._terms), *self.form.state_rates]

    @property
    def _log_rates(self) -> list[sympy.Expr]:
        return [self._log_rate, *self.form.state_rates]

    def _to_everything(self, weights: Sequence[sympy.Expr]) -> list[sympy.Expr]:
        size = self._size
        return [*self._along(weights, 0, size), *self._along(weights, size, len(self._variables))]

    def _along(self, weights: Sequence[sympy.Expr], start: int, stop: int) -> list[sympy.Expr]:
        """Derivatives to some variables, row by row: those of terms weighted and added, then those of states."""
        rows = [[self._slope(term, k) for k in range(start, stop)] for term in self.form.terms]
        first = [
            sympy.Add(*(w * s for w, s in zip(weights, column, strict=True))) for column in zip(*rows, strict=True)
        ]
        return [*first, *(self._slope(rate, k) for rate in self.form.state_rates for k in range(start, stop))]

    def _slope(self, expression: sympy.Expr, k: int) -> sympy.Expr:
        found = self._slopes.get((expression, k))
        if found is None:
            found = self._slopes[expression, k] = paired_everywhere(sympy.diff(expression, self._variables[k]))
        return found

    @cached_property
    def _slopes(self) -> dict[tuple[sympy.Expr, int], sympy.Expr]:
        return {}


def entries(law: CreepLaw) -> Lowered:
    """Lower a law to its entries; LawError, naming the term, where it holds what no kernel can evaluate."""
    return Lowered(law)


def _log_sum(names: Names, logs: Sequence[sympy.Expr]) -> tuple[sympy.Expr, list[sympy.Expr], Steps]:
    """ln of the sum of exponentials, each term's weight in it, and the steps there; finite when every term is off."""
    if len(logs) == 1:
        return sympy.Max(logs[0], NOTHING, evaluate=False), [sympy.S.One], {}
    ln_terms = dict(zip(names.logs_of_terms, logs, strict=True))
    largest, total = names.word("largest"), names.word("total")
    shares = {share: sympy.exp(ln - largest) for share, ln in zip(names.shares, ln_terms, strict=True)}
    steps = {**ln_terms, largest: sympy.Max(*ln_terms, NOTHING, evaluate=False), **shares, total: sympy.Add(*shares)}
    floor = sympy.Float(FLOOR)
    return largest + LogFloor(total, floor), [share / Floored(total, floor) for share in shares], steps


def _entry(name: str, names: Names, steps: Steps, outputs: Sequence[sympy.Expr]) -> Entry:
    """Name what has a name, what depends on theta alone and what is common; keep the steps that the outputs need."""
    given = [names.renamed(e) for e in (*steps.values(), *outputs)]
    temporaries = names.temporaries()
    constants = {e: next(temporaries) for e in _costly_constants(given, names.constants)}
    given = [e.xreplace(constants) for e in given]
    meanings = names.definitions([*given, *constants]) | {symbol: e for e, symbol in constants.items()}
    common, found = sympy.cse([*meanings.values(), *given], symbols=temporaries, order="none")
    every = dict(common) | dict(zip((*meanings, *steps), found, strict=False))
    results = found[len(found) - len(outputs) :]
    ordered = _ordered(every, results)
    constant = _constant(every, ordered, names.constants)
    return Entry(
        name,
        names.inputs,
        constants=tuple((s, every[s]) for s in ordered if s in constant),
        steps=tuple((s, every[s]) for s in ordered if s not in constant),
        outputs=tuple(results),
    )


def _costly_constants(expressions: Sequence[sympy.Expr], theta: set[sympy.Symbol]) -> list[sympy.Expr]:
    """The largest subexpressions of theta alone that call a function, so that they are taken out of loops."""
    found: dict[sympy.Expr, None] = {}
    for expression in expressions:
        nodes = sympy.preorder_traversal(expression)
        for node in nodes:
            if isinstance(node, sympy.Expr) and node.free_symbols <= theta and node.has(sympy.Function):
                found[node] = None
                nodes.skip()
    return list(found)


def _ordered(steps: Steps, wanted: Sequence[sympy.Expr]) -> list[sympy.Symbol]:
    """The steps that are wanted, each after those it needs."""
    position = {symbol: k for k, symbol in enumerate(steps)}
    ordered: dict[sympy.Symbol, None] = {}

    def visit(expression: sympy.Expr) -> None:
        for symbol in sorted(expression.free_symbols & position.keys() - ordered.keys(), key=position.__getitem__):
            visit(steps[symbol])
            ordered[symbol] = None

    for expression in wanted:
        visit(expression)
    return list(ordered)


def _constant(steps: Steps, ordered: Sequence[sympy.Symbol], known: set[sympy.Symbol]) -> set[sympy.Symbol]:
    """The steps that can be taken before the point is known."""
    constant: set[sympy.Symbol] = set()
    for symbol in ordered:
        if steps[symbol].free_symbols <= known | constant:
            constant.add(symbol)
    return constant
