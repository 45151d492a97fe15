"""Candidate forms of a parameter: linear combinations of functions of temperature.

A form is taken on the parameter's own scale, x(T), where it is a sum of coefficients times functions of temperature;
a regression finds the coefficients, and the functions are named: {name: sympy term}. A parameter inside an exponential
(Q of a linear parameter, T0) enters nonlinearly and is found by variable projection.

Temperature forms that a user gives: sympy expressions, functions of temperature and feature libraries of pysindy.

An expression with the symbol of a parameter takes its place. One without it is a function of temperature that is added
on the parameter's own scale, less its value at T_ref, times a coefficient where it has no symbol of its own.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import sympy

from creepkit import registry
from creepkit.arrays import Floats
from creepkit.errors import FitError, LawError, refuse_unknown
from creepkit.language import CreepLaw, Param, TemperatureFactor, TemperatureForm, temperature
from creepkit.language.symbols import Symbol
from creepkit.language.temperature_forms import LOG_PARAMETER_RANGE, TEMPERATURE_SPAN
from creepkit.laws.temperature_forms import creepkit_temperature_forms

TRACED_FUNCTIONS = ("exp", "log", "sqrt", "sin", "cos", "tan", "sinh", "cosh", "tanh", "arctan")
"""Functions of NumPy that a function of temperature may call."""


def given_forms(form: Any, T_ref: float) -> list[TemperatureFactor | TemperatureForm]:
    """The forms that one entry of a list of forms stands for: one, or those of a feature library.

    form : a form or a factor; a sympy expression; a function of T_ref that returns a form or a factor, as ck.linear, or
        one of temperature; a feature library of pysindy, whose features of T/1000 K are forms each and all together.
    """
    if isinstance(form, TemperatureFactor | TemperatureForm):
        return [form]
    if isinstance(form, sympy.Expr):
        return [_expression_form([form], T_ref)]
    if all(hasattr(form, name) for name in ("fit", "transform", "get_feature_names")):
        features = _features(form)
        together = [_expression_form(features, T_ref)] if len(features) > 1 else []
        return [*(_expression_form([one], T_ref) for one in features), *together]
    if not callable(form):
        raise FitError(f"{form!r} is no form: give a name, a sympy expression in ck.temperature, or a function of it")
    try:
        made = form(T_ref)
    except (TypeError, ValueError, ArithmeticError):
        made = None
    if isinstance(made, TemperatureFactor | TemperatureForm):
        return [made]
    return [_expression_form([_traced(form)], T_ref)]


def _expression_form(expressions: Sequence[sympy.Expr], T_ref: float) -> TemperatureForm:
    """The form of functions of temperature, each with a coefficient of its own, or of one expression with symbols."""
    name = " and ".join(str(one).replace(temperature.name, "T") for one in expressions)

    def build(symbol: sympy.Symbol, param: Param) -> tuple[sympy.Expr, dict[sympy.Symbol, Param]]:
        own = {s: Symbol(s.name) for one in expressions for s in one.free_symbols - {temperature}}
        parts = [one.xreplace(own) for one in expressions]
        real_symbol = Symbol(symbol.name)
        if real_symbol in own.values():
            expression = parts[0].xreplace({real_symbol: symbol})
            increment = sympy.log(expression / symbol) if param.scale == "log" else expression - symbol
            coefficients = [s for s in own.values() if s != real_symbol]
        else:
            coefficients = list(own.values())
            if not coefficients:
                coefficients = [Symbol(f"{symbol.name}_{k + 1}") for k in range(len(parts))]
                parts = [c * part for c, part in zip(coefficients, parts, strict=True)]
            increment = sum(part - part.subs(temperature, sympy.Float(T_ref)) for part in parts)
            expression = symbol * sympy.exp(increment) if param.scale == "log" else symbol + increment
        return expression, {c: _coefficient(c, increment, param, name, T_ref) for c in coefficients}

    return TemperatureForm(name, build, "given by the user", float(T_ref))


def _coefficient(symbol: sympy.Symbol, increment: sympy.Expr, param: Param, form: str, T_ref: float) -> Param:
    """A coefficient; its bounds let the parameter move by half its range in 100 K, as in the built-in forms."""
    slope = sympy.diff(increment, symbol)
    known = slope.free_symbols <= {temperature}
    moved = [float(slope.subs(temperature, T_ref + dT)) for dT in (0.0, TEMPERATURE_SPAN)] if known else [0.0, 0.0]
    if not moved[1] - moved[0]:
        raise FitError(
            f"form '{form}': '{symbol}' is no coefficient of a function of temperature, so that it needs bounds; give "
            "a TemperatureForm whose build() returns its Param"
        )
    low, high = param.bounds
    reach = (LOG_PARAMETER_RANGE if param.scale == "log" else high - low) / 2 / abs(moved[1] - moved[0])
    return Param(f"coefficient of {form} in {param.meaning}", bounds=(-reach, reach), off=0.0)


@dataclass(frozen=True)
class _Traced:
    """A number of which the operations are recorded as a sympy expression; NumPy calls its functions as methods."""

    expression: sympy.Expr

    def __getattr__(self, name: str) -> Callable[[], _Traced]:
        if name not in TRACED_FUNCTIONS:
            raise AttributeError(name)
        function = getattr(sympy, {"arctan": "atan"}.get(name, name))
        return lambda: _Traced(function(self.expression))

    def __neg__(self) -> _Traced:
        return _Traced(-self.expression)


def _trace(operation: Callable[[Any, Any], Any]) -> None:
    """Give traced numbers an operator of Python, with a number on either side."""
    name = operation.__name__
    setattr(_Traced, f"__{name}__", lambda self, other: _Traced(operation(self.expression, _expression_of(other))))
    setattr(_Traced, f"__r{name}__", lambda self, other: _Traced(operation(_expression_of(other), self.expression)))


for _operation in (operator.add, operator.sub, operator.mul, operator.truediv, operator.pow):
    _trace(_operation)


def _expression_of(value: Any) -> sympy.Expr:
    if isinstance(value, _Traced):
        return value.expression
    return sympy.Integer(int(value)) if float(value).is_integer() else sympy.Float(float(value))


def _traced(function: Callable[[Any], Any]) -> sympy.Expr:
    """What a function of temperature computes."""
    try:
        return _expression_of(function(_Traced(temperature)))
    except (TypeError, ValueError, AttributeError) as error:
        raise FitError(
            f"the function {getattr(function, '__name__', function)!r} cannot be written as an expression ({error}): "
            f"use arithmetic and {', '.join(TRACED_FUNCTIONS)} of numpy, or give a sympy expression in ck.temperature"
        ) from None


def _features(library: Any) -> list[sympy.Expr]:
    """The features of a library that depend on temperature, as functions of T/1000 K."""
    library.fit(np.array([[0.9], [1.0], [1.1]]))
    try:
        row = library.transform(np.array([[_Traced(temperature / 1000)]], dtype=object))
        found = [_expression_of(one) for one in np.asarray(row, dtype=object).ravel()]
    except (TypeError, ValueError, AttributeError) as error:
        raise FitError(
            f"the features of {type(library).__name__} cannot be written as expressions ({error}): use arithmetic and "
            f"{', '.join(TRACED_FUNCTIONS)} of numpy"
        ) from None
    return [one for one in found if one.has(temperature)]


def symbol_names(form: Any) -> set[str]:
    """Names of all symbols of a form beside temperature, where it is an expression."""
    return {s.name for s in form.free_symbols - {temperature}} if isinstance(form, sympy.Expr) else set()


CONSTANT = "constant"


ARRHENIUS = "arrhenius"


ARRHENIUS_ODDS = 4.0
"""Prior odds of 1/T over any other form of a rate coefficient: that creep is thermally activated."""


_RANK_TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False)
class CandidateForm:
    """A candidate form of one parameter.

    terms : {coefficient: sympy function of temperature (and of what is inside exponentials)}; the first coefficient
        is the parameter itself, at T_ref. nonlinear_parameters : {symbol: Param} inside exponentials. offset : a
        function of temperature that has no coefficient. form : None for a constant. prior_odds : of the form.
    """

    name: str
    parameter: str
    form: TemperatureForm | None
    terms: Mapping[str, sympy.Expr]
    table: Mapping[str, Param]
    nonlinear_parameters: Mapping[sympy.Symbol, Param] = field(default_factory=dict)
    offset: sympy.Expr = sympy.S.Zero
    prior_odds: float = 1.0

    @property
    def parameter_count(self) -> int:
        """How many numbers the form has."""
        return len(self.terms) + len(self.nonlinear_parameters)

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Its numbers by name: coefficients, then what is inside exponentials."""
        return (*self.terms, *(s.name for s in self.nonlinear_parameters))

    def without(self, dropped: Set[str]) -> CandidateForm:
        """The form without some of its coefficients; a constant where no other number is left."""
        gone = [name for name in self.terms if name in dropped]
        form = self.form
        if not gone or form is None:
            return self
        terms = {name: term for name, term in self.terms.items() if name not in dropped}
        table = {name: param for name, param in self.table.items() if name not in dropped}
        if len(terms) == 1 and self.offset == 0:
            own = {self.parameter: self.table[self.parameter]}
            return CandidateForm(CONSTANT, self.parameter, None, terms, own, prior_odds=self.prior_odds)

        def build(symbol: sympy.Symbol, param: Param) -> tuple[sympy.Expr, dict[sympy.Symbol, Param]]:
            expression, extra = form.build(symbol, param)
            zero = {s: 0 for s in extra if s.name in dropped}
            return expression.subs(zero), {s: p for s, p in extra.items() if s not in zero}

        name = f"{self.name} without {', '.join(gone)}"
        reduced = TemperatureForm(name, build, form.reference, form.T_ref)
        return replace(self, name=name, form=reduced, terms=terms, table=table)

    @cached_property
    def functions(self) -> list[Callable[..., Any]]:
        """One function of (T, *inner) for each term, and one for the offset."""
        expressions = (*self.terms.values(), self.offset)
        return [sympy.lambdify((temperature, *self.nonlinear_parameters), term, "numpy") for term in expressions]

    def basis_values(self, T: Floats, nonlinear_values: Sequence[float]) -> Floats:
        """(temperatures, terms + 1) values of the terms, then of the offset.

        T : (temperatures,) K.
        """
        values = [np.broadcast_to(np.asarray(f(T, *nonlinear_values), float), T.shape) for f in self.functions]
        return np.stack(values, axis=1)


