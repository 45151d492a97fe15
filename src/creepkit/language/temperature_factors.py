"""Factors of temperature on the rates of a law: those of its terms, and those of its internal variables.

A part of a state equation that is proportional to the rate coefficient of a term is a multiple of the creep rate and
takes that term's factor. Every other part has a rate of its own, and a factor of its own: the activation energy of
the rate coefficient B is Q_B, as of B's form activated(). A part that nothing multiplies takes the state's name.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import TypeVar

import sympy

from creepkit.errors import LawError, nearest
from creepkit.language.law_record import LawRecord
from creepkit.language.symbols import POINT_VARIABLES, Param, State, temperature
from creepkit.language.temperature_forms import TemperatureFactor

Law = TypeVar("Law", bound=LawRecord)


_PER_SECOND = re.compile(r"(1/s|/s|\bs\)|s\^-1|s\*\*-1)$")
"""Ends of units per second: "1/s", "MPa/s", "1/(MPa s)"."""


def times(
    law: Law,
    factor: TemperatureFactor,
    terms: Iterable[str] | None = None,
    states: Iterable[str] | None = None,
    *,
    shared: bool = False,
) -> Law:
    """Multiply the rates of terms and of internal variables by a factor of temperature; see CreepLaw.times."""
    if not isinstance(factor, TemperatureFactor):
        raise LawError(f"law '{law.name}': times() takes a factor such as arrhenius(T_ref=1073), found {factor!r}")
    chosen_terms = _chosen(law, "term", terms, tuple(law.terms))
    chosen_states = _chosen(law, "state", states, tuple(s.name for s in law.states))
    parameters = _FactorParameters(law, factor)
    expression = parameters.expression_of(None)
    inherited: dict[sympy.Symbol, sympy.Expr] = {}
    for label, term in law.terms.items():
        for coefficient in rate_coefficients(law, term):
            if label in chosen_terms:
                inherited[coefficient] = expression
            else:
                inherited.setdefault(coefficient, sympy.S.One)
    new_states = {}
    for symbol, state in law.states.items():
        parts = _StateParts(law, symbol, state, inherited)
        if symbol.name in chosen_states:
            if states is not None and not parts.own:
                raise LawError(
                    f"law '{law.name}': state '{symbol}' is a multiple of the creep rate and takes the factor of its "
                    "term; leave it out of states="
                )
            parts.multiply_own(expression if shared else None, parameters, named=states is not None)
        new_states[symbol] = replace(state, rate=sympy.Add(*parts.inheriting, *parts.own))
    new_terms = {label: term * expression if label in chosen_terms else term for label, term in law.terms.items()}
    used = {s for rate in (*new_terms.values(), *(z.rate for z in new_states.values())) for s in rate.free_symbols}
    if not (chosen_terms or chosen_states):
        raise LawError(f"law '{law.name}': times() was told to multiply no term and no state")
    restricted = [*chosen_terms, *chosen_states] if terms is not None or states is not None else []
    description = f"({', '.join([*restricted, *(['shared'] if shared else [])])})" if restricted or shared else ""
    return replace(
        law,
        name=f"{law.name}*{factor.name}{description}",
        title=f"{law.title} with {factor.name.replace('arrhenius', 'Arrhenius')} temperature dependence",
        terms=new_terms,
        states=new_states,
        params={s: p for s, p in parameters.table().items() if s in used},
        references=tuple(dict.fromkeys((*law.references, factor.reference))),
        examples=(),
    )


def rate_coefficients(law: LawRecord, rate: sympy.Expr) -> tuple[sympy.Symbol, ...]:
    """The parameters to which a rate is proportional: those per second, if any are, else all."""
    found = [s for s, p in law.params.items() if _is_proportional(rate, s, positive=p.scale == "log")]
    return tuple(s for s in found if _PER_SECOND.search(law.params[s].unit)) or tuple(found)


# ---- mechanisms ----------------------------------------------------------------------------------------------------


@dataclass
class _FactorParameters:
    """The factor's parameters, under a name of their own for each rate coefficient that they belong to."""

    law: LawRecord
    factor: TemperatureFactor
    expressions: dict[sympy.Symbol | None, sympy.Expr] = field(default_factory=dict)
    params: dict[sympy.Symbol | None, dict[sympy.Symbol, Param]] = field(default_factory=dict)

    def expression_of(self, owner: sympy.Symbol | None) -> sympy.Expr:
        """The factor of one rate coefficient (or state); None stands for the creep rate."""
        if owner not in self.expressions:
            suffix = "" if owner is None else f"_{owner.name}"
            taken = {*self.law.names, *(s.name for s in self.law.states)}
            taken |= {s.name for table in self.params.values() for s in table}
            names = {s: sympy.Symbol(unused_name(s.name + suffix, taken), real=True) for s in self.factor.params}
            owners: dict[sympy.Symbol, Param | State] = {**self.law.params, **self.law.states}
            meaning = "" if owner is None else f" of {owners[owner].meaning}"
            self.params[owner] = {
                names[s]: replace(p, meaning=p.meaning + meaning) for s, p in self.factor.params.items()
            }
            self.expressions[owner] = self.factor.expression.xreplace(names)
        return self.expressions[owner]

    def table(self) -> dict[sympy.Symbol, Param]:
        """The law's parameters, each followed by those of its own factor, then those of the creep rate and states."""
        ordered: dict[sympy.Symbol, Param] = {}
        for symbol, param in self.law.params.items():
            ordered |= {symbol: param, **self.params.get(symbol, {})}
        return ordered | {s: p for table in self.params.values() for s, p in table.items() if s not in ordered}


