"""What a law must be: plain symbols, declared equal to used, expressions finite and real."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import sympy
from sympy.logic.boolalg import Boolean, BooleanAtom

from creepkit.errors import LawError
from creepkit.language.params import Param, State
from creepkit.language.symbols import POINT_VARIABLES

if TYPE_CHECKING:
    from creepkit.language.law import CreepLaw


def validate_law(law: CreepLaw) -> None:
    """Raise LawError when the law is not well formed."""
    _check_names_and_titles(law)
    origin = f"law '{law.name}'"
    _check_tables(law, origin)
    _check_names(law, origin)
    _check_expressions(law, origin)
    _check_symbols(law, origin)
    _check_constraints(law, origin)


def symbols_used(law: CreepLaw) -> set[sympy.Basic]:
    """Every symbol in the law's terms and in the rates of its internal variables."""
    expressions = [*law.terms.values(), *(state.rate for state in law.states.values())]
    return set().union(*(e.free_symbols for e in expressions))


def _check_names_and_titles(law: CreepLaw) -> None:
    """Names and labels enter generated source, so that nothing in them may end a comment or a string."""
    for name in (law.name, *law.terms):
        if not name.isprintable() or not name.strip() or {'"', "\\"} & set(name):
            raise LawError(f"{name!r} cannot name a law or term: write one line of words without quotes or backslashes")
    for text in (law.title, *law.references):
        if not isinstance(text, str) or not text.isprintable():
            raise LawError(f"law '{law.name}': the title or reference {text!r} must be one line of text")


def _check_tables(law: CreepLaw, origin: str) -> None:
    for symbol, param in law.params.items():
        if not isinstance(symbol, sympy.Symbol):
            raise LawError(f"{origin}: the parameter table must be keyed by symbols, found {symbol!r}")
        if not isinstance(param, Param):
            raise LawError(f"{origin}, parameter '{symbol}': found {type(param).__name__}, write Param(...)")
    for symbol, state in law.states.items():
        if not isinstance(symbol, sympy.Symbol) or not isinstance(state, State):
            raise LawError(f"{origin}: states must be written as {{symbol: State(...)}}, found {symbol!r}: {state!r}")


def _check_names(law: CreepLaw, origin: str) -> None:
    reserved = {symbol.name for symbol in POINT_VARIABLES}
    names = [symbol.name for symbol in (*law.params, *law.states)]
    for name in names:
        if name in reserved:
            raise LawError(f"{origin}: '{name}' is a word of the language and cannot name a parameter or state")
        if names.count(name) > 1:
            raise LawError(f"{origin}: the name '{name}' is used twice; give each parameter and state its own")
        if not name.isidentifier():
            raise LawError(f"{origin}: '{name}' is not a plain name; use letters, digits and underscores")


def _check_expressions(law: CreepLaw, origin: str) -> None:
    rates: dict[str, Any] = {f"term '{label}'": expression for label, expression in law.terms.items()}
    rates |= {f"rate of state '{symbol}'": state.rate for symbol, state in law.states.items()}
    for position, expression in rates.items():
        if not isinstance(expression, sympy.Expr) or expression.has(sympy.zoo, sympy.nan, sympy.oo, sympy.I):
            raise LawError(f"{origin}, {position}: the expression {expression} is not finite and real")


def _check_symbols(law: CreepLaw, origin: str) -> None:
    """Declared must equal used, and every symbol must be plain and real."""
    used = symbols_used(law)
    for symbol in sorted({*used, *law.params, *law.states}, key=str):
        if symbol != sympy.Symbol(symbol.name, real=True):
            raise LawError(
                f"{origin}: the symbol '{symbol}' is not a plain real one; make it with parameters(\"{symbol}\"), "
                "or import it from creepkit.language when it is a word of the language"
            )
    declared = {*law.params, *law.states, *POINT_VARIABLES}
    unknown = sorted(str(s) for s in used - declared)
    if unknown:
        allowed = ", ".join(sorted(str(s) for s in declared))
        raise LawError(f"{origin}: unknown symbol {', '.join(unknown)} in a rate; declared are {allowed}")
    unused = sorted(str(s) for s in set(law.params) - used)
    if unused:
        raise LawError(f"{origin}: parameter {', '.join(unused)} is declared but not used in any term")


def _check_constraints(law: CreepLaw, origin: str) -> None:
    declared = {*law.params, *law.states, *POINT_VARIABLES}
    for relation in law.constraints:
        if not isinstance(relation, Boolean) or isinstance(relation, (sympy.Symbol, BooleanAtom)):
            raise LawError(f"{origin}: the constraint {relation} is not a relation, such as n >= 0, that can fail")
        undeclared = sorted(str(s) for s in relation.free_symbols - declared)
        if undeclared:
            raise LawError(f"{origin}: a constraint mentions unknown symbol {', '.join(undeclared)}")
