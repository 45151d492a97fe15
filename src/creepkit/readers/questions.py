"""What a file leaves open, as questions with the line of tests.toml that answers each; several errors of a file as one.

A question is an error that knows its answers, the likely one first: `creepkit read --ask` puts it, everything else
raises it.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TypeVar

from creepkit.errors import HistoryError

ANSWERS_FILE = "tests.toml"
"""Name of the file of answers beside the files of tests."""


_T = TypeVar("_T")


Answer = str | float | dict[str, str]
"""What answers a question: a text, a number, or {name: what it is}."""


def toml_key(name: str) -> str:
    """A key of TOML, bare where it may be."""
    is_bare = bool(name) and all(sign.isascii() and (sign.isalnum() or sign in "_-") for sign in name)
    return name if is_bare else json.dumps(name, ensure_ascii=False)


class Question(HistoryError):
    """What is not known of a file, and asked for.

    path : of the file. key : of the table of tests.toml, such as ended, columns or gauge_length_mm. choices : answers,
    the likely one first; each is a value, or {name: value} where the key holds a table. is_free : whether another value
    may be written.
    """

    def __init__(
        self, path: Path, place: str, sentence: str, key: str, choices: Sequence[Answer], *, is_free: bool = False
    ) -> None:
        self.path, self.place, self.sentence, self.key = path, place, sentence, key
        self.choices, self.is_free = tuple(choices), is_free
        super().__init__(self.asked_of(path.name))

    def asked_of(self, files: str, count: int = 1) -> str:
        """The question with the line that answers it; files : name or pattern of those that it is about."""
        others = " or ".join(self.entry(choice) for choice in self.choices[1:])
        first = self.entry(self.choices[0]) if self.choices else f"{self.key} = ..."
        more = f" (and {count - 1} file{'s' if count > 2 else ''} more)" if count > 1 else ""
        under = f"rite into {ANSWERS_FILE} beside it: [{toml_key_in_quotes(files)}] {first}"
        joined = f"{self.sentence} W" if self.sentence.endswith("?") else f"{self.sentence}; w"
        return f"{self.place}{more}: {joined}{under}{f' (or {others})' if others else ''}"

    def entry(self, choice: Answer) -> str:
        """The line of tests.toml that gives an answer."""
        return f"{self.key} = {toml_value(choice)}"


def toml_key_in_quotes(name: str) -> str:
    """A key of TOML in quotes."""
    return json.dumps(name, ensure_ascii=False)


def toml_value(value: object) -> str:
    """A text, a number, or {name: text} as TOML."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{toml_key(k)} = {toml_value(v)}" for k, v in value.items()) + "}"
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
    single = {str(one): one for error in errors for one in single_errors(error) if isinstance(one, HistoryError)}
    if len(single) > 1:
        raise SeveralErrors(list(single.values()))
    for one in single.values():
        raise one


def collected(errors: list[HistoryError], make: Callable[[], _T]) -> _T | None:
    """What `make` returns; None where it raises a HistoryError, which is added to the errors."""
    try:
        return make()
    except HistoryError as error:
        errors.append(error)
        return None