def evaluate_forms(forms: Sequence[CandidateForm], values: Mapping[str, float], T: Floats) -> Floats:
    """(temperatures, parameters) internal values of the parameters.

    values : {name: internal value} of all numbers. T : (temperatures,) K.
    """
    columns = []
    for form in forms:
        basis = form.basis_values(np.asarray(T, float), [values[s.name] for s in form.nonlinear_parameters])
        columns.append(basis @ np.array([*(values[name] for name in form.terms), 1.0]))
    return np.stack(columns, axis=1)


def law_with_forms(law: CreepLaw, forms: Sequence[CandidateForm]) -> CreepLaw:
    """The law with its parameters in these forms."""
    return law.with_temperature(**{form.parameter: form.form for form in forms if form.form is not None})


def candidate_forms(
    law: CreepLaw,
    parameter: str,
    is_rate_coefficient: bool,
    T_ref: float,
    temperatures: Floats,
    forms: Sequence[Any] | None = None,
) -> list[CandidateForm]:
    """The forms that a parameter may take, the constant first, each with its prior odds.

    Forms of equally many numbers share equal odds, and for the coefficient of a rate 1/T counts ARRHENIUS_ODDS times.

    is_rate_coefficient : whether the parameter is the coefficient of a rate, which Arrhenius' factor is for.
    temperatures : (temperatures,) K of the estimates; T_ref : K.
    forms : those wanted, by name or as given_forms() takes them; by default all that are registered. Two that span the
        same functions are one. Where none of those given by a user suits, the parameter is constant.
    """
    param, wanted = law.table[parameter], _forms_by_name(law, parameter, T_ref, forms)
    forms_found = [CandidateForm(CONSTANT, parameter, None, {parameter: sympy.S.One}, {parameter: param})]
    for name in sorted(wanted, key=lambda n: (n != ARRHENIUS, n not in creepkit_temperature_forms(), n)):
        suitable = candidate_form(name, law, parameter, wanted[name], is_rate_coefficient) if name != CONSTANT else None
        if (
            suitable is not None
            and suitable.parameter_count < len(temperatures)
            and not _is_duplicate(suitable, forms_found, temperatures)
        ):
            forms_found.append(suitable)
    retained = [candidate for candidate in forms_found if candidate.name in wanted]
    if not retained and any(not isinstance(form, str) for form in forms or ()):
        retained = forms_found[:1]
    if not retained:
        raise FitError(f"none of the forms {', '.join(wanted)} suits parameter '{parameter}' of law '{law.name}'")
    sizes = [one.parameter_count for one in retained]
    odds = [ARRHENIUS_ODDS if is_rate_coefficient and one.name == ARRHENIUS else 1.0 for one in retained]
    return [
        replace(one, prior_odds=o / sizes.count(one.parameter_count)) for one, o in zip(retained, odds, strict=True)
    ]


