"""Conditioned coordinates: the map inverts, its derivative is right, rates and local exponents are what they say."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.inverse.coordinates import Coordinates, local_exponents
from creepkit.inverse.reference_conditions import ReferencePoint
from creepkit.kernels import lower
from creepkit.language import arrhenius, linear
from creepkit.laws.combined import COMBINED
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from helpers.registered_laws import registered_laws

LAWS = [
    *registered_laws().values(),
    COMBINED.times(arrhenius(T_ref=1073.15)).with_temperature(n_2=linear(T_ref=1073.15)),
    HYPERBOLIC_SINE + ck.law("kachanov-rabotnov"),  # an exponent stands as it is beside variables it does not mention
]
REFERENCE = ReferencePoint(stress=63.0, strain=4e-3, time=2.3e4, temperature=1040.0)


def drawn(law, seed=3):
    rng = np.random.default_rng(seed)
    ends = np.array([[p.to_internal(b) for b in p.bounds] for p in law.params.values()])
    theta = ends[:, 0] + rng.uniform(size=len(ends)) * (ends[:, 1] - ends[:, 0])
    if "s_0" in law.names:  # a threshold, below the reference stress: else there is no rate
        theta[law.names.index("s_0")] = 20.0
    return theta


def test_the_map_inverts_and_its_jacobian_equals_central_differences():
    for law in LAWS:
        coordinates, theta = Coordinates(law, REFERENCE), drawn(law)
        u = coordinates.u(theta)
        np.testing.assert_allclose(coordinates.theta(u), theta, rtol=1e-12, atol=1e-12, err_msg=law.name)
        exact = coordinates.jacobian(u)
        for k in range(u.size):
            step = np.zeros(u.size)
            step[k] = 1e-6 * max(1.0, abs(u[k]))
            difference = (coordinates.theta(u + step) - coordinates.theta(u - step)) / (2 * step[k])
            np.testing.assert_allclose(exact[:, k], difference, rtol=2e-6, atol=1e-7, err_msg=law.name)


def test_coordinate_is_the_log_rate_of_its_term_at_the_reference():
    law = COMBINED
    coordinates = Coordinates(law, REFERENCE)
    theta = drawn(law)
    u = coordinates.u(theta)
    values = {n: p.from_internal(t) for (n, p), t in zip(law.table.items(), theta, strict=True)}
    point = {"stress": REFERENCE.stress, "strain": REFERENCE.strain, "time": REFERENCE.time}
    for k, label in zip(coordinates.term_rates, law.terms, strict=True):
        single = law.only(label)
        log_rate = lower(single, "numpy").log_rate({n: values[n] for n in single.names}, **point)
        assert u[k] == pytest.approx(float(log_rate), rel=1e-12)


def test_sums_in_either_order_have_the_coordinates_of_their_own_parameters():
    """a + b and b + a share a fingerprint: what is derived for one must not be taken for the other."""
    one, other = HYPERBOLIC_SINE + NORTON, NORTON + HYPERBOLIC_SINE
    reference = ReferencePoint(stress=100.0, strain=0.01, time=1e5, temperature=1000.0)
    first, second = Coordinates(one, reference), Coordinates(other, reference)
    sinh, power = {"A": 1e-10, "n": 2.0, "B": 40.0}, {"A": 1e-17, "n": 5.0}
    theta = [*HYPERBOLIC_SINE.to_internal(sinh)[0], *NORTON.to_internal(power)[0]]
    u, v = first.u(np.array(theta)), second.u(np.array([*theta[3:], *theta[:3]]))
    assert u == pytest.approx([*v[2:], *v[:2]])


# ---- local exponents -----------------------------------------------------------------------------------------------

EXPONENTS_AT = ReferencePoint(stress=110.0, strain=0.004, time=2.0e4, temperature=1050.0)


def inner(law, values):
    return np.array([p.to_internal(values[name]) for name, p in law.table.items()])


def test_that_of_sinh_is_n_x_coth_x():
    law = ck.law("hyperbolic-sine")
    values = {"A": 1e-9, "n": 2.5, "B": 60.0}
    u = Coordinates(law, EXPONENTS_AT).u(inner(law, values))
    x = 110.0 / 60.0
    assert u[law.names.index("n")] == pytest.approx(2.5 * x / np.tanh(x), rel=1e-12)


def test_that_of_a_drifting_exponent_is_n_at_the_reference_time():
    law = ck.law("drifting-exponent").fix(m=0)
    values = {"A": 1e-16, "n_0": 4.9, "n_inf": 4.3, "C": 2.7, "tau_d": 13823.6, "tau_r": 8090.4}
    (local,) = local_exponents(law)
    assert law.names[local.position] == "n_inf"
    u = Coordinates(law, EXPONENTS_AT).u(inner(law, values))
    decay, rise = np.exp(-2e4 / values["tau_d"]), np.exp(-2e4 / values["tau_r"])
    n = values["n_inf"] + (values["C"] + values["n_0"] - values["n_inf"]) * decay - values["C"] * rise
    assert u[local.position] == pytest.approx(n, rel=1e-12)


def test_a_power_law_keeps_its_exponent():
    names = ("norton", "strain-hardening", "time-hardening")
    assert [name for name in names if local_exponents(ck.law(name)) != ()] == []
