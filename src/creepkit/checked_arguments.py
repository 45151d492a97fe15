"""Arguments of public functions and records, checked against their annotations before anything is done with them.

@checked
def rate(stress: float, tests: Sequence[History]) -> float: ...

raises an ArgumentError, in one sentence, for a text in the place of the stress. What is right is passed on as it is,
except that a generator becomes a list where several objects are wanted, as it can be read only once.

A class that a module imports for type checking alone is known by its name: where no instance exists yet, its module
need not be imported to say that a value is none. pydantic, which would have to import it, takes longer to import than a
law to be made.
"""

from __future__ import annotations

import builtins
import contextlib
import functools
import inspect
import math
import numbers
import os
import sys
import types
import typing
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, TypeVar, Union

from creepkit.errors import ArgumentError, nearest, quoted_value
from creepkit.limits import ANY_NUMBER, FINITE, Limits

Anything = TypeVar("Anything", bound=Callable[..., Any])


WITHOUT_A_SENTENCE = (ArithmeticError, AttributeError, LookupError, OSError, RecursionError, TypeError, ValueError)
"""Errors of Python's in place of which the error of a check is raised."""


# ---- functions and records that check ------------------------------------------------------------------------------


def checked(public: Anything) -> Anything:
    """The function, or the class with a constructor, that checks its arguments; signature and docstring stay.

    Numbers must be finite, unless the default is not or the annotation has other limits; those of pairs such as bounds
    may be infinite. What a constructor itself says of a wrong value comes first.
    """
    if not inspect.isclass(public):
        return typing.cast(Anything, _checked_function(public, public, [public]))
    name = "__init__" if "__init__" in public.__dict__ else "__new__"
    constructor = inspect.unwrap(getattr(public, name))
    generated = is_dataclass(public) and not constructor.__code__.co_filename.endswith(".py")
    sources = [one for one in reversed(public.__mro__) if is_dataclass(one)] if generated else [constructor]
    replacement = _checked_function(constructor, public, sources)
    setattr(public, name, replacement)  # of __new__ a static method, as Python takes it for one
    return public


def _checked_function(function: Any, public: Any, annotated: Sequence[Any]) -> Any:
    """The function that checks; public : itself, or its class. annotated : what has its annotations.

    Of records of options, whose fields are arguments of functions, errors name these alone.
    """
    name, constructs = f"{public.__qualname__}()", public is not function
    of = "" if hasattr(public, "fields_are_arguments") else f" of {name}"

    @functools.cache
    def arguments() -> _Arguments:
        return _Arguments(name, of, inspect.signature(function).parameters, annotations_of(annotated))

    @functools.wraps(function)
    def checking(*args: Any, **kwargs: Any) -> Any:
        try:
            args, kwargs = arguments().checked(args, kwargs)
        except ArgumentError:
            if constructs:
                with contextlib.suppress(*WITHOUT_A_SENTENCE):
                    function(*args, **kwargs)
            raise
        return function(*args, **kwargs)

    return checking


