"""Safetensors files with one JSON header, written whole or not at all; nothing in them is evaluated."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import Tensor

from creepkit.errors import SurrogateError

HEADER_KEY = "creepkit"
"""Under which the header stands in the file's metadata."""


FORMAT = "creepkit-surrogate"


VERSION = 1


def write_safetensors(path: str | Path, tensors: Mapping[str, Tensor], header: Mapping[str, Any]) -> Path:
    """Write tensors and a JSON-able header to a temporary name, then rename: a file is whole or absent."""
    path = Path(path)
    text = json.dumps({"format": FORMAT, "version": VERSION, **header}, allow_nan=False)
    contiguous = {name: tensor.detach().cpu().contiguous().clone() for name, tensor in tensors.items()}
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        temporary.write_bytes(save(contiguous, metadata={HEADER_KEY: text}))
        os.replace(temporary, path)
    except OSError as error:
        reason = f"cannot be written ({error.strerror})"
        raise SurrogateError(f"{path}: {reason}; choose a file in a folder that exists and has room") from None
    finally:
        temporary.unlink(missing_ok=True)
    return path


def read_safetensors(path: str | Path) -> tuple[dict[str, Tensor], dict[str, Any]]:
    """Return the tensors and the header of a file; SurrogateError says what is wrong with any other."""
    path = Path(path)
    if not path.is_file():
        raise SurrogateError(f"{path}: there is no such file; give one that creepkit train wrote")
    try:
        with safe_open(path, framework="pt") as file:
            header_text = (file.metadata() or {}).get(HEADER_KEY)
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 (a handle, not a mapping)
    except OSError as error:
        raise SurrogateError(f"{path}: cannot be read ({error.strerror or error})") from None
    except SafetensorError:
        raise SurrogateError(f"{path}: damaged, or not a safetensors file; train again or take a copy") from None
    if header_text is None:
        raise SurrogateError(f"{path}: weights of another program (there is no creepkit header); train with creepkit")
    return tensors, _checked_header(path, header_text)


def _checked_header(path: Path, text: str) -> dict[str, Any]:
    """The header of this version of the format."""
    try:
        header = json.loads(text)
    except (json.JSONDecodeError, RecursionError):
        header = None
    if not isinstance(header, dict) or header.get("format") != FORMAT or not isinstance(header.get("kind"), str):
        raise SurrogateError(f"{path}: its header is damaged; train again or take a copy")
    version = header.get("version")
    if version != VERSION:
        newer = isinstance(version, int) and version > VERSION
        advice = "written by a newer creepkit: update creepkit" if newer else "of an unknown version: train again"
        raise SurrogateError(f"{path}: version {version!r} of the format, this creepkit reads {VERSION}; {advice}")
    return header
