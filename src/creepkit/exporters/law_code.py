"""A law as code: assignments and outputs in identifiers of the target language, ready for a printer of that language.

Whatever the target's syntax is, the formulas are those of the compiled kernels: terms in log form, nothing that
overflows, exact derivatives. The parameters keep the author's values. Names that the target cannot keep are renamed,
and the exported text says so.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import sympy

from creepkit.errors import SAID, ExportError, LawError, restated
from creepkit.exporters.law_description import refuse_back_stress
from creepkit.kernels.log_form import leading_exponents
from creepkit.kernels.symbolic_kernel import KernelFunction, SymbolicKernel, symbolic_kernel
from creepkit.language.symbols import POINT_VARIABLES
from creepkit.records import LawWithValues


class Identifiers:
    """Identifiers of a language, each given out once.

    reserved : words of the language and names that the text uses itself. ignore_case : whether A and a are the same
    name (Fortran). max_length : characters allowed.
    """

    def __init__(self, reserved: Collection[str], *, ignore_case: bool = False, max_length: int = 63) -> None:
        self._normalise = str.lower if ignore_case else str
        self._taken = {self._normalise(word) for word in reserved}
        self._max_length = max_length
        self.renamings: dict[str, str] = {}

    def unique(self, requested: str, endings: Sequence[str] = ()) -> str:
        """The identifier for a requested name: itself where the language allows it and it is free.

        endings : what else is derived from it, each of which has to be free as well.
        """
        ascii_name = unicodedata.normalize("NFKD", requested).encode("ascii", "ignore").decode()
        is_identifier = re.fullmatch(r"[A-Za-z]\w*", ascii_name)
        stem = ascii_name if is_identifier else re.sub(r"\W+", "_", ascii_name).strip("_") or "unnamed"
        stem = (stem if stem[0].isalpha() else f"x_{stem}")[: self._max_length]
        candidate, count = stem, 1
        while not self._taken.isdisjoint(names := {self._normalise(f"{candidate}{end}") for end in ("", *endings)}):
            count += 1
            candidate = f"{stem[: self._max_length - 1 - len(str(count))]}_{count}"
        self._taken |= names
        if candidate != requested:
            self.renamings[requested] = candidate
        return candidate

    def unique_names(self, requested: Iterable[str]) -> list[str]:
        """Identifiers for several names, in order."""
        return [self.unique(name) for name in requested]

    def renaming_notes(self, original_names: Collection[str]) -> list[str]:
        """One line for each of the author's names that had to change."""
        return [f"'{old}' is called {new} here" for old, new in self.renamings.items() if old in original_names]


def factor_text(factor: float) -> str:
    """A factor before an expression, such as "3600.0 * "; nothing for one."""
    return "" if factor == 1 else f"{factor!r} * "


def called_names(texts: Iterable[str]) -> dict[str, None]:
    """The names that texts call as functions, in order, each once."""
    return {name: None for text in texts for name in re.findall(r"(\w+)\(", text)}


Assignments = tuple[tuple[sympy.Symbol, sympy.Expr], ...]


_kernel_entries = lru_cache(maxsize=128)(symbolic_kernel)


@dataclass(frozen=True)
class CodeFunction:
    """One function to be printed, in names of the target.

    inputs : the variables of the point and states that it reads. assignments : named subexpressions, each after those
    it needs. outputs : expressions, in the order of creepkit.kernels.interface.
    """

    inputs: tuple[sympy.Symbol, ...]
    assignments: Assignments
    outputs: tuple[sympy.Expr, ...]

    @property
    def symbols(self) -> set[sympy.Basic]:
        """Every symbol that an assignment or an output reads."""
        return set().union(*(e.free_symbols for e in (*(e for _, e in self.assignments), *self.outputs)))

    def with_outputs(self, indices: Sequence[int]) -> CodeFunction:
        """The same for some of its outputs, with the assignments that those need."""
        outputs = tuple(self.outputs[k] for k in indices)
        used = set().union(*(e.free_symbols for e in outputs))
        assignments = []
        for symbol, expression in reversed(self.assignments):
            if symbol in used:
                assignments.append((symbol, expression))
                used |= expression.free_symbols
        return CodeFunction(tuple(s for s in self.inputs if s in used), tuple(reversed(assignments)), outputs)


