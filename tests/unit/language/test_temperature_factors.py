"""Which rates an Arrhenius factor multiplies: by how much each rate rises between two temperatures."""

import math

import numpy as np
import pytest
import sympy

import creepkit as ck
from creepkit.errors import LawError
from creepkit.language import CreepLaw, Param, State, activated, arrhenius, linear, parameters, states, strain, stress
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING

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


def test_an_exponent_of_temperature_is_no_activation():
    one = law(D * stress**c).with_temperature(c=linear(T_REF)).times(arrhenius(T_REF))
    assert "Q_D" in one.names


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


def test_the_new_energies_say_what_they_are_of():
    one = ck.law("norton").times(arrhenius()).table["Q"]
    assert law(D * stress**c).times(arrhenius()).table["Q_D"].meaning == "activation energy of rate coefficient"
    assert law((c - H) / (1 + c)).times(arrhenius()).table["Q_H"].meaning == "activation energy of internal variable"
    assert (one.meaning, one.unit) == ("activation energy", "J/mol")


@pytest.mark.parametrize(
    ("chosen", "message"),
    [
        ({"states": ["x"]}, "has no state 'x'"),
        ({"terms": "crep"}, "has no term 'crep': did you mean 'creep'"),
        ({"terms": (), "states": ()}, "multiply no term and no state"),
        ({"states": ["H"]}, "state 'H' is a multiple of the creep rate"),
    ],
)
def test_wrong_choices_are_explained(chosen, message):
    with pytest.raises(LawError, match=message):
        law(h * CREEP).times(arrhenius(), **chosen)
