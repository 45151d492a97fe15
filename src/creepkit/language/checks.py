"""What a law must be: plain symbols, declared equal to used, expressions finite and real."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import sympy
from sympy.logic.boolalg import Boolean, BooleanAtom

from creepkit.errors import LawError
from creepkit.language.params import Param, State
from creepkit.language.symbols import POINT

if TYPE_CHECKING:
    from creepkit.language.law import CreepLaw


def check(law: CreepLaw) -> None:
    """Raise LawError when the law is not well formed."""
    _check_words(law)
    where = f"law '{law.name}'"
    _check_tables(law, where)
    _check_names(law, where)
    _check_expressions(law, where)
    _check_symbols(law, where)
    _check_constraints(law, where)


def symbols_used(law: CreepLaw) -> set[sympy.Basic]:
    """Every symbol in the law's terms and in the rates of its internal variables."""
    expressions = [*law.terms.values(), *(state.rate for state in law.states.values())]
    return set().union(*(e.free_symbols for e in expressions))


def _check_words(law: CreepLaw) -> None:
    """Names and labels enter generated source, so that nothing in them may end a comment or a string."""
    for word in (law.name, *law.terms):
        if not word.isprintable() or not word.strip() or {'"', "\\"} & set(word):
            raise LawError(f"{word!r} cannot name a law or term: write one line of words without quotes or backslashes")
    for text in (law.title, *law.references):
        if not isinstance(text, str) or not text.isprintable():
            raise LawError(f"law '{law.name}': the title or reference {text!r} must be one line of text")


def _check_tables(law: CreepLaw, where: str) -> None:
    for symbol, param in law.params.items():
        if not isinstance(symbol, sympy.Symbol):
            raise LawError(f"{where}: the parameter table must be keyed by symbols, found {symbol!r}")
        if not isinstance(param, Param):
            raise LawError(f"{where}, parameter '{symbol}': found {type(param).__name__}, write Param(...)")
    for symbol, state in law.states.items():
        if not isinstance(symbol, sympy.Symbol) or not isinstance(state, State):
            raise LawError(f"{where}: states must be written as {{symbol: State(...)}}, found {symbol!r}: {state!r}")


def _check_names(law: CreepLaw, where: str) -> None:
    reserved = {symbol.name for symbol in POINT}
    names = [symbol.name for symbol in (*law.params, *law.states)]
    for name in names:
        if name in reserved:
            raise LawError(f"{where}: '{name}' is a word of the language and cannot name a parameter or state")
        if names.count(name) > 1:
            raise LawError(f"{where}: the name '{name}' is used twice; give each parameter and state its own")
        if not name.isidentifier():
            raise LawError(f"{where}: '{name}' is not a plain name; use letters, digits and underscores")


def _check_expressions(law: CreepLaw, where: str) -> None:
    rates: dict[str, Any] = {f"term '{label}'": expression for label, expression in law.terms.items()}
    rates |= {f"rate of state '{symbol}'": state.rate for symbol, state in law.states.items()}
    for place, expression in rates.items():
        if not isinstance(expression, sympy.Expr) or expression.has(sympy.zoo, sympy.nan, sympy.oo, sympy.I):
            raise LawError(f"{where}, {place}: the expression {expression} is not finite and real")


def _check_symbols(law: CreepLaw, where: str) -> None:
    """Declared must equal used, and every symbol must be plain and real."""
    used = symbols_used(law)
    for symbol in sorted({*used, *law.params, *law.states}, key=str):
        if symbol != sympy.Symbol(symbol.name, real=True):
            raise LawError(
                f"{where}: the symbol '{symbol}' is not a plain real one; make it with parameters(\"{symbol}\"), "
                "or import it from creepkit.language when it is a word of the language"
            )
    declared = {*law.params, *law.states, *POINT}
    unknown = sorted(str(s) for s in used - declared)
    if unknown:
        allowed = ", ".join(sorted(str(s) for s in declared))
        raise LawError(f"{where}: unknown symbol {', '.join(unknown)} in a rate; declared are {allowed}")
    unused = sorted(str(s) for s in set(law.params) - used)
    if unused:
        raise LawError(f"{where}: parameter {', '.join(unused)} is declared but not used in any term")


def _check_constraints(law: CreepLaw, where: str) -> None:
    declared = {*law.params, *law.states, *POINT}
    for relation in law.constraints:
        if not isinstance(relation, Boolean) or isinstance(relation, (sympy.Symbol, BooleanAtom)):
            raise LawError(f"{where}: the constraint {relation} is not a relation, such as n >= 0, that can fail")
        stray = sorted(str(s) for s in relation.free_symbols - declared)
        if stray:
            raise LawError(f"{where}: a constraint mentions unknown symbol {', '.join(stray)}")
