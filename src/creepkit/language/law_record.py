"""LawRecord: named sympy terms and a parameter table, its validation, its fingerprint and its internal values.

The rate of equivalent creep strain is the sum of the terms. Everything else (derivatives, kernels, LaTeX, exports,
reports) is derived from this record by functions. The fingerprint is the identity of the law's mathematics: a hash of
the canonical structure and a hash of values at fixed points, computed with 30 digits; titles, bounds and references do
not enter.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, replace
from functools import partial
from itertools import islice
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Self

import mpmath
import sympy
from sympy.logic.boolalg import Boolean, BooleanAtom

from creepkit.errors import POWER_REMEDY, LawError, nearest, quoted
from creepkit.language.expression_trees import evaluate_multiprecision
from creepkit.language.symbols import (
    POINT_VARIABLES,
    ConditionSymbol,
    Param,
    State,
    SymbolTuple,
    mean_stress,
    principal_stress,
    stress,
)

if TYPE_CHECKING:
    from creepkit.arrays import ArrayLike, Bools, Floats


def validate_law(law: LawRecord) -> None:
    """Raise LawError when the law is not well formed."""
    _check_names_and_titles(law)
    origin = f"law '{law.name}'"
    for symbol in (*law.params, *law.states):
        if isinstance(symbol, SymbolTuple):
            symbol.refuse()
    _check_expressions(law, origin)
    _check_names(law, origin)
    _check_symbols(law, origin)
    _check_constraints(law, origin)
    _check_back_stresses(law, origin)


def symbols_used(law: LawRecord) -> set[sympy.Basic]:
    """Every symbol in the law's terms and in the rates of its internal variables."""
    expressions = [*law.terms.values(), *(state.rate for state in law.states.values())]
    return set().union(*(e.free_symbols for e in expressions))


def checked_examples(name: str, examples: Any) -> tuple[Mapping[str, float], ...]:
    """The examples of a law as a tuple of read-only mappings; LawError for anything else."""
    given = tuple(examples) if isinstance(examples, Sequence) and not isinstance(examples, str) else (examples,)
    for example in given:
        numbers = isinstance(example, Mapping) and all(isinstance(v, (int, float)) for v in example.values())
        if not numbers or "rate" not in example:
            raise LawError(
                f"law '{name}': the example {quoted(repr(example), 60)} is not understood; write a tuple of examples "
                "such as "
                '{"A": 1e-16, "n": 4, "stress": 100, "rate": 1e-8}'
            )
    return tuple(MappingProxyType(dict(example)) for example in given)


def _check_names_and_titles(law: LawRecord) -> None:
    """Names and labels enter generated source, so that nothing in them may end a comment or a string."""
    for name in (law.name, *law.terms):
        if not name.isprintable() or not name.strip() or {'"', "\\"} & set(name):
            raise LawError(f"{name!r} cannot name a law or term: write one line of words without quotes or backslashes")
    for text in (law.title, *law.references):
        if not isinstance(text, str) or not text.isprintable():
            raise LawError(f"law '{law.name}': the title or reference {text!r} must be one line of text")


def _check_names(law: LawRecord, origin: str) -> None:
    reserved = {symbol.name for symbol in POINT_VARIABLES}
    names = [symbol.name for symbol in (*law.params, *law.states, *law.conditions)]
    for name in names:
        if name in reserved:
            raise LawError(f"{origin}: '{name}' is a word of the language and cannot name a parameter or state")
        if names.count(name) > 1:
            raise LawError(f"{origin}: the name '{name}' is used twice; give each symbol of the law its own")
        if not name.isidentifier():
            raise LawError(f"{origin}: '{name}' is not a plain name; use letters, digits and underscores")


