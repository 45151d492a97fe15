"""Whatever is given to a public function or record: one sentence of creepkit's own, or a result; nothing from inside.

Each argument in turn is a bad value, beside good values of those that must be given.
"""

from __future__ import annotations

import importlib
import inspect
import signal
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, partial
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
    "half a character": lambda: "\ud800",
    "array of no rows": lambda: np.zeros((0, 3)),
}


LONGEST = 5.0
"""s of processor time, of one call."""


ONCE: dict[str, Callable[[], object]] = {
    "train": lambda: importlib.import_module("torch"),
    "interactive_page": lambda: ck.interactive_page("norton", "first.html"),  # trains the reduced-order model
}
"""What is done once on a machine or in a process, and takes longer than a call may."""


NOT_CALLED = {
    "hookimpl": "pluggy's decorator",
    "Predictor": "a protocol",
    "Specimen": "a protocol",
    "Status": "an enumeration of Python's",
    "Axisymmetric": "a base class with abstract methods; Python says which are missing",
    "PerTest": "a base class without constructor",
    "TestPiece": "a base class without constructor",
    "Prediction": "made in each step of an identification, and checked by check_prediction where it is used",
}


TEXTS = ("empty text", "text", "long text", "no path", "half a character")
RIGHT: dict[str, dict[str, tuple[str, ...]]] = {
    "forecast": {"tolerances": ("{}",)},
    "report": {"to": ("text",), "title": TEXTS},
    "screen": {"using": ("{}",), "to": ("empty text", "text")},
}
"""Values that are allowed, with which the whole work would be done, which takes longer."""


@contextmanager
def _time_limit() -> Iterator[None]:
    def stop(*_: Any) -> None:
        raise TimeoutError(f"longer than {LONGEST} s")

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, LONGEST)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def _callables() -> list[str]:
    return [n for n in ck.__all__ if n not in NOT_CALLED and callable(getattr(ck, n))]


@cache
def _histories() -> list[ck.History]:
    times = np.array([1.0, 3.0, 10.0, 30.0, 100.0, 300.0])
    return [
        ck.History(f"{s:g}", times, {"strain": 1e-15 * s**5 * times}, ck.constant_stress(s), 1000.0)
        for s in (60.0, 80.0, 100.0)
    ]


@cache
def _fit() -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return ck.identify("norton", _histories(), starts=1, sobol_points=8)


def good_values(name: str) -> dict[str, Any]:
    """Values of arguments by their name, of a function or record."""
    fit, histories, grid = _fit(), _histories(), np.linspace(1.0, 2.0, 4)
    by_name: dict[str, Any] = {
        "histories": histories,
        "tests": histories,
        "history": histories[0],
        "fit": fit,
        "fits": [fit],
        "source": fit,
        "target": "python",
        "law": ck.law("norton"),
        "laws": ["norton"],
        "using": "uniaxial",
        "values": {"A": 1e-15, "n": 5.0},
        "penalty": "subsets",
        "specimen": "uniaxial",
        "predictor": ck.specimen("uniaxial"),
        "loading": ck.constant_stress(80.0),
        "times": grid,
        "frame_times": grid,
        "temperature": 1000.0,
        "temperatures": (1000.0,),
        "stress": 80.0,
        "stresses": grid,
        "strain": 0.01,
        "outputs": {"strain": grid},
        "bounds": (1.0, 2.0),
        "meaning": "exponent",
        "name": "a",
        "title": "a",
        "columns": {"x": "x", "y": "y", "z": "z"},
        "names": "a b",
        "steps": ((0.0, 1.0),),
        "record": ck.Program.constant(1.0),
        "quantity": "stress",
        "value": 1.0,
        "default": 1.0,
        "kind": "laws",
        "to": "written",
        "path": "nowhere",
        "paths": "nowhere",
        "seed": 0,
        "measured": [grid],
        "predicted": [grid],
    }
    numbers = dict.fromkeys(("E", "E0", "b", "T0", "P1", "P2", "amplitude", "sigma_x", "sigma_y", "shape"), 1.0)
    numbers |= dict.fromkeys(("initial", "level", "longest_hours"), 0.9) | {"Tj": 10.0}
    own_values: dict[str, dict[str, Any]] = {
        "Channel": {"quantity": "temperature", "values": grid},
        "InstrumentRecord": {"channels": {}},
        "Nuisance": {"kind": "offset"},
        "Program": {"times": grid - 1.0, "values": grid},
        "State": {"rate": ck.stress},
        "TimeGrid": {"values": grid},
        "check_specimen": {"specimen": ck.specimen("uniaxial")},
        "export": {"source": ck.law_with_values("norton", {"A": 1e-15, "n": 5.0})},
        "law": {"name": "norton"},
        "law_with_values": {"source": "norton"},
        "specimen": {"name": "uniaxial"},
        "wachtman": {"E0": 1e5},
    }
    return by_name | numbers | own_values.get(name, {})