class _Arguments:
    """The arguments of one function, made when it is first called.

    kinds : {argument: (what is allowed, whether several objects are)}. positional : names in order, of which the last,
    `further`, goes on for all that follow.
    """

    def __init__(
        self, name: str, of: str, parameters: Mapping[str, inspect.Parameter], hints: Mapping[str, Any]
    ) -> None:
        several = {one.kind: one.name for one in parameters.values()}
        self.name, self.of, self.parameters = name, of, parameters
        self.positional = [one.name for one in parameters.values() if one.kind <= one.POSITIONAL_OR_KEYWORD]
        self.further = several.get(inspect.Parameter.VAR_POSITIONAL, "")
        self.options = several.get(inspect.Parameter.VAR_KEYWORD, "")
        self.kinds = {"": _with_several(kind_of(Any))}
        for one in parameters.values():
            infinite = isinstance(one.default, float) and not math.isfinite(one.default)
            kind = kind_of(hints.get(one.name, Any), ANY_NUMBER if infinite else FINITE)
            self.kinds[one.name] = _with_several(kind)

    def checked(self, args: tuple[Any, ...], kwargs: dict[str, Any]) -> tuple[tuple[Any, ...], dict[str, Any]]:
        """The arguments of a call, with lists for generators; ArgumentError for a wrong one."""
        for argument in () if self.options else kwargs:
            if argument not in self.parameters:
                known = [one for one in self.parameters if one not in ("self", "cls")]
                raise ArgumentError(f"{self.name} takes no argument '{argument}'; {nearest(argument, known)}")
        further = [self.further] * (len(args) - len(self.positional))
        judged = tuple(map(self._judged, args, [*self.positional, *further][: len(args)]))
        return judged, {key: self._judged(value, key) for key, value in kwargs.items()}

    def _judged(self, value: Any, argument: str) -> Any:
        kind, several = self.kinds[argument if argument in self.kinds else self.options]
        if several and isinstance(value, Iterator):
            value = list(value)
        if wrong := kind.mismatch(value):
            raise ArgumentError(wrong.sentence(argument, self.of))
        return value


# ---- what an annotation allows ---------------------------------------------------------------------------------------


class Mismatch(NamedTuple):
    """Where in an argument, as '[3]', what stands there, and what is allowed in words."""

    place: str
    value: Any
    allowed: str

    def sentence(self, argument: str, of: str = "") -> str:
        """What is wrong with an argument; of : what it is an argument of."""
        return f"{argument}{self.place}{of} is {quoted_value(self.value)}; allowed is {self.allowed}"


class Kind(NamedTuple):
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
        wrong = []
        for member in self.members:
            if (one := member.mismatch(value)) is None:
                return None
            wrong.append(one)
        if wrong:
            deepest = max(wrong, key=lambda one: one.place.count("["))
            return deepest._replace(allowed=_listed(one.allowed for one in wrong if one.place == deepest.place))
        if not self.test(value):
            return Mismatch("", value, self.words)
        for key, part, kind in self.parts(value) if self.parts else ():
            if within := kind.mismatch(part):
                return within._replace(place=f"[{key!r}]{within.place}")
        return None


def _with_several(kind: Kind) -> tuple[Kind, bool]:
    """A kind, and whether it allows several objects, so that a generator has to be read first."""
    return kind, any(one.parts or one.test in (_is_series, _is_array) for one in (kind, *kind.members))


class Array:
    """Stands for numpy's ArrayLike, a union that Python would take apart."""


class KnownByName(type):
    """Stands for a class that a module imports for type checking alone."""

    def __instancecheck__(cls, value: object) -> bool:
        return cls.__name__ in {one.__name__ for one in type(value).__mro__}


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


def annotations_of(sources: Sequence[Any]) -> dict[str, Any]:
    """{argument: resolved annotation} of a function, or of a record and those that it derives from."""
    hints: dict[str, Any] = {}
    for source in sources:
        hints |= inspect.get_annotations(source, locals=_Names(vars(sys.modules[source.__module__])), eval_str=True)
        for one in fields(source) if is_dataclass(source) else ():
            if "limits" in one.metadata and one.name in hints:
                hints[one.name] = Annotated[hints[one.name], one.metadata["limits"]]
    return {argument: hint for argument, hint in hints.items() if argument != "return"}


SERIES = (Sequence, Collection, Iterable, list, set, frozenset, tuple)


