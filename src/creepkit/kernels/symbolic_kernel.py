"""The functions of a kernel as symbols: which numbers rate, update and sensitivity return, under printable names.

Steps carry the author's terms where there are any: `ln_stress`, `B = exp(ln_B)`, `strain_hardening` for the term of
that name; other common subexpressions are called x0, x1 ...
"""

from __future__ import annotations

import keyword
import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import sympy

from creepkit.kernels.extremes import Max
from creepkit.kernels.kernel_functions import TARGET_FUNCTIONS, Floored, LogFloor, assignment_lines, expression_source
from creepkit.kernels.log_form import (
    FLOOR,
    LogForm,
    floor_of,
    in_one_sentence,
    log_form,
    with_all_exponential_differences,
)
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import POINT_VARIABLES

_RESERVED_NAMES = (
    *keyword.kwlist,
    *TARGET_FUNCTIONS,
    *("rate", "log_rate", "update", "sensitivity", "log_sensitivity", "exponents"),
)


_TEMPORARY_PATTERN = re.compile(r"[xy]\d+")


class PrintableNames:
    """Printable symbols of one law.

    Attributes: `inputs` are the point, the states and theta, in order; `theta` the last of them; `constants` theta and
    the parameters of log scale themselves; `terms`, `log_terms` and `scaled_terms` hold one symbol a term, for its
    rate, the logarithm of it, and its fraction of the largest.
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
        self._logs = {
            LogFloor(self._printed[s], floor_of(s)): self.new_symbol(f"ln_{self._printed[s].name}") for s in bases
        }
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


LOG_RATE_OFF = sympy.Float(-1e30)
"""ln of the rate of a law whose terms are all off: finite, in single precision too."""


Assignments = Mapping[sympy.Symbol, sympy.Expr]


@dataclass(frozen=True)
class KernelFunction:
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
    def source(self) -> str:
        """The function as text: it takes its inputs one by one and returns a tuple."""
        arguments = ", ".join(s.name for s in self.inputs)
        lines = [f"def {self.name}({arguments}):", *assignment_lines((*self.constants, *self.steps), "    ")]
        outputs = "".join(f"        {expression_source(output)},\n" for output in self.outputs)
        return "\n".join(lines) + f"\n    return (\n{outputs}    )\n"


class SymbolicKernel:
    """A law as entries, ready for a printer, each made when it is first asked for.

    form is in the author's symbols, entries are in printable ones; the layout of `update` and `sensitivity` is that of
    kernels.interface.
    """

    def __init__(self, law: CreepLaw) -> None:
        self.law, self.form = law, log_form(law)
        self.names = PrintableNames(law, self.form)
        self._terms = {symbol: sympy.exp(ln) for symbol, ln in zip(self.names.terms, self.form.terms, strict=True)}
        self._log_rate, self._weights, self._scaled_terms = _log_sum_exp(self.names, self.form.terms)
        point = (*POINT_VARIABLES, *law.states)
        self._size, self._variables = len(point), (*point, *self.form.theta)
        self._known_derivatives: dict[tuple[sympy.Expr, int], sympy.Expr] = {}

    @cached_property
    def rate(self) -> KernelFunction:
        """Rates: of creep, then of each state."""
        return self._function("rate", self._terms, self._rates)

    @cached_property
    def terms(self) -> KernelFunction:
        """The rate of each term of the law."""
        return self._function("terms", self._terms, [*self._terms])

    @cached_property
    def log_rate(self) -> KernelFunction:
        """ln of the rate of creep, then rates of states."""
        return self._function("log_rate", self._scaled_terms, self._log_rates)

    @cached_property
    def update(self) -> KernelFunction:
        """The same, then derivatives to the point and the states."""
        outputs = [*self._log_rates, *self._derivatives(self._weights, 0, self._size)]
        return self._function("update", self._scaled_terms, outputs)

    @cached_property
    def sensitivity(self) -> KernelFunction:
        """Rates, their derivatives to the point and the states, then to theta."""
        derivatives = self._all_derivatives([*self._terms])
        return self._function("sensitivity", self._terms, [*self._rates, *derivatives])

    @cached_property
    def log_sensitivity(self) -> KernelFunction:
        """The same of ln of the rate."""
        derivatives = self._all_derivatives(self._weights)
        return self._function("log_sensitivity", self._scaled_terms, [*self._log_rates, *derivatives])

    def _function(self, name: str, steps: Assignments, outputs: Sequence[sympy.Expr]) -> KernelFunction:
        with in_one_sentence(self.law):
            return _kernel_function(name, self.names, steps, outputs)

    @property
    def _rates(self) -> list[sympy.Expr]:
        return [sympy.Add(*self._terms), *self.form.state_rates]

    @property
    def _log_rates(self) -> list[sympy.Expr]:
        return [self._log_rate, *self.form.state_rates]

    def _all_derivatives(self, weights: Sequence[sympy.Expr]) -> list[sympy.Expr]:
        size = self._size
        return [*self._derivatives(weights, 0, size), *self._derivatives(weights, size, len(self._variables))]

    def _derivatives(self, weights: Sequence[sympy.Expr], start: int, stop: int) -> list[sympy.Expr]:
        """Derivatives to some variables, row by row: those of terms weighted and added, then those of states."""
        rows = [[self._derivative(term, k) for k in range(start, stop)] for term in self.form.terms]
        rate_derivatives = [
            sympy.Add(*(w * s for w, s in zip(weights, column, strict=True))) for column in zip(*rows, strict=True)
        ]
        return [
            *rate_derivatives,
            *(self._derivative(rate, k) for rate in self.form.state_rates for k in range(start, stop)),
        ]

    def _derivative(self, expression: sympy.Expr, k: int) -> sympy.Expr:
        if (expression, k) not in self._known_derivatives:
            with in_one_sentence(self.law):
                derivative = with_all_exponential_differences(sympy.diff(expression, self._variables[k]))
            self._known_derivatives[expression, k] = derivative
        return self._known_derivatives[expression, k]


def symbolic_kernel(law: CreepLaw) -> SymbolicKernel:
    """Lower a law to its entries; LawError, naming the term, where it holds what no kernel can evaluate."""
    with in_one_sentence(law):
        return SymbolicKernel(law)


def _log_sum_exp(
    names: PrintableNames, log_terms: Sequence[sympy.Expr]
) -> tuple[sympy.Expr, list[sympy.Expr], Assignments]:
    """ln of the sum of exponentials, each term's weight in it, and the steps there; finite when every term is off."""
    if len(log_terms) == 1:
        return Max(log_terms[0], LOG_RATE_OFF), [sympy.S.One], {}
    ln_terms = dict(zip(names.log_terms, log_terms, strict=True))
    largest, total = names.new_symbol("largest"), names.new_symbol("total")
    scaled_terms = {scaled: sympy.exp(ln - largest) for scaled, ln in zip(names.scaled_terms, ln_terms, strict=True)}
    steps = {**ln_terms, largest: Max(*ln_terms, LOG_RATE_OFF), **scaled_terms, total: sympy.Add(*scaled_terms)}
    floor = sympy.Float(FLOOR)
    return largest + LogFloor(total, floor), [share / Floored(total, floor) for share in scaled_terms], steps


