"""The cache folder, whose compiled code is executed: used only where it is ours alone to write to.

A folder or file that another user made or can write to may hold what they want us to run. It is left alone, which is
said once: laws are then compiled anew by every process. On Windows, where files have no such owners, a user's folder
counts as the user's.
"""

from __future__ import annotations

import os
import stat
import warnings
from functools import cache
from pathlib import Path

from creepkit.errors import CacheWarning

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