def _check_expressions(law: LawRecord, origin: str) -> None:
    rates: dict[str, Any] = {f"term '{label}'": expression for label, expression in law.terms.items()}
    rates |= {f"rate of state '{symbol}'": state.rate for symbol, state in law.states.items()}
    for position, expression in rates.items():
        if isinstance(expression, sympy.Basic) and expression.has(sympy.Xor):
            raise LawError(f"{origin}, {position}: ^ is no power in Python; {POWER_REMEDY}")
        if not isinstance(expression, sympy.Expr) or expression.has(sympy.zoo, sympy.nan, sympy.oo, sympy.I):
            raise LawError(f"{origin}, {position}: the expression {expression} is not finite and real")
        if expression_size(expression) > LARGEST_SIZE:
            raise LawError(
                f"{origin}, {position}: the expression is too large, its nodes times its symbols above {LARGEST_SIZE}; "
                "write it with fewer parts, or fewer of them within each other"
            )


def _check_symbols(law: LawRecord, origin: str) -> None:
    """Declared must equal used, and every symbol must be plain and real."""
    used = symbols_used(law)
    for symbol in sorted({*used, *law.params, *law.states} - {*law.conditions}, key=str):
        if symbol != sympy.Symbol(symbol.name, real=True):
            raise LawError(
                f"{origin}: the symbol '{symbol}' is not a plain real one; make it with parameters(\"{symbol}\"), "
                "or import it from creepkit.language when it is a word of the language"
            )
    declared = {*law.params, *law.states, *law.conditions, *POINT_VARIABLES}
    unknown = sorted(str(s) for s in used - declared)
    if unknown:
        allowed = ", ".join(sorted(str(s) for s in declared))
        raise LawError(
            f"{origin}: unknown symbol {', '.join(unknown)} in a rate; declared are {allowed}; "
            f"add {'it' if len(unknown) == 1 else 'them'} to params= or states=, or make it with conditions()"
        )
    unused = sorted(str(s) for s in set(law.params) - used)
    if unused:
        raise LawError(f"{origin}: parameter {', '.join(unused)} is declared but not used in any term")


def _check_constraints(law: LawRecord, origin: str) -> None:
    declared = {*law.params, *law.states, *law.conditions, *POINT_VARIABLES}
    for relation in law.constraints:
        if not isinstance(relation, Boolean) or isinstance(relation, (sympy.Symbol, BooleanAtom)):
            raise LawError(f"{origin}: the constraint {relation} is not a relation, such as n >= 0, that can fail")
        undeclared = sorted(str(s) for s in relation.free_symbols - declared)
        if undeclared:
            raise LawError(f"{origin}: a constraint mentions unknown symbol {', '.join(undeclared)}")


def _check_back_stresses(law: LawRecord, origin: str) -> None:
    """Only the effective stress, that less the back stresses, has the direction of the flow."""
    if not law.back_stresses:
        return
    written = f"stress - {' - '.join(symbol.name for symbol in law.back_stresses)}"
    effective, own = sympy.Dummy(real=True), {*law.back_stresses}
    rates = {f"term '{label}'": (expression, own) for label, expression in law.terms.items()}
    for symbol, state in law.states.items():
        rates[f"rate of state '{symbol}'"] = state.rate, set() if symbol in own else own
    for position, (expression, excluded) in rates.items():
        left = expression.subs(law.effective_stress, effective).free_symbols
        if stray := left & ({stress, principal_stress, mean_stress} | excluded):
            names = ", ".join(sorted(map(str, stray)))
            raise LawError(
                f"{origin}, {position}: {names} stands beside the effective stress; a law with a back stress takes "
                f"stress as {written} alone"
            )


LARGEST_SIZE = 1450
"""Of a rate: its first derivatives then have some 6000 nodes, and its kernel is made in seconds."""


def expression_size(expression: sympy.Basic) -> int:
    """Nodes of an expression, counted up to the limit, times its symbols: a fifth of the nodes of its derivatives."""
    nodes = sum(1 for _ in islice(sympy.preorder_traversal(expression), LARGEST_SIZE + 1))
    return nodes * max(len(expression.free_symbols), 1)


_FIXED_POINTS = ((83.0, 0.013, 5.1e3, 1041.0, 71.0, 23.0), (141.0, 2.3e-4, 7.7e4, 1123.0, 131.0, 57.0))


