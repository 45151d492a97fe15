"""Text files of numbers: what a cell must hold, said with its place, 'file:line'."""

from __future__ import annotations

import math
import re
from pathlib import Path

from creepkit.errors import SolveError

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?", re.ASCII)


def read_text(path: Path) -> str:
    """The text of a file in UTF-8, or SolveError."""
    try:
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise SolveError(f"{path}: cannot be read ({error.strerror or error})") from error
    except UnicodeDecodeError as error:
        raise SolveError(f"{path}: is not text in UTF-8; a mesh is read from text files only") from error


def parse_number(place: str, name: str, cell: str) -> float:
    """A finite number; 1.5d0 as Fortran writes it is one too."""
    text = cell.strip()
    value = float(text.lower().replace("d", "e")) if _NUMBER.fullmatch(text) else math.nan
    if not math.isfinite(value):
        raise SolveError(f"{place}: '{name}' is {_shown(text)}; write a finite number such as 2.5")
    return value


def parse_index(place: str, name: str, cell: str) -> int:
    """A number of a node, an element or the like, from 1 on."""
    text = cell.strip()
    if not (text.isascii() and text.isdigit() and int(text) > 0):
        raise SolveError(f"{place}: '{name}' is {_shown(text)}; write a whole number from 1 on")
    return int(text)


def _shown(text: str) -> str:
    return f"'{text}'" if text else "empty"
