"""Samples of every format that creepkit reads, for the program that mutates them.

A module beside this one joins by its function `samples()`, which returns ReaderSample objects.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class ReaderSample:
    """A file of some format, and what reads it.

    name : of format and sample. files : {name: content} of a folder. mutated : which of them is mutated. read : turns
    the path of the mutated file into a result, or raises an error of creepkit. difference : what distinguishes two
    results, "" for nothing. decided : what a reader says that it assumed of a result, so that it is no silent change.
    delimiter : between cells, where the file is a table of text; "" where it is none. misspelling : (key or name,
    misspelt) that the file holds, and another (head with a unit, without it). reader : name of the reader, "" where no
    other sample is of the same one. repeated : texts, such as a key with its value, none of which may stand twice.
    """

    name: str
    files: Mapping[str, bytes]
    mutated: str
    read: Callable[[Path], Any]
    difference: Callable[[Any, Any], str]
    decided: Callable[[Any], str] = lambda result: ""
    delimiter: str = ""
    misspelt: tuple[tuple[str, str], ...] = ()
    without_unit: tuple[tuple[str, str], ...] = ()
    reader: str = ""
    repeated: tuple[str, ...] = ()

    def write(self, folder: Path, content: bytes | None = None) -> Path:
        """Write the files into a folder, with other content of the mutated one; the path of that."""
        for name, good in self.files.items():
            (folder / name).write_bytes(good if content is None or name != self.mutated else content)
        return folder / self.mutated


def all_samples() -> dict[str, ReaderSample]:
    """{name: sample} of all modules of samples."""
    others = {path.stem for path in Path(__file__).parent.glob("*.py")} - {"samples", "mutations"}
    modules = [importlib.import_module(f"file_samples.{name}") for name in sorted(others)]
    return {sample.name: sample for module in modules for sample in module.samples()}
