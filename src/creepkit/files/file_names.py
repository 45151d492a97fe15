"""Names of files from names of laws, tests and alloys, which any system can save and tell apart.

Windows has names of devices that no file may have, whatever its suffix, drops dots and blanks at the end, and, as macOS
does, takes `Norton` and `norton` for one file.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Sequence

DEVICE_NAMES = frozenset(
    [
        "con",
        "prn",
        "aux",
        "nul",
        "conin$",
        "conout$",
        *(f"{port}{k}" for port in ("com", "lpt") for k in "0123456789¹²³"),
    ]
)
"""Names of devices on Windows."""


MOST_SIGNS = 80
"""Signs of a name: folders, a suffix and temporary additions have to fit into 255 as well."""


PLAIN_SIGNS = "A-Za-z0-9._=+-"
"""What may stand in a name, as a set of a regular expression."""


LAW_SIGNS = "A-Za-z0-9._=-"
"""Those of laws: a sum of laws, norton+dorn, is saved as norton-dorn."""


def file_stem(text: str, default: str = "file", signs: str = PLAIN_SIGNS, gap: str = "-") -> str:
    """A name without suffix that any system can save; different texts may get the same.

    default : the name of a text of which nothing is left. gap : what stands for signs that are none of `signs`.
    """
    plain = re.sub(f"[^{signs}]+", gap, text).strip("._-")[:MOST_SIGNS].rstrip("._-") or default
    return f"{default}-{plain}" if plain.split(".")[0].casefold() in DEVICE_NAMES else plain


def hashed_stem(text: str, default: str = "x", others: Iterable[str] = ()) -> str:
    """The text itself where any system can save it, else with the beginning of a hash, so that it stays apart.

    others : texts of other files in the same folder; one that differs by case alone makes the hash necessary.
    """
    plain = file_stem(text, default)
    unlike = all(other == text or other.casefold() != text.casefold() for other in others)
    if plain == text and unlike:
        return plain
    return f"{plain}_{hashlib.sha256(text.encode('utf-8', 'replace')).hexdigest()[:6]}"


def numbered_stems(texts: Sequence[str], default: str = "file", signs: str = PLAIN_SIGNS) -> list[str]:
    """A name for each text; later ones that a system might take for an earlier one get a number."""
    names: list[str] = []
    taken: set[str] = set()
    for text in texts:
        plain = name = file_stem(text, default, signs)
        number = 2
        while name.casefold() in taken:
            name, number = f"{plain}-{number}", number + 1
        taken.add(name.casefold())
        names.append(name)
    return names
