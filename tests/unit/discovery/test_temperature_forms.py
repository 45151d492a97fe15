"""Temperature forms against the functions they stand for."""

import numpy as np
import pytest
import sympy

import creepkit as ck
from creepkit.discovery.forms import candidate_forms, law_with_forms
from creepkit.kernels import lower
from creepkit.language import (
    GAS_CONSTANT,
    boltzmann,
    curved,
    logarithmic,
    modified_arrhenius,
    t_log_t,
    temperature,
    wachtman_form,
)
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from helpers.literature_laws import EQUATIONS

T_REF = 1000.0
EVERY = (boltzmann, curved, logarithmic, modified_arrhenius, t_log_t, wachtman_form)
WARM = np.array([850.0, 950.0, 1000.0, 1050.0, 1200.0])


def value(form, law=NORTON, parameter="n", **numbers):
    """The parameter's values at WARM under a form with these numbers."""
    expression, extra = form.build(law.symbol(parameter), law.table[parameter])
    assert {s.name for s in extra} | {parameter} == set(numbers)
    known = {sympy.Symbol(name, real=True): v for name, v in numbers.items()}
    return np.array([float(expression.subs({**known, temperature: T})) for T in WARM])


def left_over(values, *functions):
    """What a straight sum of functions of temperature cannot follow, relative."""
    columns = np.stack([f(WARM) for f in functions], axis=1)
    columns /= np.linalg.norm(columns, axis=0)
    return np.abs(values - columns @ np.linalg.lstsq(columns, values, rcond=None)[0]).max() / np.abs(values).max()


# ---- closed forms --------------------------------------------------------------------------------------------------


def test_straight_lines_in_ln_t_and_t_ln_t():
    T = WARM
    assert np.allclose(value(logarithmic(T_REF), n=4.0, n_L=-6.0), 4.0 - 6.0 * np.log(T / T_REF), rtol=1e-12)
    expected = 4.0 - 0.7 * (T * np.log(T) - T_REF * np.log(T_REF)) / 1000
    assert np.allclose(value(t_log_t(T_REF), n=4.0, n_TL=-0.7), expected, rtol=1e-12)


def test_on_a_log_scale_a_straight_line_in_ln_t_is_a_power():
    found = value(logarithmic(T_REF), HYPERBOLIC_SINE, "B", B=80.0, B_L=-2.5)
    assert np.allclose(found, 80.0 * (WARM / T_REF) ** -2.5, rtol=1e-12)


def test_exponentials_of_reciprocal_temperature():
    n, slope, T0 = 4.0, 2e-3, 6000.0
    found = value(boltzmann(T_REF), n=n, n_E=slope, n_T0=T0)
    b = slope * T_REF**2 / T0 / np.exp(-T0 / T_REF)
    assert np.allclose(found, n + b * (np.exp(-T0 / WARM) - np.exp(-T0 / T_REF)), rtol=1e-12)
    found = value(wachtman_form(T_REF), n=n, n_W=slope, n_T0=T0)
    b = slope / (np.exp(-T0 / T_REF) * (1 + T0 / T_REF))
    assert np.allclose(found, n + b * (WARM * np.exp(-T0 / WARM) - T_REF * np.exp(-T0 / T_REF)), rtol=1e-12)


def test_forms_of_two_terms_span_what_they_say():
    found = value(curved(T_REF), n=4.0, n_T=-3e-3, n_C=2e-2)
    assert left_over(found, np.ones_like, lambda T: T, lambda T: 1 / T) < 1e-10
    assert left_over(found, np.ones_like, lambda T: T) > 1e-3
    found = value(modified_arrhenius(T_REF), NORTON, "A", A=1e-15, Q_A=4e5, A_B=50.0)
    assert left_over(np.log(found), np.ones_like, lambda T: 1 / T, np.log) < 1e-10
    one = value(modified_arrhenius(T_REF), NORTON, "A", A=1e-15, Q_A=4e5, A_B=0.0)
    assert np.allclose(one, 1e-15 * np.exp(-4e5 / GAS_CONSTANT * (1 / WARM - 1 / T_REF)), rtol=1e-10)


# ---- every form ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", EVERY, ids=lambda f: f.__name__)
@pytest.mark.parametrize("parameter", ["A", "n", "B"])
def test_a_parameter_keeps_its_value_at_the_reference_temperature(form, parameter):
    law = HYPERBOLIC_SINE.with_temperature(**{parameter: form(T_REF)})
    values = law.center() | {"A": 1e-9, "n": 3.0, "B": 60.0}
    plain = {name: values[name] for name in HYPERBOLIC_SINE.names}
    expected = float(lower(HYPERBOLIC_SINE, "numpy").rate(plain, stress=70.0))
    assert float(lower(law, "numpy").rate(values, stress=70.0, temperature=T_REF)) == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("form", EVERY, ids=lambda f: f.__name__)
def test_bounds_let_a_parameter_move_by_half_its_range_in_a_hundred_kelvin(form):
    """At its bound a slope moves n, whose range is 7, by 3.5 in 100 K."""
    expression, extra = form(T_REF).build(NORTON.symbol("n"), NORTON.table["n"])
    first = next(s for s in extra if not s.name.endswith("T0"))
    rest = {s: (300.0 if s.name.endswith("T0") else 0.0) for s in extra if s != first}
    slope = sympy.diff(expression.subs(rest), temperature).subs({temperature: T_REF, first: extra[first].bounds[1]})
    assert abs(float(slope)) == pytest.approx(7.0 / 200.0, rel=1e-6)


def test_energies_of_creep_and_of_damage_have_names_of_their_own():
    """As those of law.times(arrhenius()): Q of the rate of creep, Q_B of that of damage."""
    law, T = EQUATIONS["Kachanov-Rabotnov"], np.array([850.0, 900.0, 950.0])
    forms = [candidate_forms(law, name, True, 900.0, T, ["arrhenius"])[0] for name in ("A", "B")]
    assert [form.parameter_names for form in forms] == [("A", "Q"), ("B", "Q_B")]
    assert set(law_with_forms(law, forms).names) == set(law.times(ck.arrhenius(T_ref=900.0)).names)
