"""Expressions as JSON trees and back, and their values in multiple precision; nothing is evaluated from text.

A tree is a symbol ("stress"), an integer (2) or a list whose first entry is a head: ["mul", "A", ["pow", "stress",
"n"]]. Other numbers are ["rational", 1, 3] and ["float", 0.1], in double precision. Rebuilt expressions equal the
original exactly, since sympy does not rearrange them.
Evaluation works at mpmath's current precision; a number whose exponent would be astronomical raises OverflowError.
"""

from __future__ import annotations

import reprlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import mpmath
import sympy
from sympy.core.function import Application
from sympy.logic.boolalg import Boolean

from creepkit.errors import LawError, nearest
from creepkit.language.symbols import ConditionSymbol

_BINARY_EXPONENT_LIMIT = 2.0**30
"""Largest |log2| of a number that is computed."""


def evaluate_multiprecision(expression: sympy.Basic, values: Mapping[sympy.Symbol, Any]) -> Any:
    """Return the value of `expression` (an mpf, an mpc, or a bool for a condition) with the symbols of `at` as given.

    ArithmeticError when it has no finite value there or none that can be computed; LawError for a function unknown.
    """
    if isinstance(expression, sympy.Symbol):
        return values[expression]
    if isinstance(expression, sympy.Rational):
        return mpmath.mpf(expression.p) / mpmath.mpf(expression.q)
    if isinstance(expression, sympy.Float):
        return mpmath.mpf(expression)
    if isinstance(expression, sympy.Piecewise):
        return _evaluate_piecewise(expression, values)
    function = _FUNCTIONS.get(expression.func) or _mpmath_function(expression.func)
    try:
        return function(*(evaluate_multiprecision(argument, values) for argument in expression.args))
    except (ValueError, TypeError) as error:  # the logarithm of zero, the order of complex numbers
        raise ArithmeticError(f"{expression} has no value: {error}") from None


def _evaluate_piecewise(expression: sympy.Piecewise, values: Mapping[sympy.Symbol, Any]) -> Any:
    for branch, condition in expression.args:
        if evaluate_multiprecision(condition, values):
            return evaluate_multiprecision(branch, values)
    raise ArithmeticError(f"no branch of {expression} holds")


def _power(base: Any, exponent: Any) -> Any:
    if base != 0 and abs(exponent) * (abs(mpmath.mag(base)) + 1) > _BINARY_EXPONENT_LIMIT:
        raise OverflowError("a power is too large or too small to be computed")
    return base**exponent


def _overflow_guarded(function: Callable[[Any], Any]) -> Callable[[Any], Any]:
    def guarded(x: Any) -> Any:
        if abs(x) > _BINARY_EXPONENT_LIMIT:
            raise OverflowError(f"{function.__name__} of {mpmath.nstr(x, 6)} is too large or too small to be computed")
        return function(x)

    return guarded


def _mpmath_function(head: Any) -> Callable[..., Any]:
    function = getattr(mpmath, head.__name__, None)
    if not callable(function):
        raise LawError(f"the function '{head.__name__}' has no numeric form; build the law from other functions")
    return function  # type: ignore[no-any-return]


_FUNCTIONS: dict[Any, Callable[..., Any]] = {
    sympy.Add: lambda *terms: mpmath.fsum(terms),
    sympy.Mul: lambda *factors: mpmath.fprod(factors),
    sympy.Pow: _power,
    sympy.exp: _overflow_guarded(mpmath.exp),
    sympy.sinh: _overflow_guarded(mpmath.sinh),
    sympy.cosh: _overflow_guarded(mpmath.cosh),
    sympy.coth: _overflow_guarded(mpmath.coth),
    sympy.sin: _overflow_guarded(mpmath.sin),
    sympy.cos: _overflow_guarded(mpmath.cos),
    sympy.Abs: abs,
    sympy.Max: max,
    sympy.Min: min,
    sympy.Heaviside: lambda x, half: mpmath.mpf(x > 0) if x != 0 else half,
    type(sympy.pi): lambda: +mpmath.pi,
    type(sympy.E): lambda: +mpmath.e,
    sympy.GreaterThan: lambda a, b: a >= b,
    sympy.StrictGreaterThan: lambda a, b: a > b,
    sympy.LessThan: lambda a, b: a <= b,
    sympy.StrictLessThan: lambda a, b: a < b,
    sympy.And: lambda *conditions: all(conditions),
    sympy.Or: lambda *conditions: any(conditions),
    type(sympy.true): lambda: True,
    type(sympy.false): lambda: False,
}


