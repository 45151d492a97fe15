"""The command line: one command a file, and nothing heavy is imported before a command runs.

Compiled code has a folder of its own for each state of the sources: numba checks the file of a compiled function
alone, not those of the functions it calls, so code cached beside the sources would outlive an edit or an upgrade. The
command line, the set-up and the tests share this folder.
"""

from __future__ import annotations

import atexit
import os
import shutil
import signal
import sys
import tempfile
import zlib
from pathlib import Path
from types import FrameType

_SOURCES = Path(__file__).parents[1]


_COMPILED_SOURCES = ("integration/*.py", "kernels/*.py", "fem/*.py", "specimens/bulge/**/*.py")


_KEPT_CACHES = 3


def set_numba_cache() -> None:
    """Let numba keep its code in that folder unless NUMBA_CACHE_DIR is set; numba must not be imported yet."""
    if "NUMBA_CACHE_DIR" not in os.environ:
        folder = numba_cache_folder()
        try:
            _remove_old_caches(folder)
            folder.mkdir(parents=True, exist_ok=True)
            usable = os.access(folder, os.W_OK)
        except OSError:
            usable = False
        if not usable:  # no home, or one that is not ours to write to: each process compiles for itself
            folder = Path(tempfile.mkdtemp(prefix="creepkit-"))
            atexit.register(shutil.rmtree, folder, ignore_errors=True)
        os.environ["NUMBA_CACHE_DIR"] = str(folder)


def numba_cache_folder() -> Path:
    """The folder for these sources, in CREEPKIT_CACHE or the user's cache folder."""
    checksum = 0
    for pattern in _COMPILED_SOURCES:
        for path in sorted(_SOURCES.glob(pattern)):
            checksum = zlib.crc32(path.read_bytes(), checksum)
    configured = os.environ.get("CREEPKIT_CACHE")
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path(os.path.expanduser("~")) / ".cache") / "creepkit"
    return Path(configured or cache) / "compiled" / f"{checksum:08x}"


def _remove_old_caches(folder: Path) -> None:
    """Remove what the oldest states of the sources have left; another process may be at it too."""
    if folder.is_dir():
        os.utime(folder)
        return
    ages = {path: path.stat().st_mtime for path in folder.parent.glob("*") if path.exists()}
    other_folders = sorted(ages, key=lambda path: ages[path], reverse=True)
    for old in other_folders[_KEPT_CACHES:]:
        shutil.rmtree(old, ignore_errors=True)


POSTPONEMENT = 0.02
"""s, after which an interrupt that came at a bad moment comes again."""


def _interrupt(signum: int, frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt, but not within numba's dispatcher, which does not survive an exception there."""
    while frame is not None:
        if f"{os.sep}numba{os.sep}" in frame.f_code.co_filename:
            signal.setitimer(signal.ITIMER_REAL, POSTPONEMENT)
            return
        frame = frame.f_back
    raise KeyboardInterrupt


def main() -> None:
    """Run the command line; the entry point of the script `creepkit`."""
    if hasattr(signal, "setitimer"):  # not on Windows
        signal.signal(signal.SIGINT, _interrupt)
        signal.signal(signal.SIGALRM, _interrupt)
    try:
        from creepkit.cli.app import app

        set_numba_cache()
        app()
    except KeyboardInterrupt:  # before the command began, which says so itself
        sys.exit(130)
