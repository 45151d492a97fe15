"""What pydantic makes of an annotation, and the words for what it allows."""

from __future__ import annotations

import functools
import math
import numbers
import os
import types
import typing
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, Union

import numpy as np
from pydantic import BeforeValidator, PlainValidator, TypeAdapter, ValidationError
from pydantic_core import PydanticCustomError

from creepkit.errors import ArgumentError, quoted_value
from creepkit.resolved_annotations import Array, is_instance, protocol_members

UNIONS = (Union, types.UnionType)
SERIES = (Sequence, Collection, Iterable, list, set, frozenset, tuple)


def judged_value(value: Any, kind: Any, argument: str, function: str, *, finite: bool) -> Any:
    """The value itself, or a list of what a generator gives; ArgumentError where its annotation does not allow it.

    kind : the resolved annotation. finite : whether numbers must be.
    """
    if isinstance(value, Iterator) and _takes_several(kind):
        value = list(value)
    try:
        _validator(kind, finite).validate_python(value)
    except ValidationError as error:
        place, wrong, allowed = _first_wrong(error)
        text = f"{argument}{place} of {function} is {quoted_value(wrong)}; allowed is {allowed}"
        raise ArgumentError(text, argument) from None
    return value


@functools.cache
def _validator(kind: Any, finite: bool) -> TypeAdapter[Any]:
    return TypeAdapter(_adapted(kind, finite)[0])


def _takes_several(kind: Any) -> bool:
    origin, args = typing.get_origin(kind), typing.get_args(kind)
    return any(map(_takes_several, args)) if origin in UNIONS else origin in SERIES or _is_array_type(kind)


def _first_wrong(error: ValidationError) -> tuple[str, Any, str]:
    """Where a value is wrong, as '[3]', deepest in it, what stands there, and all that is allowed there."""
    allowed: dict[str, list[str]] = {}
    wrong: dict[str, Any] = {}
    for one in error.errors(include_url=False):
        # the members of a union stand in a location beside indices and keys, under the names of our functions
        parts = [part for part in one["loc"] if not str(part).startswith("function-") and part != "[key]"]
        place = "".join(f"[{part!r}]" for part in parts)
        allowed.setdefault(place, []).append(one["msg"])
        wrong.setdefault(place, one["input"])
    deepest = max(allowed, key=lambda place: place.count("["))
    return deepest, wrong[deepest], _listed(allowed[deepest])


def _listed(words: list[str]) -> str:
    unique = sorted(dict.fromkeys(words), key=lambda one: one == "None")
    return unique[0] if len(unique) == 1 else f"{', '.join(unique[:-1])} or {unique[-1]}"


Adapted = tuple[Any, str]
"""(type for pydantic, what it allows in words)."""


def _adapted(kind: Any, finite: bool) -> Adapted:
    """An annotation as pydantic is to judge it: numbers of numpy are numbers, and True is none."""
    origin, args = typing.get_origin(kind), typing.get_args(kind)
    if kind in TESTS:
        return _tested(*TESTS[kind])
    if kind is float:
        return _tested(_is_finite, "a finite number") if finite else _tested(_is_number, "a number")
    if _is_array_type(kind):
        return _tested(_is_array, "an array of numbers")
    if origin in UNIONS:
        members = [_adapted(one, finite) for one in args if one is not str or Path not in args]  # a text is a path too
        return Union[tuple(member for member, _ in members)], _listed([words for _, words in members])  # noqa: UP007
    if origin is Literal:
        kinds = tuple({type(value) for value in args})  # which of them, the function itself says
        return _tested(lambda value: isinstance(value, kinds), _listed([repr(value) for value in args]))
    if origin is tuple and args[1:] != (...,):
        items = [_adapted(one, finite=False) for one in args if one != ()]
        words = f"({', '.join(words for _, words in items)})"
        return _container(tuple[tuple(item for item, _ in items)], tuple, words, len(items))  # type: ignore[misc]
    if origin in SERIES:
        item, words = _adapted(args[0], finite)
        return _container(list[item], list, "a list" if item is Any else f"a list, each item {words}")  # type: ignore[valid-type]
    if isinstance(origin, type) and issubclass(origin, Mapping):
        (key, name), (item, words) = _adapted(args[0], finite), _adapted(args[1], finite)
        return _container(dict[key, item], dict, f"a mapping of {name} to {words}")  # type: ignore[valid-type]
    if Callable in (origin, kind):
        return _tested(callable, "a function")
    return _instance(kind if origin is None else origin)