DEPTH_LIMIT, SIZE_LIMIT = 60, 5000
"""Levels and nodes of the largest expression that is written or read."""


EXPONENT_LIMIT = 1000
"""Largest numeric exponent."""


_INTEGER_DIGIT_LIMIT = 300


_ANY_NUMBER = SIZE_LIMIT


@dataclass(frozen=True)
class _NodeType:
    """What a head builds: a sympy type, how many arguments it takes, of which kind, and what kind it is."""

    type: Any
    fewest_arguments: int = 1
    most_arguments: int = 1
    argument_kind: type = sympy.Expr
    result_kind: type = sympy.Expr


_NODE_TYPES = {
    "add": _NodeType(sympy.Add, 2, _ANY_NUMBER),
    "mul": _NodeType(sympy.Mul, 2, _ANY_NUMBER),
    "pow": _NodeType(sympy.Pow, 2, 2),
    **{f.__name__: _NodeType(f) for f in (sympy.exp, sympy.log, sympy.sinh, sympy.cosh, sympy.tanh, sympy.coth)},
    **{f.__name__: _NodeType(f) for f in (sympy.asinh, sympy.sin, sympy.cos, sympy.atan, sympy.erf, sympy.sign)},
    "abs": _NodeType(sympy.Abs),
    "max": _NodeType(sympy.Max, 2, _ANY_NUMBER),
    "min": _NodeType(sympy.Min, 2, _ANY_NUMBER),
    "heaviside": _NodeType(sympy.Heaviside, 2, 2),
    "ge": _NodeType(sympy.GreaterThan, 2, 2, result_kind=Boolean),
    "gt": _NodeType(sympy.StrictGreaterThan, 2, 2, result_kind=Boolean),
    "le": _NodeType(sympy.LessThan, 2, 2, result_kind=Boolean),
    "lt": _NodeType(sympy.StrictLessThan, 2, 2, result_kind=Boolean),
    "and": _NodeType(sympy.And, 2, _ANY_NUMBER, Boolean, Boolean),
    "or": _NodeType(sympy.Or, 2, _ANY_NUMBER, Boolean, Boolean),
}


_HEAD_OF_TYPE = {head.type: name for name, head in _NODE_TYPES.items()}


KNOWN_NODES = (
    *_HEAD_OF_TYPE,
    *(sympy.Piecewise, sympy.functions.elementary.piecewise.ExprCondPair, type(sympy.true), type(sympy.false)),
)
"""What expressions and conditions of laws are made of, beside symbols and numbers."""


KNOWN_FUNCTIONS = tuple(t for t in KNOWN_NODES if issubclass(t, Application) and not issubclass(t, Boolean))
"""The functions that a law may call."""


_CONSTANTS = {"pi": sympy.pi, "e": sympy.E, "true": sympy.true, "false": sympy.false}


_KNOWN_HEADS = (*_NODE_TYPES, *_CONSTANTS, "rational", "float", "piecewise")


# ---- writing -------------------------------------------------------------------------------------------------------


def expression_to_tree(expression: sympy.Basic) -> Any:
    """Return the tree of an expression or condition; LawError when it holds what the language does not know."""
    return _Writer().tree(expression, 0)


