"""Planted tables of minimum creep rates and of rupture times, from closed forms with scatter between tests."""

from __future__ import annotations

import numpy as np

from creepkit.records import History, constant_stress

GAS_CONSTANT = 8.314462618
"""J/(mol K)."""
KACHANOV_VALUES = {"A": 1e-16, "n": 4.0, "B": 1e-15, "k": 3.5, "r": 4.0}
STRESSES = (55, 65, 75, 85, 100, 120, 65, 100, 80, 140)
"""MPa."""
SCATTER = 0.1
"""Standard deviation of ln of a rate, and of ln of a rupture time."""


def rate_table(rng, scatter=SCATTER, exponent=5.0, energy=4e5):
    """Twelve minimum rates, 1e-8 1/s at 100 MPa and 1100 K, by a power law with Arrhenius' factor."""
    tests = []
    for stress in (50.0, 80.0, 120.0, 160.0):
        for temperature in (1050.0, 1100.0, 1150.0):
            factor = np.exp(-energy / GAS_CONSTANT * (1.0 / temperature - 1.0 / 1100.0))
            rate = 1e-8 * (stress / 100.0) ** exponent * factor * np.exp(scatter * rng.standard_normal())
            name, loading = f"{stress:g} MPa, {temperature:g} K", constant_stress(stress, "stress")
            tests.append(History(name, np.array([1.0]), {}, loading, temperature, minimum_rate=float(rate)))
    return tests


def kachanov_life(stress, values=KACHANOV_VALUES):
    """Rupture time, s, under constant stress: damage from 0 to 0.99 with domega/dt = B s^k / (1 - omega)^r."""
    power = values["r"] + 1.0
    return (1.0 - 0.01**power) / (power * values["B"] * stress ** values["k"])


def whole_life_table(rng, rates=True, lives=True, scatter=SCATTER):
    """Ten tests at constant stress with minimum rate, rupture time or both; every fifth stopped at half its life."""
    tests = []
    for k, stress in enumerate(STRESSES):
        rate_scatter, life_scatter = scatter * rng.standard_normal(2)
        rate = KACHANOV_VALUES["A"] * stress ** KACHANOV_VALUES["n"] * np.exp(rate_scatter)
        life = float(kachanov_life(stress) * np.exp(life_scatter))
        known = {"minimum_rate": float(rate)} if rates else {}
        if lives:
            known |= {"unruptured": True} if k % 5 == 4 else {"rupture_time": life}
        end = 1.0 if not lives else 0.5 * life if k % 5 == 4 else life
        tests.append(History(f"t{k}", np.array([end]), {}, constant_stress(stress, "stress"), 1000.0, **known))
    return tests
