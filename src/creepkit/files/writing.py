"""Writing files: whole or not at all, never through links or into devices, and never over what creepkit did not write.

What is written takes a temporary name in the same folder, then its own. RECORD lists what creepkit wrote in a folder, a
line of JSON for each content: [name, bytes and SHA-256, what it was made from]. A file is creepkit's own while its
content is listed under its name; any other file is replaced by force alone, and so is one that was made from another
study or measured file than the new one. Without the list nothing is lost: its files then need force.

Files in folders that creepkit keeps for itself (shards, caches) are `internal`: always replaced, and listed nowhere.

Names of files from names of laws, tests and alloys are such that any system can save and tell apart: Windows has names
of devices that no file may have, whatever its suffix, drops dots and blanks at the end, and, as macOS does, takes
`Norton` and `norton` for one file.

The cache folder, whose compiled code is executed, is used only where it is ours alone to write to: a folder or file
that another user made or can write to may hold what they want us to run. It is left alone, which is said once: laws are
then compiled anew by every process. On Windows, where files have no such owners, a user's folder counts as the user's.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import re
import secrets
import shutil
import stat
import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from functools import cache
from pathlib import Path

from creepkit.errors import CacheWarning, CreepkitError, quoted
from creepkit.files.reading import FileKind, read_text, sha256_of

DEVICE_NAMES = frozenset(
    [
        "con",
        "prn",
        "aux",
        "nul",
        "conin$",
        "conout$",
        *(f"{port}{k}" for port in ("com", "lpt") for k in "0123456789¹²³"),
    ]
)
"""Names of devices on Windows."""


MOST_SIGNS = 80
"""Signs of a name: folders, a suffix and temporary additions have to fit into 255 as well."""


PLAIN_SIGNS = "A-Za-z0-9._=+-"
"""What may stand in a name, as a set of a regular expression."""


LAW_SIGNS = "A-Za-z0-9._=-"
"""Those of laws: a sum of laws, norton+dorn, is saved as norton-dorn."""


def file_stem(text: str, default: str = "file", signs: str = PLAIN_SIGNS, gap: str = "-") -> str:
    """A name without suffix that any system can save; different texts may get the same.

    default : the name of a text of which nothing is left. gap : what stands for signs that are none of `signs`.
    """
    plain = re.sub(f"[^{signs}]+", gap, text).strip("._-")[:MOST_SIGNS].rstrip("._-") or default
    return f"{default}-{plain}" if plain.split(".")[0].casefold() in DEVICE_NAMES else plain


def hashed_stem(text: str, default: str = "x", others: Iterable[str] = ()) -> str:
    """The text itself where any system can save it, else with the beginning of a hash, so that it stays apart.

    others : texts of other files in the same folder; one that differs by case alone makes the hash necessary.
    """
    plain = file_stem(text, default)
    unlike = all(other == text or other.casefold() != text.casefold() for other in others)
    if plain == text and unlike:
        return plain
    return f"{plain}_{hashlib.sha256(text.encode('utf-8', 'replace')).hexdigest()[:6]}"


def numbered_stems(texts: Sequence[str], default: str = "file", signs: str = PLAIN_SIGNS) -> list[str]:
    """A name for each text; later ones that a system might take for an earlier one get a number."""
    names: list[str] = []
    taken: set[str] = set()
    for text in texts:
        plain = name = file_stem(text, default, signs)
        number = 2
        while name.casefold() in taken:
            name, number = f"{plain}-{number}", number + 1
        taken.add(name.casefold())
        names.append(name)
    return names


RECORD = ".creepkit-written"
"""The list of what creepkit wrote in a folder."""


ADVICE = "choose a file in a folder that exists and has space"


FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Numbers of errors of a disk, or of a user's share of it, that takes no more."""


_RECORD_FILE = FileKind("a list of written files", CreepkitError, "remove it")
_ANY_FILE = FileKind("a result", CreepkitError, "choose another name", maximum_bytes=2**62)


