"""The functions of printed kernels as arithmetic without branches, so that vectors can pass through them.

exp and log reduce their argument by powers of two (Cody and Waite, Software Manual for the Elementary Functions, 1980)
and sum a series there: exp(r) for |r| <= ln(2)/2, and ln m = 2 artanh s with s = (m - 1)/(m + 1) for m between
sqrt(1/2) and sqrt(2). The other functions are composed from these. Errors are below four units of the last place over
all doubles, but where ln sinh(x) passes through 0; results overflow to infinity and underflow gradually, and NaN gives
NaN. erf, asinh, atan, sin and cos are those of the C library, one number after the other.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import wraps
from typing import Any

from creepkit.kernels import numpy_functions
from creepkit.kernels.llvm_code import (
    INTEGER,
    Value,
    bits,
    block_of,
    call_formula,
    call_intrinsic,
    call_libm,
    comparison,
    number_of_bits,
    operation,
    select,
)

Formula = Callable[..., Any]


def _function(formula: Formula) -> Formula:
    """Make a formula a function of the module that calls it; constants are evaluated at once."""

    @wraps(formula)
    def call(*arguments: Any) -> Any:
        if block_of(arguments) is None:
            return float(getattr(numpy_functions, formula.__name__)(*arguments))
        return call_formula(formula, *arguments)

    return call


def _vector_function(formula: Formula) -> Formula:
    """The same for vectors; a single number goes to the C library's function, which is faster there."""
    for_vectors = _function(formula)

    @wraps(formula)
    def call(*arguments: Any) -> Any:
        block = block_of(arguments)
        single = block is not None and block.lanes == 1
        return call_libm(formula.__name__, *arguments) if single else for_vectors(*arguments)

    return call


# ---- comparisons and powers ----------------------------------------------------------------------------------------


choose = select
"""a where the condition holds, else b."""


def both(a: Any, b: Any) -> Any:
    """Whether both conditions hold."""
    return _logical("and", a, b)


def either(a: Any, b: Any) -> Any:
    """Whether one of the conditions holds."""
    return _logical("or", a, b)


def _logical(instruction: str, a: Any, b: Any) -> Any:
    if isinstance(a, Value) or isinstance(b, Value):
        return operation(instruction, a, b, "i1")
    return a and b if instruction == "and" else a or b


def larger(a: Any, b: Any) -> Any:
    """max(a, b); NaN when either is."""
    return select(either(_at_least(a, b), _is_nan(a)), a, b)


def smaller(a: Any, b: Any) -> Any:
    """min(a, b); NaN when either is."""
    return select(either(_at_least(b, a), _is_nan(a)), a, b)


def _at_least(a: Any, b: Any) -> Any:
    return comparison("oge", a, b) if isinstance(a, Value) or isinstance(b, Value) else a >= b


def _is_nan(a: Any) -> Any:
    return comparison("uno", a, 0.0) if isinstance(a, Value) else math.isnan(a)


def heaviside(x: Any) -> Any:
    """1 where x > 0, else 0."""
    return select(x > 0.0, 1.0, 0.0)


def floored(x: Any, floor: Any) -> Any:
    """max(x, floor); NaN when x is."""
    return select(x < floor, floor, x)


def square(x: Any) -> Any:
    """Return x times x."""
    return x * x


def sqrt(x: Any) -> Any:
    """Square root."""
    return call_intrinsic("sqrt", x) if isinstance(x, Value) else math.sqrt(x)


def power(x: Any, y: Any) -> Any:
    """Return x to the y; whole and half exponents up to 64 by multiplication."""
    if isinstance(y, Value) or 2 * y != int(2 * y) or abs(y) > 64:
        return call_libm("pow", x, y)
    whole = int(abs(y))
    result = _whole_power(x, whole)
    if abs(y) != whole:
        result = result * sqrt(x)
    return 1.0 / result if y < 0 else result


