"""The degree of rates, against its definition: the factor by which they change."""

import pytest
import sympy

from creepkit.exporters.homogeneity import degree

x, y, n, a = sympy.symbols("x y n a", positive=True)


@pytest.mark.parametrize(
    "expression",
    [
        3 * x**n * y**-2,
        (x**2 + a * x * y) ** n,
        sympy.exp(x / y) * x,
        x ** (n + sympy.exp(-x / y)),
        sympy.Piecewise((x, x > y), (2 * y, True)),
        sympy.Heaviside(x - y) * x * y,
        sympy.Integer(4),
    ],
)
def test_a_rate_changes_by_that_power_of_the_factor(expression: sympy.Expr) -> None:
    found = degree(expression, {x: 1, y: 1})
    assert found is not None
    at = {x: 1.3, y: 0.7, n: 3.2, a: 2.0}
    ratio = expression.subs({x: 1.7 * x, y: 1.7 * y}, simultaneous=True).subs(at) / expression.subs(at)
    assert float(ratio) == pytest.approx(1.7 ** float(found.subs(at)), rel=1e-12)


@pytest.mark.parametrize("expression", [x + x**2, sympy.exp(x), 1 + x, n**x, sympy.sin(x * y)])
def test_other_rates_have_none(expression: sympy.Expr) -> None:
    assert degree(expression, {x: 1, y: 1}) is None
