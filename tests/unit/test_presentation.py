"""The functions of higher modules that print, plot and save records are there, and fit the records' methods."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Callable, Iterator
from importlib import import_module
from typing import Any

import numpy as np

from creepkit.inverse.selection import rank
from creepkit.inverse.uncertainty.correlation import Correlation
from creepkit.inverse.uncertainty.profile_likelihood import ProfileLikelihood
from creepkit.laws.norton import NORTON
from creepkit.presentation import function_named
from helpers import source_tree
from helpers.log_rate_predictor import known_scatter, measured
from helpers.source_tree import public_classes


def named_functions() -> Iterator[tuple[str, str, Callable[..., Any], str]]:
    """(class.method, its return annotation, the function that it calls by name, that name)."""
    for name, module in public_classes():
        tree = next(
            one for one in ast.walk(source_tree.tree(module)) if isinstance(one, ast.ClassDef) and one.name == name
        )
        for keyword in tree.keywords:
            declared = {"text": "str", "details": "str", "figure": "Figure", "panel": "None"}.get(keyword.arg or "")
            if declared and isinstance(keyword.value, ast.Constant):
                yield name, declared, function_named(keyword.value.value), keyword.value.value
        for method in (one for one in tree.body if isinstance(one, ast.FunctionDef)):
            for call in (one for one in ast.walk(method) if isinstance(one, ast.Call)):
                first = call.args[0] if call.args else None
                if ast.unparse(call.func) == "present" and isinstance(first, ast.Constant):
                    declared = ast.unparse(method.returns) if method.returns else ""
                    yield f"{name}.{method.name}", declared, function_named(first.value), first.value


def test_a_method_declares_what_the_function_that_it_names_returns() -> None:
    """Any stands for a record of a higher module, which the record cannot name."""
    named, wrong = list(named_functions()), []
    for method, declared, function, name in named:
        returned = inspect.signature(function).return_annotation
        if declared != returned and "Any" not in declared and returned != method.partition(".")[0]:
            wrong.append(f"{method} declares {declared}, and {name} returns {returned}")
    assert len(named) > 50
    assert not wrong, "\n".join(wrong)


def test_every_class_that_prints_so_has_a_text() -> None:
    for name, module in public_classes(base="Presentable"):
        assert getattr(import_module(module), name)._text, name


AXIS = np.array([10.0, 100.0])
RECORDS = [
    Correlation(("ln A", "n"), np.array([[1.0, -0.5], [-0.5, 1.0]]), np.ones(2)),
    ProfileLikelihood("n", "1", AXIS, np.ones(2), 4.0, None, 5.0, 3.84, 0.95, (3.0, 5.0)),
]


def test_records_print_as_text() -> None:
    values = {"A": float(np.exp(-15.0 - 4.0 * np.log(50.0))), "n": 4.0}
    fit = known_scatter(NORTON, measured(NORTON, values, (30.0, 50.0, 80.0), sd=0.2, seed=3), 0.2)
    ranking = rank([fit])
    texts = [str(record) for record in (*RECORDS, fit, ranking, ranking.model_average, fit.correlation())]
    assert [text for text in texts if not text.strip() or "object at" in text] == []
    assert fit.undetermined() == ()
    samples = fit.sample(draws=20)
    assert repr(samples).startswith("<PosteriorSamples of norton: 20 draws, medians A = ")
    np.testing.assert_array_equal(samples.to_dataframe()["n"], samples.values["n"])
