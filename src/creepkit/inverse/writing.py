"""Text files that are whole or absent, whatever interrupts their writing."""

from __future__ import annotations

import os
import secrets
from pathlib import Path

from creepkit.errors import FitError


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
