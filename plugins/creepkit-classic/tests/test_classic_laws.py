"""Each law comes through its entry point, keeps what every law promises, and has values to begin with."""

from importlib import import_module

import pytest

import creepkit as ck

LAWS = [
    *("blackburn", "coble", "dorn", "double-power", "garofalo", "graham-walles", "mpc-omega", "nabarro-herring"),
    *("norton-bailey-rate", "norton-bailey-strain", "norton-bailey-time", "theta-projection", "threshold-stress"),
]


@pytest.mark.parametrize("name", LAWS)
def test_typical_values_are_within_the_bounds(name: str) -> None:
    law, typical = ck.law(name), import_module(f"creepkit_classic.{name.replace('-', '_')}").TYPICAL

    assert law.values(typical) == typical
    assert [key for key, value in typical.items() if not law.table[key].within_bounds(value)] == []