def _forms_by_name(law: CreepLaw, parameter: str, T_ref: float, forms: Sequence[Any] | None) -> dict[str, Any]:
    """{name: form about T_ref} of those wanted of a parameter, without expressions that name another parameter."""
    registered = registry.default_registry().all(registry.kinds.TEMPERATURE_FORMS)
    wanted: dict[str, Any] = {}
    for form in [CONSTANT, *registered] if forms is None else forms:
        if isinstance(form, str):
            check_form_names([form])
            wanted[form] = None if form == CONSTANT else registered[form].value(T_ref)
        elif not symbol_names(form) & {*law.names} - {parameter}:
            wanted |= {one.name: one for one in given_forms(form, T_ref)}
    return wanted


def factor_as_form(factor: TemperatureFactor, keep_names: bool) -> TemperatureForm:
    """A factor of rates as a form of one rate coefficient; its parameters keep their names where it stands alone."""

    def build(symbol: sympy.Symbol, param: Param) -> tuple[sympy.Expr, dict[sympy.Symbol, Param]]:
        renamed = {s: s if keep_names else Symbol(f"{s.name}_{symbol.name}") for s in factor.params}
        return symbol * factor.expression.xreplace(renamed), {renamed[s]: p for s, p in factor.params.items()}

    return TemperatureForm(factor.name, build, factor.reference, factor.T_ref)


