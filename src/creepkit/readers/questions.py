"""What a file leaves open, as questions with the line of tests.toml that answers each; several errors of a file as one.

A question is an error that knows its answers, the likely one first: `creepkit read --ask` puts it, everything else
raises it.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Sequence
from itertools import takewhile
from pathlib import Path
from typing import TypeVar

from creepkit.errors import HistoryError

ANSWERS_FILE = "tests.toml"
"""Name of the file of answers beside the files of tests."""


_T = TypeVar("_T")


Answer = str | float | dict[str, str]
"""What answers a question: a text, a number, or {name: what it is}."""


class Question(HistoryError):
    """What is not known of a file, and asked for.

    path : of the file. key : of the table of tests.toml, such as ended, columns or gauge_length_mm. choices : answers,
    the likely one first; each is a value, or {name: value} where the key holds a table. is_free : whether another value
    may be written. names, at : of the files of a folder of which the same is asked, and all places where it is.
    """

    def __init__(
        self, path: Path, place: str, sentence: str, key: str, choices: Sequence[Answer], *, is_free: bool = False
    ) -> None:
        self.path, self.place, self.sentence, self.key = path, place, sentence, key
        self.choices, self.is_free = tuple(choices), is_free
        self.names: tuple[str, ...] = (path.name,)
        self.at = frozenset((place,))
        super().__init__(sentence)

    def __str__(self) -> str:
        """The question with the line that answers it."""
        others = " or ".join(self.entry(choice) for choice in self.choices[1:])
        first = self.entry(self.choices[0]) if self.choices else f"{self.key} = ..."
        under = f"rite into {ANSWERS_FILE} beside it: [{toml_value(self.pattern)}] {first}"
        joined = f"{self.sentence} W" if self.sentence.endswith("?") else f"{self.sentence}; w"
        return f"{self.places}: {joined}{under}{f' (or {others})' if others else ''}"

    @property
    def places(self) -> str:
        """Where it stands, and how often else."""
        more = len(self.names) - 1
        others = f" (and {more} file{'s' if more > 1 else ''} more)" if more else ""
        return f"{self.place}{others or (f' (and {len(self.at) - 1} more)' if len(self.at) > 1 else '')}"

    @property
    def pattern(self) -> str:
        """The name of its file; of several a pattern, such as RX*.csv, which may match others."""
        if len(self.names) == 1:
            return self.names[0]
        suffixes = {Path(name).suffix for name in self.names}
        shared = takewhile(lambda signs: len(set(signs)) == 1, zip(*self.names, strict=False))
        return f"{''.join(signs[0] for signs in shared)}*{suffixes.pop() if len(suffixes) == 1 else ''}"

    def entry(self, choice: Answer) -> str:
        """The line of tests.toml that gives an answer."""
        return f"{self.key} = {toml_value(choice)}"


def merged(errors: Iterable[Exception]) -> list[Exception]:
    """Errors by themselves; those that say the same of several places, and questions of files of a folder, as one."""
    found, questions, of_place = list[Exception](), dict[tuple[object, ...], Question](), dict[object, Question]()
    for one in (one for error in errors for one in single_errors(error)):
        if isinstance(one, Question):
            one = of_place.setdefault((one.place, one.key, repr(one.choices)), one)  # numbers in it may differ
            key = (one.path.parent, one.key, one.sentence, repr(one.choices))
            question = questions.setdefault(key, one)
            question.at |= one.at
            question.names = tuple(sorted({*question.names, *one.names}))
            found.append(question)
        else:
            found.append(one)
    alike = dict[str, list[Exception]]()
    for one in {str(one): one for one in found}.values():
        is_plain = isinstance(one, HistoryError) and not isinstance(one, Question)
        alike.setdefault(str(one).partition(": ")[2] if is_plain else str(one), []).append(one)
    return [one[0] if len(one) == 1 else _at_places(sentence, one) for sentence, one in alike.items()]


def _at_places(sentence: str, errors: Sequence[Exception]) -> HistoryError:
    """Errors of one sentence as one, with the first of their places and how many more there are."""
    return HistoryError(f"{str(errors[0]).partition(': ')[0]} (and {len(errors) - 1} more): {sentence}")


def toml_value(value: object) -> str:
    """A text, a number, or {name: text} as TOML."""
    if isinstance(value, dict):
        keys = {k: k if re.fullmatch(r"[A-Za-z0-9_-]+", k) else toml_value(k) for k in value}
        return "{" + ", ".join(f"{keys[k]} = {toml_value(v)}" for k, v in value.items()) + "}"
    return f"{value:g}" if isinstance(value, float) else json.dumps(value, ensure_ascii=False)


class SeveralErrors(HistoryError):
    """Several errors of the files of a call; errors : each by itself."""

    def __init__(self, errors: Sequence[HistoryError]) -> None:
        self.errors = tuple(errors)
        listed = "; ".join(f"({k}) {error}" for k, error in enumerate(self.errors, 1))
        super().__init__(f"{len(self.errors)} things are to be corrected: {listed}")


def single_errors(error: Exception) -> tuple[Exception, ...]:
    """The errors of which an error consists; itself where it is one."""
    return error.errors if isinstance(error, SeveralErrors) else (error,)


def raise_all(errors: Iterable[HistoryError]) -> None:
    """Raise the errors, if there are some: one as it is, several as one, each sentence once."""
    single = [one for one in merged(errors) if isinstance(one, HistoryError)]
    if len(single) > 1:
        raise SeveralErrors(single)
    for one in single:
        raise one


def collected(errors: list[HistoryError], make: Callable[[], _T]) -> _T | None:
    """What `make` returns; None where it raises a HistoryError, which is added to the errors."""
    try:
        return make()
    except HistoryError as error:
        errors.append(error)
        return None
