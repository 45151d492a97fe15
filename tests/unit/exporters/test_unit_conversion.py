"""Degrees of rates, units of rate coefficients and converted values, against the factor by which rates change."""

import mpmath
import pytest
import sympy

import creepkit as ck
from creepkit.errors import ExportError
from creepkit.exporters.unit_conversion import coefficient_unit, convert_values, degree
from creepkit.kernels.multiprecision import MultiprecisionLaw
from creepkit.records import LawWithValues, Units
from creepkit.registry import default_registry
from helpers.literature_laws import EQUATIONS

x, y, n, a = sympy.symbols("x y n a", positive=True)
SCALED = [
    3 * x**n * y**-2,
    (x**2 + a * x * y) ** n,
    sympy.exp(x / y) * x,
    x ** (n + sympy.exp(-x / y)),
    sympy.Piecewise((x, x > y), (2 * y, True)),
    sympy.Heaviside(x - y) * x * y,
    sympy.Max(x - y, 0) ** n,
    sympy.Integer(4),
]
UNITS = Units("Pa", "h")


def test_a_rate_changes_by_that_power_of_the_factor_and_others_have_none():
    at = {x: 1.3, y: 0.7, n: 3.2, a: 2.0}
    for expression in SCALED:
        found = degree(expression, {x: 1, y: 1})
        assert found is not None, expression
        ratio = expression.subs({x: 1.7 * x, y: 1.7 * y}, simultaneous=True).subs(at) / expression.subs(at)
        assert float(ratio) == pytest.approx(1.7 ** float(found.subs(at)), rel=1e-12), expression
    for expression in (x + x**2, sympy.exp(x), 1 + x, n**x, sympy.sin(x * y)):
        assert degree(expression, {x: 1, y: 1}) is None, expression


@pytest.mark.parametrize(
    ("law", "name", "unit"),
    [
        (ck.law("norton"), "A", "MPa^-n s^-1"),
        (ck.law("time-hardening"), "A", "MPa^-n s^-(m + 1)"),
        (ck.law("combined"), "A_3", "MPa^-n_3 s^-(m_2 + 1)"),
        (ck.law("norton").fix(n=4.0), "A", "MPa^-4 s^-1"),
        (ck.law("norton").times(ck.arrhenius()), "A", "MPa^-n s^-1"),
        (ck.law("hyperbolic-sine"), "A", ""),  # sinh of a stress over a stress: 1/s
        (ck.law("norton").with_temperature(n=ck.linear()), "A", ""),  # none: the exponent differs with temperature
    ],
)
def test_the_unit_of_a_rate_coefficient(law, name, unit):
    assert coefficient_unit(law, name) == unit
    if name == "A" and unit == "MPa^-n s^-1":
        head = " ".join(ck.export(LawWithValues(law, law.center()), "abaqus").replace("!", " ").split())
        assert f"({unit} for stress in MPa and time in s)" in head


def test_converted_values_give_the_same_rates():
    """At 300 MPa, above the threshold of laws that have one, and at 40 MPa."""
    laws = {**{name: one.value for name, one in default_registry().laws().items()}, **EQUATIONS}
    bad, converted = [], 0
    for name, law in laws.items():
        source = LawWithValues(law, law.center(), units=UNITS)
        try:
            values = convert_values(source).values
        except ExportError:
            continue
        exact, converted = MultiprecisionLaw(law), converted + 1
        states = [state.initial + 0.1 for state in law.states.values()]
        for stress, strain, time in ((300.0, 1e-3, 7.2e4), (40.0, 0.02, 3.6e6)):
            native = [stress, strain, time, 1073.0, stress, stress / 3, *states]
            other = [1e6 * stress, strain, time / 3600, 1073.0, 1e6 * stress, 1e6 * stress / 3, *states]
            pairs = zip(
                exact.term_and_state_rates(native, [*source.values.values()]),
                exact.term_and_state_rates(other, [values[n] for n in law.names]),
                strict=True,
            )
            bad += [f"{name}: {b} for {a}" for a, b in pairs if abs(b - 3600 * a) > 1e-10 * mpmath.mpf(3600) * abs(a)]
    assert not bad, "\n".join(bad)
    assert converted > 20
