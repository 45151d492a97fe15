"""The algebra of laws: results are ordinary laws whose rates are what pencil and paper give."""

import math

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

import creepkit as ck
from creepkit.errors import LawError
from creepkit.language import (
    GAS_CONSTANT,
    CreepLaw,
    Param,
    State,
    activated,
    arrhenius,
    exponential,
    inverse_temperature,
    linear,
    parameters,
    states,
    strain,
    stress,
    temperature,
    time,
)
from creepkit.laws.combined import COMBINED
from creepkit.laws.drifting_exponent import DRIFTING_EXPONENT
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING

POINT = {stress: 120.0, strain: 0.013, time: 3.6e4, temperature: 1123.15}


def rate(law, point=POINT, **values):
    """The rate of a law at a point, 1/s, from its expression."""
    numbers = {symbol: values[symbol.name] for symbol in law.params}
    return float(law.rate.subs({**point, **numbers}))


# ---- addition ------------------------------------------------------------------------------------------------------


def test_the_combined_law_is_equation_2_of_the_paper():
    assert COMBINED.names == ("A_1", "n_1", "B", "A_2", "n_2", "m_1", "A_3", "n_3", "m_2")
    values = dict(A_1=1e-9, n_1=2, B=80, A_2=2e-17, n_2=4, m_1=-0.3, A_3=3e-15, n_3=3, m_2=-0.4)
    expected = 1e-9 * math.sinh(120 / 80) ** 2 + 2e-17 * 120**4 * 0.013**-0.3 + 3e-15 * 120**3 * 3.6e4**-0.4
    assert rate(COMBINED, **values) == pytest.approx(expected, rel=1e-13)


def _letters(names):
    symbols = parameters(" ".join(names))
    exponent = Param("exponent", bounds=(1, 8))
    term = sympy.Mul(*(stress**s for s in symbols))
    return CreepLaw("trial", {"power law": term}, dict.fromkeys(symbols, exponent))


NAMES = st.lists(st.sampled_from(["A", "A_1", "A_2", "A_3", "n", "n_0", "n_inf", "n_2"]), min_size=1, unique=True)


@given(NAMES, NAMES, NAMES)
@settings(max_examples=60, deadline=None)
def test_addition_is_associative_whatever_the_names(a, b, c):
    a, b, c = _letters(a), _letters(b), _letters(c)
    left, right = (a + b) + c, a + (b + c)
    assert left.names == right.names
    assert list(left.terms.items()) == list(right.terms.items())


def test_addition_renames_internal_variables_and_what_mentions_them():
    A, n = parameters("A n")
    (omega,) = states("omega")
    table = {A: NORTON.table["A"], n: NORTON.table["n"]}
    damage = CreepLaw(
        "damage",
        {"creep": A * (stress / (1 - omega)) ** n},
        table,
        states={omega: State(0.1, A * stress, limit=1.0)},
        constraints=(n >= 0,),
    )
    twice = damage + damage
    assert [s.name for s in twice.states] == ["omega_1", "omega_2"]
    (first, second) = twice.states.values()
    assert str(first.rate) == "A_1*stress"
    assert str(second.rate) == "A_2*stress"
    assert [str(c) for c in twice.constraints] == ["n_1 >= 0", "n_2 >= 0"]


# ---- taking away ---------------------------------------------------------------------------------------------------


def test_only_and_without_are_two_ways_of_saying_the_same():
    kept = COMBINED.only("strain hardening", "time hardening")
    dropped = COMBINED.without("hyperbolic sine")
    assert kept == dropped
    assert kept.names == ("A_2", "n_2", "m_1", "A_3", "n_3", "m_2")


def test_fixing_a_rate_coefficient_at_zero_drops_its_term_and_parameters():
    reduced = COMBINED.fix(A_2=0)
    assert list(reduced.terms) == ["hyperbolic sine", "time hardening"]
    assert reduced.names == ("A_1", "n_1", "B", "A_3", "n_3", "m_2")


def test_fixing_the_exponent_of_sinh_at_zero_drops_the_breakdown_stress():
    assert HYPERBOLIC_SINE.fix(n=0).names == ("A",)


def test_fixing_what_a_constraint_mentions_fixes_it_there_too():
    fixed = DRIFTING_EXPONENT.fix(n_0=4, n_inf=4, C=0)
    assert fixed.names == ("A", "m")
    assert fixed.constraints == ()


def test_values_that_break_a_constraint_are_refused():
    law = NORTON.with_temperature(n=linear(1000.0)).fix(n=1, n_T=-0.03)
    assert law.at(1010.0).names == ("A",)
    with pytest.raises(LawError, match=r"its constraint .* >= 0 cannot hold for .*@1300K"):
        law.at(1300.0)


