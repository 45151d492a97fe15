"""Maxima that are differentiated without comparing their arguments: same values, and no time lost."""

import time as clock
from collections.abc import Callable

import numpy as np
import pytest
import sympy

import creepkit as ck
from creepkit.kernels.extremes import Heaviside, Max, Min
from creepkit.language import CreepLaw, strain, stress, time
from helpers.literature_laws import POWER, RATE, A, n

x, y, z = sympy.symbols("x y z", real=True)


@pytest.mark.parametrize(("own", "numpy_function"), [(Max, np.max), (Min, np.min)])
def test_values_and_slopes_are_those_of_the_extreme_argument(own: type, numpy_function: Callable) -> None:
    arguments = (x * y, y + 2, z**2 - x)
    expression = own(*arguments)
    for point in ((1.0, 2.0, 3.0), (4.0, 2.0, 1.0), (0.1, 7.0, 2.0), (-3.0, 1.0, 0.5)):
        at = dict(zip((x, y, z), point, strict=True))
        values = [float(one.subs(at)) for one in arguments]
        chosen = arguments[values.index(numpy_function(values))]
        assert float(expression.subs(at)) == numpy_function(values)
        for symbol in at:
            assert float(expression.diff(symbol).subs(at)) == float(chosen.diff(symbol).subs(at))


def test_duplicates_nested_ones_and_numbers_are_joined() -> None:
    assert Max(x, Max(y, x), 1, 3) == Max(3, x, y)
    assert Min(x, x) == x
    assert (Max(2, 5), Min(2, 5)) == (5, 2)
    assert [Heaviside(sympy.Integer(k)) for k in (-1, 0, 1)] == [0, sympy.S.Half, 1]
    assert Max(x, y).xreplace({x: z}) == Max(y, z)


SHAPES = {
    "a maximum of eight sums": lambda parts: sympy.Max(*parts, evaluate=False),
    "a minimum of eight sums": lambda parts: sympy.Min(*parts, evaluate=False),
    "a maximum of minima": lambda parts: sympy.Max(
        *(sympy.Min(*parts[k : k + 2], evaluate=False) for k in range(0, 8, 2)), evaluate=False
    ),
    "absolute values in a maximum": lambda parts: sympy.Max(*(sympy.Abs(one) for one in parts[:4]), evaluate=False),
    "steps of sums": lambda parts: sympy.Add(*(sympy.Heaviside(one, 0) * one for one in parts[:4])),
    "branches": lambda parts: sympy.Piecewise(
        *((a, b > strain) for a, b in zip(parts[:4], parts[4:], strict=True)), (parts[0], True), evaluate=False
    ),
}


@pytest.mark.parametrize("name", SHAPES)
def test_a_law_of_many_branches_is_exported_in_seconds(name: str) -> None:
    numbers = [1.0 + 0.37 * k for k in range(8)]
    parts = [c * stress**2 - 1.5 * k * stress + sympy.sin(c * stress * time) for k, c in enumerate(numbers)]
    law = CreepLaw("branches", {"t": A * stress**n * SHAPES[name](parts)}, {A: RATE, n: POWER})
    start = clock.process_time()
    for target in ("c", "abaqus", "mfront", "python", "latex"):
        assert ck.export(law, target, {"A": 1e-16, "n": 4.0})
    assert clock.process_time() - start < 30.0
