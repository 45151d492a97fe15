"""The order of files that are frames of one sequence, by the numbers in their names."""

from __future__ import annotations

import math
import re
from collections import Counter, defaultdict
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from creepkit.errors import HistoryError

_DIGITS = re.compile(r"(\d+)")


MOST_SEQUENCES = 4


def skeleton(name: str) -> str:
    """A file's name without its numbers: `frame_012.csv` is `frame_#.csv`."""
    return _DIGITS.sub("#", name)


def numbers_in(name: str) -> tuple[int, ...]:
    """The numbers in a file's name."""
    return tuple(int(digits) for digits in _DIGITS.findall(name))


def in_order(files: Sequence[Path]) -> list[Path]:
    """The files by the numbers in their names; HistoryError where they are no one sequence.

    One file of another name that says it is the reference ("ref") comes first.
    """
    reference, files = _reference_apart(files)
    kinds = sorted({skeleton(file.name) for file in files})
    folder = files[0].parent
    if len(files) > 1 and len(kinds) > 1:
        raise HistoryError(
            f"{folder}: frames of different names, {' and '.join(kinds[:3])}, are no one sequence; name a pattern such "
            f"as '{folder}/{kinds[0].replace('#', '*')}', or a list of the files in order"
        )
    ordered = sorted(files, key=lambda file: (numbers_in(file.name), file.name))
    _check_one_sequence(ordered)
    return [*reference, *ordered]


def _reference_apart(files: Sequence[Path]) -> tuple[list[Path], list[Path]]:
    """The one file of its name that says that it is the reference, if there are others; and the others."""
    counts = Counter(skeleton(file.name) for file in files)
    lone = [file for file in files if counts[skeleton(file.name)] == 1 and "ref" in file.name.lower()]
    if len(lone) != 1 or len(files) == 1:
        return [], list(files)
    return lone, [file for file in files if file != lone[0]]


def _check_one_sequence(ordered: Sequence[Path]) -> None:
    """Refuse results of several cameras or regions in one folder, such as cam0_001.csv and cam1_001.csv."""
    numbers = [numbers_in(file.name) for file in ordered]
    for first, second in pairwise(ordered):
        if numbers_in(first.name) == numbers_in(second.name):
            raise HistoryError(f"{first} and {second.name} have the same number; keep one of them")
    varying = [k for k in range(len(numbers[0])) if len({one[k] for one in numbers}) > 1]
    if len(varying) < 2:
        return
    outer, inner = varying[0], varying[-1]
    members = defaultdict(set)
    for one in numbers:
        members[one[outer]].add(one[inner])
    sets = list(members.values())
    if len(varying) == 2 and 2 <= len(sets) <= MOST_SEQUENCES and len(sets[0]) > 1 and all(s == sets[0] for s in sets):
        raise HistoryError(
            f"{ordered[0].parent}: {ordered[0].name} and {ordered[len(sets[0])].name} look like {len(sets)} sequences "
            "in one folder; name a pattern that has one of them, or a list of the files in order"
        )


def missing_numbers(ordered: Sequence[Path]) -> tuple[int, ...]:
    """The numbers that are missing between the first and the last file; () where names do not count in one place."""
    _, counted_files = _reference_apart(ordered)
    if len({skeleton(file.name) for file in counted_files}) > 1:
        return ()
    numbers = [numbers_in(file.name) for file in counted_files]
    varying = [k for k in range(len(numbers[0])) if len({one[k] for one in numbers}) > 1]
    if len(varying) != 1:
        return ()
    counted = [one[varying[0]] for one in numbers]
    step = math.gcd(*(b - a for a, b in pairwise(counted)))
    expected = range(counted[0], counted[-1] + 1, max(step, 1))
    if len(expected) > 10 * len(counted):
        return ()
    return tuple(sorted(set(expected) - set(counted)))