def cases(name: str) -> Iterator[tuple[str, str, Callable[[], Any]]]:
    """(argument, name of the bad value, call); a needed argument without a good value is as bad."""
    function, good = getattr(ck, name), good_values(name)
    parameters = inspect.signature(function).parameters
    several = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
    needed = [key for key, p in parameters.items() if p.default is p.empty and p.kind not in several]
    for argument, parameter in parameters.items():
        for label, make in BAD.items():
            if (make() is None and parameter.default is None) or label in RIGHT.get(name, {}).get(argument, ()):
                continue
            given = {key: good[key] if key in good else make() for key in needed if key != argument}
            if parameter.kind is parameter.VAR_POSITIONAL:
                yield argument, label, partial(function, make(), **given)
            else:
                key = "x" if parameter.kind is parameter.VAR_KEYWORD else argument
                yield argument, label, partial(function, **given, **{key: make()})


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="calls cannot be limited in time on Windows")
@pytest.mark.parametrize("name", _callables())
def test_nothing_but_a_sentence_comes_out(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    ONCE.get(name, lambda: None)()
    wrong = []
    for argument, label, call in cases(name):
        try:
            with _time_limit(), warnings.catch_warnings():
                warnings.simplefilter("ignore")
                call()
        except CreepkitError:
            pass
        except Exception as error:
            wrong.append(f"{argument} = {label}: {type(error).__name__}: {str(error)[:100]}")
    assert wrong == [], "\n".join(wrong)


def test_every_exception_is_a_public_name() -> None:
    assert NOT_CALLED.keys() <= set(ck.__all__)


@pytest.mark.parametrize("starts", [[(5, 900.0), (0, 1000.0)], [(0, 900.0), (0, 1000.0)], [(5, 900.0)], [], {"a": 1}])
def test_steps_out_of_order_are_refused(starts: Any) -> None:
    with pytest.raises(CreepkitError, match="steps"):
        ck.Program.steps(starts)


@pytest.mark.parametrize("state", [{"temperature": T} for T in (-5.0, 0.0, np.nan, 1e9, [1000.0, np.nan], "x")])
@pytest.mark.parametrize("source", ["fit", "average"])
def test_a_rate_is_of_a_state_of_a_material(source: str, state: dict[str, Any]) -> None:
    rated = _fit() if source == "fit" else ck.rank([_fit()]).model_average
    for quantity in (rated.rate, rated.local_exponent):
        with pytest.raises(CreepkitError, match="temperature"):
            quantity(stress=80.0, **state, warn=False)
        for stress in (np.nan, np.inf, 0.0, -1.0, "x"):
            with pytest.raises(CreepkitError, match="stress"):
                quantity(stress=stress, temperature=1000.0, warn=False)
    with pytest.raises(CreepkitError, match="temperature"):
        ck.rate_at(80.0, **state)
