"""Candidate laws: what a law reduces to, and sums of two."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

from creepkit.language import CreepLaw


def reductions(law: CreepLaw) -> list[CreepLaw]:
    """The law, and all that it reduces to: each non-empty set of its terms, exponents whose `off` is 0 in or out.

    Table 1 is the set of reductions of Eq. (2) to single terms.
    """
    laws: list[CreepLaw] = []
    labels = list(law.terms)
    for count in range(len(labels), 0, -1):
        for kept_labels in combinations(labels, count):
            reduced = law.without(*(label for label in labels if label not in kept_labels)) if count < len(labels) else law
            laws += _with_exponents_off(reduced)
    return _distinct_laws(laws)


def sums_of_two(laws: Sequence[CreepLaw]) -> list[CreepLaw]:
    """Sums of every two of the laws, such as primary and steady creep of Norton's law beside strain hardening."""
    return [a + b for a, b in combinations(_distinct_laws(laws), 2)]


def _with_exponents_off(law: CreepLaw) -> list[CreepLaw]:
    """The law with every set of its exponents switched off that may be."""
    names = [name for name, p in law.table.items() if p.scale != "log" and p.off == 0.0]
    laws = []
    for count in range(len(names) + 1):
        for switched_off in combinations(names, count):
            laws.append(law.fix(**dict.fromkeys(switched_off, 0.0)) if switched_off else law)
    return laws


def _distinct_laws(laws: Sequence[CreepLaw]) -> list[CreepLaw]:
    by_fingerprint: dict[str, CreepLaw] = {}
    for law in laws:
        by_fingerprint.setdefault(law.fingerprint, law)
    return list(by_fingerprint.values())
