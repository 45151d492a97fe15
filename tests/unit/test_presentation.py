"""The table of functions that print, plot and save records: every entry is there, and fits the record's method."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np
import pytest

from creepkit.inverse.selection import rank
from creepkit.inverse.sparsity.bootstrap import SelectionFrequencies
from creepkit.inverse.sparsity.result import PenaltyPath
from creepkit.inverse.uncertainty.correlation import Correlation
from creepkit.inverse.uncertainty.model_averaging import RateBand
from creepkit.inverse.uncertainty.profile_likelihood import ProfileLikelihood
from creepkit.laws.norton import NORTON
from creepkit.presentation import PRESENTERS, Presentable, present, presenter
from creepkit.records import constant_stress
from creepkit.specimens.run import Run
from helpers.log_rate_predictor import known_scatter, measured
from helpers.source_tree import public_classes

ENTRIES = [(name, verb, function) for name, verbs in PRESENTERS.items() for verb, function in verbs.items()]
each_entry = pytest.mark.parametrize(("name", "verb", "function"), ENTRIES, ids=[f"{n}.{v}" for n, v, _ in ENTRIES])

METHODS = {"text": "__str__"}
"""{verb: method that asks for it} where the two are not of one name."""


def record_class(name: str) -> type:
    """The class of creepkit of that name, which is unique."""
    (module,) = (module for found, module in public_classes() if found == name)
    result = getattr(import_module(module), name)
    assert isinstance(result, type)
    return result


@each_entry
def test_an_entry_names_a_function_that_takes_the_record_first(name: str, verb: str, function: str) -> None:
    resolved = presenter(function)
    assert inspect.isfunction(resolved)
    assert list(inspect.signature(resolved).parameters)


@each_entry
def test_a_record_has_the_method_that_asks_for_an_entry(name: str, verb: str, function: str) -> None:
    kind = record_class(name)
    method: Callable[..., Any] = getattr(kind, METHODS.get(verb, verb))
    if verb == "text":
        assert issubclass(kind, Presentable)
        assert method is Presentable.__str__
    else:
        assert verb in inspect.getsource(method)
        assert inspect.getdoc(method)


@each_entry
def test_a_method_declares_what_its_function_returns(name: str, verb: str, function: str) -> None:
    """Any stands for a record of a higher module, which the record cannot name."""
    method = getattr(record_class(name), METHODS.get(verb, verb))
    declared = inspect.signature(method).return_annotation
    assert declared == inspect.signature(presenter(function)).return_annotation or "Any" in declared


def test_every_class_that_prints_so_has_a_text() -> None:
    printed = {name for name, _ in public_classes(base="Presentable")}
    assert printed == {name for name, verbs in PRESENTERS.items() if "text" in verbs}


def test_a_derived_class_uses_the_entries_of_its_base() -> None:
    class Longer(Run):
        """A run of a specimen of another package."""

    run = Longer("bar", np.array([0.0, 1.0]), {"strain": np.array([0.0, 0.01])}, constant_stress(50.0), 1000.0)
    assert str(run) == "bar: complete; 2 frames to 1 s, where strain 0.01"


def test_a_verb_without_an_entry_is_an_error_that_names_both() -> None:
    with pytest.raises(AttributeError, match="'fly' of a record of class CreepLaw"):
        present(NORTON, "fly")


AXIS = np.array([10.0, 100.0])
RECORDS = [
    Correlation(("ln A", "n"), np.array([[1.0, -0.5], [-0.5, 1.0]]), np.ones(2)),
    ProfileLikelihood("n", "1", AXIS, np.ones(2), 4.0, None, 5.0, 3.84, 0.95, (3.0, 5.0)),
    RateBand(AXIS, 1e-9 * AXIS, 5e-10 * AXIS, 2e-9 * AXIS, (6e-10 * AXIS, 1.5e-9 * AXIS), 1073.0, 5.0),
    PenaltyPath("l2", ("one",), AXIS, np.ones((2, 1)), AXIS, (("one",), ("one",)), np.zeros(2), np.ones((2, 1)), 1),
    SelectionFrequencies("tests", 4, {"one": 3}, {("one",): 3}),
]


@pytest.mark.parametrize("record", RECORDS, ids=lambda record: type(record).__name__)
def test_a_record_prints_as_text(record: object) -> None:
    text = str(record)
    assert text.strip()
    assert "object at" not in text


def test_an_identification_and_what_follows_from_it_print_as_text() -> None:
    values = {"A": float(np.exp(-15.0 - 4.0 * np.log(50.0))), "n": 4.0}
    fit = known_scatter(NORTON, measured(NORTON, values, (30.0, 50.0, 80.0), sd=0.2, seed=3), 0.2)
    ranking = rank([fit])
    for record in (fit, ranking, ranking.model_average, fit.correlation()):
        assert "n" in str(record)
    assert fit.undetermined() == ()
