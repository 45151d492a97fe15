"""Text files that are whole or absent, whatever interrupts their writing."""

from __future__ import annotations

import errno
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from creepkit.errors import DatasetError, FitError

if TYPE_CHECKING:
    pass


def write_text_atomically(text: str, path: Path) -> Path:
    """Write to a temporary name, then rename."""
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
    try:
        temporary.write_text(text, encoding="utf-8")
        os.replace(temporary, path)
    except OSError as error:
        raise FitError(f"{path}: cannot be written ({error.strerror}); choose a file in a folder that exists") from None
    finally:
        temporary.unlink(missing_ok=True)
    return path


@contextmanager
def replace_on_success(path: Path) -> Iterator[Path]:
    """A temporary name beside `path` that takes its place at the end; removed when writing fails, which is said."""
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
    try:
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        raise DatasetError(f"{path}: cannot be written: {_error_cause(error)}") from None
    finally:
        if temporary.exists():
            temporary.unlink()


def remove_temporary_files(path: Path) -> None:
    """Remove what processes that died while they wrote `path` have left; nobody must be writing it now."""
    for temporary in path.parent.glob(f".{path.name}.*.part"):
        temporary.unlink(missing_ok=True)


def _error_cause(error: OSError) -> str:
    message = os.strerror(error.errno) if error.errno else " ".join(str(error).split())
    full = error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
    return f"{message}; {'make room' if full else 'choose another folder'} and start again, nothing done is lost"


def write_if_absent(path: Path, text: str) -> None:
    """Write a file that is whole or absent, and that the first of several writers decides."""
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
    try:
        temporary.write_text(text, encoding="utf-8")
        try:
            os.link(temporary, path)
        except FileExistsError:
            pass  # another campaign was faster; what it wrote is compared
        except OSError:  # a file system without links
            os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