_force: ContextVar[bool] = ContextVar("force", default=False)
_origin: ContextVar[str] = ContextVar("origin", default="")


@contextmanager
def overwriting() -> Iterator[None]:
    """Allow files that creepkit did not write to be replaced by what is written in this block."""
    token = _force.set(True)
    try:
        yield
    finally:
        _force.reset(token)


@contextmanager
def made_from(path: str | Path) -> Iterator[None]:
    """Note with each file that is written in this block what it was made from, and keep those that were not.

    For results whose names are not chosen by who calls the command, but stand in a study or in a measured file: names
    such as D1 are the same for many recordings.
    """
    token = _origin.set(os.path.realpath(path) if str(path) else "")
    try:
        yield
    finally:
        _origin.reset(token)


@contextmanager
def replace_on_success(
    path: Path, error: type[CreepkitError], advice: str = ADVICE, *, force: bool = False, internal: bool = False
) -> Iterator[Path]:
    """The temporary name of a file that takes the place of `path` at the end, and is removed when the writing fails.

    error : class of what is raised when the file cannot be written. advice : what to do then. force : whether a file
    that creepkit did not write is replaced. internal : see above.
    """
    check_target(path, error, force=force or internal)
    temporary = temporary_name(path)
    try:
        yield temporary
        if not internal:
            with suppress(OSError):
                shutil.copymode(path, temporary)
            _note_written(path, f"{temporary.stat().st_size} {sha256_of(temporary, _ANY_FILE)}")
        os.replace(temporary, path)
    except OSError as failure:
        message = os.strerror(failure.errno) if failure.errno else " ".join(str(failure).split())
        remedy = "free some space and start again" if failure.errno in FULL else advice
        raise error(f"{path}: cannot be written: {message}; {remedy}") from None
    finally:
        with suppress(OSError):
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


def check_target(path: Path, error: type[CreepkitError], *, force: bool = False) -> None:
    """Raise `error` where a result could not be written to `path`; for before the work that makes it.

    Refused are folders, devices, pipes, symbolic links, files in folders that are missing or not open to writing,
    and, without `force`, files that are read-only or that creepkit did not write.
    """
    if problem := _problem(path, force=force or _force.get()):
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


def temporary_name(path: Path) -> Path:
    """A new name beside `path`; the beginning of a long name is enough, since 255 bytes are allowed."""
    return path.with_name(f".{path.name[:40]}.{secrets.token_hex(4)}.part")


def remove_temporary_files(path: Path) -> None:
    """Remove what processes that were killed while they wrote `path` have left; none may be writing it now."""
    for temporary in path.parent.glob(".*.????????.part"):
        if temporary.name.startswith(f".{path.name[:40]}."):
            temporary.unlink(missing_ok=True)


def _problem(path: Path, *, force: bool) -> str:
    """Why nothing may be written to a path, and what to do; "" where it may."""
    folder = path.absolute().parent
    try:
        mode = path.lstat().st_mode
    except FileNotFoundError:
        mode = stat.S_IFREG | 0o200
    except (OSError, ValueError) as failure:  # ValueError: a name with a null byte
        return f"{getattr(failure, 'strerror', None) or failure}; {ADVICE}"
    by_force = "choose another name, or overwrite it by force (--force, in Python creepkit.overwriting())"
    if stat.S_ISDIR(mode):
        return "it is a folder; name a file in it"
    if stat.S_ISLNK(mode):
        target = os.path.realpath(path)
        return f"it is a symbolic link to {target}, and nothing is written through links; name that file, or another"
    if not stat.S_ISREG(mode):
        return "it is a device, a pipe or the like; name a regular file"
    if not folder.is_dir():
        return f"there is no folder {path.parent}; {ADVICE}"
    if not os.access(folder, os.W_OK | os.X_OK):
        return f"the folder {path.parent} is not open to writing; {ADVICE}"
    if not force and not mode & 0o222:
        return f"it is there and read-only; {by_force}"
    if not force and is_foreign(path):
        return f"it is there, and creepkit did not write it as it is now; {by_force}"
    if not force and (origin := _other_origin(path)):
        return f"it is there, and creepkit made it {origin}; {by_force}"
    return ""


