"""Candidate forms of a parameter as small libraries of functions of temperature.

A form is taken on the parameter's own scale, x(T), where it is a sum of coefficients times functions of temperature;
the coefficients are what a regression finds, and the names of the functions are our own: {name: sympy term}. What
stands inside an exponential (Q of a linear parameter, T0) is not a coefficient and is left to variable projection.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import sympy

from creepkit import registry
from creepkit.arrays import Floats
from creepkit.errors import FitError, LawError, nearest
from creepkit.language import CreepLaw, Factor, Param, TemperatureForm, temperature
from creepkit.laws.temperature_forms import creepkit_temperature_forms

CONSTANT = "constant"
ARRHENIUS = "arrhenius"
PREFERRED = 4.0
"""Prior odds of 1/T over any other form of a rate coefficient: that creep is thermally activated."""
_SAME = 1e-9


@dataclass(frozen=True, eq=False)
class Library:
    """A candidate form of one parameter.

    terms : {coefficient: sympy function of temperature (and of what is inside exponentials)}; the first coefficient
        is the parameter itself, at T_ref. inner : {symbol: Param} inside exponentials. offset : a function of
        temperature that has no coefficient. form : None for a constant. odds : prior odds of the form.
    """

    name: str
    parameter: str
    form: TemperatureForm | None
    terms: Mapping[str, sympy.Expr]
    table: Mapping[str, Param]
    inner: Mapping[sympy.Symbol, Param] = field(default_factory=dict)
    offset: sympy.Expr = sympy.S.Zero
    odds: float = 1.0

    @property
    def size(self) -> int:
        """How many numbers the form has."""
        return len(self.terms) + len(self.inner)

    @property
    def names(self) -> tuple[str, ...]:
        """Its numbers by name: coefficients, then what is inside exponentials."""
        return (*self.terms, *(s.name for s in self.inner))

    @cached_property
    def functions(self) -> list[Callable[..., Any]]:
        """One function of (T, *inner) for each term, and one for the offset."""
        wanted = (*self.terms.values(), self.offset)
        return [sympy.lambdify((temperature, *self.inner), term, "numpy") for term in wanted]

    def columns(self, T: Floats, inner: Sequence[float]) -> Floats:
        """(temperatures, terms + 1) values of the terms, then of the offset."""
        values = [np.broadcast_to(np.asarray(f(T, *inner), float), T.shape) for f in self.functions]
        return np.stack(values, axis=1)


def curves(libraries: Sequence[Library], values: Mapping[str, float], T: Floats) -> Floats:
    """(temperatures, parameters) of internal parameters, from the internal values {name: value} of all numbers."""
    found = []
    for one in libraries:
        both = one.columns(np.asarray(T, float), [values[s.name] for s in one.inner])
        found.append(both @ np.array([*(values[name] for name in one.terms), 1.0]))
    return np.stack(found, axis=1)


def law_with(law: CreepLaw, libraries: Sequence[Library]) -> CreepLaw:
    """The law with its parameters in these forms."""
    return law.with_temperature(**{one.parameter: one.form for one in libraries if one.form is not None})


def candidates(
    law: CreepLaw, parameter: str, rate: bool, T_ref: float, temperatures: Floats, forms: Sequence[str] | None = None,
    prior: Mapping[str, float] | None = None,
) -> list[Library]:  # fmt: skip
    """The forms that a parameter may take, the constant first, each with its prior odds.

    rate : whether the parameter is the coefficient of a rate, which Arrhenius' factor is for.
    forms : names of those wanted; by default all that are registered. Two that span the same functions are one.
    prior : {form: odds}; in the others' place the default: forms of equally many numbers share equal odds, and for
        rates 1/T counts PREFERRED times.
    """
    param, known = law.table[parameter], registry.default().temperature_forms()
    wanted = _wanted(forms, [CONSTANT, *known])
    found = [Library(CONSTANT, parameter, None, {parameter: sympy.S.One}, {parameter: param})]
    for name in sorted(wanted, key=lambda n: (n != ARRHENIUS, n not in creepkit_temperature_forms(), n)):
        made = known[name].value(T_ref) if name != CONSTANT else None
        library = None if made is None else library_of(name, law, parameter, made, rate)
        if library is not None and library.size < len(temperatures) and not _repeats(library, found, temperatures):
            found.append(library)
    kept = [one for one in found if one.name in wanted]
    if not kept:
        raise FitError(f"none of the forms {', '.join(wanted)} suits parameter '{parameter}' of law '{law.name}'")
    for name in prior or {}:
        if name not in {one.name for one in kept}:
            told = nearest(name, [one.name for one in kept])
            raise FitError(f"prior odds are given for '{name}', no form that parameter '{parameter}' may take: {told}")
    return _with_odds(kept, rate, prior or {})


def as_form(factor: Factor, alone: bool) -> TemperatureForm:
    """A factor of rates as a form of one rate coefficient; its parameters keep their names where it stands alone."""

    def build(symbol: sympy.Symbol, param: Param) -> tuple[sympy.Expr, dict[sympy.Symbol, Param]]:
        new = {s: s if alone else sympy.Symbol(f"{s.name}_{symbol.name}", real=True) for s in factor.params}
        return symbol * factor.expression.xreplace(new), {new[s]: p for s, p in factor.params.items()}

    return TemperatureForm(factor.name, build, factor.reference, factor.T_ref)


def library_of(name: str, law: CreepLaw, parameter: str, made: Any, rate: bool) -> Library | None:
    """A form's library; None where it does not suit the parameter, as inverse() does none of log scale."""
    param, symbol = law.table[parameter], law.symbol(parameter)
    if isinstance(made, Factor):
        if not rate:
            return None
        made = as_form(made, len(law.terms) == 1 and "Q" not in law.names)
    try:
        expression, extra = made.build(symbol, param)
    except LawError:
        return None
    if param.scale == "log":
        expression = symbol + sympy.expand_log(sympy.log(sympy.powsimp(expression / symbol)), force=True)
    table = {parameter: param, **{s.name: p for s, p in extra.items()}}
    terms, rest, inner = _split(expression, [symbol, *extra])
    return Library(name, parameter, made, terms, table, {s: extra[s] for s in inner}, rest)


