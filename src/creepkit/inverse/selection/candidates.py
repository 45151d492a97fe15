"""Candidate laws: what a law reduces to, and sums of two."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

from creepkit.language import CreepLaw


def reductions(law: CreepLaw) -> list[CreepLaw]:
    """The law, and all that it reduces to: each non-empty set of its terms, exponents whose `off` is 0 in or out.

    Table 1 is the set of reductions of Eq. (2) to single terms.
    """
    found: list[CreepLaw] = []
    labels = list(law.terms)
    for count in range(len(labels), 0, -1):
        for kept in combinations(labels, count):
            part = law.without(*(label for label in labels if label not in kept)) if count < len(labels) else law
            found += _with_exponents_off(part)
    return _distinct(found)


def sums_of_two(laws: Sequence[CreepLaw]) -> list[CreepLaw]:
    """Sums of every two of the laws, such as primary and steady creep of Norton's law beside strain hardening."""
    return [a + b for a, b in combinations(_distinct(laws), 2)]


def _with_exponents_off(law: CreepLaw) -> list[CreepLaw]:
    """The law with every set of its exponents switched off that may be."""
    names = [name for name, p in law.table.items() if p.scale != "log" and p.off == 0.0]
    found = []
    for count in range(len(names) + 1):
        for gone in combinations(names, count):
            found.append(law.fix(**dict.fromkeys(gone, 0.0)) if gone else law)
    return found


def _distinct(laws: Sequence[CreepLaw]) -> list[CreepLaw]:
    kept: dict[str, CreepLaw] = {}
    for law in laws:
        kept.setdefault(law.fingerprint, law)
    return list(kept.values())
