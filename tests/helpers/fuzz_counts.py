"""Counts of mutated files that are kept in a file, so that a run of hours may be ended and goes on later."""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

MOST_FAULTS = 40
"""Of a sample, that are kept with their details."""


class FuzzCounts:
    """What came of the mutations of each sample, {name: counts}; in a file where one is given.

    Another first seed begins again; the file is to be removed where samples or mutations were changed.
    """

    def __init__(self, path: Path | None, names: list[str], first: int) -> None:
        self.path = path
        kept: dict[str, Any] = {}
        if path is not None and path.exists():
            kept = json.loads(path.read_text(encoding="utf-8"))
        self._samples: dict[str, dict[str, Any]] = {}
        for name in names:
            known = kept.pop(name, {})
            start = {"first": first, "next": first, "kinds": {}, "faults": []}
            self._samples[name] = known if known.get("first") == first else start
        self._others = kept

    def add(self, name: str, seed: int, kind: str, outcome: str, detail: str, *, fault: bool) -> None:
        """Count one mutation."""
        one = self._samples[name]
        counts = one["kinds"].setdefault(kind, {})
        counts[outcome] = counts.get(outcome, 0) + 1
        one["next"] = seed + 1
        if fault and len(one["faults"]) < MOST_FAULTS:
            one["faults"].append(f"{name}, seed {seed}, {kind}: {outcome}: {detail}")

    def save(self) -> None:
        """Write the file, whole or not at all."""
        if self.path is not None:
            temporary = self.path.with_name(f"{self.path.name}.part")
            temporary.write_text(json.dumps({**self._others, **self._samples}, indent=1), encoding="utf-8")
            os.replace(temporary, self.path)

    def next_seed(self, name: str) -> int:
        """The first seed that is not counted yet."""
        return int(self._samples[name]["next"])

    def outcomes(self, name: str) -> Counter[str]:
        """{outcome: mutations} of a sample."""
        return sum((Counter(counts) for counts in self._samples[name]["kinds"].values()), Counter())

    def kinds(self, names: list[str]) -> dict[str, Counter[str]]:
        """{kind of mutation: {outcome: mutations}} of some samples."""
        found: dict[str, Counter[str]] = {}
        for name in names:
            for kind, counts in self._samples[name]["kinds"].items():
                found.setdefault(kind, Counter()).update(counts)
        return found

    def faults(self, names: list[str]) -> Iterator[str]:
        """What went wrong, a line each."""
        for name in names:
            yield from self._samples[name]["faults"]
