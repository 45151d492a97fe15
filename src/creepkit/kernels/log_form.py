"""The log form of a law: each term as its logarithm, in functions that every target evaluates accurately.

A term f becomes ln f = ln A + n ln(stress) + m ln(strain) + ...: nothing overflows on the way, and derivatives become
f d(ln f). Parameters of log scale enter as their logarithm. Only states that are bases of powers are floored (FLOOR).
Differences of exponentials that cancel are rewritten, and the leading exponent of time at t -> 0+ is found.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import sympy

from creepkit.errors import SAID, LawError, quoted, restated
from creepkit.kernels.extremes import Max, Min
from creepkit.kernels.kernel_functions import (
    Coth,
    ExpDifference,
    Expm1,
    Floored,
    Log1p,
    LogCosh,
    LogFloor,
    LogRise,
    LogSinh,
    LogTanh,
    Tanh,
    in_sympy_functions,
)
from creepkit.language.expression_trees import KNOWN_FUNCTIONS, KNOWN_NODES
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import POINT_VARIABLES, strain, temperature, time


def with_exponential_differences(expression: sympy.Expr) -> sympy.Expr:
    """Rewrite sums of c exp(a) - c exp(b) as c ExpDifference(a, b), and of c exp(a) - c as c Expm1(a)."""
    if not expression.has(sympy.exp):
        return expression
    groups: dict[sympy.Expr, list[tuple[sympy.Expr, sympy.Expr]]] = defaultdict(list)
    for summand in sympy.Add.make_args(sympy.expand_mul(expression)):
        number, rest = summand.as_coeff_Mul()
        exponents = [f.args[0] for f in sympy.Mul.make_args(rest) if isinstance(f, sympy.exp)]
        others = [f for f in sympy.Mul.make_args(rest) if not isinstance(f, sympy.exp)]
        groups[sympy.Mul(*others)].append((number, sympy.Add(*exponents)))
    if not all(len(group) == 2 and group[0][0] + group[1][0] == 0 for group in groups.values()):
        return expression
    return sympy.Add(*(other * _exponential_difference(*group) for other, group in groups.items()))


def with_all_exponential_differences(expression: sympy.Expr) -> sympy.Expr:
    """The same in every sum within an expression."""
    return expression.replace(lambda e: e.is_Add, with_exponential_differences)


def _exponential_difference(first: tuple[sympy.Expr, sympy.Expr], second: tuple[sympy.Expr, sympy.Expr]) -> sympy.Expr:
    """Return k exp(a) - k exp(b), always with the same one of the two in front."""
    (number, a), (_, b) = sorted((first, second), key=lambda pair: (pair[1] == 0, sympy.default_sort_key(pair[1])))
    return number * (Expm1(a) if b == 0 else ExpDifference(a, b))


FLOOR = 1e-30
"""Stress, strain and states below this act as this when they are bases of powers; slopes are those there."""


TIME_FLOOR = 1e-120
"""The same for time: with m = -0.95, t^m has done 2 % of its strain at 1e6 s by 1e-30 s, and 1e-6 of it by 1e-120 s."""


COMPOSITE_FLOOR = 1e-200
"""Composite bases, such as Max(stress - threshold, 0), are floored here: a term that is zero becomes about 1e-200 1/s,
small enough to be nothing and large enough for its slope, which is the term over this floor."""


def floor_of(symbol: sympy.Symbol) -> sympy.Float:
    """The floor of a variable of the point, or of a state, as the base of a power."""
    return sympy.Float(TIME_FLOOR if symbol == time else FLOOR)


@dataclass(frozen=True)
class LogForm:
    """A law in log form.

    terms : ln of each term, in the law's order.
    state_rates : the rate of each internal variable, linear.
    theta : internal parameters, one symbol each in the law's order (`ln_A` for A of log scale, else itself).
    logs : {parameter of log scale: its internal symbol}.
    coefficients : for each term, the positions in theta that multiply it: -inf there switches the term off.
    """

    terms: tuple[sympy.Expr, ...]
    state_rates: tuple[sympy.Expr, ...]
    theta: tuple[sympy.Symbol, ...]
    logs: dict[sympy.Symbol, sympy.Symbol]
    coefficients: tuple[tuple[int, ...], ...]


_SYMPY_FAILURES = (ArithmeticError, AttributeError, NotImplementedError, RecursionError, TypeError, ValueError)
"""What sympy raises where it cannot rewrite, differentiate or compare."""


@contextmanager
def in_one_sentence(law: CreepLaw, done: str = "differentiated and lowered to kernels") -> Iterator[None]:
    """LawError for what sympy raises while it rewrites or differentiates a law, such as conditions on conditions."""
    try:
        yield
    except _SYMPY_FAILURES as error:
        cause = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        raise LawError(
            f"law '{law.name}' cannot be {done} ({cause}); write it in another "
            "form, without conditions within conditions"
        ) from error


def log_form(law: CreepLaw) -> LogForm:
    """Lower a law; LawError, naming the term, where it holds what no kernel can evaluate."""
    with in_one_sentence(law):
        return _log_form(law)


def _log_form(law: CreepLaw) -> LogForm:
    logs = _log_symbols(law)
    lowering = _LogLowering(logs, {*POINT_VARIABLES, *law.states})
    rates = {f"rate of '{symbol}'": state.rate for symbol, state in law.states.items()}
    for place, expression in ({f"term '{k}'": v for k, v in law.terms.items()} | rates).items():
        _check_expression(expression, f"law '{law.name}', {place}")
    terms = []
    for label, term in law.terms.items():
        with restated(LawError, LawError, f"law '{law.name}', term '{label}': {SAID}"):
            terms.append(lowering.log_of(term))
    positions = {symbol: k for k, symbol in enumerate(law.params) if symbol in logs}
    coefficients = [sorted(positions[s] for s in _vanishing_factors(t) if s in logs) for t in law.terms.values()]
    return LogForm(
        terms=tuple(terms),
        state_rates=tuple(
            with_all_exponential_differences(lowering.linear(state.rate)) for state in law.states.values()
        ),
        theta=tuple(logs.get(s, s) for s in law.params),
        logs=logs,
        coefficients=tuple(map(tuple, coefficients)),
    )


def _log_symbols(law: CreepLaw) -> dict[sympy.Symbol, sympy.Symbol]:
    """A symbol for the logarithm of each parameter of log scale, of a name that is still free."""
    taken_names, logs = {*law.names, *(s.name for s in law.states)}, {}
    for symbol, param in law.params.items():
        if param.scale == "log":
            name = f"ln_{symbol.name}"
            while name in taken_names:
                name += "_"
            taken_names.add(name)
            logs[symbol] = sympy.Symbol(name, real=True)
    return logs


def _check_expression(expression: sympy.Expr, origin: str) -> None:
    """Refuse what has no kernel, and branches that leave a gap."""
    for node in sympy.preorder_traversal(expression):
        if not (node.is_Atom or isinstance(node, KNOWN_NODES)):
            allowed = ", ".join(sorted(f.__name__ for f in KNOWN_FUNCTIONS))
            raise LawError(
                f"{origin}: the function {node.func.__name__} in {quoted(node, 200)} has no kernel; allowed are "
                f"{allowed}"
            )
        if isinstance(node, sympy.Piecewise) and node.args[-1].cond != sympy.true:
            raise LawError(
                f"{origin}: the last branch of {quoted(node, 200)} must hold in all remaining cases: write (..., True)"
            )


def _vanishing_factors(term: sympy.Expr) -> set[sympy.Symbol]:
    """The symbols whose zero makes the whole term zero."""
    if term.is_Symbol:
        return {term}
    if term.is_Mul:
        return set().union(*map(_vanishing_factors, term.args))
    if term.is_Pow and term.exp.is_positive:
        return _vanishing_factors(term.base)
    if isinstance(term, sympy.Piecewise):
        branches = [_vanishing_factors(branch) for branch, _ in term.args if branch != 0]
        return set.intersection(*branches) if branches else set()
    return set()


class _LogLowering:
    """One pass over a law's expressions. logs : {parameter: its logarithm}; bases : what FLOOR applies to."""

    def __init__(self, logs: dict[sympy.Symbol, sympy.Symbol], bases: set[sympy.Symbol]) -> None:
        self.logs, self.bases = logs, bases

    # ---- logarithms ------------------------------------------------------------------------------------------------

    def log_of(self, e: sympy.Expr) -> sympy.Expr:
        """Return ln(e) for e > 0."""
        if not e.free_symbols:
            return _log_of_number(e)
        if e in self.logs:
            return self.logs[e]
        if e.is_Mul:
            return self._log_of_product(e)
        if e.is_Pow:
            base = sympy.Abs(e.base) if e.exp.is_even and e.base.is_Add else e.base
            return self.linear(e.exp) * self.log_of(base)
        if e.is_Add:
            return self._log_of_sum(e)
        if isinstance(e, sympy.Piecewise):
            return sympy.Piecewise(*((self.log_of(branch), self.linear(condition)) for branch, condition in e.args))
        if isinstance(e, sympy.exp):
            return self.linear(e.args[0])
        if e.func in _LOG_FUNCTIONS:
            return _LOG_FUNCTIONS[e.func](self.linear(e.args[0]))
        return LogFloor(self.linear(e), floor_of(e) if e in self.bases else sympy.Float(COMPOSITE_FLOOR))

    def _log_of_product(self, e: sympy.Mul) -> sympy.Expr:
        """Return the sum of logarithms; a negative number is moved into a factor: -3 (a - b) is 3 (b - a)."""
        number, rest = e.as_coeff_Mul()
        factors = list(sympy.Mul.make_args(rest))
        if number > 0:
            return sympy.Add(*(self.log_of(f) for f in (number, *factors)))
        sums = [f for f in factors if f.is_Add]
        negated = next(iter(sums or filter(self._may_be_negative, factors)), None)
        if negated is None:
            raise LawError(f"{e} is negative, and a rate is not; write recovery as a factor or an internal variable")
        factors.remove(negated)
        if negated.is_Add:
            log_of_negated = self.log_of(sympy.Add(*(-a for a in negated.args)))
        else:
            log_of_negated = LogFloor(-self.linear(negated), sympy.Float(COMPOSITE_FLOOR))
        return sympy.Add(*(self.log_of(f) for f in (-number, *factors)), log_of_negated)

    def _may_be_negative(self, factor: sympy.Expr) -> bool:
        positive = (sympy.exp, sympy.sinh, sympy.cosh, sympy.Abs)
        return not (factor.is_Pow or isinstance(factor, positive) or factor in self.logs or factor in self.bases)

    def _log_of_sum(self, e: sympy.Expr) -> sympy.Expr:
        """Differences of exponentials keep their digits and do not overflow, cosh(x) - 1 among them."""
        if len(e.args) == 2 and e.args[0] == -1 and isinstance(e.args[1], sympy.cosh):
            return _log_of_number(sympy.Integer(2)) + 2 * LogSinh(self.linear(e.args[1].args[0]) / 2)
        total = with_exponential_differences(self.linear(e))
        number, factors = total.as_coeff_mul()
        results = [f for f in factors if isinstance(f, (Expm1, ExpDifference))]
        others = [f for f in factors if f not in results]
        if len(results) != 1 or not all(isinstance(f, sympy.exp) for f in others):
            return LogFloor(total, sympy.Float(COMPOSITE_FLOOR))
        a, b = (*results[0].args, sympy.S.Zero)[:2]
        high, low = (a, b) if number > 0 else (b, a)
        return sympy.Add(_log_of_number(abs(number)), *(f.args[0] for f in others), high, LogRise(high - low))

    # ---- values ----------------------------------------------------------------------------------------------------

    def linear(self, e: sympy.Basic) -> sympy.Basic:
        """Return e in internal parameters, with powers as exp(k ln x)."""
        if e in self.logs:
            return sympy.exp(self.logs[e])
        if not e.args:
            return e
        if e.is_Pow:
            return self._power(e)
        if isinstance(e, sympy.log):
            return self._logarithm(e.args[0])
        if isinstance(e, sympy.Abs) and e.args[0] in self.bases:
            return e.args[0]
        arguments = [self.linear(argument) for argument in e.args]
        return _REWRITES.get(e.func, e.func)(*arguments)

    def _power(self, e: sympy.Pow) -> sympy.Expr:
        if not e.exp.is_Integer:
            return sympy.exp(self.linear(e.exp) * self.log_of(e.base))
        base = self.linear(e.base)
        may_be_zero = e.base in self.bases and e.base != temperature
        return Floored(base, floor_of(e.base)) ** e.exp if e.exp < 0 and may_be_zero else base**e.exp

    def _logarithm(self, e: sympy.Expr) -> sympy.Expr:
        return Log1p(self.linear(e - 1)) if e.is_Add and sympy.S.One in e.args else self.log_of(e)


