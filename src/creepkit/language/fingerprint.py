"""Fingerprint: the identity of a law's mathematics.

Two parts: a hash of the canonical structure (term names, parameter names, expressions) and a hash of numeric
values of each rate at fixed points, computed with 30 digits. Titles, bounds and references do not enter.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import TYPE_CHECKING

import mpmath
import sympy

from creepkit.language.precise import evaluate_multiprecision
from creepkit.language.symbols import POINT_VARIABLES

if TYPE_CHECKING:
    from creepkit.language.law import CreepLaw

_FIXED_POINTS = ((83.0, 0.013, 5.1e3, 1041.0, 71.0, 23.0), (141.0, 2.3e-4, 7.7e4, 1123.0, 131.0, 57.0))


def fingerprint_of(law: CreepLaw) -> str:
    """Return ``structure-numbers``, 12 + 8 hexadecimal digits."""
    return f"{_hash(structure_of(law))[:12]}-{_hash(_signature(law))[:8]}"


def structure_of(law: CreepLaw) -> str:
    """The law's mathematics as text, for hashing only (it is never parsed)."""
    parts = [f"{label} = {sympy.srepr(expression)}" for label, expression in law.terms.items()]
    parts += [f"{s.name}' = {sympy.srepr(v.rate)} from {v.initial!r} to {v.limit!r}" for s, v in law.states.items()]
    parts += [f"{s.name}: {p.scale}" for s, p in law.params.items()]
    return "\n".join(parts)


def _signature(law: CreepLaw) -> str:
    """Each rate to 10 digits at two fixed points with parameters drawn from a fixed sequence."""
    symbols = [*POINT_VARIABLES, *law.states, *law.params]
    state_values = [0.11 + 0.07 * (k % 7) for k in range(len(law.states))]
    parameter_values = [1.3 + 0.31 * ((5 * k) % 11) for k in range(len(law.params))]
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
    return hashlib.sha256(text.encode()).hexdigest()
