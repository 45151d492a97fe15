"""Whatever is given to a public function or record: one sentence of creepkit's own, or a result; nothing from inside.

Each argument in turn is a bad value, beside good values of those that must be given.
"""

from __future__ import annotations

import inspect
import os
import signal
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import CreepkitError

BAD: dict[str, Callable[[], Any]] = {
    "None": lambda: None,
    "empty text": lambda: "",
    "text": lambda: "x",
    "bytes": lambda: b"x",
    "nan": lambda: float("nan"),
    "inf": lambda: float("inf"),
    "-1": lambda: -1,
    "huge": lambda: 10**400,
    "[]": list,
    "[None]": lambda: [None],
    "{}": dict,
    "{'a': 1}": lambda: {"a": 1},
    "object": object,
    "array of nan": lambda: np.array([np.nan]),
    "generator": lambda: (one for one in ["x"]),
    "long text": lambda: "x" * 100_000,
    "no path": lambda: "\0",
}

LONGEST = 5.0
"""s, of one call."""

NOT_CALLED = {
    "hookimpl": "pluggy's decorator",
    "Predictor": "a protocol",
    "Specimen": "a protocol",
    "Status": "an enumeration of Python's",
    "PerTest": "a base class without constructor",
    "TestPiece": "a base class without constructor",
    "Prediction": "checked by check_prediction, as any predictor's is, when it is used",
    "CameraFormat": "",
}
NOT_CALLED.pop("CameraFormat")

OF_ANY_TYPE = {
    ("discover", "progress"): "called later",
}


@contextmanager
def _time_limit() -> Iterator[None]:
    def stop(*_: Any) -> None:
        raise TimeoutError(f"longer than {LONGEST} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, LONGEST)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def _callables() -> list[str]:
    return [n for n in ck.__all__ if n not in NOT_CALLED and callable(getattr(ck, n)) and not inspect.ismodule(n)]


def _history() -> ck.History:
    times = np.array([1.0, 10.0, 100.0])
    return ck.History("a", times, {"strain": 1e-5 * times}, ck.constant_stress(80.0), 1000.0)


def good_values(name: str) -> dict[str, Any]:
    """Values of arguments by their name, of a function or record."""
    history = _history()
    values: dict[str, Any] = {
        "histories": [history],
        "tests": [history],
        "history": history,
        "law": ck.law("norton"),
        "laws": ["norton"],
        "source": ck.law("norton"),
        "target": "python",
        "stress": 80.0,
        "temperature": 1000.0,
        "times": np.array([1.0, 10.0]),
        "loading": ck.constant_stress(80.0),
        "outputs": {"strain": np.array([1e-5, 1e-4])},
        "values": {"A": 1e-20, "n": 5.0},
        "using": "uniaxial",
        "name": "a",
        "bounds": (1.0, 2.0),
        "steps": [(0.0, 1.0)],
        "quantity": "stress",
        "value": 1.0,
    }
    special: dict[str, dict[str, Any]] = {
        "Channel": {"quantity": "temperature", "values": np.array([1.0, 2.0])},
        "InstrumentRecord": {"channels": {}},
        "StressSteps": {"steps": ((0.0, 1.0),)},
        "specimen": {"name": "uniaxial"},
        "law": {"name": "norton"},
    }
    return values | special.get(name, {})


def cases(name: str) -> Iterator[tuple[str, str, Callable[[], Any]]]:
    """(argument, name of the bad value, call)."""
    function = getattr(ck, name)
    parameters = inspect.signature(function).parameters
    good = good_values(name)
    needed = {
        key: good[key]
        for key, p in parameters.items()
        if p.default is p.empty and p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY) and key in good
    }
    for argument, parameter in parameters.items():
        for label, make in BAD.items():
            if parameter.kind is parameter.VAR_POSITIONAL:
                yield argument, label, lambda make=make: function(make(), **needed)
            elif parameter.kind is parameter.VAR_KEYWORD:
                yield argument, label, lambda make=make: function(**needed, **{"x": make()})
            else:
                others = {key: value for key, value in needed.items() if key != argument}
                missing = [
                    key
                    for key, p in parameters.items()
                    if p.default is p.empty and p.kind is not p.VAR_KEYWORD and p.kind is not p.VAR_POSITIONAL
                    and key not in needed and key != argument
                ]
                yield argument, label, lambda make=make, o=others, m=missing, a=argument: function(
                    **o, **{key: make() for key in m}, **{a: make()}
                )


@pytest.mark.parametrize("name", _callables())
def test_nothing_but_a_sentence_of_creepkit_comes_out(name: str, tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.chdir(tmp_path)
    wrong = []
    for argument, label, call in cases(name):
        start = time.perf_counter()
        try:
            with _time_limit(), warnings.catch_warnings():
                warnings.simplefilter("ignore")
                call()
        except CreepkitError:
            pass
        except Exception as error:
            wrong.append(f"{argument} = {label}: {type(error).__name__}: {str(error)[:100]}")
        if time.perf_counter() - start > LONGEST:
            wrong.append(f"{argument} = {label}: too long")
    assert wrong == [], "\n".join(wrong)
