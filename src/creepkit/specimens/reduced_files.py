"""Files of the tables of one-degree-of-freedom models: safetensors with one JSON header."""

from __future__ import annotations

import json
import os
from pathlib import Path

from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from creepkit.errors import SolveError
from creepkit.specimens.reduced_tables import ReducedOrderTables

_HEADER_KEY = "creepkit"


def write_tables(tables: ReducedOrderTables, path: str | Path) -> Path:
    """Write to a temporary name, then rename: a file is whole or absent."""
    path = Path(path)
    arrays, document = tables.to_tensors()
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        temporary.write_bytes(save(arrays, metadata={_HEADER_KEY: json.dumps(document)}))
        os.replace(temporary, path)
    except OSError as error:
        why = f"cannot be written ({error.strerror})"
        raise SolveError(f"{path}: {why}; choose a file in a folder that exists and has room") from None
    finally:
        temporary.unlink(missing_ok=True)
    return path


def read_tables(path: str | Path) -> ReducedOrderTables:
    """The tables of a file; SolveError says what is wrong with any other."""
    path = Path(path)
    if not path.is_file():
        raise SolveError(f"{path}: there is no such file; give one that creepkit base wrote")
    try:
        with safe_open(path, framework="numpy") as file:
            message = (file.metadata() or {}).get(_HEADER_KEY, "{}")
            arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 (a handle, not a mapping)
        document = json.loads(message)
    except (SafetensorError, json.JSONDecodeError):
        raise SolveError(f"{path}: damaged, or not a file of tables; make it again with 'creepkit base'") from None
    try:
        return ReducedOrderTables.from_tensors(arrays, document)
    except SolveError as error:
        raise SolveError(f"{path}: {error}") from None
