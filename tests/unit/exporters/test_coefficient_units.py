"""Units of rate coefficients in the heads of exported texts, by dimensional analysis."""

import pytest

import creepkit as ck
from creepkit.exporters.law_description import coefficient_unit


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


def test_a_subroutine_states_it():
    law = ck.law_with_values(ck.law("norton"), {"A": 1e-12, "n": 4.0}, elastic=ck.Elastic(150e3, 0.3))
    head = " ".join(ck.export(law, "abaqus").replace("!", " ").split())
    assert "(MPa^-n s^-1 for stress in MPa and time in s)" in head
