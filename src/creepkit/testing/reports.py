"""Checks as functions of asserts, and the report of what they find, one ConformanceCheck a property.

@finding("load {}", each=lambda case: loads_of(case.predictor))
def check_load(case, load):
    assert ..., "what is wrong; what to write"
    return "what a passing report says of it"

A check of a module is found by its decorator and run in the order of the file. Its name holds the item that it is run
for; one that returns None has nothing to say of this subject. Whatever the code of a plugin raises is a finding too.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from creepkit.errors import CreepkitError, PluginError


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
        return not self.failures

    @property
    def failures(self) -> tuple[ConformanceCheck, ...]:
        """The checks that do not hold."""
        return tuple(check for check in self.checks if not check.passed)

    def __str__(self) -> str:
        name = getattr(self.subject, "name", getattr(self.subject, "__name__", type(self.subject).__name__))
        lines = [f"{name}: {'conforms' if self.passed else 'does NOT conform'}"]
        lines += [f"  {'ok  ' if c.passed else 'FAIL'} {c.name}: {c.detail}" for c in self.checks]
        return "\n".join(lines)


Checking = Callable[..., "str | None"]


def finding(
    name: str, each: Callable[..., Iterable[Any]] | None = None, *, needed: bool = False
) -> Callable[[Checking], Checking]:
    """Mark a function as a check.

    name : of what it finds. each : gives the items for each of which it is run. needed : whether those that follow mean
    nothing where it fails.
    """

    def decorate(check: Checking) -> Checking:
        check.__dict__.update(finding=name, each=each, needed=needed)
        return check

    return decorate


def run(checks: ModuleType | Iterable[Checking], *case: Any) -> list[ConformanceCheck]:
    """The findings of the checks of a module, or of these, about what they take."""
    if not __debug__:
        raise PluginError("checks are assertions, which python -O leaves out; run them without -O")
    listed: Iterable[Any] = vars(checks).values() if isinstance(checks, ModuleType) else checks
    found: list[ConformanceCheck] = []
    for check in (one for one in listed if hasattr(one, "finding")):
        found += _findings(check, case)
        if check.needed and not found[-1].passed:
            break
    return found


def _findings(check: Any, case: tuple[Any, ...]) -> list[ConformanceCheck]:
    if check.each is None:
        return _found(check.finding, lambda: check(*case))
    items: list[Any] = []
    problem = _found(check.finding.format("").strip(), lambda: items.extend(check.each(*case)))
    named = [(check.finding.format(getattr(item, "name", item)), item) for item in items]
    return problem + [found for name, item in named for found in _found(name, lambda item=item: check(*case, item))]  # type: ignore[misc]


def _found(name: str, check: Callable[[], str | None]) -> list[ConformanceCheck]:
    try:
        with np.errstate(all="ignore"):
            detail = check()
    except (AssertionError, CreepkitError) as error:
        return [ConformanceCheck(name, False, " ".join(str(error).split()))]
    except Exception as error:  # of the code that is checked, whatever it is
        last = traceback.extract_tb(error.__traceback__)[-1]
        message = f"{type(error).__name__}: {' '.join(str(error).split()) or 'no message'}"
        return [ConformanceCheck(name, False, f"{message} ({last.filename}, line {last.lineno})")]
    return [] if detail is None else [ConformanceCheck(name, True, detail)]