def _instance(kind: Any) -> Adapted:
    if not isinstance(kind, type) or kind in (Any, object):
        return Any, "anything"
    words = f"{'an' if kind.__name__[0] in 'AEIOU' else 'a'} {kind.__name__}"
    if getattr(kind, "_is_protocol", False) and not getattr(kind, "_is_runtime_protocol", False):
        members = protocol_members(kind)
        words = "a function" if "__call__" in members else f"an object with {' and '.join(members)}"
    return _tested(lambda value: is_instance(value, kind), words)


def _tested(test: Callable[[Any], bool], words: str) -> Adapted:
    """What passes a test."""
    return Annotated[Any, PlainValidator(_refusing(test, words))], words


def _container(kind: Any, make: type, words: str, length: int | None = None) -> Adapted:
    """A list, tuple or dict of what pydantic judges item by item, made of what is one in numpy's sense too."""

    def convertible(value: Any) -> bool:
        right = isinstance(value, Mapping) if make is dict else _is_series(value)
        return right and length in (None, len(value))

    return Annotated[kind, BeforeValidator(_refusing(convertible, words, make))], words


def _refusing(test: Callable[[Any], bool], words: str, make: Any = lambda value: value) -> Callable[[Any], Any]:
    def made_or_refused(value: Any) -> Any:
        if not test(value):
            raise PydanticCustomError("not_allowed", "{words}", {"words": words})
        return make(value)

    return made_or_refused


def _is_number(value: Any) -> bool:
    number_of_numpy = getattr(value, "shape", None) == () and getattr(value.dtype, "kind", "") in "fiu"
    if isinstance(value, bool) or not (number_of_numpy or isinstance(value, numbers.Real)):
        return False
    try:
        return math.isfinite(value) or True
    except OverflowError:
        return False


def _is_finite(value: Any) -> bool:
    return _is_number(value) and math.isfinite(value)


def _is_integer(value: Any) -> bool:
    return not isinstance(value, bool) and isinstance(value, numbers.Integral) and abs(int(value)) < 2**63


def _is_path(value: Any) -> bool:
    try:
        parts = os.fsencode(value).replace(b"\\", b"/").split(b"/") if isinstance(value, str | Path) else [b"\0"]
    except ValueError:  # of characters that no file name has
        return False
    return not any(b"\0" in part or len(part) > 255 for part in parts)  # bytes of one name


def _is_series(value: Any) -> bool:
    """Several objects that can be read again; no array of rows without rows."""
    if isinstance(value, str | bytes | bytearray | Mapping) or not isinstance(value, Iterable):
        return False
    shape = getattr(value, "shape", (1,))
    return hasattr(value, "__len__") and shape != () and 0 not in shape[1:] and shape[:1] != (0,)


def _is_array_type(kind: Any) -> bool:
    return kind is Array or np.ndarray in (kind, typing.get_origin(kind))


def _is_array(value: Any) -> bool:
    """Real numbers in an array, or what numpy makes one of."""
    if isinstance(value, str | bytes | Mapping) or not (hasattr(value, "__len__") or _is_number(value)):
        return False
    try:
        return np.asarray(value).dtype.kind in "fiub"
    except (TypeError, ValueError, RuntimeError, OverflowError):
        return False


TESTS: dict[Any, tuple[Callable[[Any], bool], str]] = {
    None: (lambda value: value is None, "None"),
    type(None): (lambda value: value is None, "None"),
    str: (lambda value: isinstance(value, str), "a text"),
    int: (_is_integer, "a whole number below 2**63"),
    bool: (lambda value: isinstance(value, bool | np.bool_), "True or False"),
    Path: (_is_path, "a path"),
}
