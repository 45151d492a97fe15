"""Writing files whole or not at all: to a temporary name in the same folder, then renamed over the target."""

from __future__ import annotations

import errno
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from creepkit.errors import CreepkitError


@contextmanager
def replace_on_success(
    path: Path, error: type[CreepkitError], advice: str = "choose a file in a folder that exists and has space"
) -> Iterator[Path]:
    """A temporary name beside `path` that takes its place at the end, and is removed when the writing fails.

    error : class of what is raised when the file cannot be written. advice : what to do then.
    A target that exists and is no regular file (a folder, a device, a pipe) is refused before anything is written.
    """
    check_target(path, error)
    temporary = _temporary_name(path)
    try:
        yield temporary
        os.replace(temporary, path)
    except OSError as failure:
        raise error(f"{path}: cannot be written: {_cause(failure, advice)}") from None
    finally:
        with suppress(OSError):  # the folder may be no folder
            temporary.unlink(missing_ok=True)


def write_text(text: str, path: Path, error: type[CreepkitError]) -> Path:
    """Write a text in UTF-8, with the line ends that it has."""
    return write_bytes(text.encode("utf-8"), path, error)


def write_bytes(content: bytes, path: Path, error: type[CreepkitError]) -> Path:
    """Write a file whole or not at all, in the place of one that is there."""
    with replace_on_success(path, error) as temporary:
        temporary.write_bytes(content)
    return path


def write_if_absent(path: Path, text: str) -> None:
    """Write a file that the first of several writers decides; OSError when there is no space for it."""
    temporary = _temporary_name(path)
    try:
        temporary.write_bytes(text.encode("utf-8"))
        try:
            os.link(temporary, path)
        except FileExistsError:
            pass  # another process was faster; the caller compares what it wrote
        except OSError:  # a file system without links
            os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def check_target(path: Path, error: type[CreepkitError], *, force: bool = True) -> None:
    """Raise `error` for a target that is no regular file, or, without `force`, for one that exists."""
    if path.is_dir():
        raise error(f"{path}: cannot be written: it is a folder; name a file in it")
    if path.exists() and not path.is_file():
        raise error(f"{path}: cannot be written: it is a device, a pipe or the like; name a regular file")
    if path.exists() and not force:
        raise error(f"{path} exists already and was left as it is; choose another name, or overwrite it by force")


def remove_temporary_files(path: Path) -> None:
    """Remove what processes that ended while they wrote `path` have left; none may be writing it now."""
    for temporary in path.parent.glob(f".{path.name}.*.part"):
        temporary.unlink(missing_ok=True)


def _temporary_name(path: Path) -> Path:
    return path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")


def _cause(failure: OSError, advice: str) -> str:
    message = os.strerror(failure.errno) if failure.errno else " ".join(str(failure).split())
    full = failure.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
    return f"{message}; {'free some space and start again' if full else advice}"
