"""Folders below one without tests: in which of them there are files of tests."""

from __future__ import annotations

from pathlib import Path

from creepkit.errors import CreepkitError

MOST_FOLDERS, MOST_FILES_TRIED, MOST_FOLDERS_NAMED = 40, 3, 4
"""Folders below one without tests that are looked into, files that are read of each, and folders that are named."""


def folders_with_tests(folder: Path, reader: str | None) -> list[Path]:
    """Folders below, at most two levels down, of which a file can be read as a test."""
    import creepkit as ck

    found = []
    levels = (sorted(folder.glob(pattern)) for pattern in ("*", "*/*"))
    below = [one for level in levels for one in level if one.is_dir() and not _is_hidden(one.relative_to(folder))]
    for one in below[:MOST_FOLDERS]:
        for file in sorted(path for path in one.iterdir() if path.is_file())[:MOST_FILES_TRIED]:
            try:
                ck.read_histories([file], reader)
            except CreepkitError:
                continue
            found.append(one)
            break
    return found[:MOST_FOLDERS_NAMED]


def _is_hidden(path: Path) -> bool:
    return any(part.startswith(".") or part.endswith(".results") for part in path.parts)
