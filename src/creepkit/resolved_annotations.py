"""Annotations of functions and records as types, and which values are plainly of them.

A class that a module imports for type checking alone is known by its name: where no instance exists yet, its module
need not be imported to say that a value is none.
"""

from __future__ import annotations

import builtins
import functools
import inspect
import sys
import types
import typing
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any


def is_plainly(value: Any, kind: Any) -> bool:
    """Whether a value is what a resolved annotation says beyond doubt: a finite float, a str, a list of them."""
    origin, args = typing.get_origin(kind), typing.get_args(kind)
    if kind is Any or (kind is None and value is None) or (origin is Callable and callable(value)):
        return True
    if kind in (float, int):
        return type(value) in (int, kind) and -(2**63) < value < 2**63
    if isinstance(kind, type) and origin is None:
        return kind is not Path and is_instance(value, kind)
    if origin in (typing.Union, types.UnionType):
        return (value is None or Path not in args) and any(is_plainly(value, one) for one in args)
    if origin is typing.Literal:
        return type(value) is str and value in args
    if origin in (Sequence, list, tuple) and type(value) in (list, tuple):
        if origin is tuple and args[1:] != (...,):
            return len(value) == len(args) and all(map(is_plainly, value, args))
        return all(is_plainly(one, args[0]) for one in value)
    if origin is Mapping and type(value) in (dict, types.MappingProxyType):
        return all(is_plainly(key, args[0]) and is_plainly(one, args[1]) for key, one in value.items())
    return False


def is_instance(value: Any, kind: type) -> bool:
    """Whether a value is of a class, or an object that has all that a protocol asks for."""
    if not getattr(kind, "_is_protocol", False):
        return isinstance(value, kind)
    return not isinstance(value, type) and all(hasattr(value, one) for one in protocol_members(kind))


@functools.cache
def protocol_members(kind: type) -> list[str]:
    """The methods and properties of a protocol, by name."""
    names = {name for one in kind.__mro__ if getattr(one, "_is_protocol", False) for name in vars(one)}
    return sorted(name for name in names if name == "__call__" or not name.startswith("_"))


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


class Array:
    """Stands for numpy's ArrayLike, a union that Python would take apart."""


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
