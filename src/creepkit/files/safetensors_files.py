"""Safetensors files with one JSON header, written whole or not at all; nothing in them is evaluated."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from creepkit.files.json_documents import DocumentFormat, check_heading, compact_json, parse_json
from creepkit.files.reading import check_readable
from creepkit.files.writing import write_bytes

HEADER_KEY = "creepkit"
"""Under which the header stands in the file's metadata."""


def write_safetensors(
    path: str | Path,
    arrays: Mapping[str, NDArray[Any]],
    header: Mapping[str, Any],
    document: DocumentFormat,
    *,
    internal: bool = False,
) -> Path:
    """Write arrays (...,) by name and a JSON-able header below the heading of its format.

    internal : in a folder that creepkit keeps for itself, or under a name that only creepkit uses.
    """
    text = compact_json({**document.heading, **header})
    contiguous = {name: np.array(array, order="C", copy=True) for name, array in arrays.items()}
    content = save(contiguous, metadata={HEADER_KEY: text})
    return write_bytes(content, Path(path), document.kind.error, internal=internal)


def read_safetensors(path: str | Path, document: DocumentFormat) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """The arrays, {name: (...,)}, and the header without its heading; the error of its kind for other files."""
    path, kind = Path(path), document.kind
    check_readable(path, kind)
    try:
        with safe_open(path, framework="numpy") as file:
            text = (file.metadata() or {}).get(HEADER_KEY)
            arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 (a handle, not a mapping)
    except OSError as error:
        raise kind.error(f"{path}: cannot be read ({error.strerror or error})") from None
    except (SafetensorError, TypeError, AttributeError):  # the latter for types of numbers that NumPy has not
        raise kind.error(f"{path}: damaged, or not a safetensors file; {kind.advice}") from None
    if text is None:
        raise kind.error(f"{path}: written by another program (there is no creepkit header); {kind.advice}")
    return arrays, check_heading(parse_json(text, f"{path}: its header", kind), str(path), document)