class LawCode:
    """A law with its values, reduced of what is off, as functions in names of a target's language.

    source : what is exported, reduced. point, states, conditions : symbols of the six variables of the point, of the
        states, and of what tests state besides.
    parameters : {symbol: the author's value}; logarithms : {symbol: the parameter it is the logarithm of}.
    """

    def __init__(
        self,
        source: LawWithValues,
        identifiers: Identifiers,
        target_names: Mapping[str, str] | None = None,
        *,
        keeps_inactive: bool = False,
    ) -> None:
        """target_names : {name of a variable of the point or of a state: its name in the target's code}.

        keeps_inactive : whether what is switched off stays in the code, where other values can switch it on.
        """
        self.source = source if keeps_inactive else source.without_inactive_terms()
        self.law, self.identifiers = self.source.law, identifiers
        refuse_back_stress(self.law)
        with restated(LawError, ExportError, f"cannot be written as a program: {SAID}"):
            self._lowered: SymbolicKernel = _kernel_entries(self.law)
        self._symbols: dict[sympy.Symbol, sympy.Symbol] = {}
        inputs, size = self._lowered.rate.inputs, len(POINT_VARIABLES) + len(self.law.states)
        names = target_names or {}
        requested = [names.get(s.name, s.name) for s in (*POINT_VARIABLES, *self.law.states)]
        symbols = [self._new_symbol(symbol, name) for symbol, name in zip(inputs, requested, strict=False)]
        self.point, self.states = tuple(symbols[: len(POINT_VARIABLES)]), tuple(symbols[len(POINT_VARIABLES) :])
        self.conditions = tuple(self._new_symbol(s, names.get(s.name, s.name)) for s in self.law.conditions)
        self.parameters: dict[sympy.Symbol, float] = {}
        self.logarithms: dict[sympy.Symbol, sympy.Symbol] = {}
        for theta, (name, param) in zip(inputs[size:], self.law.table.items(), strict=True):
            symbol = sympy.Symbol(identifiers.unique(name), real=True)
            self.parameters[symbol] = self.source.values[name]
            if param.scale == "log":
                self.logarithms[self._new_symbol(theta, f"ln_{name}")] = symbol
            else:
                self._symbols[theta] = symbol
        self._parameter_of_exp = {sympy.exp(ln): symbol for ln, symbol in self.logarithms.items()}

    def function(self, entry_name: str) -> CodeFunction:
        """Return an entry of the kernel: rate, terms, log_rate or update."""
        entry: KernelFunction = getattr(self._lowered, entry_name)
        return self._in_target_names((*entry.constants, *entry.steps), entry.outputs)

    def leading_time_exponent(self) -> float:
        """The exponent beta of time in strain ~ t^beta as t -> 0+ from a virgin state; 1 where nothing is singular.

        Taken at 100 MPa and 1000 K where it varies with the point, as integrators do.
        """
        values = {ln: sympy.log(self.parameters[symbol]) for ln, symbol in self.logarithms.items()} | self.parameters
        pairs = [[float(e.subs(values)) for e in exponents] for exponents, _ in self.leading_exponents()]
        return min((1.0 + time) / (1.0 - strain) for time, strain in pairs)

    def leading_exponents(self) -> list[tuple[tuple[sympy.Expr, sympy.Expr], tuple[sympy.Symbol, ...]]]:
        """For each term the exponents of time and of strain at t -> 0+, and its coefficients: zero switches it off.

        The exponents are functions of the parameters and their logarithms, at 100 MPa and 1000 K where they vary with
        the point, as integrators take them.
        """
        form = self._lowered.form
        symbols = [*self.parameters]
        of_logs = {symbol: ln for ln, symbol in self.logarithms.items()}
        renamed: dict[sympy.Basic, sympy.Basic] = {
            theta: of_logs.get(symbol, symbol) for theta, symbol in zip(form.theta, symbols, strict=True)
        }
        point = dict(zip(POINT_VARIABLES, (100.0, 0.0, 0.0, 1000.0, 100.0, 100.0 / 3.0), strict=True))
        virgin = point | {symbol: state.initial for symbol, state in self.law.states.items()}
        renamed |= {s: sympy.Float(value) for s, value in virgin.items()}
        return [
            ((time.xreplace(renamed), strain.xreplace(renamed)), tuple(symbols[k] for k in coefficients))
            for (time, strain), coefficients in zip(leading_exponents(form), form.coefficients, strict=True)
        ]

    def _new_symbol(self, symbol: sympy.Symbol, requested: str) -> sympy.Symbol:
        self._symbols[symbol] = sympy.Symbol(self.identifiers.unique(requested), real=True)
        return self._symbols[symbol]

    def _in_target_names(
        self, assignments: Sequence[tuple[sympy.Symbol, sympy.Expr]], outputs: Sequence[sympy.Expr]
    ) -> CodeFunction:
        for symbol, expression in assignments:
            if symbol not in self._symbols:
                parameter = self._parameter_of_exp.get(expression.xreplace(self._symbols))
                if parameter is None:
                    self._new_symbol(symbol, symbol.name)
                else:
                    self._symbols[symbol] = parameter  # B = exp(ln_B) is the author's B, free of a logarithm's rounding
        definitions = {
            self._symbols[s]: e.xreplace(self._symbols)
            for s, e in assignments
            if self._symbols[s] not in self.parameters
        }
        full = CodeFunction((), tuple(definitions.items()), tuple(e.xreplace(self._symbols) for e in outputs))
        variables = (*self.point, *self.states, *self.conditions)
        return replace(full, inputs=tuple(s for s in variables if s in full.symbols))

    def logarithms_used(self, function: CodeFunction) -> dict[sympy.Symbol, sympy.Symbol]:
        """The logarithms of parameters that a function reads: {ln_A: A}."""
        return {ln: symbol for ln, symbol in self.logarithms.items() if ln in function.symbols}

    def renaming_notes(self) -> list[str]:
        """One line for each name of the author's that the target could not keep."""
        variables = (*POINT_VARIABLES, *self.law.states, *self.law.conditions)
        return self.identifiers.renaming_notes({*self.law.names, *(s.name for s in variables)})
