"""The lowering pass: logarithms of terms, stable functions on every target, differences of exponentials."""

from typing import Any

import mpmath
import numpy as np
import pytest
import sympy
import torch
from sympy import Piecewise, exp, gamma, sinh

from creepkit.errors import LawError
from creepkit.kernels import kernel_functions, llvm_functions, numpy_functions, scalar_functions, torch_functions
from creepkit.kernels.kernel_functions import (
    TARGET_FUNCTION_NAMES,
    ExpDifference,
    Expm1,
    LogFloor,
    LogRise,
    LogSinh,
    StableFunction,
)
from creepkit.kernels.log_form import FLOOR, log_form, with_exponential_differences
from creepkit.language import parameters, strain, stress, time
from helpers.compiled_functions import compiled_function
from helpers.literature_laws import POWER, RATE, A, B, law, m, n, number, r, scale

x, y = sympy.symbols("x y", real=True)
ln_A, ln_B = sympy.symbols("ln_A ln_B", real=True)
FUNCTIONS = [
    f
    for f in vars(kernel_functions).values()
    if isinstance(f, type) and issubclass(f, StableFunction) and f != StableFunction
]
ONE_ARGUMENT = [f for f in FUNCTIONS if len(f.partial_derivatives) == 1]


def evaluated(function: type[StableFunction], value: float, target: str) -> float:
    name = TARGET_FUNCTION_NAMES[function.__name__]
    if target == "torch":
        return float(getattr(torch_functions, name)(torch.tensor(value, dtype=torch.float64)))
    if target == "scalar":
        return float(getattr(scalar_functions, name)(value))
    if target.startswith("llvm"):
        count = 8 if target == "llvm vectors" else 1
        return float(compiled_function(getattr(llvm_functions, name))(np.full(count, value))[0])
    return float(getattr(numpy_functions, name)(np.float64(value)))


# ---- stable functions ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda f: f.__name__)
@pytest.mark.parametrize("at", [(1e-3, 2.0), (0.7, 0.7001), (40.0, 3.0)])
def test_slopes_are_those_of_the_plain_forms(function: type[StableFunction], at: tuple[float, float]) -> None:
    """The floors, where there are any, lie below the points."""
    arguments = (x, y) if function is ExpDifference else (x, sympy.Float(1e-30))[: len(function.partial_derivatives)]
    values = dict(zip((x, y), at, strict=True))

    for argument in (x, y)[: 2 if function is ExpDifference else 1]:
        slope = kernel_functions.in_sympy_functions(sympy.diff(function(*arguments), argument))
        plain = sympy.diff(function.sympy_form(*arguments), argument)
        assert abs(slope.evalf(60, subs=values) / plain.evalf(60, subs=values) - 1) < 1e-14


@pytest.mark.parametrize("target", ["numpy", "torch", "scalar", "llvm", "llvm vectors"])
@pytest.mark.parametrize("function", ONE_ARGUMENT, ids=lambda f: f.__name__)
def test_values_keep_their_digits_from_tiny_to_huge_arguments(function: type[StableFunction], target: str) -> None:
    with mpmath.workdps(400):
        exact = sympy.lambdify(x, function.sympy_form(x), "mpmath")
        for value in (1e-12, 1e-3, 0.5, 3.0, 40.0, 300.0):
            true, got = exact(mpmath.mpf(value)), evaluated(function, value, target)
            near_zero = function is LogSinh and value == 0.5  # ln sinh passes through 0 at 0.88
            assert abs(mpmath.mpf(got) / true - 1) < (1e-14 if near_zero else 2e-15), value


@pytest.mark.parametrize("functions", [numpy_functions, torch_functions, scalar_functions], ids=lambda f: f.__name__)
@pytest.mark.parametrize(("a", "b"), [(-1e-9, -3e-9), (-2.0, -2.0), (-1.0, -1000.0), (-1000.0, -1.0), (3.0, 2.999)])
def test_exp_difference_keeps_its_digits(functions: Any, a: float, b: float) -> None:
    given = torch.tensor([a, b], dtype=torch.float64) if functions is torch_functions else (a, b)
    got = functions.exp_difference(*given)

    with mpmath.workdps(40):
        true = mpmath.exp(mpmath.mpf(a)) - mpmath.exp(mpmath.mpf(b))
    assert float(got) == pytest.approx(float(true), rel=1e-15, abs=0)


# ---- differences of exponentials -----------------------------------------------------------------------------------


def test_sums_that_vanish_as_a_whole_are_paired_and_others_stay() -> None:
    total = y + (2 - y) * exp(-x)
    assert with_exponential_differences(total) == total
    assert with_exponential_differences(1 - exp(-x)) == -Expm1(-x)
    assert with_exponential_differences(y * exp(-x) - y * exp(-2 * x)) in (
        y * ExpDifference(-x, -2 * x),
        -y * ExpDifference(-2 * x, -x),
    )


# ---- logarithms of terms -------------------------------------------------------------------------------------------


def test_a_product_of_powers_becomes_a_sum_and_functions_that_overflow_have_logarithms() -> None:
    form = log_form(law(A * stress**n * strain**m, {A: RATE, n: POWER, m: number(-1, 0)}))

    (term,) = form.terms
    assert term == ln_A + n * LogFloor(stress, sympy.Float(FLOOR)) + m * LogFloor(strain, sympy.Float(FLOOR))
    assert form.theta == (ln_A, n, m)
    assert form.coefficients == ((0,),)
    term = A * sinh(stress / B) * (exp(stress / B) - 1) * (1 - exp(-r * time))
    (found,) = log_form(law(term, {A: RATE, B: scale(1, 10), r: number(0.1, 1)})).terms
    ratio = stress * exp(-ln_B)

    assert found == ln_A + LogSinh(ratio) + ratio + LogRise(ratio) + LogRise(r * time)


def test_a_branch_that_is_zero_does_not_hide_the_coefficient() -> None:
    form = log_form(law(Piecewise((A * stress**n, stress > 10), (0, True)), {A: RATE, n: POWER}))

    assert form.coefficients == ((0,),)


def test_the_name_of_a_logarithm_gives_way_to_a_parameter_of_that_name() -> None:
    (taken,) = parameters("ln_A")
    form = log_form(law(A * taken * stress**n, {A: RATE, taken: number(1, 2), n: POWER}))
    assert [s.name for s in form.theta] == ["ln_A_", "ln_A", "n"]


# ---- what has no kernel --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("term", "message"),
    [
        (A * stress**n * gamma(B), r"term 'term': the function gamma in gamma\(B\) has no kernel; allowed are Abs, "),
        (A * Piecewise((stress**n / B, stress < 100)), r"the last branch of .* write \(\.\.\., True\)"),
        (-A * stress**n / B, r"term 'term': -A\*stress\*\*n/B is negative, and a rate is not; write recovery"),
    ],
)
def test_a_law_without_a_kernel_says_why_in_one_sentence(term: sympy.Expr, message: str) -> None:
    foreign = law(term, {A: RATE, n: POWER, B: scale(1, 4)})

    with pytest.raises(LawError, match=message):
        log_form(foreign)
