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

    def __init__(self, reserved: Collection[str], *, ignore_case: bool = False, longest: int = 63) -> None:
        self._fold = str.lower if ignore_case else str
        self._taken = {self._fold(word) for word in reserved}
        self._longest = longest
        self.renamed: dict[str, str] = {}

    def name(self, wanted: str) -> str:
        """The identifier for `wanted`: itself where the language allows it and it is free."""
        plain = unicodedata.normalize("NFKD", wanted).encode("ascii", "ignore").decode()
        stem = plain if re.fullmatch(r"[A-Za-z]\w*", plain) else re.sub(r"\W+", "_", plain).strip("_") or "unnamed"
        stem = (stem if stem[0].isalpha() else f"x_{stem}")[: self._longest]
        found, count = stem, 1
        while self._fold(found) in self._taken:
            count += 1
            found = f"{stem[: self._longest - 1 - len(str(count))]}_{count}"
        self._taken.add(self._fold(found))
        if found != wanted:
            self.renamed[wanted] = found
        return found

    def names(self, wanted: Iterable[str]) -> list[str]:
        """Identifiers for several names, in order."""
        return [self.name(one) for one in wanted]

    def told(self, of: Collection[str]) -> list[str]:
        """One line for each of the author's names `of` that had to change."""
        return [f"'{old}' is called {new} here" for old, new in self.renamed.items() if old in of]
