"""Output of commands: tables for people, JSON for programs, and the progress of long computations."""

from __future__ import annotations

import math
import re
import sys
import threading
import time
from collections.abc import Iterable, Sequence
from types import TracebackType
from typing import Any

import typer

from creepkit import errors
from creepkit.jobs.progress import duration_text, series_of_task
from creepkit.reports.blocks import Table, as_text


def printable(text: str) -> str:
    """A text for a terminal, of any number of lines with tabs, each as messages show it."""
    return "".join(one if one in ("\n", "\t") else errors.printable(one) for one in re.split("([\n\t])", text))


def tell(text: object = "", *, err: bool = False) -> None:
    """Print a text for people, whatever names of files, tests and laws stand in it, and a line end.

    err : on stderr, as notes beside what a program reads from stdout.
    """
    typer.echo(printable(str(text)), err=err)


def tell_written(path: object, what: str = "", *, err: bool = False) -> None:
    """Print that a file or folder was written; what : the rest of the line."""
    tell(f"wrote {errors.printable(str(path))}{what}", err=err)


def put(text: str) -> None:
    """Print a text that a program reads, or a file would hold: unchanged, and without a line end of its own."""
    typer.echo(text, nl=False)


def print_table(title: str, columns: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print a table; title : "" for none."""
    tell(as_text([Table(title, columns, [*rows])]).strip("\n"))


def print_json(value: Any, **more: Any) -> None:
    """Print a result, records and arrays among it, as JSON; more : keys beside those of a record."""
    from creepkit.files.json_documents import json_text
    from creepkit.reports.documents import document

    put(json_text({**document(value), **document(more)} if more else document(value)))


class ProgressBar:
    """Use as a context; call `tick(task, done, total)`, maybe with a note, from the work. Writes to stderr."""

    LONG_STAGE = 20.0
    """s after which a stage that goes on has a plain line more, the next one after twice that time, and so on."""

    def __init__(self) -> None:
        self._bar: Any = None
        self._tasks: dict[str, Any] = {}
        self._stage, self._said, self._begun, self._due, self._ended = "", "", 0.0, math.inf, threading.Event()

    def __enter__(self) -> ProgressBar:
        if sys.stderr.isatty():
            from rich.console import Console
            from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
            from rich.progress import Progress as Bar

            columns = (
                TextColumn("{task.description}", markup=False),
                BarColumn(),
                MofNCompleteColumn(),
                TimeRemainingColumn(),
                TextColumn("{task.fields[note]}", markup=False),
            )
            self._bar = Bar(*columns, console=Console(stderr=True))
            self._bar.start()
        else:
            threading.Thread(target=self._watch, daemon=True).start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        if self._bar is not None:
            self._bar.stop()

    def _watch(self) -> None:
        """Say how far a long stage is, whether or not a part of it ends: a part may take minutes."""
        while not self._ended.wait(min(1.0, 0.2 * self.LONG_STAGE)):
            now = time.monotonic()
            if now > self._due:
                self._due += 2.0 * (now - self._begun)
                tell(f"{self._said} ({duration_text(now - self._begun)} so far)", err=True)

    def tick(self, task: str, done: int, total: int, note: str = "") -> None:
        """Report that `done` of `total` parts of a task are finished; note : what else there is to say.

        A task that is done when it is named first, as an answer is, stands as it is.
        """
        task, member = series_of_task(task)
        task = errors.printable(task)
        note = errors.printable(", ".join(part for part in (member, note) if part))
        if self._bar is not None:
            if task not in self._tasks:
                self._tasks[task] = self._bar.add_task(task, total=total, note=note)
            self._bar.update(self._tasks[task], completed=done, total=total, note=note)
            return
        now = time.monotonic()
        if f"{task} {member}" != self._stage:
            self._stage, self._begun, self._due = f"{task} {member}", now, now + self.LONG_STAGE
            tell(f"{task}{member and f' {member}'}{' ...' * (done < total)}", err=True)
        left = f", about {duration_text((now - self._begun) * (total / done - 1))} more" if 0 < done < total else ""
        more = note.removeprefix(member).lstrip(", ")
        self._said = f"{self._stage.strip()}: {done} of {total}{more and f' ({more})'}{left}"
