"""Whether a value is what an annotation says: one quick test for each annotation, and the words for it."""

from __future__ import annotations

import ast
import collections.abc
import importlib
import math
import numbers
import os
import sys
import types
import typing
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from creepkit.errors import quoted

LARGEST_INTEGER = 2**63 - 1
LARGEST_NAME = 255
"""Bytes of one part of a path."""


Part = tuple[str, Any, str]
"""(place such as '[3]', what stands there, what is allowed there)."""


def _no_parts(value: Any) -> Iterator[Part]:
    yield from ()


@dataclass(frozen=True)
class Check:
    """accepts : of a value. words : what is allowed. several : where a tuple is right. parts : that are wrong.

    named : the checks of a TypedDict by key.
    """

    accepts: Callable[[Any], bool]
    words: str
    several: bool = False
    parts: Callable[[Any], Iterator[Part]] = _no_parts
    named: Mapping[str, Check] | None = None

    def wrong_part(self, value: Any) -> Part:
        """Where a value is wrong, what stands there, and what is allowed."""
        return next(self.parts(value), ("", value, self.words))


ANYTHING = Check(lambda value: True, "anything")
NOTHING = Check(lambda value: value is None, "None")
TEXT = Check(lambda value: isinstance(value, str), "a text")
CALLABLE = Check(callable, "a function")


def is_finite_number(value: object) -> bool:
    """Whether a default lets only finite numbers pass: all but nan and the infinities."""
    return not (isinstance(value, float) and not math.isfinite(value))


def _is_number(value: Any) -> bool:
    kind: type = type(value)
    if kind is float or kind is bool:
        return kind is float
    if isinstance(value, numbers.Real):
        return not isinstance(value, numbers.Integral) or abs(int(value)) < 10**300
    return getattr(value, "shape", None) == () and getattr(getattr(value, "dtype", None), "kind", "") in "fiu"


def _is_finite(value: Any) -> bool:
    return _is_number(value) and math.isfinite(value)


def _is_integer(value: Any) -> bool:
    return type(value) is not bool and isinstance(value, numbers.Integral) and abs(int(value)) <= LARGEST_INTEGER


def _is_truth(value: Any) -> bool:
    return isinstance(value, bool) or getattr(getattr(value, "dtype", None), "kind", "") == "b"


def _is_path(value: Any) -> bool:
    if not isinstance(value, str | Path):
        return False
    try:
        encoded = os.fsencode(value)
    except ValueError:  # of characters that no file name has
        return False
    parts = encoded.replace(b"\\", b"/").split(b"/")
    return b"\0" not in encoded and max(map(len, parts)) <= LARGEST_NAME


def _is_array(value: Any) -> bool:
    """Real numbers in an array, or what numpy makes one of."""
    import numpy as np

    if not isinstance(value, np.ndarray):
        if (
            value is None
            or isinstance(value, str | bytes | Mapping)
            or not (hasattr(value, "__len__") or hasattr(value, "__array__") or _is_number(value))
        ):
            return False
        try:
            value = np.asarray(value)
        except (TypeError, ValueError, RuntimeError, OverflowError):
            return False
    return value.dtype.kind in "fiub"


NUMBER, FINITE = Check(_is_number, "a number"), Check(_is_finite, "a finite number")
INTEGER, TRUTH = Check(_is_integer, "a whole number below 2**63"), Check(_is_truth, "True or False")
PATH = Check(_is_path, "a path")
ARRAY = Check(_is_array, "an array of numbers", several=True)


def check_of(annotation: Any, names: Mapping[str, Any], *, finite: bool = True) -> Check:
    """The check of an annotation, a type or its text; of what cannot be resolved, none.

    finite : whether single numbers must be.
    """
    if isinstance(annotation, str):
        try:
            annotation = eval(annotation, {}, names)
        except Exception:  # of a name that no module of this installation has
            return ANYTHING
    return _Checks(names, finite).of(annotation)


