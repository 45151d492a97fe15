"""Generated modules on disk: compiled once, found again by later processes, loaded only when intact.

Each module has a folder of its own, named after the hash of all that it was made from, with the source, numba's
machine code and a seal: the SHA-256 of every file. A folder is built under a temporary name and renamed into place
whole, so that processes may build the same module at once. What its seal does not match is built anew.

Machine code from the cache is executed: keep the folder writable for yourself alone, as it is by default.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from numba.core import config

SOURCE_FILE, CHECKSUM_FILE = "law.py", "SHA256SUMS"

_loaded_modules: dict[str, ModuleType] = {}
_numba_settings: Any = config


def load_module(key: str, source: Callable[[], str]) -> ModuleType:
    """Return the module of `key`: from memory, from disk, or made from text() now."""
    if key not in _loaded_modules:
        folder = _module_folder(f"law_{key}")
        _loaded_modules[key] = _execute_module(key, folder / SOURCE_FILE) if is_intact(folder) else _build_module(key, folder, source())
    return _loaded_modules[key]


def cache_folder() -> Path:
    """Where generated kernels are kept: CREEPKIT_CACHE, else `creepkit` in the user's cache folder."""
    chosen = os.environ.get("CREEPKIT_CACHE")
    base = Path(chosen) if chosen else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "creepkit"
    return base / "kernels"


def is_intact(folder: Path) -> bool:
    """Whether a folder holds the files its seal names, unchanged, and no others."""
    try:
        return (folder / CHECKSUM_FILE).read_text(encoding="utf-8") == _checksums(folder)
    except (OSError, UnicodeDecodeError):
        return False


# ---- folders -------------------------------------------------------------------------------------------------------


def _module_folder(name: str) -> Path:
    """Where a module belongs: in the cache folder, or in a private one when that cannot be written."""
    folder = cache_folder()
    if _writable(folder):
        return folder / name
    private = _private_folder() / name
    if is_intact(folder / name) and not private.exists():
        shutil.copytree(folder / name, private)  # numba must be able to write beside the source
    return private


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True


@cache
def _private_folder() -> Path:
    """A folder of this process, removed when it ends."""
    private = tempfile.mkdtemp(prefix="creepkit-")
    atexit.register(shutil.rmtree, private, ignore_errors=True)
    return Path(private)


# ---- making and loading --------------------------------------------------------------------------------------------


def _build_module(key: str, folder: Path, source: str) -> ModuleType:
    """Write, compile and seal a module in a temporary folder, then put the folder into its place."""
    temporary = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f"new_{folder.name}_"))
    try:
        (temporary / SOURCE_FILE).write_text(source, encoding="utf-8", newline="\n")
        module = _execute_module(key, temporary / SOURCE_FILE)
        (temporary / CHECKSUM_FILE).write_text(_checksums(temporary), encoding="utf-8", newline="\n")
        _install_folder(temporary, folder)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    return module


def _install_folder(temporary: Path, folder: Path) -> None:
    """Rename the new folder into place; an intact one that is there already stays, a damaged one goes."""
    if folder.exists() and not is_intact(folder):
        _remove_folder(folder)
    try:
        os.rename(temporary, folder)
    except OSError:
        if not folder.exists():
            raise


def _remove_folder(folder: Path) -> None:
    """Take a folder away whole, so that no process sees half of it."""
    temporary = tempfile.mkdtemp(dir=folder.parent, prefix="damaged_")
    try:
        os.replace(folder, Path(temporary) / folder.name)
    except FileNotFoundError:  # another process has just done it
        return
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def _execute_module(key: str, path: Path) -> ModuleType:
    source = path.read_text(encoding="utf-8")
    module = ModuleType(f"creepkit_kernel_{key}")
    module.__file__, module.__dict__["SOURCE"] = str(path), source
    sys.modules[module.__name__] = module  # numba finds the functions of cached machine code through their module
    with _machine_code_in_module_folder():
        exec(compile(source, str(path), "exec"), module.__dict__)
    return module


@contextmanager
def _machine_code_in_module_folder() -> Iterator[None]:
    """Overrule NUMBA_CACHE_DIR: the seal has to cover the machine code, and the folder moves as a whole."""
    previous = _numba_settings.CACHE_DIR
    _numba_settings.CACHE_DIR = ""
    try:
        yield
    finally:
        _numba_settings.CACHE_DIR = previous


def _checksums(folder: Path) -> str:
    """One line a file: its SHA-256 and its path."""
    files = sorted(p for p in folder.rglob("*") if p.is_file() and p != folder / CHECKSUM_FILE)
    return "".join(f"{hashlib.sha256(p.read_bytes()).hexdigest()}  {p.relative_to(folder).as_posix()}\n" for p in files)
