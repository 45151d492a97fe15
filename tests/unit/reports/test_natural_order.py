"""Tests of a ranking stand as a person counts: P2 before P10."""

from types import SimpleNamespace

from creepkit.reports.ranking_plot import _columns


def test_numbers_in_names_count_as_numbers():
    names = ["P10", "P2", "a1 b10", "P1", "a1 b9", "12", "P"]
    fit = SimpleNamespace(tests=[SimpleNamespace(name=n) for n in names], histories=())
    assert [names[k] for k in _columns(fit)] == ["P", "P1", "P2", "P10", "a1 b9", "a1 b10", "12"]
