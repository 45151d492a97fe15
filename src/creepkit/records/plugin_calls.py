"""Calls into code of plugins: whatever they raise becomes one sentence with the plugin's file and line."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Protocol, TypeVar

from creepkit.errors import CreepkitError, HistoryError, quoted, raised_text, refuse_unknown

if TYPE_CHECKING:
    from pathlib import Path

    from creepkit.records.history import History
    from creepkit.records.interfaces import Reader

_T = TypeVar("_T")


OWN_PACKAGE = "creepkit"


class _Offered(Protocol):
    @property
    def name(self) -> str: ...


_Plugin = TypeVar("_Plugin", bound=_Offered)


def named_one(kind: str, name: str, offered: Iterable[_Plugin]) -> _Plugin:
    """The reader, or the format, of a name; HistoryError with the nearest one where there is none."""
    known = {one.name: one for one in offered}
    refuse_unknown(name, known, HistoryError, f"no {kind} is called '{name}'")
    return known[name]


def only_one(kind: str, place: object, accepting: Sequence[_Plugin], argument: str) -> _Plugin:
    """The one reader, or format, that accepts a file; HistoryError for several, which an argument tells apart."""
    if len(accepting) > 1:
        names = " and ".join(f"'{one.name}'" for one in accepting)
        raise HistoryError(f"{place}: the {kind}s {names} both accept it; say which one with {argument}=")
    return accepting[0]


def call_of_plugin(call: Callable[[], _T], owner: object, what: str, error: type[CreepkitError]) -> _T:
    """What a call into a plugin's object returns; `error`, one sentence with file and line, where it raises another.

    owner : the object whose method is called; what creepkit's own classes raise stays as it is, for it is no plugin's.
    what : the call in words, "reader 'camera': read()".
    """
    try:
        return call()
    except CreepkitError:
        raise
    except (Exception, SystemExit) as raised:
        if type(owner).__module__.partition(".")[0] == OWN_PACKAGE:
            raise
        raise error(f"{what} raised {raised_text(raised)}") from raised


def call_of_reader(call: Callable[[], _T], reader: Reader, path: Path, method: str) -> _T:
    """What a reader's accepts() or read() returns; HistoryError whatever it raises, also of creepkit's own readers."""
    return call_on_file(call, f"{path}: {method}() of reader '{reader.name}'")


def call_on_file(call: Callable[[], _T], what: str) -> _T:
    """What a call that reads a measured file returns; HistoryError, one sentence, whatever else it raises.

    The content of a file may lead any reader to an error that nobody has foreseen; the user is told of which file.
    Such an error is the cause of the HistoryError, so that a test can tell it from those that were foreseen.

    what : the file and the call in words.
    """
    try:
        return call()
    except CreepkitError:
        raise
    except MemoryError:
        raise HistoryError(f"{what} needs more memory than there is; divide the file, or give it more") from None
    except RecursionError:
        raise HistoryError(f"{what} found something nested too deep; no file of a test is") from None
    except OSError as failure:
        raise HistoryError(f"{what} cannot read it ({quoted(failure.strerror or failure, 120)})") from failure
    except (Exception, SystemExit) as raised:
        raise HistoryError(f"{what} raised {raised_text(raised)}") from raised


def accepts_path(reader: Reader, path: Path) -> bool:
    """Whether a reader accepts a file or folder; HistoryError where accepts() raises or returns no bool."""
    accepted = call_of_reader(lambda: reader.accepts(path), reader, path, "accepts")
    if not isinstance(accepted, bool):
        raise HistoryError(
            f"{path}: accepts() of reader '{reader.name}' returned a {type(accepted).__name__}; it must return a bool"
        )
    return accepted


def histories_in(reader: Reader, path: Path) -> list[History]:
    """The histories that a reader finds in a file or folder; HistoryError where read() raises or returns others."""
    from creepkit.records.history import History  # which needs numpy, while exports need no more than call_of_plugin

    what = f"{path}: read() of reader '{reader.name}'"
    histories = call_of_reader(lambda: reader.read(path), reader, path, "read")
    if not isinstance(histories, list):
        raise HistoryError(f"{what} returned a {type(histories).__name__}; it must return a list of histories")
    for history in histories:
        if not isinstance(history, History):
            raise HistoryError(f"{what} returned a {type(history).__name__} in its list; it must return histories")
    return histories
