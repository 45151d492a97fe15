"""`creepkit read --ask`: the open questions of files of tests, one after another, answered in a file beside them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from creepkit.errors import CreepkitError, HistoryError, printable
from creepkit.files.writing import write_text
from creepkit.readers.ends_of_tests import LABEL
from creepkit.readers.questions import ANSWERS_FILE, Question, single_errors, toml_value
from creepkit.readers.tests_file import read_answers, with_answer
from creepkit.readers.text_tables import UNUSED
from creepkit.reports.terminal import tell

LEAVE_OPEN = "?"
"""What is typed to leave a question open."""


def put_questions(read: Callable[[], object], answer: Callable[[str], str] | None) -> list[Path]:
    """Put the questions that reading raises until none is left, and return the files of answers that were written.

    read : reads the files, and raises what is open. answer : what was typed at a prompt; None without a terminal, where
    each question is a line with the text that answers it, and the last of them an error.
    """
    asked, written = set[tuple[Path, str, str]](), dict[Path, None]()
    while questions := [one for one in _open_questions(read) if _identity(one) not in asked]:
        if answer is None:
            for question in questions:
                tell(question)
            count = f"{len(questions)} question{'s' if len(questions) > 1 else ''}"
            raise HistoryError(f"{count} open; answer them in {ANSWERS_FILE}, or run this in a terminal")
        for question in questions:
            asked.add(_identity(question))
            if (value := _answer_to(question, answer)) is not None:
                written[_write(question, value)] = None
    return list(written)


def _identity(question: Question) -> tuple[Path, str, str]:
    return question.path, question.key, question.sentence


def _open_questions(read: Callable[[], object]) -> list[Question]:
    """The questions that reading raises; [] where it raises none, whatever else is wrong."""
    try:
        read()
    except CreepkitError as error:
        return [one for one in single_errors(error) if isinstance(one, Question)]
    return []


def _answer_to(question: Question, answer: Callable[[str], str]) -> str | None:
    """The answer as TOML; None where the question stays open."""
    tell(f"{question.place}: {question.sentence}")
    for number, choice in enumerate(question.choices, 1):
        tell(f"  {number}  {_in_words(choice)}{' [Enter]' if number == 1 else ''}")
    count = len(question.choices)
    listed = f"{'1 to ' * (count > 1)}{count}" if count else ""
    asked = " or ".join(filter(None, (listed, "what it is" if question.is_free else "")))
    while True:
        typed = answer(f"{asked}, {LEAVE_OPEN} leaves it open: ").strip()
        if typed == LEAVE_OPEN:
            return None
        chosen = typed or "1"
        if chosen.isdecimal() and 1 <= int(chosen) <= len(question.choices):
            return toml_value(question.choices[int(chosen) - 1])
        if question.is_free and typed:
            first = question.choices[0] if question.choices else ""
            return toml_value(dict.fromkeys(first, typed) if isinstance(first, dict) else _number_or_text(typed))
        tell(f"'{printable(typed)}' is none of these")


def _in_words(choice: str | float | dict[str, str]) -> str:
    if not isinstance(choice, dict):
        return str(choice)
    meanings = {LABEL: "only a label", UNUSED: "stays unread"}
    return ", ".join(
        f"{repr(name) if name else 'an empty cell'}: {meanings.get(what, what)}" for name, what in choice.items()
    )


def _number_or_text(typed: str) -> str | float:
    try:
        return float(typed.replace(",", "."))
    except ValueError:
        return typed


def _write(question: Question, value: str) -> Path:
    """Add an answer to the file beside the tests; it stays valid, or nothing is written."""
    file = question.path.parent / ANSWERS_FILE
    text = file.read_text(encoding="utf-8") if file.is_file() else ""
    write_text(with_answer(text, question.path.name, question.key, value), file, HistoryError, force=True)
    read_answers(file)
    return file
