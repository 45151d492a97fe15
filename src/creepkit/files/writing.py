"""Writing files: whole or not at all, never through links or into devices, and never over what creepkit did not write.

A file is creepkit's own while its content is what creepkit wrote under its name. That stands in a list in the same
folder, RECORD, a line `SHA256  NAME` for each content as `sha256sum` prints it: a file that a person made or changed is
not in it. Any other file is replaced by force alone. The list is ours when it is a regular file of our user; without
it nothing is lost: a file is then taken for a foreign one.

Files in folders that creepkit keeps for itself (shards, caches) are `internal`: always replaced, and listed nowhere.
"""

from __future__ import annotations

import errno
import hashlib
import os
import stat
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path
from typing import Literal

from creepkit.checked_arguments import checked
from creepkit.errors import CreepkitError
from creepkit.files.reading import FileKind, read_bytes
from creepkit.files.temporary_names import PART, temporary_beginning, temporary_name

RECORD = ".creepkit-written"
"""The list of what creepkit wrote in a folder."""


MOST_RECORD_BYTES = 1_000_000
"""Of a list, beyond which the last content of each name is kept alone."""


ForeignRule = Literal["refuse", "beside", "replace"]
"""What becomes of a result whose target is not creepkit's own: none is written, or under another name, or over it."""


_foreign_rule: ContextVar[ForeignRule] = ContextVar("foreign_rule", default="refuse")


FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Numbers of errors of a disk, or of a user's share of it, that takes no more."""


WAITS = (0.02, 0.1, 0.4)
"""s between attempts to give a file the name of one that another program holds."""


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
) -> Iterator[Path]:
    """A temporary name beside `path` that takes its place at the end, and is removed when the writing fails.

    error : class of what is raised when the file cannot be written. advice : what to do then. force : whether a file
    that creepkit did not write is replaced. internal : see above. Permissions of a file that is replaced are kept.
    """
    rule = "replace" if force or internal else _foreign_rule.get()
    check_target(path, error, force=rule != "refuse")
    temporary = temporary_name(path)
    try:
        yield temporary
        if not internal:
            _flush(temporary)
        if rule == "beside" and is_foreign(path):
            raise error(_keep_beside(path, temporary, "was made or changed by something else meanwhile"))
        if internal:
            _replace(temporary, path)
        else:
            with suppress(OSError):
                temporary.chmod(stat.S_IMODE(path.stat().st_mode) & 0o777)
            _note(path, temporary)
            try:
                _replace(temporary, path)
            except PermissionError:  # although its folder takes files
                raise error(_keep_beside(path, temporary, "cannot be replaced: another program holds it")) from None
    except OSError as failure:
        raise error(f"{path}: cannot be written: {_cause(failure, advice)}") from None
    finally:
        with suppress(OSError):  # the folder may be no folder
            temporary.unlink(missing_ok=True)


def write_text(
    text: str, path: Path, error: type[CreepkitError], *, force: bool = False, internal: bool = False
) -> Path:
    """Write a text in UTF-8, with the line ends that it has; as write_bytes()."""
    return write_bytes(text.encode("utf-8"), path, error, force=force, internal=internal)


def write_bytes(
    content: bytes, path: Path, error: type[CreepkitError], *, force: bool = False, internal: bool = False
) -> Path:
    """Write a file whole or not at all, in the place of one that is there; as replace_on_success()."""
    with replace_on_success(path, error, force=force, internal=internal) as temporary:
        temporary.write_bytes(content)
    return path


def write_if_absent(path: Path, text: str) -> None:
    """Write a file that the first of several writers decides; OSError when there is no space for it."""
    temporary = temporary_name(path)
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


def is_foreign(path: Path) -> bool:
    """Whether a file is there that creepkit did not write as it is."""
    try:
        return path.is_file() and (digest_of(path), path.name) not in _written(path.parent)
    except OSError:
        return True


def written_files(folder: Path, pattern: str = "*") -> list[Path]:
    """Files of a folder, no links, that are as creepkit wrote them."""
    known = _written(folder)
    files = (path for path in folder.glob(pattern) if not path.is_symlink() and path.is_file())
    return [path for path in files if (digest_of(path), path.name) in known]


def is_listed(path: Path) -> bool:
    """Whether creepkit wrote a file of this name in this folder, whatever it holds now."""
    return any(name == path.name for _, name in _written(path.parent))


