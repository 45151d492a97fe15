"""What a conformance kit found: one ConformanceCheck a property, and the report of all of them."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from creepkit.errors import CreepkitError


@dataclass(frozen=True)
class ConformanceCheck:
    """One finding: what was checked, whether it holds, and the figure or the sentence that says so."""

    name: str
    passed: bool
    detail: str


@dataclass(frozen=True)
class ConformanceReport:
    """All findings about one law, specimen, predictor, reader or exporter.

    kind : "law", "specimen" and so on.
    """

    subject: Any
    checks: tuple[ConformanceCheck, ...]
    kind: str = "law"

    @property
    def passed(self) -> bool:
        """Whether every check holds."""
        return all(check.passed for check in self.checks)

    @property
    def failures(self) -> tuple[ConformanceCheck, ...]:
        """The checks that do not hold."""
        return tuple(check for check in self.checks if not check.passed)

    def __str__(self) -> str:
        name = getattr(self.subject, "name", type(self.subject).__name__)
        lines = [f"{name}: {'conforms' if self.passed else 'does NOT conform'}"]
        lines += [f"  {'ok  ' if c.passed else 'FAIL'} {c.name}: {c.detail}" for c in self.checks]
        return "\n".join(lines)


def findings(name: str, check: Callable[[], Iterable[ConformanceCheck]]) -> list[ConformanceCheck]:
    """The findings of one property of a plugin's object; whatever its code raises is a finding too, with its line."""
    found = []
    try:
        with np.errstate(all="ignore"):
            for one in check():
                found.append(one)
    except CreepkitError as error:
        found.append(ConformanceCheck(name, False, " ".join(str(error).split())))
    except Exception as error:  # of the code that is checked, whatever it is
        last = traceback.extract_tb(error.__traceback__)[-1]
        message = " ".join(str(error).split()) or "no message"
        found.append(
            ConformanceCheck(name, False, f"{type(error).__name__}: {message} ({last.filename}, line {last.lineno})")
        )
    return found