# ---- the list of what was written ----------------------------------------------------------------------------------


def is_foreign(path: Path) -> bool:
    """Whether a file is there that creepkit did not write as it is."""
    return path.is_file() and _recorded_origin(path) is None


def _recorded_origin(path: Path) -> str | None:
    """What a file was made from, "" where that was not noted; None of a file that creepkit did not write as it is."""
    size = path.stat().st_size
    with suppress(CreepkitError):
        if any(content.startswith(f"{size} ") for content in _written(path.parent).get(path.name, ())):
            content = f"{size} {sha256_of(path, _ANY_FILE)}"
            return _written(path.parent)[path.name].get(content)  # read anew: it names a content before that is there
    return None


def _other_origin(path: Path) -> str:
    """How creepkit made a file that is there: "from X", if not from what is made from now; else ""."""
    now, before = _origin_seen_from(path.parent), _recorded_origin(path) if path.is_file() else None
    if not now or before is None or before == now:
        return ""
    return f"from {quoted(before, 120)}" if before else "by another command"


def _origin_seen_from(folder: Path) -> str:
    try:
        return os.path.relpath(_origin.get(), os.path.realpath(folder)).replace(os.sep, "/") if _origin.get() else ""
    except ValueError:  # on another drive
        return _origin.get()


def _written(folder: Path) -> dict[str, dict[str, str]]:
    """{name: {bytes and SHA-256: origin}} of what creepkit wrote in a folder; other lines are passed over."""
    contents: dict[str, dict[str, str]] = {}
    with suppress(CreepkitError):
        for line in read_text(folder / RECORD, _RECORD_FILE).splitlines():
            with suppress(ValueError, TypeError):
                name, content, origin = json.loads(line)
                contents.setdefault(name, {})[str(content)] = origin
    return contents


def _note_written(path: Path, content: str) -> None:
    """List a content; before it takes its place, so that a process that dies in between leaves no foreign file."""
    origin = _origin_seen_from(path.parent)
    if _written(path.parent).get(path.name, {}).get(content) != origin:
        with suppress(OSError), open(path.parent / RECORD, "a", encoding="utf-8") as record:
            record.write(json.dumps([path.name, content, origin]) + "\n")


ENVIRONMENT_VARIABLE = "CREEPKIT_CACHE"


def cache_folder(name: str) -> Path | None:
    """The cache folder of a kind of files, made where it is missing; None where none can be used.

    It lies in CREEPKIT_CACHE, an absolute path, else in `creepkit` in the user's cache folder.
    """
    try:
        base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
        folder = Path(os.environ.get(ENVIRONMENT_VARIABLE) or Path(base) / "creepkit") / name
        if not folder.is_absolute():
            raise OSError(f"{folder} is not an absolute path")
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if is_ours_alone(folder):
            return folder
        problem = f"{folder} belongs to another user, or others can write to it"
    except (OSError, RuntimeError) as error:  # RuntimeError: a user without a home folder
        problem = f"the cache folder cannot be used ({error})"
    warn_once(f"{problem}, so that laws are compiled anew; set {ENVIRONMENT_VARIABLE} to a folder of your own")
    return None


def is_ours_alone(path: Path) -> bool:
    """Whether a regular file or folder is this user's or root's, and nobody else can write to it; OSError if none."""
    status = os.lstat(path)
    if not (stat.S_ISREG(status.st_mode) or stat.S_ISDIR(status.st_mode)):
        return False
    if not hasattr(os, "geteuid"):
        return True
    return status.st_uid in (os.geteuid(), 0) and not status.st_mode & 0o022


@cache
def warn_once(sentence: str) -> None:
    """Warn of a cache that is not used."""
    warnings.warn(sentence, CacheWarning, stacklevel=3)