@dataclass(frozen=True)
class _Checks:
    names: Mapping[str, Any]
    finite: bool

    def of(self, annotation: Any) -> Check:
        if isinstance(annotation, str | typing.ForwardRef):
            return check_of(getattr(annotation, "__forward_arg__", annotation), self.names, finite=self.finite)
        simple: dict[Any, Check] = {
            None: NOTHING,
            type(None): NOTHING,
            str: TEXT,
            int: INTEGER,
            bool: TRUTH,
            Path: PATH,
            Any: ANYTHING,
        }
        simple |= {float: FINITE if self.finite else NUMBER, object: ANYTHING, _ArrayLike: ARRAY}
        if isinstance(annotation, collections.abc.Hashable) and annotation in simple:
            return simple[annotation]
        origin, args = typing.get_origin(annotation), typing.get_args(annotation)
        if origin in (typing.Union, types.UnionType):
            return self._one_of(args)
        if origin is Literal:
            return self._literal(args)
        if origin is typing.Unpack or origin is typing.Annotated:
            return self.of(args[0])
        if origin is type:
            return Check(lambda value: isinstance(value, type), "a class")
        if _is_numpy_array(origin or annotation):
            return ARRAY
        alias = origin if hasattr(origin, "__value__") else annotation if hasattr(annotation, "__value__") else None
        if alias is not None:  # newer releases of NumPy define NDArray as one
            return self.of(alias.__value__[args] if args else alias.__value__)
        if origin in (tuple, list):
            return self._tuple(args) if origin is tuple and args and args[-1] is not ... else self._several(args)
        if isinstance(origin, type) and issubclass(origin, Mapping):
            return self._mapping(args)
        if origin is collections.abc.Callable or annotation is collections.abc.Callable:
            return CALLABLE
        if origin in (collections.abc.Sequence, collections.abc.Collection, collections.abc.Iterable, set, frozenset):
            return self._several(args)
        if typing.is_typeddict(annotation):
            hints = {key: check_of(_unwrapped(hint), self.names) for key, hint in annotation.__annotations__.items()}
            return Check(lambda value: isinstance(value, Mapping), "a mapping", named=hints)
        return self._instance(origin or annotation)

    def _one_of(self, kinds: tuple[Any, ...]) -> Check:
        if Path in kinds:  # a text is one as well
            kinds = tuple(kind for kind in kinds if kind is not str)
        checks = sorted(map(self.of, kinds), key=lambda check: check is not NOTHING)
        if ANYTHING in checks:
            return ANYTHING
        tests = tuple(check.accepts for check in checks)
        several = tuple(check for check in checks if check.several)

        def parts(value: Any) -> Iterator[Part]:
            for check in several:
                if check.several and isinstance(value, list | tuple | Mapping):
                    yield from check.parts(value)

        words = _listed(
            [check.words for check in [*checks[1:], checks[0]]]
            if NOTHING in checks
            else [check.words for check in checks]
        )
        return Check(lambda value: any(test(value) for test in tests), words, bool(several), parts)

    def _literal(self, values: tuple[Any, ...]) -> Check:
        """Of the type of one of the values; which of them, the function itself says in words of its own."""
        kinds = tuple({type(value) for value in values})
        return Check(lambda value: isinstance(value, kinds), _listed([repr(value) for value in values]))

    def _tuple(self, args: tuple[Any, ...]) -> Check:
        checks = tuple(_Checks(self.names, finite=False).of(kind) for kind in args if kind != ())

        def accepts(value: Any) -> bool:
            if not _is_series(value) or len(value) != len(checks):
                return False
            return all(check.accepts(one) for check, one in zip(checks, value, strict=True))

        words = f"({', '.join(check.words for check in checks)})" if checks else "()"
        return Check(accepts, words, several=True)

    def _several(self, args: tuple[Any, ...]) -> Check:
        each = self.of(args[0]) if args else ANYTHING

        def accepts(value: Any) -> bool:
            return _is_series(value) and all(map(each.accepts, value))

        def parts(value: Any) -> Iterator[Part]:
            for k, one in enumerate(value if _is_series(value) else ()):
                if not each.accepts(one):
                    place, wrong, words = each.wrong_part(one)
                    yield f"[{k}]{place}", wrong, words

        words = "a list" if each is ANYTHING else f"a list, each item {each.words}"
        return Check(accepts, words, several=True, parts=parts)

    def _mapping(self, args: tuple[Any, ...]) -> Check:
        key, each = (self.of(args[0]), self.of(args[1])) if args else (ANYTHING, ANYTHING)

        def accepts(value: Any) -> bool:
            return isinstance(value, Mapping) and all(key.accepts(k) and each.accepts(v) for k, v in value.items())

        def parts(value: Any) -> Iterator[Part]:
            for k, one in value.items() if isinstance(value, Mapping) else ():
                if key.accepts(k) and not each.accepts(one):
                    place, wrong, words = each.wrong_part(one)
                    yield f"[{quoted(k)!r}]{place}", wrong, words

        return Check(accepts, f"a mapping of {key.words} to {each.words}", parts=parts, several=False)

    def _instance(self, kind: Any) -> Check:
        if not isinstance(kind, type):
            return ANYTHING
        if getattr(kind, "_is_protocol", False) and not getattr(kind, "_is_runtime_protocol", False):
            return _protocol(kind)
        article = "an" if kind.__name__[0] in "AEIOU" else "a"
        return Check(lambda value: isinstance(value, kind), f"{article} {kind.__name__}")


