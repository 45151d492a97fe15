"""What the conformance kit finds: one Check for each promise, a Report for the law."""

from __future__ import annotations

from dataclasses import dataclass

from creepkit.language.law import CreepLaw


@dataclass(frozen=True)
class ConformanceCheck:
    """One finding: what was checked, whether it holds, and the figure or the sentence that says so."""

    name: str
    passed: bool
    detail: str


@dataclass(frozen=True)
class ConformanceReport:
    """All findings about one law."""

    law: CreepLaw
    checks: tuple[ConformanceCheck, ...]

    @property
    def passed(self) -> bool:
        """Whether every check holds."""
        return all(check.passed for check in self.checks)

    @property
    def failures(self) -> tuple[ConformanceCheck, ...]:
        """The checks that do not hold."""
        return tuple(check for check in self.checks if not check.passed)

    def __str__(self) -> str:
        lines = [f"{self.law.name}: {'conforms' if self.passed else 'does NOT conform'}"]
        lines += [f"  {'ok  ' if c.passed else 'FAIL'} {c.name}: {c.detail}" for c in self.checks]
        return "\n".join(lines)
