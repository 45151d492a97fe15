"""Annotations as types: where a value is not what one allows, and the words for what is.

A class that a module imports for type checking alone is known by its name: where no instance exists yet, its module
need not be imported to say that a value is none.
"""

from __future__ import annotations

import builtins
import functools
import inspect
import math
import numbers
import os
import sys
import types
import typing
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, Union

SERIES = (Sequence, Collection, Iterable, list, set, frozenset, tuple)


class Array:
    """Stands for numpy's ArrayLike, a union that Python would take apart."""


def annotations_of(sources: Sequence[Any]) -> dict[str, Any]:
    """{argument: resolved annotation} of a function, or of a record and those that it derives from."""
    kinds: dict[str, Any] = {}
    for source in sources:
        names = _Names(vars(sys.modules[source.__module__]))
        for argument, annotation in inspect.get_annotations(source).items():
            if argument == "return":
                continue
            text = getattr(annotation, "__forward_arg__", annotation)
            kind = kinds[argument] = eval(text, {}, names) if isinstance(text, str) else text
            if typing.get_origin(kind) is typing.Unpack:  # the keys of a TypedDict
                kinds |= annotations_of(typing.get_args(kind))
    return kinds


class _Names(dict[str, Any]):
    """Names of a module as its annotations mean them; an alias may be a text."""

    def __getitem__(self, name: str) -> Any:
        if name == "ArrayLike":
            return Array
        if name.startswith("__"):  # asked of every namespace by debuggers
            raise KeyError(name)
        kind = self.get(name, getattr(builtins, name, None))
        if kind is None:
            return KnownByName(name, (), {})
        return eval(kind, {}, self) if isinstance(kind, str) else kind


class KnownByName(type):
    """Stands for a class that a module imports for type checking alone."""

    def __instancecheck__(cls, value: object) -> bool:
        return cls.__name__ in {one.__name__ for one in type(value).__mro__}


class Mismatch(typing.NamedTuple):
    """Where in an argument, as '[3]', what stands there, and what is allowed in words."""

    place: str
    value: Any
    allowed: str


class Kind(typing.NamedTuple):
    """What an annotation allows.

    words : such as "a list, each item a text". test : of the value as a whole. parts : (index or key, part, its kind)
    of a value that passed. members : of a union, one of which is enough.
    """

    words: str
    test: Callable[[Any], bool] = lambda value: True
    parts: Callable[[Any], Iterable[tuple[Any, Any, Kind]]] | None = None
    members: tuple[Kind, ...] = ()

    def mismatch(self, value: Any) -> Mismatch | None:
        """Where a value is not what is allowed, deepest in it; None of a value that is right."""
        if self.members:
            wrong = [one for member in self.members if (one := member.mismatch(value))]
            if len(wrong) < len(self.members):
                return None
            deepest = max(wrong, key=lambda one: one.place.count("["))
            return deepest._replace(allowed=_listed(one.allowed for one in wrong if one.place == deepest.place))
        if not self.test(value):
            return Mismatch("", value, self.words)
        for key, part, kind in self.parts(value) if self.parts else ():
            if within := kind.mismatch(part):
                return within._replace(place=f"[{key!r}]{within.place}")
        return None