def _protocol(kind: type) -> Check:
    """What has the methods and properties of a protocol; a function where it is called."""
    members = {name for one in kind.__mro__ if getattr(one, "_is_protocol", False) for name in vars(one)}
    if "__call__" in members:
        return CALLABLE
    names = sorted(name for name in members if not name.startswith("_"))
    return Check(
        lambda value: not isinstance(value, type) and all(hasattr(value, name) for name in names),
        f"an object with {' and '.join(names)}",
    )


def _is_series(value: Any) -> bool:
    """Several objects that can be read again."""
    if isinstance(value, list | tuple):
        return True
    if isinstance(value, str | bytes | bytearray | Mapping) or not hasattr(value, "__len__"):
        return False
    shape = getattr(value, "shape", None)
    if isinstance(shape, tuple) and (shape == () or 0 in shape):  # an array of nothing has no truth value
        return False
    return hasattr(value, "__iter__")


MOST_LEVELS = 100
"""Of lists in lists; Python prints a thousand at most."""


def is_nested_deep(value: Any) -> bool:
    """Whether lists, tuples and mappings stand in one another in more levels than any argument has."""
    waiting, looked_at = [(value, 0)], 0
    while waiting and looked_at < 100_000:
        looked_at += 1
        one, level = waiting.pop()
        if level > MOST_LEVELS:
            return True
        if isinstance(one, list | tuple):
            waiting += [(item, level + 1) for item in one]
        elif isinstance(one, Mapping):
            waiting += [(item, level + 1) for item in one.values()]
    return False


def _is_numpy_array(kind: Any) -> bool:
    numpy = sys.modules.get("numpy")
    return numpy is not None and kind is numpy.ndarray


def _unwrapped(hint: Any) -> Any:
    return getattr(hint, "__forward_arg__", hint)


def _listed(words: list[str]) -> str:
    unique = list(dict.fromkeys(words))
    return unique[0] if len(unique) == 1 else f"{', '.join(unique[:-1])} or {unique[-1]}"


class _ArrayLike:
    """Stands for numpy's type of that name, a union that would be taken apart."""


class _Later(type):
    """The type of a class that is imported for type checking alone: no instance exists before its module does."""

    home: str

    def __instancecheck__(cls, value: object) -> bool:
        module = sys.modules.get(cls.home) or importlib.import_module(cls.home)
        return check_of(getattr(module, cls.__name__), names_of_module(vars(module))).accepts(value)


class _Names(dict[str, Any]):
    """Names of a module as its annotations mean them, also those that are imported for type checking alone."""

    def __init__(self, module: Mapping[str, Any]) -> None:
        super().__init__(ArrayLike=_ArrayLike)
        self._module = module

    def __missing__(self, name: str) -> Any:
        if name in self._module:
            return self._module[name]
        builtin = getattr(importlib.import_module("builtins"), name, None)
        if builtin is not None:
            return builtin
        home = _imported_for_checking(self._module.get("__file__") or "")[name]
        if not home.startswith("creepkit"):
            return getattr(importlib.import_module(home), name)
        self[name] = _Later(name, (), {"home": home})
        return self[name]


_NAMES: dict[str, _Names] = {}


def names_of_module(module: Mapping[str, Any]) -> Mapping[str, Any]:
    """The names that annotations of a module mean; module : its globals."""
    name = str(module.get("__name__"))
    if name not in _NAMES:
        _NAMES[name] = _Names(module)
    return _NAMES[name]


def _imported_for_checking(path: str) -> dict[str, str]:
    """{name: module} of what a source file imports for type checking alone."""
    try:
        tree = ast.parse(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError, SyntaxError):
        return {}
    found: dict[str, str] = {}
    for node in tree.body:
        if isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING"):
            for one in node.body:
                if isinstance(one, ast.ImportFrom) and one.module and not one.level:
                    found |= {alias.asname or alias.name: one.module for alias in one.names}
    return found