def fingerprint_of(law: LawRecord) -> str:
    """Return ``structure-numbers``, 12 + 8 hexadecimal digits; LawError where sympy fails at the expressions."""
    with _failures_said(law):
        return f"{_hash(structure_of(law))[:12]}-{_hash(_signature(law))[:8]}"


def structure_of(law: LawRecord) -> str:
    """The law's mathematics as text, for hashing only (it is never parsed)."""
    with _failures_said(law):
        parts = [f"{label} = {sympy.srepr(expression)}" for label, expression in law.terms.items()]
        parts += [f"{s.name}' = {sympy.srepr(v.rate)} from {v.initial!r} to {v.limit!r}" for s, v in law.states.items()]
        parts += [f"{s.name} is a back stress" for s in law.back_stresses]
        parts += [f"{s.name}: {p.scale}" for s, p in law.params.items()]
        parts += [f"{s.name} in {s.unit}" for s in law.conditions]
        return "\n".join(parts)


@contextmanager
def _failures_said(law: LawRecord) -> Iterator[None]:
    """LawError in the place of what sympy raises of a comparison with what is no number, deep in an expression."""
    try:
        yield
    except LawError:
        raise
    except (ArithmeticError, AttributeError, TypeError, ValueError) as error:
        why = quoted(" ".join(str(error).split()))
        raise LawError(f"law '{law.name}': sympy fails at its expressions ({why}); write them another way") from None


def _signature(law: LawRecord) -> str:
    """Each rate to 10 digits at two fixed points with parameters drawn from a fixed sequence."""
    symbols = [*POINT_VARIABLES, *law.states, *law.params, *law.conditions]
    state_values = [0.11 + 0.07 * (k % 7) for k in range(len(law.states))]
    parameter_values = [1.3 + 0.31 * ((5 * k) % 11) for k in range(len(law.params) + len(law.conditions))]
    expressions = [*law.terms.values(), *(state.rate for state in law.states.values())]
    lines = []
    with mpmath.workdps(30):
        for point in _FIXED_POINTS:
            values = [mpmath.mpf(v) for v in (*point, *state_values, *parameter_values)]
            lines += [_digits_text(expression, dict(zip(symbols, values, strict=True))) for expression in expressions]
    return "\n".join(lines)


def _digits_text(expression: sympy.Expr, values: Mapping[sympy.Symbol, mpmath.mpf]) -> str:
    try:
        return str(mpmath.nstr(evaluate_multiprecision(expression, values), 10))
    except ArithmeticError:
        return "undefined"


def _hash(text: str) -> str:
    import hashlib  # which takes longer to import than a law to be made

    return hashlib.sha256(text.encode()).hexdigest()