@functools.cache
def kind_of(annotation: Any, finite: bool) -> Kind:
    """What a resolved annotation allows; finite : whether numbers must be, those of pairs such as bounds apart."""
    origin, args = typing.get_origin(annotation), typing.get_args(annotation)
    if annotation in SCALARS:
        return SCALARS[annotation]
    if annotation is float:
        return Kind(f"a {'finite ' * finite}number", lambda value: _is_number(value, finite))
    if annotation is Array or getattr(origin or annotation, "__name__", "") == "ndarray":
        return Kind("an array of numbers", _is_array)
    if origin in (Union, types.UnionType):
        members = tuple(kind_of(one, finite) for one in args if one is not str or Path not in args)  # a text is a path
        return Kind(_listed(one.words for one in members), members=members)
    if origin is Literal:  # which of them, the function itself says
        kinds = tuple({type(value) for value in args})
        return Kind(_listed(map(repr, args)), lambda value: isinstance(value, kinds))
    if origin is tuple and args[1:] != (...,):
        items = [kind_of(one, False) for one in args if one != ()]
        return Kind(
            f"({', '.join(one.words for one in items)})",
            lambda value: _is_series(value) and len(value) == len(items),
            lambda value: zip(range(len(items)), value, items, strict=True),
        )
    if origin in SERIES:
        item = kind_of(args[0], finite)
        if args[0] is Any:
            return Kind("a list", _is_series)
        words = f"a list, each item {item.words}"
        return Kind(words, _is_series, lambda value: ((k, one, item) for k, one in enumerate(value)))
    if isinstance(origin, type) and issubclass(origin, Mapping):
        pair = [kind_of(one, finite) for one in args]
        return Kind(
            f"a mapping of {pair[0].words} to {pair[1].words}",
            lambda value: isinstance(value, Mapping),
            lambda value: ((key, *one) for key in value for one in zip((key, value[key]), pair, strict=True)),
        )
    if Callable in (origin, annotation):
        return Kind("a function", callable)
    return _kind_of_class(origin or annotation)


def _kind_of_class(kind: Any) -> Kind:
    if not isinstance(kind, type) or kind in (Any, object):
        return Kind("anything")
    words = f"{'an' if kind.__name__[0] in 'AEIOU' else 'a'} {kind.__name__}"
    if not getattr(kind, "_is_protocol", False):
        return Kind(words, lambda value: isinstance(value, kind))
    names = {name for one in kind.__mro__ if getattr(one, "_is_protocol", False) for name in vars(one)}
    members = sorted(name for name in names if name == "__call__" or not name.startswith("_"))
    if not getattr(kind, "_is_runtime_protocol", False):  # whose name tells a user nothing
        words = "a function" if "__call__" in members else f"an object with {' and '.join(members)}"
    return Kind(words, lambda value: not isinstance(value, type) and all(hasattr(value, one) for one in members))


def takes_several(annotation: Any) -> bool:
    """Whether several objects are wanted, so that a generator has to be read first."""
    kind = kind_of(annotation, True)
    return any(one.parts or one.test in (_is_series, _is_array) for one in (kind, *kind.members))


def _listed(allowed: Iterable[str]) -> str:
    unique = sorted(dict.fromkeys(allowed), key=lambda one: one == "None")
    return unique[0] if len(unique) == 1 else f"{', '.join(unique[:-1])} or {unique[-1]}"


def _is_number(value: Any, finite: bool) -> bool:
    if type(value) is not float:
        number_of_numpy = getattr(value, "shape", None) == () and getattr(value.dtype, "kind", "") in "fiu"
        if isinstance(value, bool) or not (number_of_numpy or isinstance(value, numbers.Real)):
            return False
    try:
        return math.isfinite(value) or not finite
    except OverflowError:
        return False


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


def _is_array(value: Any) -> bool:
    """Real numbers in an array, or what numpy makes one of."""
    if isinstance(value, str | bytes | Mapping) or not (hasattr(value, "__len__") or _is_number(value, finite=False)):
        return False
    import numpy as np  # which the definition of a law does without

    try:
        return np.asarray(value).dtype.kind in "fiub"
    except (TypeError, ValueError, RuntimeError, OverflowError):
        return False


SCALARS: dict[Any, Kind] = {
    None: Kind("None", lambda value: value is None),
    type(None): Kind("None", lambda value: value is None),
    str: Kind("a text", lambda value: isinstance(value, str)),
    int: Kind("a whole number below 2**63", _is_integer),
    bool: Kind("True or False", lambda value: isinstance(value, bool) or type(value).__name__ in ("bool_", "bool")),
    Path: Kind("a path", _is_path),
}