def test_an_internal_variable_that_nothing_needs_goes():
    A, B = parameters("A B")
    (omega,) = states("omega")
    coefficient = NORTON.table["A"]
    law = CreepLaw(
        "two", {"a": A * stress, "b": B * (1 + omega)}, {A: coefficient, B: coefficient}, states={omega: State(0, B)}
    )
    assert not law.without("b").states
    assert law.without("a").states == law.states


# ---- temperature ---------------------------------------------------------------------------------------------------


def test_arrhenius_is_one_at_its_reference_and_falls_as_boltzmann_says():
    law = NORTON.times(arrhenius(T_ref=1073.15))
    values = dict(A=1e-16, n=5.0, Q=4e5)
    at_reference = rate(law, {**POINT, temperature: 1073.15}, **values)
    assert at_reference == pytest.approx(1e-16 * 120**5, rel=1e-14)
    expected = math.exp(-4e5 / 8.314462618 * (1 / 1123.15 - 1 / 1073.15))
    assert rate(law, **values) / at_reference == pytest.approx(expected, rel=1e-12)
    assert GAS_CONSTANT == 8.314462618


def test_at_gives_the_rate_at_that_temperature():
    law = COMBINED.times(arrhenius()).with_temperature(n_1=linear())
    values = {**law.center(), "A_1": 1e-9, "n_1_T": -0.01}
    cold = law.at(1123.15)
    assert not cold.uses(temperature)
    assert rate(cold, **{name: values[name] for name in cold.names}) == pytest.approx(rate(law, **values), rel=1e-12)


FORMS = {
    "linear": (linear(1000.0), "n", "n_T", lambda p, q: p + q * (1123.15 - 1000)),
    "inverse": (inverse_temperature(1000.0), "n", "n_I", lambda p, q: p + q * (1000 / 1123.15 - 1)),
}


@pytest.mark.parametrize("name", FORMS)
def test_forms_of_an_exponent(name):
    form, param, slope, closed = FORMS[name]
    law = NORTON.with_temperature(**{param: form})
    assert law.names == ("A", "n", slope)
    exponent = closed(5.0, 0.004)
    assert rate(law, A=1e-16, n=5.0, **{slope: 0.004}) == pytest.approx(1e-16 * 120**exponent, rel=1e-12)
    reference = rate(law, {**POINT, temperature: 1000.0}, A=1e-16, n=5.0, **{slope: 0.004})
    assert reference == pytest.approx(1e-16 * 120**5, rel=1e-13)


def test_forms_of_a_positive_parameter():
    law = HYPERBOLIC_SINE.with_temperature(B=activated(1000.0), A=exponential(1000.0))
    assert law.names == ("A", "A_T", "n", "B", "Q_B")
    B = 80 * math.exp(-2e4 / 8.314462618 * (1 / 1123.15 - 1 / 1000))
    expected = 1e-9 * math.exp(0.01 * 123.15) * math.sinh(120 / B) ** 2
    assert rate(law, A=1e-9, A_T=0.01, n=2, B=80, Q_B=2e4) == pytest.approx(expected, rel=1e-12)


def test_a_constraint_follows_its_parameter_into_temperature():
    law = DRIFTING_EXPONENT.with_temperature(n_inf=linear(1000.0))
    drift = {s for relation in law.constraints for s in relation.free_symbols}
    assert {"n_inf", "n_inf_T", "temperature"} <= {s.name for s in drift}
    values = {**law.center(), "n_0": 1.0, "n_inf": 1.0, "C": 0.0, "n_inf_T": -0.03}
    late = {**POINT, time: 1e6, **{s: values[s.name] for s in law.params}}
    assert any(relation.subs(late) == sympy.false for relation in law.constraints)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda: NORTON.fix(**{"A": 0}), "no term is left"),
        (lambda: NORTON.fix(**{"n": 9}), r"cannot fix n = 9; allowed are 1 to 8 or 0 \(off\)"),
        (lambda: NORTON.fix(**{"n": float("nan")}), "cannot fix n = nan"),
        (lambda: NORTON.fix(**{"n": "five"}), "parameter 'n': 'five' is not a number"),
        (lambda: NORTON.fix(**{"k": 1}), "has no parameter 'k'"),
        *((lambda T=T: NORTON.times(arrhenius()).at(T), "temperature") for T in (0, -5, 2e4)),
        (lambda: NORTON.with_temperature(A=linear()), "has a log scale: use activated"),
        (lambda: NORTON.with_temperature(A=inverse_temperature()), "has a log scale: use activated"),
        (lambda: NORTON.with_temperature(n="linear"), "n needs a form such as linear"),
        (lambda: NORTON.with_temperature(n=linear()).with_temperature(n=linear()), "depends on temperature twice"),
        (lambda: NORTON.with_temperature(q=linear()), "has no parameter 'q'"),
        (lambda: NORTON.times(linear()), r"times\(\) takes a factor"),
        (lambda: arrhenius(T_ref=-3), "T_ref = -3 is not a temperature in K"),
    ],
)
def test_what_cannot_be_meant_is_explained(wrong, message):
    with pytest.raises(LawError, match=message):
        wrong()


