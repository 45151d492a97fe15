"""Writing files: whole or not at all, never through links or into devices, and never over what creepkit did not write.

A file is creepkit's own while its content is what creepkit wrote under its name (see written_lists). Any other file is
replaced by force alone, and so is one that was made from another study or measured file than the new one.

Files in folders that creepkit keeps for itself (shards, caches) are `internal`: always replaced, and listed nowhere.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path
from typing import Literal

from creepkit.checked_arguments import checked
from creepkit.errors import CreepkitError
from creepkit.files.temporary_names import is_temporary
from creepkit.files.unfinished_files import ReplacedError, UnfinishedFile, is_own
from creepkit.files.written_lists import is_foreign, note_written, other_origin

ForeignRule = Literal["refuse", "beside", "replace"]
"""What becomes of a result whose target is not creepkit's own: none is written, or under another name, or over it."""


_foreign_rule: ContextVar[ForeignRule] = ContextVar("foreign_rule", default="refuse")


FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Numbers of errors of a disk, or of a user's share of it, that takes no more."""


ADVICE = "choose a file in a folder that exists and has space"


@checked
@contextmanager
def overwriting(rule: ForeignRule = "replace") -> Iterator[None]:
    """Allow files that creepkit did not write to be replaced by what is written in this block.

    rule : "replace"; "refuse", as it is outside; or "beside", with which a result whose target is foreign is kept
        under another name before that is said: for work that began when the target was free.
    """
    token = _foreign_rule.set(rule)
    try:
        yield
    finally:
        _foreign_rule.reset(token)


@contextmanager
def replace_on_success(
    path: Path, error: type[CreepkitError], advice: str = ADVICE, *, force: bool = False, internal: bool = False
) -> Iterator[UnfinishedFile]:
    """A new file that takes the place of `path` at the end, and is removed when the writing fails.

    error : class of what is raised when the file cannot be written. advice : what to do then. force : whether a file
    that creepkit did not write is replaced. internal : see above. Permissions of a file that is replaced are kept
    where it is the user's.
    """
    rule = "replace" if force or internal else _foreign_rule.get()
    check_target(path, error, force=rule != "refuse")
    unfinished: UnfinishedFile | None = None
    try:
        unfinished = UnfinishedFile(path)
        yield unfinished
        if internal:
            unfinished.move_to(path)
            return
        unfinished.flush()
        written = unfinished.summary()
        if rule == "beside" and _is_kept(path):
            raise error(_keep_beside(path, unfinished, written, "was made or changed by something else meanwhile"))
        with suppress(OSError):
            status = path.lstat()
            if is_own(status):
                unfinished.allow(stat.S_IMODE(status.st_mode) & 0o777)
        note_written(path, *written)
        try:
            unfinished.move_to(path)
        except PermissionError:  # although its folder takes files
            kept = _keep_beside(path, unfinished, written, "cannot be replaced: another program holds it")
            raise error(kept) from None
    except ReplacedError as failure:
        raise error(f"{path}: cannot be written: {failure}; choose a folder that nobody else may write to") from None
    except OSError as failure:
        raise error(f"{path}: cannot be written: {_cause(failure, advice)}") from None
    finally:
        if unfinished is not None:
            unfinished.end()


def write_text(
    text: str, path: Path, error: type[CreepkitError], *, force: bool = False, internal: bool = False
) -> Path:
    """Write a text in UTF-8, with the line ends that it has; as write_bytes()."""
    return write_bytes(text.encode("utf-8"), path, error, force=force, internal=internal)


def write_bytes(
    content: bytes, path: Path, error: type[CreepkitError], *, force: bool = False, internal: bool = False
) -> Path:
    """Write a file whole or not at all, in the place of one that is there; as replace_on_success()."""
    with replace_on_success(path, error, force=force, internal=internal) as unfinished:
        unfinished.write_bytes(content)
    return path


def write_if_absent(path: Path, text: str) -> None:
    """Write a file that the first of several writers decides; OSError when there is no space for it."""
    unfinished = UnfinishedFile(path)
    try:
        unfinished.write_bytes(text.encode("utf-8"))
        with suppress(FileExistsError):  # another process was faster; the caller compares what it wrote
            unfinished.link_to(path)
    finally:
        unfinished.end()


