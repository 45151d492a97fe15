"""Internal variables of a simulated bar, against the closed form of Kachanov's damage at constant true stress."""

import numpy as np

import creepkit as ck
from helpers.kachanov_law import kachanov

STRESS, C, v = 100.0, 1e-16, 4.0
RUPTURE = 1.0 / ((v + 1.0) * C * STRESS**v)
"""s; w = 1 - (1 - t/t_r)^(1/(v + 1)) solves w' = C (s/(1 - w))^v."""


def test_damage_of_a_bar_is_its_closed_form_up_to_its_end():
    law = kachanov(ck.stress, limit=0.9)
    times = np.append(np.linspace(0.0, 0.95, 9), [1.2]) * RUPTURE
    values = {"A": 1e-16, "n": 3.0, "C": C, "v": v}
    run = ck.simulate(law, "uniaxial", values, loading=ck.constant_stress(STRESS, "stress"), times=times)
    assert run.status is ck.Status.RUPTURED
    assert run.times.size == 9
    np.testing.assert_allclose(
        run.states["damage"], 1.0 - (1.0 - run.times / RUPTURE) ** (1.0 / (v + 1.0)), rtol=1e-3, atol=1e-7
    )
    np.testing.assert_allclose(run.creep_strain, run.outputs["strain"], rtol=1e-12)


def test_a_bar_without_internal_variables_has_none():
    loading = ck.constant_strain(1e-3)
    elastic = ck.Elastic(150e3)
    run = ck.simulate(
        "norton", "relaxation", {"A": 1e-16, "n": 4.0}, loading=loading, elastic=elastic, times=[0.0, 3600.0]
    )
    assert run.states == {}
    np.testing.assert_allclose(run.outputs["stress"], 150e3 * (1e-3 - run.creep_strain), rtol=1e-12)