def test_bounds_are_changed_and_nothing_else() -> None:
    law = HYPERBOLIC_SINE.with_bounds(n=(3, 6))

    assert law.table["n"].bounds == (3, 6)
    assert law.table["A"] == HYPERBOLIC_SINE.table["A"]
    assert (law.name, law.fingerprint) == (HYPERBOLIC_SINE.name, HYPERBOLIC_SINE.fingerprint)
    assert HYPERBOLIC_SINE.with_bounds() is HYPERBOLIC_SINE
    with pytest.raises(LawError, match="has no parameter 'nn': did you mean 'n'"):
        HYPERBOLIC_SINE.with_bounds(nn=(3, 6))


# ---- temperature factors ---------------------------------------------------------------------------------------------

# Which rates an Arrhenius factor multiplies: by how much each rate rises between two temperatures.


A, n, h, r, D, c = parameters("A n h r D c")
H, w = states("H w")
RATE = Param("rate coefficient", bounds=(1e-40, 1e-5), unit="1/s", scale="log", off=0.0)
NUMBER = Param("number", bounds=(0.1, 10))
TABLE = {A: RATE, n: NUMBER, h: NUMBER, r: RATE, D: RATE, c: NUMBER}
CREEP = A * (stress * (1 - H)) ** n
T_REF, T, HOT = 1000.0, 1010.0, 1030.0
ENERGIES = {"Q": 3e5, "Q_r": 2e5, "Q_D": 1.5e5, "Q_H": 1e5, "Q_2": 5e4}
VALUES = {"A": 1e-12, "n": 3.0, "h": 2.0, "r": 1e-6, "D": 1e-7, "c": 0.5} | ENERGIES


def law(growth, term=CREEP):
    used = set(sympy.sympify(term).free_symbols | sympy.sympify(growth).free_symbols)
    table = {s: p for s, p in TABLE.items() if s in used}
    return CreepLaw("trial", {"creep": term}, table, states={H: State(0.1, growth)})


def energies(one):
    """Apparent activation energies, J/mol, of the creep rate and of H between two temperatures."""
    kernel, values = ck.lower(one, "numpy"), {name: VALUES[name] for name in one.names}
    point = dict(stress=80.0, strain=0.02, H=0.3, temperature=np.array([T, HOT]))
    scale = 8.314462618 / (1 / T - 1 / HOT)
    growth = np.abs(np.broadcast_to(kernel.state_rates(values, **point)["H"], 2))
    return tuple(float(scale * np.diff(v)[0]) for v in (kernel.log_rate(values, **point), np.log(growth)))


@pytest.mark.parametrize(
    ("growth", "names", "energy"),
    [
        (h * CREEP, "A n h Q", 3e5),  # work hardening
        (h * (1 - H / c) * CREEP, "A n h c Q", 3e5),  # saturating hardening of Dyson and McLean
        (CREEP * (h * sympy.sqrt(H) - c * H), "A n h c Q", 3e5),  # dislocation density of Kocks and Mecking
        (sympy.Max(A * stress**n * (c - H), 0), "A n c Q", 3e5),
        (sympy.Piecewise((A * stress**n, stress > 10), (0, True)), "A n Q", 3e5),
        (D * stress**c * (1 - H), "A n D Q_D c Q", 1.5e5),  # damage
        (-r * H, "A n r Q_r Q", 2e5),  # static recovery
        (D * (c * strain - H + 1), "A n D Q_D c Q", 1.5e5),
        (-H / c, "A n c Q Q_H", 1e5),  # a time constant c is no coefficient: the state gives the name
        ((c - H) / (1 + c), "A n c Q Q_H", 1e5),
    ],
)
def test_multiples_of_the_creep_rate_take_its_factor_and_other_rates_have_their_own(growth, names, energy):
    one = law(growth).times(arrhenius(T_REF))
    assert sorted(one.names) == sorted(names.split())
    assert energies(one) == pytest.approx((3e5, energy), rel=1e-9)


def test_hardening_follows_creep_and_recovery_has_its_own_energy():
    """dH/dt = h (creep rate) - r H^2, also as a product of sums: each part is multiplied by its own factor."""
    growth = (h * A * stress**n - r * H**2) * (1 - H)
    one = law(growth).times(arrhenius(T_REF))
    values = {name: VALUES[name] for name in one.names}
    found = float(ck.lower(one, "numpy").state_rates(values, stress=80.0, H=0.3, temperature=HOT)["H"])
    creep, recovery = (math.exp(-Q / 8.314462618 * (1 / HOT - 1 / T_REF)) for Q in (3e5, 2e5))
    expected = 0.7 * (2 * 1e-12 * 80**3 * creep - 1e-6 * 0.09 * recovery)
    assert found == pytest.approx(expected, rel=1e-12)


