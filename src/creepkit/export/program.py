"""A law as a program: the kernel's own entries under names of the target, ready for a printer of its language.

Whatever a target's syntax is, the formulas are those of `creepkit.kernels.entries`: terms in log form, nothing that
overflows on the way, exact derivatives. The parameters are written in the author's numbers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import sympy

from creepkit.errors import ExportError, LawError
from creepkit.export.identifiers import Identifiers
from creepkit.kernels.entries import Entry, Lowered, entries
from creepkit.kernels.leading import exponents
from creepkit.language.symbols import POINT
from creepkit.records import ValuedLaw

Steps = tuple[tuple[sympy.Symbol, sympy.Expr], ...]

_entries = lru_cache(maxsize=128)(entries)


@dataclass(frozen=True)
class Function:
    """One function to be printed, in names of the target.

    read : the variables of the point and states that it reads. steps : named subexpressions, each after those it needs.
    outputs : expressions, in the order of creepkit.kernels.interface.
    """

    read: tuple[sympy.Symbol, ...]
    steps: Steps
    outputs: tuple[sympy.Expr, ...]

    def only(self, positions: Sequence[int]) -> Function:
        """The same for some of its outputs, with the steps that those need."""
        outputs = tuple(self.outputs[k] for k in positions)
        seen = set().union(*(e.free_symbols for e in outputs))
        steps = []
        for symbol, expression in reversed(self.steps):
            if symbol in seen:
                steps.append((symbol, expression))
                seen |= expression.free_symbols
        return Function(tuple(s for s in self.read if s in seen), tuple(reversed(steps)), outputs)


class Program:
    """A law with its values, reduced of what is off, as functions in names of a target's language.

    source : what is exported, reduced. point, states : symbols of the six variables of the point and of the states.
    parameters : {symbol: the author's value}; logarithms : {symbol: the parameter it is the logarithm of}.
    """

    def __init__(self, source: ValuedLaw, identifiers: Identifiers, called: Mapping[str, str] | None = None) -> None:
        """called : {name of a variable of the point or of a state: what the target's code calls it}."""
        self.source = source.reduced()
        self.law, self.identifiers = self.source.law, identifiers
        try:
            self._lowered: Lowered = _entries(self.law)
        except LawError as error:
            raise ExportError(f"cannot be written as a program: {error}") from None
        self._names: dict[sympy.Symbol, sympy.Symbol] = {}
        inputs, size = self._lowered.rate.inputs, len(POINT) + len(self.law.states)
        originals = [(called or {}).get(s.name, s.name) for s in (*POINT, *self.law.states)]
        named = [self._named(symbol, wanted) for symbol, wanted in zip(inputs, originals, strict=False)]
        self.point, self.states = tuple(named[: len(POINT)]), tuple(named[len(POINT) :])
        self.parameters: dict[sympy.Symbol, float] = {}
        self.logarithms: dict[sympy.Symbol, sympy.Symbol] = {}
        for theta, (name, param) in zip(inputs[size:], self.law.table.items(), strict=True):
            symbol = sympy.Symbol(identifiers.name(name), real=True)
            self.parameters[symbol] = self.source.values[name]
            if param.scale == "log":
                self.logarithms[self._named(theta, f"ln_{name}")] = symbol
            else:
                self._names[theta] = symbol
        self._plain = {sympy.exp(ln): symbol for ln, symbol in self.logarithms.items()}

    def function(self, name: str) -> Function:
        """Return an entry of the kernel: rate, log_rate or update."""
        entry: Entry = getattr(self._lowered, name)
        return self._renamed((*entry.constants, *entry.steps), entry.outputs)

    def leading(self) -> float:
        """The exponent beta of time in strain ~ t^beta as t -> 0+ from a virgin state; 1 where nothing is singular.

        Taken at 100 MPa and 1000 K where it varies with the point, as integrators do.
        """
        at = dict(zip(POINT, (100.0, 0.0, 0.0, 1000.0, 100.0, 100.0 / 3.0), strict=True))
        at |= {s: state.initial for s, state in self.law.states.items()}
        values = {s: self.source.values[s.name] for s in self.law.params}
        logs = {ln: sympy.log(values[s]) for s, ln in self._lowered.form.logs.items()}
        found = []
        for time, strain in exponents(self._lowered.form):
            a, b = (float(e.subs(logs).subs(values).subs(at)) for e in (time, strain))
            found.append((1.0 + a) / (1.0 - b))
        return min(found)

    def _named(self, symbol: sympy.Symbol, wanted: str) -> sympy.Symbol:
        self._names[symbol] = sympy.Symbol(self.identifiers.name(wanted), real=True)
        return self._names[symbol]

    def _renamed(self, steps: Sequence[tuple[sympy.Symbol, sympy.Expr]], outputs: Sequence[sympy.Expr]) -> Function:
        for symbol, expression in steps:
            if symbol not in self._names:
                known = self._plain.get(expression.xreplace(self._names))
                if known is None:
                    self._named(symbol, symbol.name)
                else:
                    self._names[symbol] = known  # B = exp(ln_B) is the author's B, free of a logarithm's rounding
        meanings = {self._names[s]: e.xreplace(self._names) for s, e in steps if self._names[s] not in self.parameters}
        results = tuple(e.xreplace(self._names) for e in outputs)
        seen = set().union(*(e.free_symbols for e in (*meanings.values(), *results)))
        read = tuple(s for s in (*self.point, *self.states) if s in seen)
        return Function(read, tuple(meanings.items()), results)

    def logarithms_in(self, function: Function) -> dict[sympy.Symbol, sympy.Symbol]:
        """The logarithms of parameters that a function reads: {ln_A: A}."""
        seen = set().union(*(e.free_symbols for e in (*(e for _, e in function.steps), *function.outputs)))
        return {ln: symbol for ln, symbol in self.logarithms.items() if ln in seen}

    def renamed(self) -> list[str]:
        """One line for each name of the author's that the target could not keep."""
        own = {*self.law.names, *(s.name for s in (*POINT, *self.law.states))}
        return self.identifiers.told(own)
