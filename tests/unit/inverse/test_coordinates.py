"""Conditioned coordinates: the map inverts, its derivative is right, and it does what it is for."""

import numpy as np
import pytest

from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.reference_conditions import ReferencePoint
from creepkit.kernels import lower
from creepkit.language import arrhenius, linear
from creepkit.laws.combined import COMBINED
from creepkit.laws.drifting_exponent import DRIFTING_EXPONENT
from creepkit.laws.norton import NORTON

LAWS = [NORTON, DRIFTING_EXPONENT, COMBINED.times(arrhenius(T_ref=1073.15)).with_temperature(n_2=linear(T_ref=1073.15))]
REFERENCE = ReferencePoint(stress=63.0, strain=4e-3, time=2.3e4, temperature=1040.0)


def drawn(law, seed=3):
    rng = np.random.default_rng(seed)
    ends = np.array([[p.to_internal(b) for b in p.bounds] for p in law.params.values()])
    return ends[:, 0] + rng.uniform(size=len(ends)) * (ends[:, 1] - ends[:, 0])


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
def test_map_inverts(law):
    coordinates = Coordinates(law, REFERENCE)
    theta = drawn(law)
    np.testing.assert_allclose(coordinates.theta(coordinates.u(theta)), theta, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
def test_jacobian_equals_central_differences(law):
    coordinates = Coordinates(law, REFERENCE)
    u = coordinates.u(drawn(law))
    exact = coordinates.jacobian(u)
    for k in range(u.size):
        step = np.zeros(u.size)
        step[k] = 1e-6 * max(1.0, abs(u[k]))
        difference = (coordinates.theta(u + step) - coordinates.theta(u - step)) / (2 * step[k])
        np.testing.assert_allclose(exact[:, k], difference, rtol=2e-6, atol=1e-7)


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
