"""Whose files these are: what another user made or can write to is neither executed nor taken for work of ours.

Root's files count as ours. Where a file system gives every file one owner (some network and foreign ones do), files
that we make belong to that owner too, and nothing can be said; nor on Windows, where files have no such owners.
"""

from __future__ import annotations

import os
import stat
import tempfile
from contextlib import suppress
from importlib import import_module
from pathlib import Path

from creepkit.errors import CreepkitError

MOST_LINKS = 40


class SharedFolderError(Exception):
    """Others may have written what would be believed or executed: "/tmp/a can be written by other users"."""


def has_owners() -> bool:
    """Whether files have owners and modes that say who can write; on Windows the folder of a user is the user's."""
    return hasattr(os, "geteuid")


def is_ours(status: os.stat_result) -> bool:
    """Whether a file belongs to this user or to root."""
    if not hasattr(os, "geteuid"):
        return True
    return status.st_uid in (os.geteuid(), 0)


# ---- nobody else's to write to -------------------------------------------------------------------------------------


def check_own(path: Path, status: os.stat_result) -> None:
    """Raise SharedFolderError unless a file or folder is ours or root's and nobody else can write to it."""
    if not is_ours(status):
        raise SharedFolderError(f"{path} belongs to another user")
    if has_owners() and status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        raise SharedFolderError(f"{path} can be written by other users")


def check_private(path: Path, *, make: bool = False) -> None:
    """Raise SharedFolderError unless a folder and those above it are ours or root's and nobody else can write there.

    OSError where there is no such folder, unless it is to be made. The folders above may be open to all if they are
    sticky, as /tmp is. Each link on the way is checked with what it points to.
    """
    if not has_owners():
        if make:
            path.mkdir(parents=True, exist_ok=True)
        os.stat(path)
        return
    current, remaining, links = Path(path.anchor), list(reversed(path.parts[1:])), 0
    while remaining:
        part = remaining.pop()
        if part == os.pardir:
            current = current.parent
            continue
        candidate = current / part
        status = _status(candidate, make=make)
        if stat.S_ISLNK(status.st_mode):
            links += 1
            if links > MOST_LINKS:
                raise SharedFolderError(f"{path} is a chain of links")
            if not is_ours(status):
                raise SharedFolderError(f"{candidate} belongs to another user")
            target = Path(os.readlink(candidate))
            current = Path(target.anchor) if target.is_absolute() else current
            remaining.extend(reversed(target.parts[1:] if target.is_absolute() else target.parts))
            continue
        if not stat.S_ISDIR(status.st_mode):
            raise SharedFolderError(f"{candidate} is not a folder")
        is_sticky = bool(status.st_mode & stat.S_ISVTX) and bool(remaining)
        if is_sticky and is_ours(status):  # only owners rename or remove what lies there
            current = candidate
            continue
        check_own(candidate, status)
        current = candidate


def _status(folder: Path, *, make: bool) -> os.stat_result:
    """The status of a folder or link, which is made where it is missing, for its owner alone."""
    try:
        return os.lstat(folder)
    except FileNotFoundError:
        if not make:
            raise
    with suppress(FileExistsError):  # another process was faster
        os.mkdir(folder, 0o700)
    return os.lstat(folder)


def others_can_change(path: Path) -> bool:
    """Whether another user could change a file, or put another one in its place, while it is read."""
    if not has_owners():
        return False
    current = Path(os.path.abspath(path))
    with suppress(OSError, SharedFolderError):
        for _ in range(MOST_LINKS):
            folder = os.lstat(current.parent)
            is_sticky = bool(folder.st_mode & stat.S_ISVTX) and is_ours(folder)
            check_private(current.parent.parent if is_sticky else current.parent)
            status = os.lstat(current)
            if not stat.S_ISLNK(status.st_mode):
                check_own(current, status)
                return False
            if not is_ours(status):
                return True
            current = current.parent / os.readlink(current)
    return True


# ---- work of ours --------------------------------------------------------------------------------------------------


def check_owner(path: Path, status: os.stat_result, error: type[CreepkitError]) -> None:
    """Raise `error`, which names the owner, for a file or folder of another user that would count as work of ours."""
    if is_ours(status) or _owner_of_new_files(path.parent) == status.st_uid:
        return
    raise error(
        f"{path}: belongs to another user ({_user_name(status.st_uid)}), and only what is yours counts as work that "
        "was begun or finished before; remove it, or choose another folder or name"
    )


def check_owner_by_name(path: Path, error: type[CreepkitError]) -> None:
    """The same for what stands below a name, be it a link; where nothing does, nothing is raised."""
    with suppress(FileNotFoundError, NotADirectoryError):
        check_owner(path, os.lstat(path), error)


def _owner_of_new_files(folder: Path) -> int | None:
    """The owner of a file that is made in a folder now; None where none can be made."""
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            return os.fstat(file.fileno()).st_uid
    except OSError:
        return None


def _user_name(number: int) -> str:
    """The name of a user, or the number of one without a name."""
    with suppress(ImportError, KeyError):
        return str(import_module("pwd").getpwuid(number).pw_name)
    return f"number {number}"