@functools.cache
def kind_of(annotation: Any, limits: Limits = FINITE) -> Kind:
    """What a resolved annotation allows; limits : of its numbers, but for finite ones those of pairs such as bounds.

    Annotated[..., Limits(...)] has its own, and Annotated[..., "a text"] its own words.
    """
    origin, args = typing.get_origin(annotation), typing.get_args(annotation)
    if annotation in SCALARS:
        return SCALARS[annotation]
    if origin is Annotated:
        kind = kind_of(args[0], next((one for one in args[1:] if isinstance(one, Limits)), limits))
        return kind._replace(words=next((one for one in args[1:] if isinstance(one, str)), kind.words))
    if annotation is float:
        return Kind(str(limits), limits.__contains__)
    if annotation is int:
        test = _is_integer if not limits.whole else lambda value: _is_integer(value) and value in limits
        return Kind(str(limits) if limits.whole else "a whole number below 2**63", test)
    if annotation is Array or getattr(origin or annotation, "__name__", "") == "ndarray":
        return Kind("an array of numbers", _is_array)
    if origin in (Union, types.UnionType):
        kinds = [kind_of(one, limits) for one in args if one is not str or Path not in args]  # a text is a path
        return _union(part for one in kinds for part in one.members or (one,))
    if origin is Literal:
        return _union(Kind(repr(one), functools.partial(_is_word, one)) for one in args)
    if origin is tuple and args[1:] != (...,):
        items = [kind_of(one, ANY_NUMBER if limits == FINITE else limits) for one in args if one != ()]
        return Kind(
            f"({', '.join(one.words for one in items)})",
            lambda value: _is_series(value) and len(value) == len(items),
            lambda value: zip(range(len(items)), value, items, strict=True),
        )
    if origin in SERIES:
        if args[0] is Any:
            return Kind("a list", _is_series)
        item = kind_of(args[0], limits)
        return Kind(
            f"a list, each item {item.words}", _is_series, lambda value: ((k, one, item) for k, one in enumerate(value))
        )
    if isinstance(origin, type) and issubclass(origin, Mapping):
        pair = [kind_of(one, limits) for one in args]
        return Kind(
            f"a mapping of {pair[0].words} to {pair[1].words}",
            _instance_test(Mapping),
            lambda value: ((key, *one) for key in value for one in zip((key, value[key]), pair, strict=True)),
        )
    if Callable in (origin, annotation):
        return Kind("a function", callable)
    kind = origin or annotation
    if not isinstance(kind, type) or kind in (Any, object):
        return Kind("anything")
    words = f"{'an' if kind.__name__[0] in 'AEIOU' else 'a'} {kind.__name__}"
    if not getattr(kind, "_is_protocol", False):
        return Kind(words, _instance_test(kind))
    names = {name for one in kind.__mro__ if getattr(one, "_is_protocol", False) for name in vars(one)}
    wanted = sorted(name for name in names if name == "__call__" or not name.startswith("_"))
    if not getattr(kind, "_is_runtime_protocol", False):  # whose name tells a user nothing
        words = "a function" if "__call__" in wanted else f"an object with {' and '.join(wanted)}"
    return Kind(words, lambda value: not isinstance(value, type) and all(hasattr(value, one) for one in wanted))


def _union(kinds: Iterable[Kind]) -> Kind:
    members = tuple(kinds)
    return Kind(_listed(one.words for one in members), members=members)


def _is_word(word: Any, value: Any) -> bool:
    return isinstance(value, type(word)) and bool(value == word)


def _instance_test(*kinds: Any) -> Callable[[Any], bool]:
    return lambda value: isinstance(value, kinds)


def _listed(allowed: Iterable[str]) -> str:
    unique = sorted(dict.fromkeys(allowed), key=lambda one: one == "None")
    return unique[0] if len(unique) == 1 else f"{', '.join(unique[:-1])} or {unique[-1]}"


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
    if isinstance(value, str | bytes | Mapping) or not (hasattr(value, "__len__") or value in ANY_NUMBER):
        return False
    import numpy as np  # which the definition of a law does without

    try:
        return np.asarray(value).dtype.kind in "fiub"
    except (TypeError, ValueError, RuntimeError, OverflowError):
        return False


SCALARS: dict[Any, Kind] = {
    None: Kind("None", lambda value: value is None),
    type(None): Kind("None", lambda value: value is None),
    str: Kind("a text", _instance_test(str)),
    bool: Kind("True or False", lambda value: isinstance(value, bool) or type(value).__name__ in ("bool_", "bool")),
    Path: Kind("a path", _is_path),
}
