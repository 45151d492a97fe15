"""What the conformance kit finds: one Check for each promise, a Report for the law."""

from __future__ import annotations

from dataclasses import dataclass

from creepkit.language.law import CreepLaw


@dataclass(frozen=True)
class Check:
    """One finding: what was checked, whether it holds, and the figure or the sentence that says so."""

    name: str
    ok: bool
    detail: str


@dataclass(frozen=True)
class Report:
    """All findings about one law."""

    law: CreepLaw
    checks: tuple[Check, ...]

    @property
    def ok(self) -> bool:
        """Whether every check holds."""
        return all(check.ok for check in self.checks)

    @property
    def failures(self) -> tuple[Check, ...]:
        """The checks that do not hold."""
        return tuple(check for check in self.checks if not check.ok)

    def __str__(self) -> str:
        lines = [f"{self.law.name}: {'conforms' if self.ok else 'does NOT conform'}"]
        lines += [f"  {'ok  ' if c.ok else 'FAIL'} {c.name}: {c.detail}" for c in self.checks]
        return "\n".join(lines)