def digest_of(path: Path) -> str:
    """SHA-256 of what a file holds."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def remove_temporary_files(path: Path) -> None:
    """Remove what processes that ended while they wrote `path` have left; none may be writing it now."""
    for temporary in path.parent.iterdir():
        if temporary.name.startswith(temporary_beginning(path)) and temporary.name.endswith(PART):
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
    return _folder_problem(path)


def _folder_problem(path: Path) -> str:
    folder = path.absolute().parent
    if not folder.is_dir():
        return f"there is no folder {path.parent}; {ADVICE}"
    if not os.access(folder, os.W_OK | os.X_OK):
        return f"the folder {path.parent} is not open to writing; {ADVICE}"
    return ""


# ---- the list of what creepkit wrote -------------------------------------------------------------------------------


_RECORD_FILE = FileKind("a list of written files", CreepkitError, "remove it", maximum_bytes=4 * MOST_RECORD_BYTES)


def _written(folder: Path) -> dict[tuple[str, str], None]:
    """The (sha256, name) of what creepkit wrote in a folder, in their order; nothing where the list is not ours."""
    path = folder / RECORD
    try:
        status = path.lstat()
        if not stat.S_ISREG(status.st_mode) or (hasattr(os, "geteuid") and status.st_uid != os.geteuid()):
            return {}
        lines = read_bytes(path, _RECORD_FILE).split(b"\n")
    except (OSError, CreepkitError):
        return {}
    found: dict[tuple[str, str], None] = {}
    for line in lines:
        digest, separator, name = line.lstrip(b"\\").partition(b"  ")
        if separator:
            found[digest.decode("ascii", "replace"), os.fsdecode(_unescaped(name) if line[:1] == b"\\" else name)] = (
                None
            )
    return found


def _note(path: Path, content: Path) -> None:
    """Enter into the list that the content of a file is ours below the name of `path`; where it cannot be, nothing.

    Before the file takes its place: a process that dies in between leaves no file of ours that looks foreign.
    """
    with suppress(OSError):
        entry, known = (digest_of(content), path.name), _written(path.parent)
        record = path.parent / RECORD
        if entry in known:
            return
        if not known and os.path.lexists(record) and record.stat().st_size:
            return  # somebody else's, or damaged
        if os.path.lexists(record) and record.stat().st_size > MOST_RECORD_BYTES:
            last = {name: digest for digest, name in known}
            temporary = temporary_name(record)
            temporary.write_bytes(b"".join(_line(digest, name) for name, digest in last.items()))
            _replace(temporary, record)
        flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
        descriptor = os.open(record, flags, 0o666)
        try:
            os.write(descriptor, _line(*entry))  # in one piece, as several processes may do it
        finally:
            os.close(descriptor)


def _line(digest: str, name: str) -> bytes:
    """A line as sha256sum prints it: with a backslash in front where the name has one, or a line end."""
    plain = os.fsencode(name)
    escaped = plain.replace(b"\\", b"\\\\").replace(b"\n", b"\\n").replace(b"\r", b"\\r")
    return (b"" if escaped == plain else b"\\") + digest.encode() + b"  " + escaped + b"\n"


def _unescaped(name: bytes) -> bytes:
    pieces = name.split(b"\\\\")
    return b"\\".join(piece.replace(b"\\n", b"\n").replace(b"\\r", b"\r") for piece in pieces)


# ---- the end of a writing, and failures -----------------------------------------------------------------------------


def _flush(temporary: Path) -> None:
    """Have the content on the disk before its name is: else a failing machine may leave an empty file."""
    with temporary.open("rb+") as file:
        os.fsync(file.fileno())


def _replace(temporary: Path, path: Path) -> None:
    """Give a file its name; Windows refuses that as long as anybody reads the file which has it, as scanners do."""
    for wait in WAITS:
        try:
            return os.replace(temporary, path)
        except PermissionError:
            time.sleep(wait)
    return os.replace(temporary, path)


def _keep_beside(path: Path, temporary: Path, reason: str) -> str:
    """Give a result the first free name beside its own, whose file is foreign; the sentence that says so."""
    for number in range(2, 1000):
        other = path.with_name(f"{path.stem}-{number}{path.suffix}")
        if not os.path.lexists(other):
            _note(other, temporary)
            _replace(temporary, other)
            return f"{path}: {reason}, and is left as it is; the result is {other}"
    return f"{path}: {reason}, and is left as it is; the result is lost"


def _cause(failure: OSError, advice: str) -> str:
    message = os.strerror(failure.errno) if failure.errno else " ".join(str(failure).split())
    return f"{message}; {'free some space and start again' if failure.errno in FULL else advice}"
