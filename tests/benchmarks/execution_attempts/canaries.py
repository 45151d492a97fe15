"""What an attempt leaves where it is successful, and what came of each attempt.

The code of an attempt is harmless: it makes a file (or, in a page, an element or a number) that says that it ran.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

CANARY = "executed_canary"
"""The file that executed code makes in its working folder."""

OUTCOMES = ("refused", "harmless", "executed", "broken", "traceback")
FAULTS = OUTCOMES[2:]
LIMIT = 120.0
"""s in which a program must end."""

SOURCE = "open({path!r}, 'a').write(str(globals().get('__file__')) + chr(10))\n"
"""Python that makes the canary; path : where."""


@dataclass(frozen=True)
class Attempt:
    """What came of one attempt. section, target : the table and the row it counts in. text : what was tried."""

    section: str
    target: str
    outcome: str
    detail: str = ""


@dataclass(frozen=True)
class Control:
    """An attempt on something that is unsafe on purpose; noticed : how many of `tried` left a canary that was found."""

    section: str
    consumer: str
    tried: int
    noticed: int
    least: int = -1
    """How many have to be noticed; all where it is negative."""

    @property
    def is_fault(self) -> bool:
        """Whether the canary would go unnoticed."""
        return self.noticed < (self.tried if self.least < 0 else self.least)


Found = Iterator[Attempt | Control]


def planted(folder: Path) -> str:
    """Python that makes the canary in a folder, wherever it is executed."""
    return SOURCE.format(path=str(folder / CANARY))


def left(folder: Path) -> str:
    """What the canary in a folder says, "" where there is none; it is removed."""
    path = folder / CANARY
    with suppress(FileNotFoundError):
        text = path.read_text(errors="replace")
        path.unlink()
        return text or "made"
    return ""


@dataclass(frozen=True)
class Ended:
    """How a program ended."""

    code: int
    output: str
    problem: str

    @property
    def has_traceback(self) -> bool:
        """Whether the program failed in a way that is no sentence."""
        return "Traceback (most recent call last)" in self.problem or self.code in (70, -11, -6)


def run(words: Sequence[str], folder: Path, variables: Mapping[str, str] | None = None, limit: float = LIMIT) -> Ended:
    """Run a program in a folder, with some variables of the environment; after `limit` s it is ended, with its own."""
    process = subprocess.Popen(
        list(words), cwd=folder, env={**os.environ, **(variables or {})}, start_new_session=True,
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    try:
        output, problem = process.communicate(timeout=limit)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        output, problem = process.communicate()
        problem += b"\nno end"
        return Ended(-9, output.decode(errors="replace"), problem.decode(errors="replace"))
    return Ended(process.returncode, output.decode(errors="replace"), problem.decode(errors="replace"))


def creepkit(*words: str) -> list[str]:
    """The command of creepkit, by this interpreter."""
    return [sys.executable, "-P", "-m", "creepkit", *words]


def judged(ended: Ended, folder: Path, refused: bool | None = None) -> tuple[str, str]:
    """Outcome and detail of a run in a folder; refused : whether it must, or must not, end with an error."""
    if said := left(folder):
        return "executed", said[:300]
    if ended.has_traceback:
        return "traceback", f"exit {ended.code}: {ended.problem[-400:]}"
    if refused is not None and (ended.code in (1, 2)) != refused:
        return "broken", f"exit {ended.code}: {ended.problem[-400:]}"
    return ("harmless" if ended.code == 0 else "refused"), ""
