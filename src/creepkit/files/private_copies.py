"""Files that others could change are read from a private copy: what is checked is then what is read.

A library that opens a file by name, and more than once, may meet another file each time: a pipe that never ends, or
content that nobody has checked. Where nobody else can do that, the file itself is read.
"""

from __future__ import annotations

import errno
import hashlib
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from creepkit.files.owners import SharedFolderError, check_private, others_can_change
from creepkit.files.reading import PIECE_BYTES, FileKind, check_readable, opened_regular


@dataclass(frozen=True)
class UnchangingFile:
    """A file that nobody else changes while it is read.

    path : of it. digest : SHA-256 of what a copy holds and where; "" for the file itself.
    """

    path: Path
    digest: str = ""


@contextmanager
def unchanging(path: Path, kind: FileKind) -> Iterator[UnchangingFile]:
    """The regular file `path`, or a copy of it in a private temporary folder; the error of `kind` where neither is."""
    if not others_can_change(path):
        check_readable(path, kind)
        yield UnchangingFile(path)
        return
    with opened_regular(path, kind) as descriptor:  # before a folder is made
        try:
            folder = tempfile.TemporaryDirectory(prefix="creepkit_read_")
        except OSError as error:
            raise kind.error(_no_copy(path, error.strerror or str(error))) from None
        with folder as name:
            try:
                check_private(Path(name))
                copy = Path(name) / "copy"
                digest = _copy(descriptor, copy)
            except (OSError, SharedFolderError) as error:
                raise kind.error(_no_copy(path, getattr(error, "strerror", None) or str(error))) from None
            yield UnchangingFile(copy, digest)


def _no_copy(path: Path, cause: str) -> str:
    return (
        f"{path}: others can change this file while it is read, and no private copy can be made ({cause}); move it to "
        "a folder of your own, or set TMPDIR to one with space"
    )


def _copy(source: int, copy: Path) -> str:
    """Copy an open file, at most as long as it is now, without its holes; the SHA-256 of what it holds and where."""
    size, position, digest = os.fstat(source).st_size, 0, hashlib.sha256()
    digest.update(b"%d\n" % size)
    with copy.open("xb") as target:
        target.truncate(size)
        while (position := _next_content(source, position)) < size:
            os.lseek(source, position, os.SEEK_SET)
            piece = os.read(source, min(PIECE_BYTES, size - position))
            if not piece:  # it has become shorter
                break
            target.seek(position)
            target.write(piece)
            digest.update(b"%d\n" % position)
            digest.update(piece)
            position += len(piece)
    return digest.hexdigest()


def _next_content(file: int, position: int) -> int:
    """Where the next bytes are that lie in no hole; the end of a file without any."""
    seek_data = getattr(os, "SEEK_DATA", None)
    if seek_data is None:
        return position
    try:
        return os.lseek(file, position, seek_data)
    except OSError as error:  # behind the last bytes; else of a file system that does not know
        return max(position, os.fstat(file).st_size) if error.errno == errno.ENXIO else position