class _Writer:
    def __init__(self) -> None:
        self.size = 0

    def tree(self, expression: sympy.Basic, depth: int) -> Any:
        self.size += 1
        _check_size(self.size, depth)
        if isinstance(expression, sympy.Symbol):
            return _name_of(expression)
        if isinstance(expression, sympy.Float):
            return _float_tree(expression)
        if isinstance(expression, sympy.Integer):
            return _checked_integer(int(expression))
        if isinstance(expression, sympy.Rational):
            return ["rational", _checked_integer(int(expression.p)), _checked_integer(int(expression.q))]
        for head, constant in _CONSTANTS.items():
            if expression is constant:
                return [head]
        if isinstance(expression, sympy.Piecewise):
            pairs = [[self.tree(part, depth + 1) for part in pair.args] for pair in expression.args]
            return ["piecewise", *pairs]
        name = _HEAD_OF_TYPE.get(expression.func)
        if name is None:
            raise LawError(f"'{expression}' cannot be written to a file; known are the heads {', '.join(_KNOWN_HEADS)}")
        return [name, *(self.tree(argument, depth + 1) for argument in expression.args)]


def _name_of(symbol: sympy.Symbol) -> str:
    if not isinstance(symbol, ConditionSymbol) and symbol != sympy.Symbol(symbol.name, real=True):
        raise LawError(f"the symbol '{symbol}' carries assumptions; make symbols with parameters(\"{symbol}\")")
    return str(symbol.name)


def _float_tree(number: sympy.Float) -> list[Any]:
    if sympy.Float(float(number))._mpf_ != number._mpf_ or number._prec != 53:
        raise LawError(f"the number {number} is not of double precision, as files hold it; write a float of Python")
    return ["float", float(number)]


# ---- reading -------------------------------------------------------------------------------------------------------


def expression_from_tree(tree: Any, symbols: Mapping[str, sympy.Symbol]) -> sympy.Expr:
    """Return the expression of a tree whose names are all in `symbols`; LawError for anything else."""
    return _Reader(symbols).read(tree, sympy.Expr)


def condition_from_tree(tree: Any, symbols: Mapping[str, sympy.Symbol]) -> Boolean:
    """Return the relation of a tree, such as ["ge", "n", 0]; LawError for anything else."""
    return _Reader(symbols).read(tree, Boolean)


class _Reader:
    def __init__(self, symbols: Mapping[str, sympy.Symbol]) -> None:
        self.symbols = symbols
        self.size = 0

    def read(self, tree: Any, kind: type) -> Any:
        return self.node(tree, kind, 0)

    def node(self, tree: Any, kind: type, depth: int) -> Any:
        self.size += 1
        _check_size(self.size, depth)
        result = self.atom(tree) if not isinstance(tree, list) else self.branch(tree, depth)
        if not isinstance(result, kind) or (kind is Boolean and isinstance(result, sympy.Symbol)):
            wanted = "a number" if kind is sympy.Expr else "a condition"
            raise LawError(f"the expression holds {_short_text(tree)} where {wanted} is needed")
        return result

    def atom(self, tree: Any) -> sympy.Basic:
        if type(tree) is int:
            return sympy.Integer(_checked_integer(tree))
        if not isinstance(tree, str):
            raise LawError(
                f"the expression holds {_short_text(tree)}; allowed are names, integers and lists with a head"
            )
        if tree not in self.symbols:
            raise LawError(f"the expression mentions {_short_text(tree)}, not declared: {nearest(tree, self.symbols)}")
        return self.symbols[tree]

    def branch(self, tree: list[Any], depth: int) -> sympy.Basic:
        if not tree or not isinstance(tree[0], str) or tree[0] not in _KNOWN_HEADS:
            raise LawError(
                f"the expression holds {_short_text(tree)}, which has no known head: {', '.join(_KNOWN_HEADS)}"
            )
        name, *arguments = tree
        if name in _CONSTANTS and not arguments:
            return _CONSTANTS[name]
        if name == "float":
            return _float_from(arguments)
        if name == "rational":
            return _rational_from(arguments)
        if name == "piecewise":
            return sympy.Piecewise(*(self.pair(a, depth + 1) for a in arguments), evaluate=False)
        head = _NODE_TYPES.get(name)
        if head is None or not head.fewest_arguments <= len(arguments) <= head.most_arguments:
            raise LawError(
                f"the expression holds {_short_text(tree)}: '{name}' does not take {len(arguments)} argument(s)"
            )
        parts = [self.node(argument, head.argument_kind, depth + 1) for argument in arguments]
        built = head.type(*parts, evaluate=False)
        _check_numbers(built, tree)
        return built

    def pair(self, tree: Any, depth: int) -> tuple[sympy.Expr, Boolean]:
        if not isinstance(tree, list) or len(tree) != 2:
            raise LawError(f"a branch of 'piecewise' is {_short_text(tree)}; write [expression, condition]")
        value, condition = self.node(tree[0], sympy.Expr, depth), self.node(tree[1], Boolean, depth)
        if condition.has(sympy.Piecewise):
            raise LawError(f"the condition {_short_text(tree[1])} of 'piecewise' holds another 'piecewise'")
        return value, condition


