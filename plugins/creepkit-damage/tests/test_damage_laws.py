"""Each law comes through its entry point, keeps what every law promises, and has values to begin with."""

from importlib import import_module

import numpy as np
import pytest
from creepkit_damage.liu_murakami import TYPICAL

import creepkit as ck
from creepkit.language import arrhenius

LAWS = ["kachanov-rabotnov", "liu-murakami", "sinh-damage"]


@pytest.mark.parametrize("name", LAWS)
def test_typical_values_are_within_the_bounds(name: str) -> None:
    law, typical = ck.law(name), import_module(f"creepkit_damage.{name.replace('-', '_')}").TYPICAL

    assert law.values(typical) == typical
    assert [key for key, value in typical.items() if not law.table[key].within_bounds(value)] == []


@pytest.mark.parametrize(("name", "growth"), [("kachanov-rabotnov", "B"), ("liu-murakami", "B"), ("sinh-damage", "M")])
def test_without_growth_the_creep_is_steady(name: str, growth: str) -> None:
    """Norton's law, or the first power of a sinh: a straight line."""
    law = ck.law(name).fix(**{growth: 0})
    values = law.center() | {"A": 1e-12} | ({"m": 0.0} if "m" in law.names else {})
    run = ck.simulate(law, "uniaxial", values, loading=ck.constant_stress(5.0, "stress"), times=[1e3, 2e3, 4e3])

    strain = run.outputs["strain"]
    assert list(strain / strain[0]) == pytest.approx([1, 2, 4], rel=1e-6)


def test_creep_and_damage_have_activation_energies_of_their_own() -> None:
    law = ck.law("liu-murakami").times(arrhenius(T_ref=873.15))
    kernel, values = ck.lower(law, "numpy"), TYPICAL | {"Q": 4e5, "Q_B": 3e5}
    point = dict(stress=240.0, temperature=np.array([873.15, 893.15]))
    rise = (1 / 873.15 - 1 / 893.15) / 8.314462618

    assert np.diff(kernel.log_rate(values, **point))[0] == pytest.approx(4e5 * rise, rel=1e-9)
    assert np.diff(np.log(kernel.state_rates(values, **point)["w"]))[0] == pytest.approx(3e5 * rise, rel=1e-9)


def test_planted_values_are_identified_from_curves_of_tertiary_creep() -> None:
    """Four stresses, to 95 % of each life, at TYPICAL values; alpha says nothing in tension and is fixed."""
    law = ck.law("liu-murakami").fix(alpha=0.5)
    planted = {name: TYPICAL[name] for name in law.names}
    tests = [
        ck.simulate(
            law,
            "uniaxial",
            planted,
            loading=ck.constant_stress(stress, "stress"),
            times=np.linspace(0.02, 0.95, 30) / (TYPICAL["B"] * stress ** TYPICAL["p"]),
            name=f"{stress:g} MPa",
        )
        for stress in (200.0, 220.0, 240.0, 260.0)
    ]

    fit = ck.identify(law, tests, starts=2)

    for name in ("n", "p", "q_2"):
        assert fit.values[name] == pytest.approx(planted[name], rel=2e-3)
