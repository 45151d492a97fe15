"""Functions of compiled kernels against mpmath, in units of the last place, as vectors and as single numbers."""

import itertools
import math
from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest

from creepkit.arrays import Floats
from creepkit.kernels import llvm_functions, numpy_functions
from helpers.compiled_functions import compiled_function

POINTS = 400
RNG = np.random.default_rng(0)


def powers(low: float, high: float) -> Floats:
    """Numbers of both sizes, evenly spread in their logarithm."""
    return 10.0 ** RNG.uniform(low, high, POINTS)


def uniform(low: float, high: float) -> Floats:
    return RNG.uniform(low, high, POINTS)


WIDE = np.concatenate([uniform(-710.4, 710.4), uniform(-1, 1), powers(-300, 0), uniform(15, 30)])
POSITIVE = np.concatenate([powers(-29, 2.8), uniform(0, 3), uniform(0.5, 1.5)])
ARGUMENTS = {
    "exp": np.concatenate([uniform(-745, 709.7), uniform(-1, 1), -powers(-300, 0), uniform(-745.1, -708)]),
    "log": np.concatenate([
        *(powers(-307, 308), uniform(0.5, 2), uniform(0.999, 1.001), powers(-323, -308)),
        *(1 + 0.5 ** np.arange(1, 53), 1 - 0.5 ** np.arange(1, 54)),
    ]),
    "expm1": np.concatenate([uniform(-40, 709.7), uniform(-1, 1), powers(-300, 0), -powers(-300, 0)]),
    "log1p": np.concatenate([powers(-300, 300), uniform(-1, 2), -powers(-300, -0.01)]),
    **dict.fromkeys(("sinh", "cosh", "tanh"), WIDE),
    **dict.fromkeys(("coth", "log_cosh", "log_rise", "log_tanh"), POSITIVE),
}  # fmt: skip
EXACT: dict[str, Callable[[Any], Any]] = {
    **{name: getattr(mpmath, name) for name in ("exp", "log", "expm1", "log1p", "sinh", "cosh", "tanh", "coth")},
    "log_cosh": lambda x: mpmath.log(mpmath.cosh(x)),
    "log_rise": lambda x: mpmath.log(-mpmath.expm1(-x)),
    "log_tanh": lambda x: mpmath.log(mpmath.tanh(x)),
}
WORST = {"exp": 2.0, "log": 2.0, "log1p": 2.0}
"""Units of the last place; 4 for the others."""


@pytest.mark.parametrize("size", [8, 1], ids=["vectors", "numbers"])
@pytest.mark.parametrize("name", ARGUMENTS)
def test_functions_are_exact_to_a_few_units_of_the_last_place(name: str, size: int) -> None:
    function, x = compiled_function(getattr(llvm_functions, name)), ARGUMENTS[name]
    x = x[: x.size // 8 * 8]

    found = np.concatenate([function(part) for part in x.reshape(-1, size)])

    with mpmath.workdps(400):
        exact = [EXACT[name](mpmath.mpf(float(v))) for v in x]
        error = [
            float(abs(mpmath.mpf(float(v)) - e) / mpmath.mpf(float(np.spacing(abs(float(e))))))
            for v, e in zip(found, exact, strict=True)
        ]
    worst = int(np.argmax(error))
    assert error[worst] <= WORST.get(name, 4.0), x[worst]


@pytest.mark.parametrize("size", [8, 1], ids=["vectors", "numbers"])
@pytest.mark.parametrize("name", ["exp", "log", "expm1", "log1p", "sinh", "cosh", "tanh", "asinh", "atan", "sqrt"])
def test_the_ends_of_the_doubles_are_those_of_numpy(name: str, size: int) -> None:
    x = [0.0, -0.0, np.inf, -np.inf, np.nan, -1.0, -5e-324, 5e-324, 800.0, -800.0, 709.782712893384, 709.7827128933841]
    x += [-745.2, -745.1, -708.5, 1e300, -1e300, 2.0**-1022, 1.7976931348623157e308, -0.5, 36.0, -36.0, 1.0, -2.0]
    with np.errstate(all="ignore"):
        expected = getattr(np, {"asinh": "arcsinh", "atan": "arctan"}.get(name, name))(np.array(x))

    function = compiled_function(getattr(llvm_functions, name))
    found = np.concatenate([function(part) for part in np.array(x).reshape(-1, size)])

    same = (found == expected) | (np.isnan(found) & np.isnan(expected))
    with np.errstate(invalid="ignore"):
        assert (same | (abs(found - expected) <= 4 * np.spacing(abs(expected)))).all()


@pytest.mark.parametrize("size", [8, 1], ids=["vectors", "numbers"])
@pytest.mark.parametrize(
    "name", ["exp_difference", "larger", "smaller", "power 3", "power -4.5", "power 0.3", "power -70"]
)
def test_functions_of_two_arguments_are_those_of_numpy(name: str, size: int) -> None:
    values = [-np.inf, -1000.0, -2.0, -2.0 + 1e-15, 0.0, 1e-9, 3.0, 1000.0, np.inf, np.nan]
    if name == "power -4.5":  # the root of minus infinity is NaN here
        values.remove(-np.inf)
    pairs = np.array(list(itertools.product(values, values)) + 7 * [(1.0, 2.0)])
    pairs = pairs[: len(pairs) // 8 * 8]
    kind, _, exponent = name.partition(" ")

    def formula(functions: Any) -> Callable[..., Any]:
        function = getattr(functions, kind)
        return (lambda a, b: function(a, float(exponent))) if exponent else function

    with np.errstate(all="ignore"):
        expected = formula(numpy_functions)(*pairs.T.copy())

    function = compiled_function(formula(llvm_functions), arguments=2)
    found = np.concatenate([function(*part.T) for part in pairs.reshape(-1, size, 2)])

    np.testing.assert_allclose(found, expected, rtol=4e-15)


def test_constants_are_evaluated_at_once() -> None:
    assert llvm_functions.exp(2.0) == math.exp(2.0)
    assert llvm_functions.power(2.0, 3.0) == 8.0
    assert llvm_functions.choose(llvm_functions.both(True, False), 1.0, 2.0) == 2.0
