"""Misspelt keys of history files, drawn by seed from all keys that a head may hold."""

from __future__ import annotations

import random
import string
from collections.abc import Collection

LETTERS = string.ascii_letters + string.digits + "_"


def edited(word: str, draw: random.Random) -> str:
    """One letter left out, twice, in the place of the next one, another one, or one more."""
    kind = draw.choice(("dropped", "doubled", "swapped", "changed", "added"))
    k = draw.randrange(len(word) + {"swapped": -(len(word) > 1), "added": 1}.get(kind, 0))
    letter = draw.choice(LETTERS) if kind in ("changed", "added") else ""
    before, at, after = word[:k], word[k : k + 1], word[k + 1 :]
    if kind == "swapped":
        return before + after[:1] + at + after[1:]
    return before + {"dropped": "", "doubled": at + at, "changed": letter, "added": letter + at}[kind] + after


UNITS = ("MPa", "kPa", "GPa", "mm", "um", "m", "s", "min", "h", "d", "K", "C", "N", "kN", "pct")


def other_unit(word: str, draw: random.Random) -> str:
    """Another unit, which is mostly none of this quantity; one edit where the word ends in no unit."""
    base, _, unit = word.rpartition("_")
    if unit not in UNITS:
        return edited(word, draw)
    return f"{base}_{draw.choice((*UNITS, 'mV', 'weeks', 'ppm', 'furlong', 'torr', 'kgf'))}"


def misspelt_keys(keys: Collection[str], count: int, seed: int, accepted: Collection[str]) -> list[tuple[str, str]]:
    """(key, misspelling) pairs: one edit, two edits, or another unit; no misspelling is itself among `accepted`.

    accepted : names in small letters with underscores, which count as spelt well.
    """
    draw, ordered = random.Random(seed), sorted(keys)
    pairs: dict[str, str] = {}
    while len(pairs) < count:
        key = draw.choice(ordered)
        kind = draw.random()
        wrong = (other_unit if kind < 0.15 else edited)(key, draw)
        if kind > 0.6 and wrong:
            wrong = edited(wrong, draw)
        plain = "_".join(wrong.casefold().replace("-", " ").replace("_", " ").split())
        if plain and plain not in accepted and wrong not in pairs:
            pairs[wrong] = key
    return [(key, wrong) for wrong, key in pairs.items()]
