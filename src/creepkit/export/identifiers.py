"""Names in a target's language: the author's words where they can stay, renamed openly where they cannot."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Iterable


class Identifiers:
    """Hands out identifiers, each once.

    reserved : words of the language and names that the text uses itself. ignore_case : whether A and a are the same
    name (Fortran). longest : characters allowed.
    """

    def __init__(self, reserved: Collection[str], *, ignore_case: bool = False, max_length: int = 63) -> None:
        self._normalise = str.lower if ignore_case else str
        self._taken = {self._normalise(word) for word in reserved}
        self._max_length = max_length
        self.renamings: dict[str, str] = {}

    def unique(self, requested: str) -> str:
        """The identifier for `wanted`: itself where the language allows it and it is free."""
        ascii_name = unicodedata.normalize("NFKD", requested).encode("ascii", "ignore").decode()
        stem = ascii_name if re.fullmatch(r"[A-Za-z]\w*", ascii_name) else re.sub(r"\W+", "_", ascii_name).strip("_") or "unnamed"
        stem = (stem if stem[0].isalpha() else f"x_{stem}")[: self._max_length]
        candidate, count = stem, 1
        while self._normalise(candidate) in self._taken:
            count += 1
            candidate = f"{stem[: self._max_length - 1 - len(str(count))]}_{count}"
        self._taken.add(self._normalise(candidate))
        if candidate != requested:
            self.renamings[requested] = candidate
        return candidate

    def unique_names(self, requested: Iterable[str]) -> list[str]:
        """Identifiers for several names, in order."""
        return [self.unique(name) for name in requested]

    def renaming_notes(self, original_names: Collection[str]) -> list[str]:
        """One line for each of the author's names `of` that had to change."""
        return [f"'{old}' is called {new} here" for old, new in self.renamings.items() if old in original_names]