def _split(
    expression: sympy.Expr, symbols: Sequence[sympy.Symbol]
) -> tuple[dict[str, sympy.Expr], sympy.Expr, list[sympy.Symbol]]:
    """What stands in a sum as a factor, what is left without, and the symbols that stand elsewhere."""
    terms: dict[str, sympy.Expr] = {}
    linear: list[sympy.Symbol] = []
    for s in symbols:
        slope = sympy.diff(expression, s)
        if s not in slope.free_symbols and not slope.free_symbols & {*linear}:
            terms[s.name] = slope
            linear.append(s)
    return terms, expression.subs(dict.fromkeys(linear, 0)), [s for s in symbols if s not in linear]


def _repeats(library: Library, found: Sequence[Library], T: Floats) -> bool:
    """Whether another form spans the same functions, as exponential() and activated() do none but 1/T twice does."""
    if library.inner or library.offset != 0:
        return False
    mine = library.columns(T, ())
    for other in found:
        if other.inner or other.offset != 0 or other.size != library.size:
            continue
        both = np.concatenate([mine[:, :-1], other.columns(T, ())[:, :-1]], axis=1)
        sizes = np.linalg.svd(both / np.linalg.norm(both, axis=0), compute_uv=False)
        if sizes[library.size] < _SAME * sizes[0]:
            return True
    return False


def _wanted(forms: Sequence[str] | None, known: Sequence[str]) -> list[str]:
    for name in forms or ():
        if name not in known:
            raise FitError(f"there is no temperature form '{name}': {nearest(name, known)}")
    return list(forms) if forms is not None else list(known)


def _with_odds(found: Sequence[Library], rate: bool, prior: Mapping[str, float]) -> list[Library]:
    sizes = [one.size for one in found]
    own = [PREFERRED if rate and one.name == ARRHENIUS else 1.0 for one in found]
    odds = [prior.get(one.name, o / sizes.count(one.size)) for one, o in zip(found, own, strict=True)]
    if min(odds) <= 0:
        bad = found[int(np.argmin(odds))].name
        raise FitError(f"the prior odds of '{bad}' are {min(odds):g}; they must be above zero, or leave the form out")
    return [replace(one, odds=o) for one, o in zip(found, odds, strict=True)]