class _StateParts:
    """The summands of a state equation: multiples of the creep rate, times their term's factor, and its own."""

    def __init__(
        self, law: LawRecord, symbol: sympy.Symbol, state: State, inherited: Mapping[sympy.Symbol, sympy.Expr]
    ) -> None:
        self.law, self.symbol = law, symbol
        self.inheriting: list[sympy.Expr] = []
        self.own: list[sympy.Expr] = []
        for summand in _summands(law, state.rate):
            coefficients = [c for c in rate_coefficients(law, summand) if c in inherited]
            if coefficients:
                self.inheriting.append(summand * inherited[coefficients[0]])
            elif summand != 0:
                self.own.append(summand)

    def multiply_own(self, shared: sympy.Expr | None, parameters: _FactorParameters, *, named: bool) -> None:
        """Multiply what has a rate of its own; what is activated already stays, unless the state was `named`."""
        for k, summand in enumerate(self.own):
            if not named and _is_activated(summand, set(self.law.states)):
                continue
            owner = next(iter(rate_coefficients(self.law, summand)), self.symbol)
            self.own[k] = summand * (shared if shared is not None else parameters.expression_of(owner))


def _summands(law: LawRecord, rate: sympy.Expr) -> list[sympy.Expr]:
    """The summands of a rate; a product of sums that has no coefficient as a whole is multiplied out."""
    parts: list[sympy.Expr] = []
    for summand in sympy.Add.make_args(rate):
        expanded = sympy.Add.make_args(sympy.expand_mul(summand)) if not rate_coefficients(law, summand) else ()
        separable = any(rate_coefficients(law, part) for part in expanded)
        parts += expanded if separable else [summand]
    return parts


def _is_proportional(rate: sympy.Expr, symbol: sympy.Symbol, *, positive: bool) -> bool:
    """Whether a rate is a multiple of a symbol, read off its structure; of the larger of two only where it is > 0."""
    if rate == symbol:
        return True
    if symbol not in rate.free_symbols:
        return False
    if isinstance(rate, sympy.Mul):
        holders = [part for part in rate.args if symbol in part.free_symbols]
        return len(holders) == 1 and _is_proportional(holders[0], symbol, positive=positive)
    if isinstance(rate, sympy.Piecewise):
        branches, conditions = zip(*rate.args, strict=True)
        free = not any(symbol in condition.free_symbols for condition in conditions)
        return free and _all_proportional(branches, symbol, positive)
    if isinstance(rate, sympy.Add) or (positive and isinstance(rate, sympy.Max | sympy.Min)):
        return _all_proportional(rate.args, symbol, positive)
    return False


def _all_proportional(parts: Iterable[sympy.Expr], symbol: sympy.Symbol, positive: bool) -> bool:
    return all(part == 0 or _is_proportional(part, symbol, positive=positive) for part in parts)


def _is_activated(rate: sympy.Expr, states: set[sympy.Symbol]) -> bool:
    """Whether a rate has a factor exp(...) of temperature alone, such as the form activated() gives."""
    others = {*POINT_VARIABLES, *states} - {temperature}
    exponents = [part.args[0] for part in sympy.Mul.make_args(rate) if isinstance(part, sympy.exp)]
    return any(
        part.has(temperature) and not part.free_symbols & others
        for exponent in exponents
        for part in sympy.Add.make_args(sympy.expand(exponent))
    )


def _chosen(law: LawRecord, kind: str, names: Iterable[str] | None, known: tuple[str, ...]) -> tuple[str, ...]:
    if names is None:
        return known
    chosen = (names,) if isinstance(names, str) else tuple(names)
    for name in chosen:
        if name not in known:
            raise LawError(f"law '{law.name}' has no {kind} '{name}': {nearest(name, known)}")
    return chosen


def unused_name(name: str, taken: set[str]) -> str:
    """The name itself, or with the first number from 2 on that is free: Q, Q_2."""
    if name not in taken:
        return name
    k = 2
    while f"{name}_{k}" in taken:
        k += 1
    return f"{name}_{k}"
