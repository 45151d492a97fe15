"""What a test finds in a folder into which creepkit wrote."""

from pathlib import Path

from creepkit.files.writing import RECORD


def names_in(folder: Path) -> list[str]:
    """The names in a folder in their order, but for the list of what was written there."""
    return sorted(path.name for path in folder.iterdir() if path.name != RECORD)
