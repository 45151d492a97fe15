"""Sentences about wrong arguments: what, where, and what is allowed."""

from __future__ import annotations

import importlib
import inspect
import math
import re
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Protocol, Unpack, get_origin

import numpy as np
import sympy

import creepkit as ck
from creepkit import limits
from creepkit.arrays import ArrayLike, Floats
from creepkit.checked_arguments import KnownByName, annotations_of, checked
from creepkit.errors import ArgumentError, CreepkitError
from helpers.mistakes import said_otherwise
from helpers.source_tree import public_classes

if TYPE_CHECKING:
    from creepkit.records import History


class Painter(Protocol):
    def paint(self) -> None: ...


class Callback(Protocol):
    def __call__(self, done: int) -> None: ...


@checked
def rate(
    stress: float = 1.0,
    *,
    limit: float = math.inf,
    tests: Sequence[History] = (),
    cycles: int = 1,
    method: Literal["a", "b"] | None = None,
    share: Annotated[float, limits.numbers(0, 1, above=True)] | None = None,
    workers: Annotated[int, limits.Limits(1, 8)] = 1,
    title: str = "",
    to: str | Path = "",
    quick: bool = False,
    bounds: tuple[float, float] = (0.0, 1.0),
    pairs: Sequence[tuple[float, str]] = (),
    times: ArrayLike | None = None,
    values: Floats | None = None,
    outputs: Mapping[str, float | None] | None = None,
    control: Literal["load", "stress"] = "load",
    law: ck.CreepLaw | str | None = None,
    painter: Painter | None = None,
    progress: Callback | None = None,
    then: Callable[[], None] | None = None,
    names: Iterable[str] = (),
) -> tuple[Any, ...]:
    """What was given, as it arrives."""
    return stress, tests, names, times


@dataclass(frozen=True)
class _Base:
    level: float


@checked
@dataclass(frozen=True)
class Record(_Base):
    """A record that judges one of its fields in its own words."""

    size: int = 1

    def __post_init__(self) -> None:
        if self.size == 0:
            raise CreepkitError("size is 0; a record holds something")


HISTORY = ck.History("a", [0.0, 1.0], {"strain": [0.0, 0.1]}, ck.constant_stress(50.0), 1000.0)
MISTAKES: list[tuple[Callable[[], Any], str]] = [
    (lambda: rate("abc"), "stress of rate() is 'abc'; allowed is a finite number"),
    (lambda: rate(math.nan), "stress of rate() is nan; allowed is a finite number"),
    (lambda: rate(True), "stress of rate() is True; allowed is a finite number"),
    (lambda: rate(limit="x"), "limit of rate() is 'x'; allowed is a number"),
    (lambda: rate(stres=1), "rate() takes no argument 'stres'; did you mean 'stress'?"),
    (lambda: rate(tests=3), "tests of rate() is 3; allowed is a list, each item a History"),
    (lambda: rate(tests=[HISTORY, 3]), "tests[1] of rate() is 3; allowed is a History"),
    (lambda: rate(tests="ab"), "tests of rate() is 'ab'; allowed is a list, each item a History"),
    (lambda: rate(cycles=1.5), "cycles of rate() is 1.5; allowed is a whole number below 2**63"),
    (lambda: rate(title=3), "title of rate() is 3; allowed is a text"),
    (lambda: rate(to=3), "to of rate() is 3; allowed is a path"),
    (lambda: rate(to="\0"), "to of rate() is '\\x00'; allowed is a path"),
    (lambda: rate(quick=1), "quick of rate() is 1; allowed is True or False"),
    (lambda: rate(bounds=(1.0, "x")), "bounds[1] of rate() is 'x'; allowed is a number"),
    (lambda: rate(bounds=(1.0,)), "bounds of rate() is (1.0,); allowed is (a number, a number)"),
    (lambda: rate(pairs=[(1.0, "a"), (2.0, 3)]), "pairs[1][1] of rate() is 3; allowed is a text"),
    (lambda: rate(times="x"), "times of rate() is 'x'; allowed is an array of numbers or None"),
    (lambda: rate(values=[[1.0], [1.0, 2.0]]), "allowed is an array of numbers or None"),
    (lambda: rate(outputs={"a": "x"}), "outputs['a'] of rate() is 'x'; allowed is a finite number or None"),
    (lambda: rate(outputs={3: 1.0}), "outputs[3] of rate() is 3; allowed is a text"),
    (lambda: rate(control=3), "control of rate() is 3; allowed is 'load' or 'stress'"),
    (lambda: rate(control="force"), "control of rate() is 'force'; allowed is 'load' or 'stress'"),
    (lambda: rate(method="c"), "method of rate() is 'c'; allowed is 'a', 'b' or None"),
    (lambda: rate(share=1.5), "share of rate() is 1.5; allowed is a number above 0 up to 1 or None"),
    (lambda: rate(share=math.nan), "share of rate() is nan; allowed is a number above 0 up to 1 or None"),
    (lambda: rate(workers=0), "workers of rate() is 0; allowed is a whole number from 1 to 8"),
    (lambda: rate(workers=2.5), "workers of rate() is 2.5; allowed is a whole number from 1 to 8"),
    (lambda: rate(workers=10**400), "workers of rate() is 1000000000000000000000000000000000000...; allowed is a"),
    (lambda: rate(law=3), "law of rate() is 3; allowed is a CreepLaw, a text or None"),
    (lambda: rate(painter=3), "painter of rate() is 3; allowed is an object with paint or None"),
    (lambda: rate(progress=3), "progress of rate() is 3; allowed is a function or None"),
    (lambda: Record("x"), "level of Record() is 'x'; allowed is a finite number"),
    (lambda: Record("x", size=0), "size is 0; a record holds something"),
    (lambda: ck.Param("exponent", bound=(1, 8)), "Param() takes no argument 'bound'; did you mean 'bounds'"),
    (lambda: ck.constant_stress(stres=1.0), "constant_stress() takes no argument 'stres'; did you mean 'stress'"),
    (
        lambda: ck.Param("exponent", (1, 8), scale="logarithmic"),
        "scale of Param() is 'logarithmic'; allowed is 'linear' or 'log'",
    ),
    (lambda: ck.law("norton").at("hot"), "temperature of CreepLaw.at() is 'hot'; allowed is a finite number"),
    (lambda: ck.ClockAlignment.stated(math.nan), "lag of ClockAlignment.stated() is nan; allowed is a finite number"),
    (lambda: ck.wachtman(1e5, math.inf, 300.0), "b of wachtman() is inf; allowed is a finite number"),
]