def _float_from(arguments: list[Any]) -> sympy.Float:
    match arguments:
        case [float() | int() as number] if type(number) is not bool and abs(number) < 1.8e308:
            return sympy.Float(float(number))
    raise LawError(f'{_short_text(["float", *arguments])} is not a finite number in the form ["float", 0.1]')


def _rational_from(arguments: list[Any]) -> sympy.Rational:
    if [type(a) for a in arguments] != [int, int] or arguments[1] < 1:
        raise LawError(f'{_short_text(["rational", *arguments])} is not a fraction in the form ["rational", 1, 3]')
    return sympy.Rational(*map(_checked_integer, arguments))


# ---- limits --------------------------------------------------------------------------------------------------------


def _check_numbers(built: sympy.Basic, tree: list[Any]) -> None:
    """Refuse numbers that sympy could not evaluate later, such as 9**9**9**9 and x**(10**99)."""
    if isinstance(built, sympy.Pow) and not built.exp.free_symbols and not magnitude(built.exp) <= EXPONENT_LIMIT:
        raise LawError(f"{_short_text(tree)} has an exponent outside -{EXPONENT_LIMIT} to {EXPONENT_LIMIT}")
    if isinstance(built, sympy.Expr) and not built.free_symbols:
        size = magnitude(built)
        if not (size == 0 or 1e-308 < size < 1e308):
            raise LawError(f"{_short_text(tree)} is not a real number between 1e-308 and 1e308 in size")


def magnitude(number: sympy.Basic) -> Any:
    """Absolute value of an expression without symbols; infinite when it is not real or cannot be computed."""
    try:
        with mpmath.workdps(20):
            value = evaluate_multiprecision(number, {})
    except ArithmeticError:
        return mpmath.inf
    return mpmath.inf if isinstance(value, mpmath.mpc) else abs(value)


def _check_size(size: int, depth: int) -> None:
    if depth > DEPTH_LIMIT or size > SIZE_LIMIT:
        raise LawError(f"an expression is too large: at most {DEPTH_LIMIT} levels and {SIZE_LIMIT} nodes are allowed")


def _checked_integer(number: int) -> int:
    if abs(number) >= 10**_INTEGER_DIGIT_LIMIT:
        raise LawError(f"an expression holds an integer of more than {_INTEGER_DIGIT_LIMIT} digits")
    return number


class _ShortRepr(reprlib.Repr):
    """A short view of any JSON, however deep or long."""

    def __init__(self) -> None:
        super().__init__()
        self.maxlevel, self.maxlist, self.maxdict, self.maxstring, self.maxother = 2, 4, 2, 30, 30

    def repr_int(self, x: int, level: int) -> str:
        return str(x) if abs(x) < 10**20 else "a very long integer"


_short_text = _ShortRepr().repr