@dataclass(frozen=True, eq=False)
class LawRecord:
    """A creep law: rate of equivalent creep strain, in 1/s, as a sum of named terms.

    name : short, lower case, unique in the registry.
    title : one line for people.
    terms : {term name: sympy expression in 1/s}, kept in this order.
    params : {symbol: Param}, in the author's order; every parameter must be used and every symbol declared.
    states : {symbol: State}, internal variables.
    constraints : relations between parameters and point that must hold, such as n(t) >= 0.
    references : where the law was published.
    examples : rates that were computed by hand or are in the publication, {parameter, point or state: value, "rate":
        1/s}, in the units of the law; check_law() compares them with every kernel. Other laws made of this one have
        none.
    falls_with_temperature : declares that a higher temperature lowers the rate, which check_law() else refuses.
    """

    name: str
    terms: Mapping[str, sympy.Expr]
    params: Mapping[sympy.Symbol, Param]
    title: str = ""
    states: Mapping[sympy.Symbol, State] = field(default_factory=dict)
    constraints: Sequence[Boolean] = ()
    references: Sequence[str] | str = ()
    examples: Sequence[Mapping[str, float]] = ()
    falls_with_temperature: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.strip():
            raise LawError(f"a law needs a name in words, found {self.name!r}")
        if not isinstance(self.terms, Mapping) or not self.terms:
            raise LawError(f"law '{self.name}' has no terms: give terms={{'name': expression}}")
        terms = {}
        for label, expression in self.terms.items():
            try:
                terms[str(label)] = sympy.sympify(expression, strict=True)
            except sympy.SympifyError:
                raise LawError(
                    f"law '{self.name}', term '{label}': {expression!r} is not a sympy expression; "
                    "text is never evaluated, write the term with the symbols of creepkit.language"
                ) from None
        states, constraints = dict(self.states), tuple(self.constraints)
        freeze = object.__setattr__
        freeze(self, "terms", MappingProxyType(terms))
        freeze(self, "params", MappingProxyType(dict(self.params)))
        freeze(self, "states", MappingProxyType(states))
        freeze(self, "constraints", constraints)
        references = (self.references,) if isinstance(self.references, str) else tuple(self.references)
        freeze(self, "references", references)
        freeze(self, "examples", checked_examples(self.name, self.examples))
        validate_law(self)

    # ---- what the law is -------------------------------------------------------------------------------------------

    @property
    def rate(self) -> sympy.Expr:
        """The rate of equivalent creep strain, 1/s: the sum of the terms, unevaluated."""
        return sympy.Add(*self.terms.values())

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the parameters, in the author's order."""
        return tuple(symbol.name for symbol in self.params)

    @property
    def table(self) -> dict[str, Param]:
        """{parameter name: Param}, in the author's order."""
        return {symbol.name: param for symbol, param in self.params.items()}

    @property
    def conditions(self) -> tuple[ConditionSymbol, ...]:
        """The conditions that its rates depend on, by name: what every test must state."""
        cached: tuple[ConditionSymbol, ...] | None = self.__dict__.get("_conditions")
        if cached is None:
            found = [symbol for symbol in symbols_used(self) if isinstance(symbol, ConditionSymbol)]
            cached = tuple(sorted(found, key=lambda symbol: str(symbol.name)))
            object.__setattr__(self, "_conditions", cached)
        return cached

    @property
    def back_stresses(self) -> tuple[sympy.Symbol, ...]:
        """Its internal variables that are back stresses."""
        return tuple(symbol for symbol, state in self.states.items() if state.kind == "back stress")

    @property
    def effective_stress(self) -> sympy.Expr:
        """The stress along which it flows: that less its back stresses."""
        return stress - sympy.Add(*self.back_stresses)

    @property
    def fingerprint(self) -> str:
        """Identity of the law's mathematics: structure and a numeric signature, without titles and bounds."""
        cached = self.__dict__.get("_fingerprint")
        if cached is None:
            cached = fingerprint_of(self)
            object.__setattr__(self, "_fingerprint", cached)
        return str(cached)

    def uses(self, symbol: sympy.Symbol) -> bool:
        """Say whether a symbol of the point (stress, strain, time, temperature ...) enters a rate."""
        return symbol in symbols_used(self)

    def symbol(self, name: str) -> sympy.Symbol:
        """Return the symbol of the parameter called `name`, or raise LawError naming the nearest one."""
        for symbol in self.params:
            if symbol.name == name:
                return symbol
        raise LawError(f"law '{self.name}' has no parameter '{name}': {nearest(name, self.names)}")

    def center(self) -> dict[str, float]:
        """The middle of the bounds, each on its own scale: {name: value}."""
        return {name: param.center for name, param in self.table.items()}

    def check_complete(self, given: Mapping[str, Any]) -> None:
        """LawError, with the parameters that lack a value, unless every one has one."""
        missing = [name for name in self.names if name not in given]
        if missing:
            how = f"give all of them, such as {{{missing[0]!r}: 1.5}}, in a command --set {missing[0]}=1.5"
            raise LawError(f"law '{self.name}' needs a value for {', '.join(missing)}; {how}")

    def values(self, given: Mapping[str, float]) -> dict[str, float]:
        """Return `given` completed and in the law's order; every parameter must be there, finite, once."""
        for name in given:
            self.symbol(name)
        self.check_complete(given)
        values = {name: self.number(given[name], f"parameter '{name}'") for name in self.names}
        for name, value in values.items():
            if not abs(value) < float("inf"):
                raise LawError(f"law '{self.name}', parameter '{name}': {value} is not a finite number")
            if not self.table[name].is_physical(value):
                description = f"{value:g} is not physical, which is {self.table[name].physical_range_text}"
                raise LawError(f"law '{self.name}', parameter '{name}': {description}")
            if self.table[name].scale == "log" and value < 0:
                raise LawError(f"law '{self.name}', parameter '{name}': {value:g} is negative; it must be positive")
            if self.table[name].scale == "log" and value == 0 and self.table[name].off != 0:
                raise LawError(f"law '{self.name}', parameter '{name}': 0 is not allowed, it must be positive")
        return values

    @property
    def log_scale(self) -> Bools:
        """Which internal values are logarithms, (parameters,)."""
        import numpy as np

        return np.array([param.scale == "log" for param in self.params.values()], bool)

    def to_internal(self, values: Mapping[str, ArrayLike] | Floats) -> Floats:
        """Return theta, the internal values: the natural logarithm where the scale is log, -inf of a coefficient of 0.

        values : {name: number or (candidates,)}, or (candidates, parameters) in the law's order, in the author's units.
        Returns (candidates, parameters), in the law's order.
        """
        import numpy as np

        if isinstance(values, Mapping):
            self.check_complete(values)
            columns = np.broadcast_arrays(*(np.atleast_1d(np.asarray(values[name], float)) for name in self.names))
            theta = np.stack(columns, axis=-1) if columns else np.zeros((1, 0))
        else:
            theta = np.array(values, dtype=float, ndmin=2)
        with np.errstate(divide="ignore"):
            theta[:, self.log_scale] = np.log(theta[:, self.log_scale])
        return np.ascontiguousarray(theta)

    def from_internal(self, theta: Floats) -> dict[str, Floats]:
        """Return {name: (...)} in the author's units from internal values; theta : (..., parameters)."""
        import numpy as np

        with np.errstate(over="ignore"):
            return {
                name: np.exp(theta[..., k]) if param.scale == "log" else np.array(theta[..., k], float)
                for k, (name, param) in enumerate(self.table.items())
            }

    @property
    def internal_bounds(self) -> Floats:
        """(2, parameters) lower and upper bounds of the internal values."""
        import numpy as np

        ends = [[param.to_internal(bound) for bound in param.bounds] for param in self.params.values()]
        return np.array(ends, float).reshape(-1, 2).T

    def number(self, value: Any, what: str) -> float:
        """Return `value` as a float, or raise LawError saying that `what` is not a number."""
        try:
            return float(value)
        except (TypeError, ValueError, OverflowError):
            raise LawError(f"law '{self.name}', {what}: {value!r} is not a number") from None

    def rename(self, name: str, title: str = "") -> Self:
        """The same law under another name."""
        return replace(self, name=name, title=title or self.title)

    # ---- value semantics -------------------------------------------------------------------------------------------

    def _key(self) -> tuple[Any, ...]:
        table: dict[sympy.Symbol, Any] = {**self.params, **self.states}
        known = tuple((s, *(v for f, v in vars(one).items() if f != "meaning")) for s, one in table.items())
        return self.rate, known, frozenset(self.constraints)

    def __eq__(self, other: object) -> bool:
        """Whether rates, parameters with their bounds, and constraints are the same, whatever they are called."""
        return self._key() == other._key() if isinstance(other, LawRecord) else NotImplemented

    def __hash__(self) -> int:
        return hash((self.rate, self.names))

    def __reduce__(self) -> tuple[Any, ...]:
        state = {f.name: getattr(self, f.name) for f in fields(self)}
        plain: dict[str, Any] = {k: dict(v) if isinstance(v, MappingProxyType) else v for k, v in state.items()}
        plain["examples"] = tuple(dict(example) for example in self.examples)
        return partial(type(self), **plain), ()
