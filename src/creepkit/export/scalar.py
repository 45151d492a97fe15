"""The functions of exported Python: their source is copied into the text of every law that needs them.

Each depends on `math` alone and mirrors the function of the same name that kernels use.
"""

from math import copysign, exp, expm1, inf, log, tanh


def log_or_off(x: float) -> float:
    """Natural logarithm; minus infinity at 0, which switches a rate coefficient off."""
    return log(x) if x != 0.0 else -inf


def log_floor(x: float, floor: float) -> float:
    """Natural logarithm of x, or of `floor` where x lies below it."""
    return log(max(x, floor))


def floored(x: float, floor: float) -> float:
    """The larger of x and `floor`."""
    return max(x, floor)


def log_sinh(x: float) -> float:
    """Natural logarithm of sinh(x) for x > 0, which never overflows."""
    x = max(x, 1e-30)
    return x + log(-0.5 * expm1(-2.0 * x))


def coth(x: float) -> float:
    """Hyperbolic cotangent for x > 0."""
    return 1.0 / tanh(max(x, 1e-30))


def exp_difference(a: float, b: float) -> float:
    """Difference exp(a) - exp(b) without cancellation."""
    return copysign(exp(max(a, b)) * -expm1(-abs(a - b)), a - b)


def heaviside(x: float) -> float:
    """1 where x > 0, else 0."""
    return 1.0 if x > 0.0 else 0.0


def absolute(x: float) -> float:
    """Absolute value."""
    return abs(x)


def power(x: float, y: float) -> float:
    """Return x to the y."""
    return float(x**y)