def check_target(path: Path, error: type[CreepkitError], *, force: bool = False) -> None:
    """Raise `error` where a result could not be written to `path`; for before the work that makes it.

    Refused are folders, devices, pipes, symbolic links, files in folders that are missing or not open to writing,
    and, without `force`, files that are read-only or that creepkit did not write.
    """
    problem = _problem(path, force=force or _foreign_rule.get() == "replace")
    if problem:
        raise error(f"{path}: cannot be written: {problem}")


def check_folder_target(folder: Path, error: type[CreepkitError], names: tuple[str, ...] = ()) -> None:
    """Raise `error` where results could not be written into a folder, which is made where it is missing.

    names : of files that are going to be written there, as far as they are known; checked as by check_target().
    """
    existing = next(one for one in (folder, *folder.absolute().parents) if os.path.lexists(one))
    if not existing.is_dir():
        raise error(f"{folder}: cannot be written: {existing} is no folder; name a folder for the results")
    if not os.access(existing, os.W_OK | os.X_OK):
        raise error(f"{folder}: cannot be written: {existing} is not open to writing; name another folder")
    for name in names if folder.is_dir() else ():
        check_target(folder / name, error)


def remove_temporary_files(path: Path) -> None:
    """Remove what processes that ended while they wrote `path` have left; none may be writing it now."""
    for temporary in path.parent.iterdir():
        if is_temporary(temporary, path):
            temporary.unlink(missing_ok=True)


# ---- what a target is ----------------------------------------------------------------------------------------------


def _problem(path: Path, *, force: bool) -> str:
    """Why nothing may be written to a path, and what to do; "" where it may."""
    try:
        mode = path.lstat().st_mode
    except FileNotFoundError:
        return _folder_problem(path)
    except (OSError, ValueError) as failure:  # ValueError: a name with a null byte
        cause = os.strerror(failure.errno) if isinstance(failure, OSError) and failure.errno else str(failure)
        return f"{cause}; {ADVICE}"
    if stat.S_ISDIR(mode):
        return "it is a folder; name a file in it"
    if stat.S_ISLNK(mode):
        target = os.path.realpath(path)
        return f"it is a symbolic link to {target}, and nothing is written through links; name that file, or another"
    if not stat.S_ISREG(mode):
        return "it is a device, a pipe or the like; name a regular file"
    if not force and not mode & 0o222:
        return "it is there and read-only; choose another name, or overwrite it by force"
    if not force and is_foreign(path):
        return (
            "it is there, and creepkit did not write it as it is now; choose another name, or overwrite it by force "
            "(--force, in Python creepkit.overwriting())"
        )
    if not force and (origin := other_origin(path)):
        return (
            f"it is there, and creepkit made it {origin}; choose another name, or overwrite it by force (--force, in "
            "Python creepkit.overwriting())"
        )
    return _folder_problem(path)


def _is_kept(path: Path) -> bool:
    """Whether a file is there that is replaced by force alone."""
    return is_foreign(path) or bool(other_origin(path))


def _folder_problem(path: Path) -> str:
    folder = path.absolute().parent
    if not folder.is_dir():
        return f"there is no folder {path.parent}; {ADVICE}"
    if not os.access(folder, os.W_OK | os.X_OK):
        return f"the folder {path.parent} is not open to writing; {ADVICE}"
    return ""


# ---- the end of a writing, and failures -----------------------------------------------------------------------------


def _keep_beside(path: Path, unfinished: UnfinishedFile, written: tuple[str, int], reason: str) -> str:
    """Give a result the first free name beside its own, whose file is foreign; the sentence that says so."""
    for number in range(2, 1000):
        other = path.with_name(f"{path.stem}-{number}{path.suffix}")
        if not os.path.lexists(other):
            note_written(other, *written)
            unfinished.move_to(other)
            return f"{path}: {reason}, and is left as it is; the result is {other}"
    return f"{path}: {reason}, and is left as it is; the result is lost"


def _cause(failure: OSError, advice: str) -> str:
    message = os.strerror(failure.errno) if failure.errno else " ".join(str(failure).split())
    return f"{message}; {'free some space and start again' if failure.errno in FULL else advice}"