def candidate_form(
    name: str, law: CreepLaw, parameter: str, temperature_form: Any, is_rate_coefficient: bool
) -> CandidateForm | None:
    """A form's library; None where it does not suit the parameter, as inverse() does none of log scale."""
    param, symbol = law.table[parameter], law.symbol(parameter)
    if isinstance(temperature_form, TemperatureFactor):
        if not is_rate_coefficient:
            return None
        of_creep = any(symbol in term.free_symbols for term in law.terms.values())  # else of an internal variable
        temperature_form = factor_as_form(temperature_form, of_creep and len(law.terms) == 1 and "Q" not in law.names)
    try:
        expression, extra = temperature_form.build(symbol, param)
    except LawError:
        return None
    if param.scale == "log":
        expression = symbol + sympy.expand_log(sympy.log(sympy.powsimp(expression / symbol)), force=True)
    table = {parameter: param, **{s.name: p for s, p in extra.items()}}
    terms, offset, nonlinear = _separate_linear_terms(expression, [symbol, *extra])
    return CandidateForm(name, parameter, temperature_form, terms, table, {s: extra[s] for s in nonlinear}, offset)


def _separate_linear_terms(
    expression: sympy.Expr, symbols: Sequence[sympy.Symbol]
) -> tuple[dict[str, sympy.Expr], sympy.Expr, list[sympy.Symbol]]:
    """Factors of a sum, what is left without them, and the symbols that stand elsewhere."""
    terms: dict[str, sympy.Expr] = {}
    linear: list[sympy.Symbol] = []
    for s in symbols:
        derivative = sympy.diff(expression, s)
        if s not in derivative.free_symbols and not derivative.free_symbols & {*linear}:
            terms[s.name] = derivative
            linear.append(s)
    return terms, expression.subs(dict.fromkeys(linear, 0)), [s for s in symbols if s not in linear]


def _is_duplicate(candidate: CandidateForm, accepted: Sequence[CandidateForm], T: Floats) -> bool:
    """Whether another form spans the same functions, as exponential() and activated() do none but 1/T twice does."""
    if candidate.nonlinear_parameters or candidate.offset != 0:
        return False
    own_basis = candidate.basis_values(T, ())
    for other in accepted:
        if other.nonlinear_parameters or other.offset != 0 or other.parameter_count != candidate.parameter_count:
            continue
        joint_basis = np.concatenate([own_basis[:, :-1], other.basis_values(T, ())[:, :-1]], axis=1)
        singular_values = np.linalg.svd(joint_basis / np.linalg.norm(joint_basis, axis=0), compute_uv=False)
        if singular_values[candidate.parameter_count] < _RANK_TOLERANCE * singular_values[0]:
            return True
    return False


def check_form_names(names: Iterable[str]) -> None:
    """FitError for a name of no temperature form that is registered."""
    known = [CONSTANT, *registry.default_registry().all(registry.kinds.TEMPERATURE_FORMS)]
    for name in names:
        refuse_unknown(name, known, FitError, f"there is no temperature form '{name}'")
