"""What creepkit wrote in a folder: a list of contents with their names, sizes, and what they were made from.

RECORD holds for each content a line `SHA256  NAME`, as `sha256sum` prints it, and before it a comment `# SIZE` or
`# SIZE ORIGIN`, which `sha256sum` passes over and lists of before do not have. A file is creepkit's own while its
content stands there under its name: one that a person made or changed does not. The list is ours when it is a regular
file of our user; without it nothing is lost: a file is then taken for a foreign one.

ORIGIN is the path of a file or folder, seen from the folder of the list: of results whose names stand in files, which
may not choose those of results that were made from others.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path

from creepkit.errors import CreepkitError, quoted
from creepkit.files.reading import FileKind, read_bytes, sha256_of
from creepkit.files.unfinished_files import UnfinishedFile, is_own

RECORD = ".creepkit-written"
"""The list of what creepkit wrote in a folder."""


MOST_RECORD_BYTES = 1_000_000
"""Of a list, beyond which the last content of each name is kept alone."""


_RECORD_FILE = FileKind("a list of written files", CreepkitError, "remove it", maximum_bytes=4 * MOST_RECORD_BYTES)


_COMMENT = re.compile(rb"# ([0-9]{1,18})(?: (.*))?", re.DOTALL)


@dataclass(frozen=True)
class WrittenFile:
    """What a list says of a content beside its hash and name. size : bytes, None in lists of before.

    origin : what it was made from, seen from the folder; "" where nothing was said of that.
    """

    size: int | None = None
    origin: str = ""


_origin: ContextVar[str] = ContextVar("origin", default="")


@contextmanager
def made_from(path: str | Path) -> Iterator[None]:
    """Note with each file that is written in this block what it was made from, and keep those that were not.

    For results whose names are not chosen by who calls the command, but stand in a study or in a measured file.
    """
    token = _origin.set(os.path.realpath(path) if str(path) else "")
    try:
        yield
    finally:
        _origin.reset(token)


def is_foreign(path: Path) -> bool:
    """Whether a file is there that creepkit did not write as it is."""
    try:
        return path.is_file() and _entry(path) is None
    except OSError:
        return True


def other_origin(path: Path) -> str:
    """How creepkit made a file that is there as it was written: "from X", if not from what is made from now; else "".

    Lists of before do not say, and neither does what is written outside made_from(), whose name a person chose: it
    replaces any file of ours, and is replaced by none that chooses its name itself.
    """
    now = _origin_seen_from(path.parent)
    try:
        entry = _entry(path) if now else None
    except OSError:  # no file is there, or no longer
        return ""
    if entry is None or entry.size is None or entry.origin == now:
        return ""
    return f"from {quoted(entry.origin, 120)}" if entry.origin else "by another command"


def written_files(folder: Path, pattern: str = "*") -> list[Path]:
    """Files of a folder, no links, that are as creepkit wrote them."""
    files = (path for path in folder.glob(pattern) if not path.is_symlink() and path.is_file())
    known = _written(folder)
    return [path for path in files if _entry(path, known) is not None]


def is_listed(path: Path) -> bool:
    """Whether creepkit wrote a file of this name in this folder, whatever it holds now."""
    return path.name in _written(path.parent)


def note_written(path: Path, digest: str, size: int) -> None:
    """Enter into the list that a content is ours below the name of `path`; where it cannot be, nothing.

    Before the file takes its place: a process that dies in between leaves no file of ours that looks foreign.
    """
    with suppress(OSError):
        known, record = _written(path.parent), path.parent / RECORD
        entry = WrittenFile(size, _origin_seen_from(path.parent))
        if known.get(path.name, {}).get(digest) == entry:
            return
        if not known and os.path.lexists(record) and record.lstat().st_size:
            return  # somebody else's, or damaged
        if os.path.lexists(record) and record.lstat().st_size > MOST_RECORD_BYTES:
            _shorten(record, known)
        flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
        descriptor = os.open(record, flags | getattr(os, "O_BINARY", 0), 0o666)
        try:
            if is_own(os.fstat(descriptor)):
                os.write(descriptor, _lines(digest, path.name, entry))  # in one piece, as several processes may do it
        finally:
            os.close(descriptor)


def _shorten(record: Path, known: dict[str, dict[str, WrittenFile]]) -> None:
    last = {name: [*contents.items()][-1] for name, contents in known.items()}
    unfinished = UnfinishedFile(record)
    try:
        unfinished.write_bytes(b"".join(_lines(digest, name, entry) for name, (digest, entry) in last.items()))
        unfinished.move_to(record)
    finally:
        unfinished.end()


def _origin_seen_from(folder: Path) -> str:
    """What is made now is made from, as lists write it."""
    origin = _origin.get()
    if not origin:
        return ""
    try:
        return os.path.relpath(origin, os.path.realpath(folder)).replace(os.sep, "/")
    except ValueError:  # on another drive
        return origin


def _entry(path: Path, known: dict[str, dict[str, WrittenFile]] | None = None) -> WrittenFile | None:
    """What the list says of a file as it is now; None of one that creepkit did not write so. OSError where it is gone.

    Hashed is only what is listed with its name and, in lists that have sizes, its size.
    """
    contents = (_written(path.parent) if known is None else known).get(path.name)
    if not contents:
        return None
    size = path.stat().st_size
    if all(entry.size not in (None, size) for entry in contents.values()):
        return None
    try:
        digest = sha256_of(path, FileKind("a result", CreepkitError, "choose another name", maximum_bytes=size))
    except CreepkitError:
        return None
    return contents.get(digest)


def _written(folder: Path) -> dict[str, dict[str, WrittenFile]]:
    """{name: {sha256: the rest}} of what creepkit wrote in a folder, in its order; {} where the list is not ours."""
    path = folder / RECORD
    try:
        if not is_own(path.lstat()):
            return {}
        lines = read_bytes(path, _RECORD_FILE).split(b"\n")
    except (OSError, CreepkitError):
        return {}
    found: dict[str, dict[str, WrittenFile]] = {}
    rest = WrittenFile()
    for line in lines:
        if comment := _COMMENT.fullmatch(line):
            rest = WrittenFile(int(comment[1]), os.fsdecode(_unescaped(comment[2] or b"")))
            continue
        digest, separator, name = line.lstrip(b"\\").partition(b"  ")
        if separator:
            contents = found.setdefault(os.fsdecode(_unescaped(name) if line[:1] == b"\\" else name), {})
            contents.pop(text := digest.decode("ascii", "replace"), None)
            contents[text] = rest
        rest = WrittenFile()
    return found


def _lines(digest: str, name: str, entry: WrittenFile) -> bytes:
    """The lines of a content: with a backslash in front where the name has one, or a line end."""
    plain = os.fsencode(name)
    escaped = _escaped(plain)
    origin = b" " + _escaped(os.fsencode(entry.origin)) if entry.origin else b""
    rest = b"" if entry.size is None else b"# %d%s\n" % (entry.size, origin)
    return rest + (b"" if escaped == plain else b"\\") + digest.encode() + b"  " + escaped + b"\n"


def _escaped(name: bytes) -> bytes:
    return name.replace(b"\\", b"\\\\").replace(b"\n", b"\\n").replace(b"\r", b"\\r")


def _unescaped(name: bytes) -> bytes:
    pieces = name.split(b"\\\\")
    return b"\\".join(piece.replace(b"\\n", b"\n").replace(b"\\r", b"\r") for piece in pieces)
