"""Local exponents as coordinates: their formulas, and that the map and its derivatives are exact."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.inverse.coordinates import Coordinates, local_exponents
from creepkit.inverse.reference_conditions import ReferencePoint

AT = ReferencePoint(stress=110.0, strain=0.004, time=2.0e4, temperature=1050.0)


def inner(law, values):
    return np.array([p.to_internal(values[name]) for name, p in law.table.items()])


def test_that_of_sinh_is_n_x_coth_x():
    law = ck.law("hyperbolic-sine")
    values = {"A": 1e-9, "n": 2.5, "B": 60.0}
    u = Coordinates(law, AT).u(inner(law, values))
    x = 110.0 / 60.0
    assert u[law.names.index("n")] == pytest.approx(2.5 * x / np.tanh(x), rel=1e-12)


def test_that_of_a_drifting_exponent_is_n_at_the_reference_time():
    law = ck.law("drifting-exponent").fix(m=0)
    values = {"A": 1e-16, "n_0": 4.9, "n_inf": 4.3, "C": 2.7, "tau_d": 13823.6, "tau_r": 8090.4}
    (local,) = local_exponents(law)
    assert law.names[local.position] == "n_inf"
    u = Coordinates(law, AT).u(inner(law, values))
    decay, rise = np.exp(-2e4 / values["tau_d"]), np.exp(-2e4 / values["tau_r"])
    n = values["n_inf"] + (values["C"] + values["n_0"] - values["n_inf"]) * decay - values["C"] * rise
    assert u[local.position] == pytest.approx(n, rel=1e-12)


@pytest.mark.parametrize("name", ["norton", "strain-hardening", "time-hardening"])
def test_a_power_law_keeps_its_exponent(name):
    assert local_exponents(ck.law(name)) == ()


@pytest.mark.parametrize("name", ["hyperbolic-sine", "combined", "drifting-exponent"])
def test_the_map_inverts_and_its_derivatives_are_exact(name):
    law, rng = ck.law(name), np.random.default_rng(0)
    coordinates = Coordinates(law, AT)
    ends = np.array([[p.to_internal(b) for b in p.bounds] for p in law.params.values()])
    theta = ends[:, 0] + rng.uniform(0.2, 0.8, (6, len(ends))) * np.diff(ends, axis=1)[:, 0]
    u = coordinates.u(theta)
    assert coordinates.theta(u) == pytest.approx(theta, rel=1e-9, abs=1e-9)
    exact = coordinates.jacobian(u)
    for k in range(len(ends)):
        step = np.zeros(len(ends))
        step[k] = 1e-5 * max(1.0, np.abs(u[:, k]).min())
        slope = (coordinates.theta(u + step) - coordinates.theta(u - step)) / (2 * step[k])
        assert exact[..., k] == pytest.approx(slope, rel=2e-5, abs=2e-5)
