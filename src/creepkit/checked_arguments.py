"""Arguments of public functions and records, checked against their annotations before anything is done with them.

@checked
def rate(stress: float, tests: Sequence[History]) -> float: ...

raises an ArgumentError, in one sentence, for a text in the place of the stress. What is right is passed on as it is,
except that a generator becomes a tuple where several objects are wanted, as it can be read only once.
"""

from __future__ import annotations

import contextlib
import functools
import inspect
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import Any, TypeVar

from creepkit.annotation_checks import MOST_LEVELS, Check, check_of, is_finite_number, is_nested_deep, names_of_module
from creepkit.errors import ArgumentError, nearest, quoted_value

Anything = TypeVar("Anything", bound=Callable[..., Any])
Annotations = Iterator[tuple[str, Any, Mapping[str, Any]]]
"""(argument, annotation, names that it may use)."""


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

    def decorate(public: Anything) -> Anything:
        made: Anything
        if inspect.isclass(public):
            made = _checked_class(public, own)
        else:
            made = _checked_function(public, public.__qualname__, lambda: _function_annotations(public), own)
        return made

    return decorate


def _checked_class(public: Any, own: tuple[str, ...]) -> Any:
    """The class, whose constructor checks its arguments."""
    name = "__init__" if "__init__" in public.__dict__ else "__new__"
    constructor = inspect.unwrap(getattr(public, name))
    generated = is_dataclass(public) and not constructor.__code__.co_filename.endswith(".py")
    annotations = (lambda: _field_annotations(public)) if generated else (lambda: _function_annotations(constructor))
    replacement = _checked_function(constructor, public.__qualname__, annotations, own, constructs=True)
    setattr(public, name, replacement)  # of __new__ a static method, as Python takes it for one
    return public


def _checked_function(
    function: Any,
    name: str,
    annotations: Callable[[], Annotations],
    own: tuple[str, ...] = (),
    constructs: bool = False,
) -> Any:
    arguments = _Arguments(function, name, annotations)

    @functools.wraps(function)
    def checking(*args: Any, **kwargs: Any) -> Any:
        try:
            args = arguments.checked(args, kwargs)
        except ArgumentError as error:
            wrong = error
        else:
            try:
                return function(*args, **kwargs)
            except RecursionError:
                arguments.check_depth(args, kwargs)
                raise
        says_itself = wrong.argument in own
        if constructs or says_itself:
            with contextlib.suppress(*WITHOUT_A_SENTENCE):
                result = function(*args, **kwargs)
                if says_itself:
                    return result
        raise wrong

    return checking


class _Arguments:
    """The checks of one function by argument, made when it is first called."""

    def __init__(self, function: Any, name: str, annotations: Callable[[], Annotations]) -> None:
        self.function, self.name, self.annotations = function, name, annotations
        code = function.__code__
        further = code.co_varnames[code.co_argcount + code.co_kwonlyargcount :]
        several = bool(code.co_flags & inspect.CO_VARARGS)
        self.positional = code.co_varnames[: code.co_argcount]
        self.named = frozenset(code.co_varnames[: code.co_argcount + code.co_kwonlyargcount])
        self.varargs = further[0] if several else ""
        self.keywords = further[several] if code.co_flags & inspect.CO_VARKEYWORDS else ""
        self.checks: dict[str, Check] | None = None

    def checked(self, args: tuple[Any, ...], kwargs: dict[str, Any]) -> tuple[Any, ...]:
        """The positional arguments, with tuples for generators, as in `kwargs`; ArgumentError for a wrong one."""
        checks = self.checks
        if checks is None:
            checks = self.checks = self._made()
        for k, value in enumerate(args):
            argument = self.positional[k] if k < len(self.positional) else self.varargs
            check = checks.get(argument)
            if check is not None and not check.accepts(value):
                args = (*args[:k], self._converted(value, check, argument), *args[k + 1 :])
        if not self.keywords and not self.named.issuperset(kwargs):
            self._refuse_unknown(next(argument for argument in kwargs if argument not in self.named))
        for argument, value in kwargs.items():
            check = checks.get(argument)
            if check is None and argument not in self.named:
                check = checks.get(self.keywords)
            if check is not None and not check.accepts(value):
                kwargs[argument] = self._converted(value, check, argument)
        return args

    def _refuse_unknown(self, argument: str) -> None:
        """ArgumentError, with the nearest name, for an argument that there is not."""
        known = [name for name in self.named if name not in ("self", "cls")]
        error = ArgumentError(f"{self.name}() takes no argument '{argument}'; {nearest(argument, known)}")
        error.argument = argument
        raise error

    def check_depth(self, args: tuple[Any, ...], kwargs: dict[str, Any]) -> None:
        """ArgumentError for an argument of lists in lists that no function of Python can print."""
        named = {**dict(zip(self.positional, args, strict=False)), **kwargs}
        for argument, value in named.items():
            if is_nested_deep(value):
                raise ArgumentError(
                    f"{argument} of {self.name}() is nested more than {MOST_LEVELS} deep; give lists of plain values"
                ) from None

    def _made(self) -> dict[str, Check]:
        parameters = inspect.signature(self.function).parameters
        found: dict[str, Check] = {}
        for argument, annotation, names in self.annotations():
            default = parameters[argument].default if argument in parameters else None
            found[argument] = check_of(annotation, names, finite=is_finite_number(default))
        options = found.get(self.keywords)
        if options is not None and options.named is not None:
            del found[self.keywords]
            found |= {key: check for key, check in options.named.items() if key not in self.named}
        return found

    def _converted(self, value: Any, check: Check, argument: str) -> Any:
        """What is iterated over once as a tuple, where that is right; else the error."""
        if check.several and _is_read_once(value):
            value = tuple(value)
            if check.accepts(value):
                return value
        place, wrong, allowed = check.wrong_part(value)
        error = ArgumentError(f"{argument}{place} of {self.name}() is {quoted_value(wrong)}; allowed is {allowed}")
        error.argument = argument
        raise error


def _is_read_once(value: Any) -> bool:
    if isinstance(value, str | bytes | Mapping):
        return False
    return hasattr(value, "__iter__") and not hasattr(value, "__getitem__")


def _function_annotations(function: Any) -> Annotations:
    namespace = names_of_module(function.__globals__)
    for argument, annotation in function.__annotations__.items():
        if argument != "return":
            yield argument, annotation, namespace


def _field_annotations(record: Any) -> Annotations:
    """Annotations of the fields of a dataclass, with the names of the module in which each field is written."""
    for field in fields(record):
        if field.init:
            owner = next(c for c in record.__mro__ if field.name in inspect.get_annotations(c))
            yield field.name, field.type, names_of_module(vars(sys.modules[owner.__module__]))