_REWRITES: dict[Any, Callable[..., sympy.Basic]] = {
    sympy.tanh: Tanh,
    sympy.coth: Coth,
    sympy.Abs: lambda x: sympy.Piecewise((x, x >= 0), (-x, True)),
    sympy.sign: lambda x: sympy.Piecewise((1, x > 0), (-1, x < 0), (0, True)),
    sympy.Max: Max,
    sympy.Min: Min,
    sympy.Heaviside: lambda x, half: sympy.Piecewise((1, x > 0), (0, x < 0), (half, True)),
}
"""Functions whose derivatives in sympy are distributions, lose digits, or take too long."""


_LOG_FUNCTIONS: dict[Any, Any] = {sympy.sinh: LogSinh, sympy.cosh: LogCosh, sympy.tanh: LogTanh}


def _log_of_number(e: sympy.Expr) -> sympy.Expr:
    value = e.evalf(30)
    if value < 0:
        raise LawError(f"{e} is negative, and a rate is not; write recovery as a factor or an internal variable")
    if value == 1:
        return sympy.S.Zero
    return sympy.Float(sympy.log(value) if value > 0 else sympy.log(sympy.Float(COMPOSITE_FLOOR)), 17)


def leading_exponents(form: LogForm) -> tuple[tuple[sympy.Expr, sympy.Expr], ...]:
    """For each term (a, b), the exponents of time and of strain at t -> 0+, as functions of theta (and the point).

    An exponent that sympy cannot find counts as 0: it decides how long steps can be, never whether they are right.
    """
    return tuple((_exponent_at_zero(term, time), _exponent_at_zero(term, strain)) for term in form.terms)


