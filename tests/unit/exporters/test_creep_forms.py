"""Laws are recognised as forms that codes have by their algebra, whatever they are called and however written."""

import math

import mpmath
import pytest
import sympy

from creepkit.errors import ExportError
from creepkit.exporters.creep_forms import CreepForm, creep_forms_of
from creepkit.kernels.multiprecision import MultiprecisionLaw
from creepkit.language import GAS_CONSTANT, State, arrhenius, linear, strain, stress, temperature, time
from creepkit.laws.combined import COMBINED
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.records import LawWithValues, Units
from helpers.creep_form_cases import CASES
from helpers.literature_laws import EQUATIONS, POWER, RATE, A, B, Q, a, k, law, m, n, number, omega, s_0, scale
from helpers.registered_laws import registered_laws

ALL = registered_laws() | EQUATIONS
POINT = (83.0, 0.013, 7.1e4, 1041.0)


def forms(source, **values):
    if not isinstance(source, LawWithValues):
        source = LawWithValues(source, values or source.center())
    return creep_forms_of(source, "The code", "export it as 'abaqus'")


def rate_of(form: CreepForm, s: float, e: float, t: float, T: float) -> mpmath.mpf:
    """The form as its docstring writes it, without a logarithm where mathematics has none."""
    shape = {"power": lambda: s**form.n, "sinh": lambda: mpmath.sinh(s / form.stress_scale) ** form.n}
    f = shape.get(form.stress_function, lambda: mpmath.exp(s / form.stress_scale))()
    return (
        mpmath.exp(form.log_coefficient)
        * f
        * e**form.strain_exponent
        * t**form.time_exponent
        * mpmath.exp(-form.Q / (GAS_CONSTANT * T))
    )


def recognised():
    for name, one in ALL.items():
        try:
            yield name, forms(one)
        except ExportError:
            continue


RECOGNISED = dict(recognised())


def test_the_catalogues_power_laws_and_sines_are_among_those_recognised():
    shipped = {"norton", "strain-hardening", "time-hardening", "hyperbolic-sine", "combined"}
    others = {"Garofalo", "shared parameters", "one term of two parts", "integer powers", "two activated"}
    assert shipped | others <= {*RECOGNISED}


@pytest.mark.parametrize("name", sorted(RECOGNISED))
def test_the_forms_of_a_law_add_up_to_it(name):
    one, (s, e, t, T) = ALL[name], POINT
    exact = mpmath.fsum(MultiprecisionLaw(one).term_and_state_rates([s, e, t, T, s, s / 3], one.center().values()))
    total = mpmath.fsum(rate_of(form, s, e, t, T) for form in RECOGNISED[name])
    assert float(total / exact) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("units", [Units("Pa", "h"), Units("ksi", "day")], ids=str)
@pytest.mark.parametrize("case", sorted(CASES))
def test_forms_in_other_units_are_the_same_rate(case, units):
    s, e, t, T = POINT
    native = mpmath.fsum(rate_of(form, s, e, t, T) for form in forms(CASES[case]))
    there = forms(CASES[case].replace(units=units))
    at = (s / units.megapascals, e, t / units.seconds, T)
    assert float(mpmath.fsum(rate_of(f, *at) for f in there) / units.seconds / native) == pytest.approx(1.0, rel=1e-12)


def test_a_planted_form_is_found_to_the_last_digits():
    written = (
        3 * A * (stress / B) ** n / sympy.sqrt(strain) * time**m / time * sympy.exp(-Q / (GAS_CONSTANT * temperature))
    )
    params = {A: RATE, n: POWER, B: scale(1, 1e3), m: number(0, 1), Q: number(1e5, 5e5)}
    (form,) = forms(law(written, params), A=2e-9, n=4.3, B=37.0, m=0.35, Q=3.1e5)
    assert (form.stress_function, form.n, form.strain_exponent, form.Q) == (
        "power",
        4.3,
        -0.5,
        pytest.approx(3.1e5, rel=1e-14),
    )
    assert form.time_exponent == pytest.approx(-0.65, rel=1e-14)
    assert form.log_coefficient == pytest.approx(math.log(6e-9) - 4.3 * math.log(37.0), rel=1e-14)


