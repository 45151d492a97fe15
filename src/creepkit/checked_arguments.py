"""Arguments of public functions and records, checked against their annotations before anything is done with them.

@checked
def rate(stress: float, tests: Sequence[History]) -> float: ...

raises an ArgumentError, in one sentence, for a text in the place of the stress. What is right is passed on as it is,
except that a generator becomes a list where several objects are wanted, as it can be read only once. The words are
those of argument_types.
"""

from __future__ import annotations

import contextlib
import functools
import inspect
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import is_dataclass
from typing import Any, TypeVar

from creepkit.argument_types import annotations_of, kind_of, takes_several
from creepkit.errors import ArgumentError, nearest, quoted_value

Anything = TypeVar("Anything", bound=Callable[..., Any])


WITHOUT_A_SENTENCE = (ArithmeticError, AttributeError, LookupError, OSError, RecursionError, TypeError, ValueError)
"""Errors of Python's in place of which the error of a check is raised."""


def checked(public: Anything) -> Anything:
    """The function, or the class with a constructor, that checks its arguments; signature and docstring stay.

    Numbers must be finite, unless the default is not; those of pairs such as bounds may be infinite. What a constructor
    itself says of a wrong value comes first.
    """
    return checked_with_own_words()(public)


def checked_with_own_words(*own: str) -> Callable[[Anything], Anything]:
    """As checked, of a function or class that itself judges the arguments of these names; its own sentence comes first.

    What it accepts beyond its annotations is right; where it fails without a sentence, that of the check is raised.
    """

    def decorate(public: Any) -> Any:
        if not inspect.isclass(public):
            return _checked_function(public, public.__qualname__, [public], own)
        name = "__init__" if "__init__" in public.__dict__ else "__new__"
        constructor = inspect.unwrap(getattr(public, name))
        generated = is_dataclass(public) and not constructor.__code__.co_filename.endswith(".py")
        sources = [one for one in reversed(public.__mro__) if is_dataclass(one)] if generated else [constructor]
        replacement = _checked_function(constructor, public.__qualname__, sources, own, constructs=True)
        setattr(public, name, replacement)  # of __new__ a static method, as Python takes it for one
        return public

    return decorate


def _checked_function(
    function: Any, name: str, annotated: Sequence[Any], own: tuple[str, ...], constructs: bool = False
) -> Any:
    """The function that checks; annotated : itself, or the records whose fields are its arguments."""

    @functools.cache
    def arguments() -> _Arguments:
        return _Arguments(f"{name}()", inspect.signature(function).parameters, annotations_of(annotated))

    @functools.wraps(function)
    def checking(*args: Any, **kwargs: Any) -> Any:
        try:
            args, kwargs = arguments().checked(args, kwargs)
        except ArgumentError as error:
            if constructs or error.argument in own:
                with contextlib.suppress(*WITHOUT_A_SENTENCE):
                    result = function(*args, **kwargs)
                    if error.argument in own:
                        return result
            raise
        return function(*args, **kwargs)

    return checking


class _Arguments:
    """The arguments of one function, with their resolved annotations, when it is first called."""

    def __init__(self, name: str, parameters: Mapping[str, inspect.Parameter], kinds: Mapping[str, Any]) -> None:
        self.name, self.parameters, self.kinds = name, parameters, kinds
        several = {one.kind: one.name for one in parameters.values()}
        self.positional = [one.name for one in parameters.values() if one.kind <= one.POSITIONAL_OR_KEYWORD]
        self.further = several.get(inspect.Parameter.VAR_POSITIONAL)
        self.options = several.get(inspect.Parameter.VAR_KEYWORD)

    def checked(self, args: tuple[Any, ...], kwargs: dict[str, Any]) -> tuple[tuple[Any, ...], dict[str, Any]]:
        """The arguments of a call, with lists for generators; ArgumentError for a wrong one."""
        unknown = () if self.options else kwargs.keys() - self.parameters.keys()
        for argument in unknown:
            known = [one for one in self.parameters if one not in ("self", "cls")]
            raise ArgumentError(f"{self.name} takes no argument '{argument}'; {nearest(argument, known)}", argument)
        further = [self.further] * (len(args) - len(self.positional))
        judged = tuple(map(self._judged, args, [*self.positional, *further][: len(args)]))
        return judged, {key: self._judged(value, key) for key, value in kwargs.items()}

    def _judged(self, value: Any, argument: str | None) -> Any:
        parameter = self.parameters.get(argument or "")
        kind = self.kinds.get((argument if parameter else self.options) or "", Any)
        default = parameter.default if parameter else None
        infinite = isinstance(default, float) and not math.isfinite(default)
        if isinstance(value, Iterator) and takes_several(kind):
            value = list(value)
        if wrong := kind_of(kind, not infinite).mismatch(value):
            where = f"{argument or ''}{wrong.place} of {self.name}"
            raise ArgumentError(f"{where} is {quoted_value(wrong.value)}; allowed is {wrong.allowed}", argument or "")
        return value