def _whole_power(x: Any, exponent: int) -> Any:
    if exponent == 0:
        return 1.0
    half = _whole_power(x, exponent // 2)
    return half * half * x if exponent % 2 else half * half


# ---- exponentials --------------------------------------------------------------------------------------------------


_LN2 = math.log(2.0)


_LN2_HIGH, _LN2_LOW = float.fromhex("0x1.62e42fefa38p-1"), float.fromhex("0x1.ef35793c7673p-45")
"""ln 2 as a sum; whole numbers to 2^11 times the first part are exact."""


_ROUNDING = 1.5 * 2.0**52
"""Added to a number below 2^51, it leaves the nearest whole number in the last bits."""


_ROUNDING_BITS = 0x4338000000000000


_EXPONENT_ONE = 1023 << 52
"""The bits of 1.0."""


_EXP_SERIES = [1.0 / math.factorial(k) for k in range(2, 14)]


def _multiply_add(a: Any, b: Any, c: Any) -> Any:
    """a b + c, with one rounding where the processor can."""
    return call_intrinsic("fmuladd", a, b, c)


def _polynomial(x: Value, coefficients: Sequence[float]) -> Value:
    """Sum of coefficients[k] x^k, pairs first (Estrin), so that multiplications overlap."""
    terms: list[Any] = list(coefficients)
    while len(terms) > 1:
        pairs = [_multiply_add(b, x, a) for a, b in zip(terms[::2], terms[1::2], strict=False)]
        terms = [*pairs, *terms[2 * len(pairs) :]]
        x = x * x
    result: Value = terms[0]
    return result


def _bounded(x: Value, low: float, high: float) -> Value:
    """x within limits; NaN stays."""
    result: Value = select(x > high, high, select(x < low, low, x))
    return result


def _reduced(x: Value) -> tuple[Value, Value]:
    """(expm1(r), k) with x = k ln 2 + r; k an integer."""
    rounded = _multiply_add(x, 1.0 / _LN2, _ROUNDING)
    k = rounded - _ROUNDING
    r = _multiply_add(k, -_LN2_LOW, _multiply_add(k, -_LN2_HIGH, x))
    return _multiply_add(r * r, _polynomial(r, _EXP_SERIES), r), operation(
        "sub", bits(rounded), _ROUNDING_BITS, INTEGER
    )


def _power_of_two(k: Value) -> Value:
    """2^k for a normal result."""
    shifted = operation("shl", k, 52, INTEGER)
    return number_of_bits(operation("add", shifted, _EXPONENT_ONE, INTEGER))


def _scaled(x: Value, k: Value) -> Value:
    """x 2^k in two steps, so that neither factor is beyond the doubles."""
    half = operation("ashr", k, 1, INTEGER)
    return x * _power_of_two(half) * _power_of_two(operation("sub", k, half, INTEGER))


@_vector_function
def exp(x: Any) -> Any:
    """Exponential."""
    p, k = _reduced(_bounded(x, -746.0, 710.0))
    return _scaled(1.0 + p, k)


@_function
def expm1(x: Any) -> Any:
    """exp(x) - 1, from 2^k expm1(r) + (2^k - 1), halved on the way for k = 1024."""
    p, k = _reduced(_bounded(x, -50.0, 710.0))
    half = _power_of_two(operation("sub", k, 1, INTEGER))
    return 2.0 * _multiply_add(half, p, half - 0.5)


@_function
def exp_difference(a: Any, b: Any) -> Any:
    """exp(a) - exp(b) without cancellation."""
    first = a >= b
    high, low = select(first, a, b), select(first, b, a)
    size = exp(high) * expm1(low - high)
    return select(first, -size, size)


def _magnitude(x: Value) -> Value:
    return call_intrinsic("fabs", x)


def _with_sign(magnitude: Value, x: Value) -> Value:
    return call_intrinsic("copysign", magnitude, x)


_HALF_E = 0.5 * math.e


def _shifted_expm1(y: Value) -> tuple[Value, Value]:
    """(whether y > 22, expm1 of y or, there, of y - 1), which does not overflow before sinh and cosh do."""
    big: Value = y > 22.0
    return big, expm1(select(big, y - 1.0, y))


@_function
def sinh(x: Any) -> Any:
    """Hyperbolic sine."""
    big, e = _shifted_expm1(_magnitude(x))
    return _with_sign(select(big, (e + 1.0) * _HALF_E, 0.5 * (e + e / (e + 1.0))), x)


@_function
def cosh(x: Any) -> Any:
    """Hyperbolic cosine."""
    big, e = _shifted_expm1(_magnitude(x))
    return select(big, (e + 1.0) * _HALF_E, 0.5 * ((e + 1.0) + 1.0 / (e + 1.0)))


@_function
def tanh(x: Any) -> Any:
    """Hyperbolic tangent."""
    y = _magnitude(x)
    e = expm1(2.0 * select(y > 20.0, 20.0, y))
    return _with_sign(e / (e + 2.0), x)


@_function
def coth(x: Any) -> Any:
    """coth(x), x > 0."""
    y = floored(x, 1e-30)
    e = expm1(2.0 * select(y > 20.0, 20.0, y))
    return (e + 2.0) / e


# ---- logarithms ----------------------------------------------------------------------------------------------------


_SMALLEST_NORMAL = 2.0**-1022


_SQRT_HALF_BITS = 0x3FE6A09E667F3BCD


_ARTANH_SERIES = [2.0 / (2 * k + 3) for k in range(10)]
"""2 artanh(s) = 2 s + s^3 (2/3 + 2/5 s^2 + ...)."""


def _log_of_normal(x: Value, lowered: Any = 0.0, correction: Any = None) -> Any:
    """ln x for a normal x > 0, less `lowered` times ln 2, plus a correction that is small against x, relative to x."""
    position = operation("sub", bits(x), _SQRT_HALF_BITS, INTEGER)
    e = operation("ashr", position, 52, INTEGER)
    m = number_of_bits(operation("sub", bits(x), operation("shl", e, 52, INTEGER), INTEGER))
    k = number_of_bits(operation("add", e, _ROUNDING_BITS, INTEGER)) - _ROUNDING - lowered
    f = m - 1.0
    s = f / (f + 2.0)
    z, half = s * s, 0.5 * f * f
    low = _multiply_add(k, _LN2_LOW, s * _multiply_add(z, _polynomial(z, _ARTANH_SERIES), half))
    if correction is not None:
        low = low + correction
    return _multiply_add(k, _LN2_HIGH, f - (half - low))


def _above_zero(x: Value, result: Value) -> Any:
    """The result where 0 < x < inf, else ln x."""
    elsewhere = select(comparison("oeq", x, 0.0), -math.inf, select(x > 0.0, x, math.nan))
    return select(both(x > 0.0, x < math.inf), result, elsewhere)


@_vector_function
def log(x: Any) -> Any:
    """Natural logarithm."""
    tiny = x < _SMALLEST_NORMAL
    normal = select(tiny, x * 2.0**54, x)
    return _above_zero(x, _log_of_normal(normal, select(tiny, 54.0, 0.0)))


@_function
def _log_above_floor(x: Any) -> Any:
    """ln x where x is no less than a normal number, or NaN."""
    return select(x < math.inf, _log_of_normal(x), x)


def log_floor(x: Any, floor: Any) -> Any:
    """ln max(x, floor)."""
    block, above = block_of((x,)), floored(x, floor)
    vector = block is not None and block.lanes > 1 and floor >= _SMALLEST_NORMAL
    return _log_above_floor(above) if vector else log(above)


@_function
def log1p(x: Any) -> Any:
    """ln(1 + x), from u = 1 + x rounded and what the rounding lost."""
    u = 1.0 + x
    return _above_zero(u, _log_of_normal(u, correction=(x - (u - 1.0)) / u))


@_function
def log_sinh(x: Any) -> Any:
    """Return ln sinh(x), x > 0."""
    y = floored(x, 1e-30)
    return y + log(-0.5 * expm1(-2.0 * y))


@_function
def log_cosh(x: Any) -> Any:
    """Return ln cosh(x): ln(1 + (cosh x - 1)) below 1, x - ln 2 + ln(1 + exp(-2 x)) above."""
    y = _magnitude(x)
    small = y < 1.0
    e = expm1(y)
    a = 1.0 + e
    return select(small, 0.0, y - _LN2) + log1p(select(small, e * (e / (2.0 * a)), 1.0 / a / a))


@_function
def log_rise(x: Any) -> Any:
    """ln(1 - exp(-x)), x > 0: ln(-expm1(-x)) below ln 2, log1p(-exp(-x)) above."""
    y = floored(x, 1e-30)
    p, k = _reduced(_bounded(-y, -746.0, 0.0))
    tail = -_scaled(1.0 + p, k)
    u = 1.0 + tail
    far = y > _LN2
    rise = select(far, u, -expm1(-y))
    return _above_zero(rise, _log_of_normal(rise, correction=select(far, (tail - (u - 1.0)) / u, 0.0)))


@_function
def log_tanh(x: Any) -> Any:
    """Return ln tanh(x), x > 0."""
    y = 2.0 * floored(x, 1e-30)
    return log_rise(y) - log1p(exp(-y))


# ---- functions of the C library ------------------------------------------------------------------------------------


def _of_libm(name: str) -> Formula:
    def call(x: Any) -> Any:
        return call_libm(name, x) if isinstance(x, Value) else getattr(math, name)(x)

    return call


asinh, atan, cos, erf, sin = (_of_libm(name) for name in ("asinh", "atan", "cos", "erf", "sin"))


FUNCTIONS = {name: value for name, value in globals().items() if not name.startswith("_")}
"""What printed text calls."""
