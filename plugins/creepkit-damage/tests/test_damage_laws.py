"""Each law comes through its entry point, keeps what every law promises, and has values to begin with."""

from importlib import import_module

import pytest

import creepkit as ck

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