@pytest.mark.parametrize(
    ("expression", "B_found"),
    [(sympy.exp(stress / B), 25.0), (10 ** (stress / B), 25.0 / math.log(10)), (sympy.exp(stress) ** (1 / B), 25.0)],
)
def test_exponentials_of_stress_in_any_notation(expression, B_found):
    (form,) = forms(law(A * expression, {A: RATE, B: scale(1, 1e3)}), A=1e-9, B=25.0)
    assert (form.stress_function, form.stress_scale) == ("exponential", pytest.approx(B_found, rel=1e-14))


def test_what_is_switched_off_is_left_out():
    values = COMBINED.center() | {"A_1": 0.0, "A_3": 0.0, "m_1": 0.0}
    (form,) = forms(COMBINED, **values)
    assert (form.label, form.stress_function, form.is_steady) == ("strain hardening", "power", True)


def test_temperature_at_a_number_is_part_of_the_coefficient():
    activated = LawWithValues(NORTON.times(arrhenius(1073.15)), {"A": 1e-9, "n": 4.0, "Q": 3e5})
    (form,), (cold,) = forms(activated), forms(activated.at(1000.0))
    assert cold.Q == 0
    assert cold.log_coefficient == pytest.approx(form.log_coefficient_at(1000.0), rel=1e-13)
    assert form.log_coefficient_at(1073.15) == pytest.approx(math.log(1e-9), rel=1e-13)


CENTERED = {"A": 1e-12, "n": 4.0}


@pytest.mark.parametrize(
    ("source", "values", "reason"),
    [
        (EQUATIONS["threshold"], {}, "which holds 'Max"),
        (EQUATIONS["threshold by branches"], {}, "which holds 'Piecewise"),
        (EQUATIONS["activation volume"], {}, "which holds 'sinh"),
        (EQUATIONS["logarithmic in strain"], {}, "which holds 'exp(-31.6228*strain)'"),
        (EQUATIONS["saturating"], {}, "its coefficient -3.16228e-23 is not positive"),
        (EQUATIONS["tanh"], {}, "which holds 'tanh(0.0316228*stress)'"),
        (EQUATIONS["shifted time"], {}, "which holds 'time + 31.6228'"),
        (
            NORTON.with_temperature(n=linear(1000.0)),
            CENTERED | {"n_T": -0.01},
            "as the exponent '14.0 - 0.01*temperature' of stress is not a number (constants at one temperature may ",
        ),
        (
            law(A * stress * sympy.exp(stress / B), {A: RATE, B: scale(1, 9)}),
            {},
            "stress enters '3.16228e-23*stress*exp(0.333333*stress)' in several ways",
        ),
        (
            law(A * sympy.sinh(-stress / B), {A: RATE, B: scale(1, 9)}),
            {},
            "its coefficient -3.16228e-23 is not positive",
        ),
        (law(A * stress**n / temperature, {A: RATE, n: POWER}), {}, "which holds 'temperature'"),
    ],
)
def test_what_is_no_form_is_refused_with_the_factor_that_is_to_blame(source, values, reason):
    with pytest.raises(ExportError) as error:
        forms(source, **values)
    told = str(error.value)
    assert told.startswith(f"law '{source.name}', term '{next(iter(source.terms))}': The code has no form for it, ")
    assert reason in told
    assert told.endswith("; export it as 'abaqus'")


def test_internal_variables_are_refused_even_where_no_term_shows_them():
    grows = law(A * stress**n, {A: RATE, n: POWER, k: POWER}, states={omega: State(0, A * stress**k, limit=0.99)})
    with pytest.raises(ExportError, match="The code has no internal variable such as 'omega'; export it as 'abaqus'"):
        forms(grows)


def test_values_decide_and_not_names():
    """A law called norton that hardens is no Norton law, and one that softens to nothing is one."""
    (form,) = forms(STRAIN_HARDENING.rename("norton"), A=1e-12, n=4.0, m=-0.2)
    assert form.strain_exponent == -0.2
    assert a != s_0