def _exponent_at_zero(term: sympy.Expr, variable: sympy.Symbol) -> sympy.Expr:
    """The limit of x d(ln f)/dx at x -> 0+, with time and strain zero elsewhere."""
    summands = [s for s in sympy.Add.make_args(term) if s.has(variable)]
    try:
        slopes = [in_sympy_functions(sympy.diff(s, variable)) for s in summands]
        result = sympy.Add(*(_limit(variable * slope, variable) for slope in slopes))
        if _is_undefined(result):
            return sympy.S.Zero
        result = result.subs({time: 0, strain: 0})
    except _SYMPY_FAILURES:
        return sympy.S.Zero
    return sympy.S.Zero if _is_undefined(result) else result


MOST_DIFFERENTIATIONS, MOST_OPERATIONS = 3, 300
"""Of a quotient whose numerator and denominator vanish; the limits of sympy may take hours."""


def _limit(slope: sympy.Expr, variable: sympy.Symbol) -> sympy.Expr:
    """The value at zero, of 0/0 by the rule of l'Hospital; NaN where that finds none."""
    at_zero = slope.subs(variable, 0)
    if not _is_undefined(at_zero) or slope.count_ops() > MOST_OPERATIONS:
        return at_zero
    above, below = sympy.fraction(sympy.together(slope))
    for _ in range(MOST_DIFFERENTIATIONS):
        if above.count_ops() + below.count_ops() > MOST_OPERATIONS:
            break
        first, second = above.subs(variable, 0), below.subs(variable, 0)
        if second != 0:
            return first / second
        if first != 0:
            break
        above, below = sympy.diff(above, variable), sympy.diff(below, variable)
    return sympy.S.NaN


def _is_undefined(expression: sympy.Expr) -> bool:
    return bool(expression.has(sympy.nan, sympy.zoo, sympy.oo, -sympy.oo, sympy.Limit, sympy.AccumBounds))
