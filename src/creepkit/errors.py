"""Errors that creepkit raises: one sentence saying which object, what was found, what is allowed, what to do."""

from __future__ import annotations

import difflib
import importlib
import os
import re
import traceback
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager

import pluggy

LONGEST_QUOTE, LONGEST_MESSAGE = 40, 2000
"""Characters of a text of a file that a message quotes, and of a whole message."""


_UNPRINTABLE = re.compile("[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff\ud800-\udfff]")
"""Characters that steer a terminal, break lines, turn the direction of writing or cannot be encoded."""


def printable(text: str) -> str:
    """A text on one line: what would break it, steer a terminal or turn the direction of writing, as its code."""
    return _UNPRINTABLE.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def steering(text: str) -> str:
    """The first character of a text, line breaks and tabs aside, that must not reach a terminal; "" where all may."""
    return next((one[0] for one in _UNPRINTABLE.finditer(text) if one[0] not in "\n\r\t"), "")


def quoted(text: object, longest: int = LONGEST_QUOTE) -> str:
    """A text of a file as messages quote it: printable, without blanks around it, and shortened."""
    whole = str(text).strip()
    shown = printable(whole[: longest + 1])
    return shown if len(shown) <= longest else f"{shown[: longest - 3]}..."


def quoted_value(value: object, longest: int = LONGEST_QUOTE) -> str:
    """A value as messages quote it: numbers, texts and short lists as Python writes them, others by their type."""
    if isinstance(value, str | bytes):
        value = value[: longest + 1]
    elif hasattr(value, "__len__") and not isinstance(value, list | tuple | dict) and not hasattr(value, "dtype"):
        return f"of type {type(value).__name__}"
    try:
        whole = repr(value)
    except Exception:  # of an integer of thousands of digits, or by a class of the caller's
        return f"of type {type(value).__name__}"
    return f"of type {type(value).__name__}" if " object at 0x" in whole else quoted(whole, longest)


class CreepkitError(Exception):
    """Base of every error that creepkit raises on purpose; its message is one sentence for the user.

    Whatever of a file or a name is quoted in it, the message is printable, on one line, and of limited length.
    """

    def __init__(self, *args: object) -> None:
        super().__init__(*(_message(arg) if isinstance(arg, str) else arg for arg in args))


def _message(text: str) -> str:
    if len(text) > LONGEST_MESSAGE:  # the beginning names the file, the end says what to do
        text = f"{text[: LONGEST_MESSAGE - 503]}...{text[-500:]}"
    return printable(text)


class ArgumentError(CreepkitError, TypeError, ValueError):
    """An argument of a public function or record is not what the annotation says."""


class LawError(CreepkitError):
    """A creep law, or an operation on one, is not well formed."""


class PluginError(CreepkitError):
    """A plugin cannot be loaded, or two plugins contradict each other."""


class HistoryError(CreepkitError):
    """A measured history, or the file that holds it, cannot be understood."""


class SolveError(CreepkitError):
    """A simulation was asked for something that it cannot do."""


class DatasetError(CreepkitError):
    """A data set or one of its shards is damaged or does not belong here."""


class SurrogateError(CreepkitError):
    """A surrogate, its file or its training was asked for something that it cannot do."""


class FitError(CreepkitError):
    """An identification was asked for something that it cannot do."""


class FitWarning(UserWarning):
    """An identification answers beyond what its tests cover; `warnings.simplefilter` turns it off, or into an error."""


class CacheWarning(UserWarning):
    """Compiled laws are not kept on disk, for others could change what is executed."""


class ExportError(CreepkitError):
    """A law cannot be written in the language that was asked for."""


class ReportError(CreepkitError):
    """A report cannot be written, or the files that it carries cannot be trusted."""


class StudyError(CreepkitError):
    """A study file, or what it asks for, is not well formed; or its results cannot be kept."""


POWER_REMEDY = "write ** for powers"
"""For ^, which sympy takes for the exclusive or."""


_OURS = (
    *(os.path.dirname(one) + os.sep for one in (__file__, importlib.__file__, pluggy.__file__)),
    "<frozen importlib",
)
"""Where files begin that are none of a plugin."""


def raised_text(error: BaseException) -> str:
    """One sentence for what a plugin raised, with the deepest line of the plugin's own file."""
    if isinstance(error, SyntaxError):
        return f"{type(error).__name__}: {error.msg} ({error.filename}, line {error.lineno})"
    description = " ".join(str(error).split())
    if not isinstance(error, CreepkitError):
        of_power = isinstance(error, TypeError) and ("for ^:" in description or "'Xor'" in description)
        remedy = f"; {POWER_REMEDY}" if of_power else ""
        description = f"{type(error).__name__}: {quoted(description, 300) or 'no message'}{remedy}"
    frames = traceback.extract_tb(error.__traceback__)
    outside = [frame for frame in frames if not frame.filename.startswith(_OURS)] or frames[-1:]
    of_plugin = [frame for frame in outside if frame.filename == outside[0].filename]
    return f"{description} ({of_plugin[-1].filename}, line {of_plugin[-1].lineno})" if of_plugin else description


def nearest(word: str, known: Iterable[str]) -> str:
    """Return `` Did you mean 'x'?`` when a known word lies near, else the list of what is known."""
    known = sorted(known)
    close = difflib.get_close_matches(word[:LONGEST_QUOTE], known, n=1, cutoff=0.55)
    if close:
        return f"did you mean '{close[0]}'? (known: {', '.join(known)})"
    return f"known: {', '.join(known) or 'none'}"


def refuse_unknown(name: object, known: Collection[str], error: type[CreepkitError], sentence: str) -> None:
    """Raise the error, with what is near, for a name that is not among those known."""
    if name not in known:
        raise error(f"{sentence}; {nearest(str(name), known)}")


SAID = "\0said\0"
"""Stands in a sentence of restated() for what the error says that was caught."""


@contextmanager
def restated(
    kinds: type[BaseException] | tuple[type[BaseException], ...], error: type[Exception], sentence: str
) -> Iterator[None]:
    """Raise errors of some kinds as another one, in the words of whoever knows what they are about."""
    try:
        yield
    except kinds as found:
        raise error(sentence.replace(SAID, getattr(found, "strerror", None) or str(found))) from None