def _kernel_function(
    name: str, names: PrintableNames, steps: Assignments, outputs: Sequence[sympy.Expr]
) -> KernelFunction:
    """Name what has a name, what depends on theta alone and what is common; keep the steps that the outputs need."""
    expressions = [names.printable(e) for e in (*steps.values(), *outputs)]
    temporaries = names.temporaries()
    constants = {e: next(temporaries) for e in _parameter_only_calls(expressions, names.constants)}
    expressions = [e.xreplace(constants) for e in expressions]
    definitions = names.definitions([*expressions, *constants]) | {symbol: e for e, symbol in constants.items()}
    common, result = sympy.cse([*definitions.values(), *expressions], symbols=temporaries, order="none")
    assignments = dict(common) | dict(zip((*definitions, *steps), result, strict=False))
    results = result[len(result) - len(outputs) :]
    ordered = _ordered_assignments(assignments, results)
    constant = _parameter_only(assignments, ordered, names.constants)
    return KernelFunction(
        name,
        names.inputs,
        constants=tuple((s, assignments[s]) for s in ordered if s in constant),
        steps=tuple((s, assignments[s]) for s in ordered if s not in constant),
        outputs=tuple(results),
    )


def _parameter_only_calls(expressions: Sequence[sympy.Expr], theta: set[sympy.Symbol]) -> list[sympy.Expr]:
    """The largest subexpressions of theta alone that call a function, so that they are taken out of loops."""
    results: dict[sympy.Expr, None] = {}
    for expression in expressions:
        nodes = sympy.preorder_traversal(expression)
        for node in nodes:
            if isinstance(node, sympy.Expr) and node.free_symbols <= theta and node.has(sympy.Function):
                results[node] = None
                nodes.skip()
    return list(results)


def _ordered_assignments(steps: Assignments, outputs: Sequence[sympy.Expr]) -> list[sympy.Symbol]:
    """The steps that are wanted, each after those it needs."""
    position = {symbol: k for k, symbol in enumerate(steps)}
    ordered: dict[sympy.Symbol, None] = {}

    def visit(expression: sympy.Expr) -> None:
        for symbol in sorted(expression.free_symbols & position.keys() - ordered.keys(), key=position.__getitem__):
            visit(steps[symbol])
            ordered[symbol] = None

    for expression in outputs:
        visit(expression)
    return list(ordered)


def _parameter_only(
    steps: Assignments, ordered: Sequence[sympy.Symbol], parameters: set[sympy.Symbol]
) -> set[sympy.Symbol]:
    """The steps that can be taken before the point is known."""
    constant: set[sympy.Symbol] = set()
    for symbol in ordered:
        if steps[symbol].free_symbols <= parameters | constant:
            constant.add(symbol)
    return constant