def test_each_mistake_has_its_sentence() -> None:
    assert not said_otherwise((call, re.escape(sentence)) for call, sentence in MISTAKES)
    assert issubclass(ArgumentError, TypeError)
    assert issubclass(ArgumentError, ValueError)


RIGHT: list[dict[str, Any]] = [
    {"stress": value} for value in (1, 1.0, np.float32(1), np.int64(1), np.array(1.0), sympy.Rational(1, 2), 10**200)
]
RIGHT += [{"limit": value} for value in (math.inf, math.nan, 1)]
RIGHT += [{"cycles": np.int32(3)}, {"quick": np.bool_(True)}, {"bounds": [0, np.inf]}, {"bounds": np.array([0.0, 1.0])}]
RIGHT += [{"tests": value} for value in ([], (HISTORY,), np.array([HISTORY], dtype=object))]
RIGHT += [{"times": value} for value in (1.0, [1, 2], [[1.0], [2.0]], np.zeros((2, 3)), range(3), [], np.array([True]))]
RIGHT += [{"painter": type("P", (), {"paint": print})()}, {"progress": print}, {"then": print}, {"law": "x"}]
RIGHT += [{"names": value} for value in (["a"], {"a"}, {"a": 1}.keys(), np.array(["a"]))]
RIGHT += [{"outputs": {"a": 1.0, "b": None}}, {"to": Path("x")}, {"pairs": [(1, "a")]}]


def test_what_is_right_arrives_as_it_is() -> None:
    for arguments in RIGHT:
        result = rate(**arguments)
        for value in arguments.values():
            if "names" not in arguments or isinstance(value, list):
                assert arguments.keys() & {"stress", "tests", "times"} == set() or any(value is one for one in result)
    assert rate(tests=(one for one in [HISTORY]))[1] == [HISTORY]
    assert rate(names=(one for one in "ab"))[2] == ["a", "b"]
    assert inspect.signature(rate).parameters["stress"].default == 1.0


def test_a_class_known_by_its_name_alone_is_a_class_of_creepkit_and_no_protocol() -> None:
    """Of a protocol or an alias that is imported for type checking alone, the name would say nothing."""
    by_name = dict(public_classes())
    wrong = []
    for name in ck.__all__:
        public = getattr(ck, name)
        outer = public.__init__ if inspect.isclass(public) else public
        function = inspect.unwrap(outer)
        if function is outer or not hasattr(function, "__code__"):  # not checked
            continue
        hints = annotations_of([public if is_dataclass(public) else function]).values()
        for kind in _parts([hint for hint in hints if get_origin(hint) is not Unpack]):
            if isinstance(kind, KnownByName):
                home = by_name.get(kind.__name__)
                if home is None or vars(getattr(importlib.import_module(home), kind.__name__)).get("_is_protocol"):
                    wrong.append(f"{name}: {kind.__name__}")
    assert not wrong, "\n".join(wrong)


def _parts(kinds: Iterable[Any]) -> Iterable[Any]:
    for kind in kinds:
        yield kind
        yield from _parts(kind if isinstance(kind, list) else getattr(kind, "__args__", ()))


def test_a_law_is_defined_without_pydantic_and_numpy() -> None:
    program = "import sys, creepkit.laws.norton"
    loaded = subprocess.run(
        [sys.executable, "-c", f"{program}; print(*sys.modules)"], check=True, capture_output=True, text=True
    ).stdout.split()
    assert not {"pydantic", "numpy"} & set(loaded)
