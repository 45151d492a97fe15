"""Cache folders: used only where they and all folders above them are ours, or root's, and nobody else's to write to.

What lies in a cache is believed, and compiled code from it is executed. On a machine that others use too, a folder that
one of them made or can write to (a name in /tmp, HOME=/tmp) may hold what they want us to run. Such a folder is left
alone; a private temporary one takes its place until the process ends, which is said once.
"""

from __future__ import annotations

import atexit
import os
import shutil
import stat
import tempfile
import warnings
from contextlib import suppress
from functools import cache
from pathlib import Path

from creepkit.errors import CacheWarning
from creepkit.files.owners import SharedFolderError, check_private

ENVIRONMENT_VARIABLE = "CREEPKIT_CACHE"


MARKER_FILE = "CACHEDIR.TAG"
"""In each cache folder that creepkit has made; only below it is anything ever removed."""


MARKER_TEXT = """Signature: 8a477f597d28d172789f06886806bc55
# A cache folder of creepkit; it may be deleted at any time. The line above is that of https://bford.info/cachedir/
"""


def cache_folder(name: str) -> Path | None:
    """The cache folder of a kind of files, made where it is missing; None where there can be none, not even for now.

    It lies in CREEPKIT_CACHE, an absolute path, else in `creepkit` in the user's cache folder, else in a temporary
    folder of this process.
    """
    try:
        folder = _configured_folder() / name
        _make_private(folder)
        return folder
    except SharedFolderError as error:
        problem = str(error)
    except OSError as error:
        problem = f"{error.filename or 'the cache folder'} cannot be used ({error.strerror or error})"
    temporary = _temporary_folder()
    if temporary is None:
        remedy = "and there is no private temporary folder either: every process compiles laws anew"
    else:
        remedy = f"and {temporary} takes its place until this process ends"
    _warn(
        f"{problem}, so that nothing is read from there or kept there, {remedy}; "
        f"set {ENVIRONMENT_VARIABLE} to a folder of your own"
    )
    with suppress(OSError):
        if temporary is None:
            return None
        (temporary / name).mkdir(mode=0o700, exist_ok=True)
        return temporary / name
    return None


def cache_environment() -> dict[str, str]:
    """The environment variable by which a process that we start shares our temporary folder; empty where we have none.

    The process that starts others decides, and says so, before they begin.
    """
    folder = cache_folder("kernels")
    shared = folder is not None and folder.parent in _TEMPORARY
    return {ENVIRONMENT_VARIABLE: str(_TEMPORARY[0])} if shared else {}


def is_marked(folder: Path) -> bool:
    """Whether creepkit has made a cache folder, and so may remove what lies in it."""
    with suppress(OSError):
        return stat.S_ISREG(os.lstat(folder / MARKER_FILE).st_mode)
    return False


# ---- which folder --------------------------------------------------------------------------------------------------


def _configured_folder() -> Path:
    """The folder that the environment asks for."""
    chosen = os.environ.get(ENVIRONMENT_VARIABLE)
    if chosen:
        if not os.path.isabs(chosen):
            raise SharedFolderError(f"{ENVIRONMENT_VARIABLE} is '{chosen}', which is not an absolute path")
        return Path(chosen)
    base = os.environ.get("XDG_CACHE_HOME", "")
    if os.path.isabs(base):  # the standard of these variables has others ignored
        return Path(base) / "creepkit"
    try:
        home = Path.home()
    except RuntimeError:  # a user without an entry, as in a container
        raise SharedFolderError("this user has no home folder") from None
    if not home.is_absolute():
        raise SharedFolderError(f"the home folder is '{home}', which is not an absolute path")
    return home / ".cache" / "creepkit"


def _make_private(folder: Path) -> None:
    """Check a folder as `check_private` does, making what is missing of it; mark it where it is new."""
    is_new = not os.path.lexists(folder)
    check_private(folder, make=True)
    if is_new:
        with suppress(OSError):  # then nothing is ever removed from it
            write_marker(folder)


def write_marker(folder: Path) -> None:
    """Mark a folder as a cache of creepkit; OSError where that is impossible."""
    descriptor = os.open(folder / MARKER_FILE, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with os.fdopen(descriptor, "w", encoding="utf-8") as stream:
        stream.write(MARKER_TEXT)


# ---- a temporary folder --------------------------------------------------------------------------------------------


_TEMPORARY: list[Path] = []


def _temporary_folder() -> Path | None:
    """A private folder for as long as this process lives; None where there can be none."""
    if not _TEMPORARY:
        with suppress(OSError, SharedFolderError):
            parent = Path(tempfile.gettempdir())
            if parent.is_absolute() and not parent.samefile(Path.cwd()):  # where Python finds no other, it names that
                folder = Path(tempfile.mkdtemp(prefix="creepkit_cache_", dir=parent))
                atexit.register(_remove, folder, os.getpid())
                check_private(folder)
                _TEMPORARY.append(folder)
    return _TEMPORARY[0] if _TEMPORARY else None


def _remove(folder: Path, process: int) -> None:
    if os.getpid() == process:  # and not a fork of it
        shutil.rmtree(folder, ignore_errors=True)


@cache
def _warn(sentence: str) -> None:
    """Warn once."""
    warnings.warn(sentence, CacheWarning, stacklevel=3)
