"""The names in printed kernels: the author's words, made fit to print and unique."""

from __future__ import annotations

import keyword
import re
import unicodedata
from collections.abc import Iterable, Iterator

import sympy

from creepkit.kernels.logform import LogForm, floor_of
from creepkit.kernels.printing import TARGET_FUNCTIONS
from creepkit.kernels.stable_functions import LogFloor
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import POINT_VARIABLES

_RESERVED_NAMES = (
    *keyword.kwlist,
    *TARGET_FUNCTIONS,
    *("rate", "log_rate", "update", "sensitivity", "log_sensitivity", "exponents"),
    *("COEFFICIENTS", "SIGNATURE", "cfunc", "isfinite", "range"),
    *("rows", "row", "x", "theta", "out", "flags"),
)
_TEMPORARY_PATTERN = re.compile(r"[xy]\d+")


class PrintableNames:
    """Printable symbols of one law.

    inputs : the point, the states and theta, in order.
    theta : the last of them. constants : theta, and the parameters of log scale themselves.
    terms, logs_of_terms, shares : one symbol a term, for its rate, the logarithm of it and its share in the largest.
    """

    def __init__(self, law: CreepLaw, form: LogForm) -> None:
        self._used_names: set[str] = set(_RESERVED_NAMES)
        originals = (*POINT_VARIABLES, *law.states, *form.theta)
        self._printed = {s: self.new_symbol(s.name) for s in originals}
        self.inputs = tuple(self._printed.values())
        self.theta = self.inputs[len(POINT_VARIABLES) + len(law.states) :]
        self._parameters_of_logs = {self._printed[ln]: self.new_symbol(symbol.name) for symbol, ln in form.logs.items()}
        self.constants = {*self.theta, *self._parameters_of_logs.values()}
        bases = (*POINT_VARIABLES, *law.states)
        self._logs = {LogFloor(self._printed[s], floor_of(s)): self.new_symbol(f"ln_{self._printed[s].name}") for s in bases}
        self.terms = tuple(self.new_symbol(label) for label in law.terms)
        self.log_terms = tuple(self.new_symbol(f"ln_{label}") for label in law.terms)
        self.scaled_terms = tuple(self.new_symbol(f"share_of_{label}") for label in law.terms)

    def new_symbol(self, text: str) -> sympy.Symbol:
        """A new symbol, named after `text` as far as a name can be."""
        name = re.sub(r"\W+", "_", unicodedata.normalize("NFKC", text)).strip("_") or "unnamed"
        if not name.isidentifier() or _TEMPORARY_PATTERN.fullmatch(name):
            name = f"{name}_" if name.isidentifier() else f"_{name}"
        while name in self._used_names:
            name += "_"
        self._used_names.add(name)
        return sympy.Symbol(name, real=True)

    def printable(self, expression: sympy.Expr) -> sympy.Expr:
        """Write an expression in printable symbols, with ln_stress for ln(stress) and 1/B for exp(-ln_B)."""
        printed = expression.xreplace(self._printed).xreplace(self._logs)
        return printed.replace(self._is_parameter, self._as_parameter)

    def definitions(self, expressions: Iterable[sympy.Expr]) -> dict[sympy.Symbol, sympy.Expr]:
        """What the symbols stand for that `renamed` has put in."""
        meanings = {symbol: e for e, symbol in self._logs.items()}
        meanings |= {symbol: sympy.exp(ln) for ln, symbol in self._parameters_of_logs.items()}
        used = set().union(*(e.free_symbols for e in expressions))
        return {symbol: e for symbol, e in meanings.items() if symbol in used}

    def temporaries(self) -> Iterator[sympy.Symbol]:
        """x0, x1, ..., which no other name looks like."""
        return iter(sympy.numbered_symbols("x", real=True))

    def _is_parameter(self, e: sympy.Expr) -> bool:
        return isinstance(e, sympy.exp) and e.args[0].as_coeff_Mul()[1] in self._parameters_of_logs

    def _as_parameter(self, e: sympy.Expr) -> sympy.Expr:
        number, ln = e.args[0].as_coeff_Mul()
        return self._parameters_of_logs[ln] ** number
