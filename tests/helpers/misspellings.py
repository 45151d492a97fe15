"""Misspelt keys of history files, drawn by seed from all keys that a head may hold."""

from __future__ import annotations

import random
import string
from collections.abc import Collection

LETTERS = string.ascii_letters + string.digits + "_"


def dropped(word: str, draw: random.Random) -> str:
    """One letter left out."""
    k = draw.randrange(len(word))
    return word[:k] + word[k + 1 :]


def doubled(word: str, draw: random.Random) -> str:
    """One letter twice."""
    k = draw.randrange(len(word))
    return word[:k] + word[k] + word[k:]


def swapped(word: str, draw: random.Random) -> str:
    """Two neighbours in the other order."""
    k = draw.randrange(max(len(word) - 1, 1))
    return word[:k] + word[k + 1 : k + 2] + word[k] + word[k + 2 :]


def changed(word: str, draw: random.Random) -> str:
    """Another letter."""
    k = draw.randrange(len(word))
    return word[:k] + draw.choice(LETTERS) + word[k + 1 :]


def added(word: str, draw: random.Random) -> str:
    """One letter more."""
    k = draw.randrange(len(word) + 1)
    return word[:k] + draw.choice(LETTERS) + word[k:]


UNITS = ("MPa", "kPa", "GPa", "mm", "um", "m", "s", "min", "h", "d", "K", "C", "N", "kN", "pct")


def other_unit(word: str, draw: random.Random) -> str:
    """Another unit, which is mostly none of this quantity; one edit where the word ends in no unit."""
    base, _, unit = word.rpartition("_")
    if unit not in UNITS:
        return draw.choice(EDITS)(word, draw)
    return f"{base}_{draw.choice((*UNITS, 'mV', 'weeks', 'ppm', 'furlong', 'torr', 'kgf'))}"


EDITS = (dropped, doubled, swapped, changed, added)


def misspelt_keys(keys: Collection[str], count: int, seed: int, accepted: Collection[str]) -> list[tuple[str, str]]:
    """(key, misspelling) pairs: one edit, two edits, or another unit; no misspelling is itself among `accepted`.

    accepted : names in small letters with underscores, which count as spelt well.
    """
    draw, ordered = random.Random(seed), sorted(keys)
    pairs: dict[str, str] = {}
    while len(pairs) < count:
        key = draw.choice(ordered)
        kind = draw.random()
        wrong = (other_unit if kind < 0.15 else draw.choice(EDITS))(key, draw)
        if kind > 0.6 and wrong:
            wrong = draw.choice(EDITS)(wrong, draw)
        plain = "_".join(wrong.casefold().replace("-", " ").replace("_", " ").split())
        if plain and plain not in accepted and wrong not in pairs:
            pairs[wrong] = key
    return [(key, wrong) for wrong, key in pairs.items()]
