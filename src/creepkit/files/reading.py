"""Opening files that a user hands over: regular files only, of limited size, text in UTF-8, one clear error for all."""

from __future__ import annotations

import hashlib
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import BufferedReader
from pathlib import Path

from creepkit.errors import CreepkitError, quoted

DEFAULT_MAXIMUM_BYTES = 50_000_000
"""Bytes; no document of creepkit is near it, and a reader must not load what memory cannot hold."""


MAXIMUM_UNPACKED_BYTES = 100_000_000
"""Of all that a compressed file holds together."""


@dataclass(frozen=True)
class FileKind:
    """A kind of file that creepkit reads or writes.

    noun : with its article, as messages name it: "an identification". error : what is raised for a file of this kind.
    advice : what to do about a file that is something else. maximum_bytes : largest size that is read.
    """

    noun: str
    error: type[CreepkitError]
    advice: str
    maximum_bytes: int = DEFAULT_MAXIMUM_BYTES


_OPEN_FLAGS = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0) | getattr(os, "O_CLOEXEC", 0)
"""Without blocking: to open a pipe without a writer must not wait."""


def check_readable(path: Path, kind: FileKind) -> None:
    """Raise the error of `kind` unless `path` is a regular file that can be opened and is not too large.

    For files that a library opens by name; all others are opened by `read_bytes` and `read_text`.
    """
    os.close(_open_regular(path, kind))


def read_bytes(path: Path, kind: FileKind, *, first: int | None = None) -> bytes:
    """The content of a regular file, or its first bytes.

    first : bytes to read of a file however large; by default all of one that is at most `kind.maximum_bytes` long.
    """
    with open_binary(path, kind, any_size=first is not None) as stream:
        content = stream.read() if first is None else stream.read(first)
    if first is None and len(content) > kind.maximum_bytes:
        raise kind.error(_too_large(path, kind))
    return content


def read_range(path: Path, kind: FileKind, start: int, count: int) -> bytes:
    """Bytes of a regular file however large: `count` of them from byte `start`, fewer at its end."""
    with open_binary(path, kind, any_size=True) as stream:
        stream.seek(start)
        return stream.read(count)


@contextmanager
def open_binary(path: Path, kind: FileKind, *, any_size: bool = False) -> Iterator[BufferedReader]:
    """A regular file of at most `kind.maximum_bytes` or of any size, open for reading; its error where that fails."""
    descriptor = _open_regular(path, kind, any_size=any_size)
    try:
        with os.fdopen(descriptor, "rb") as stream:
            yield stream
    except OSError as error:
        raise kind.error(f"{path}: cannot be read ({_cause(error)})") from None
    except MemoryError:
        raise kind.error(f"{path}: holds more than there is memory for") from None


def sha256_of(path: Path, kind: FileKind) -> str:
    """SHA-256 of the content of a regular file."""
    with open_binary(path, kind) as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def read_text(path: Path, kind: FileKind) -> str:
    """The text of a regular file in UTF-8, with or without a byte order mark."""
    content = read_bytes(path, kind)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        # positions count from behind the byte order mark, as error.object does
        line = error.object[: error.start].count(b"\n") + 1
        byte = error.object[error.start]
        raise kind.error(f"{path}:{line}: byte 0x{byte:02x} is not text in UTF-8; {kind.advice}") from None


def _open_regular(path: Path, kind: FileKind, *, any_size: bool = False) -> int:
    """An open descriptor of a regular file."""
    try:
        descriptor = os.open(path, _OPEN_FLAGS)
    except FileNotFoundError:
        raise kind.error(f"{path}: there is no such file; check its name") from None
    except (OSError, ValueError) as error:  # ValueError: a name with a null byte
        raise kind.error(f"{path}: cannot be read ({_cause(error)})") from None
    status = os.fstat(descriptor)
    problem = ""
    if stat.S_ISDIR(status.st_mode):
        problem = f"{path}: is a folder; {kind.advice}"
    elif not stat.S_ISREG(status.st_mode):
        problem = f"{path}: is no regular file but a device, a pipe or the like; {kind.advice}"
    elif not any_size and status.st_size > kind.maximum_bytes:
        problem = _too_large(path, kind)
    if problem:
        os.close(descriptor)
        raise kind.error(problem)
    return descriptor


def _too_large(path: Path, kind: FileKind) -> str:
    return f"{path}: larger than {kind.maximum_bytes / 1e6:g} MB, which {kind.noun} never is; {kind.advice}"


def _cause(error: Exception) -> str:
    return getattr(error, "strerror", None) or quoted(" ".join(str(error).split()), 120)
