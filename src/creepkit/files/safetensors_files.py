"""Safetensors files with one JSON header, written whole or not at all; nothing in them is evaluated."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors.numpy import load, save

from creepkit.files.json_documents import DocumentFormat, check_heading, compact_json, parse_json
from creepkit.files.reading import read_bytes
from creepkit.files.writing import write_bytes

HEADER_KEY = "creepkit"
"""Under which the header stands in the file's metadata."""


LENGTH_BYTES = 8
"""In front of the header, which say how long it is."""


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
    content = read_bytes(path, kind)
    try:
        arrays = load(content)  # checks types, shapes and places of all arrays
    except (SafetensorError, ValueError, KeyError, TypeError):  # KeyError: a type of numbers that NumPy lacks
        raise kind.error(f"{path}: damaged, or not a safetensors file; {kind.advice}") from None
    end = LENGTH_BYTES + int.from_bytes(content[:LENGTH_BYTES], "little")
    text = parse_json(content[LENGTH_BYTES:end].decode(), f"{path}: its header", kind).get("__metadata__", {})
    if HEADER_KEY not in text:
        raise kind.error(f"{path}: written by another program (there is no creepkit header); {kind.advice}")
    header = check_heading(parse_json(text[HEADER_KEY], f"{path}: its header", kind), str(path), document)
    return arrays, header