def test_a_rate_that_is_activated_already_keeps_its_energy():
    """The order of times() and activated() does not matter, and a form given twice is refused."""
    damage = law(D * stress**c)
    assert damage.with_temperature(D=activated(T_REF)).times(arrhenius(T_REF)).names == ("A", "n", "D", "Q_D", "c", "Q")
    one = damage.times(arrhenius(T_REF)).times(arrhenius(T_REF))
    assert one.names == ("A", "n", "D", "Q_D", "c", "Q", "Q_2")
    assert energies(one) == pytest.approx((3.5e5, 1.5e5), rel=1e-9)
    with pytest.raises(LawError, match=r"Q_D exists already; D depends on temperature twice: leave this form out"):
        damage.times(arrhenius(T_REF)).with_temperature(D=activated(T_REF))


def test_terms_states_and_sharing_are_chosen():
    damage = law(D * stress**c)
    assert energies(damage.times(arrhenius(T_REF), states=())) == pytest.approx((3e5, 0), abs=1e-4)
    assert energies(damage.times(arrhenius(T_REF), terms=())) == pytest.approx((0, 1.5e5), abs=1e-4)
    assert energies(damage.times(arrhenius(T_REF), shared=True)) == pytest.approx((3e5, 3e5), rel=1e-9)
    assert energies(damage.times(arrhenius(T_REF, Q=2.5e5))) == pytest.approx((2.5e5, 2.5e5), rel=1e-9)
    assert energies(law(h * CREEP).times(arrhenius(T_REF), states=())) == pytest.approx((3e5, 3e5), rel=1e-9)
    both = NORTON + STRAIN_HARDENING
    part = both.times(arrhenius(T_REF), terms=["power law"])
    assert [t.has(ck.temperature) for t in part.terms.values()] == [True, False]
    assert both.times(arrhenius(T_REF)).names[-1:] == ("Q",)
    assert damage.times(arrhenius(T_REF), states=()).name == "trial*arrhenius(creep)"


def test_two_states_have_two_energies_unless_they_share_a_coefficient():
    table = {A: RATE, n: NUMBER, D: RATE, r: RATE, c: NUMBER}
    two = {H: State(0.0, r * (1 - H)), w: State(0.0, D * stress**c, limit=0.9)}
    one = CreepLaw("two", {"creep": CREEP / (1 - w)}, table, states=two).times(arrhenius())
    assert one.names == ("A", "n", "D", "Q_D", "r", "Q_r", "c", "Q")
    chained = {H: State(0.0, D * (1 - H)), w: State(0.0, D * c * H)}
    table.pop(r)
    one = CreepLaw("chained", {"creep": CREEP / (1 - w)}, table, states=chained).times(arrhenius())
    assert one.names == ("A", "n", "D", "Q_D", "c", "Q")


@pytest.mark.parametrize(
    ("chosen", "message"),
    [
        ({"states": ["x"]}, "has no state 'x'"),
        ({"terms": "crep"}, "has no term 'crep'; did you mean 'creep'"),
        ({"terms": (), "states": ()}, "multiply no term and no state"),
        ({"states": ["H"]}, "state 'H' is a multiple of the creep rate"),
    ],
)
def test_wrong_choices_are_explained(chosen, message):
    with pytest.raises(LawError, match=message):
        law(h * CREEP).times(arrhenius(), **chosen)


def test_laws_are_summed_multiplied_and_written_with_values_as_expressions_are():
    assert sum([NORTON, STRAIN_HARDENING]) == NORTON + STRAIN_HARDENING
    assert (2 * NORTON).rate == (NORTON * 2).rate == 2 * NORTON.rate
    warm = NORTON.times(arrhenius(T_REF))
    Q, R, T, T_ref = (*sympy.symbols("Q R", real=True), ck.temperature, sympy.Symbol("T_ref", real=True))
    shown = warm.expr.subs({"A": 3.0, sympy.Symbol("n"): 5})
    assert warm.rate.subs({"A": 3.0, warm.symbol("n"): 5}).free_symbols == {Q, T, stress}
    assert STRAIN_HARDENING.fix(m=0) == NORTON != NORTON.with_bounds(n=(3, 5))
    assert hash(STRAIN_HARDENING.fix(m=0)) == hash(NORTON)
    assert sympy.simplify(shown - 3.0 * stress**5 * sympy.exp(-Q / R * (1 / T - 1 / T_ref))) == 0
    assert r"^{n_\infty + " in DRIFTING_EXPONENT.latex()  # what is added before what is taken away
