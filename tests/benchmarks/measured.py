"""Pages of measured figures: a benchmark program prints its tables through a Page, and may write them to docs/measured.

What stands in the terminal and what stands in the page are the same lines. A page has the title and the description of
the program (its docstring), the tables, and a last line with date, commit, machine and the command that repeats them.
"""

from __future__ import annotations

import argparse
import inspect
import os
import platform
import shlex
import subprocess
import sys
from collections.abc import Iterable
from datetime import date
from importlib.metadata import version
from pathlib import Path

from scipy.stats import binomtest

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "measured"
PACKAGES = ("numpy", "llvmlite", "torch")


class Page:
    """The tables of one run of a program, printed line by line as they come and kept for a page of the documentation.

    name : of the page's file, without extension. documentation : the program's docstring: a title, a usage text that
    is indented (left out of the page), and paragraphs that say what is measured, against what, and in which columns.
    """

    def __init__(self, name: str, documentation: str | None) -> None:
        self.name = name
        self.title, self.description = title_and_description(documentation or name)
        self._lines: list[str] = []

    def heading(self, text: str) -> None:
        """Begin a section."""
        self._print("", f"## {text}")

    def paragraph(self, text: str) -> None:
        """Add a sentence or two."""
        self._print("", text)

    def code(self, text: str) -> None:
        """Add text whose line breaks and columns matter."""
        self._print("", "```text", *text.rstrip().splitlines(), "```")

    def table(self, *heads: str) -> None:
        """Begin a table; heads say what a column holds and in which unit."""
        self._print("", _markdown_row(heads), "|" + "-|" * len(heads))

    def row(self, *cells: object) -> None:
        """Add a row to the table begun last."""
        self._print(_markdown_row(map(str, cells)))

    def write(self) -> Path:
        """Write the page with what was printed so far."""
        path = write(self.name, self.title, "\n".join([self.description, *self._lines]), command_line())
        progress(f"written: {path}")
        return path

    def _print(self, *lines: str) -> None:
        self._lines.extend(lines)
        print(*lines, sep="\n", flush=True)


FOLDERS = ("--keep", "--before", "--data", "--jobs", "--python")
"""Options with a value that change no result."""


def write(name: str, title: str, text: str, command: str) -> Path:
    """Write docs/measured/<name>.md: title, text, and a line with date, commit, machine, versions and the command."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    path = FOLDER / f"{name}.md"
    footer = f"Measured on {date.today().isoformat()}, commit {commit()}: {machine()}. Repeat with `{command}`."
    path.write_text(f"# {title}\n\n{text.strip()}\n\n{footer}\n", encoding="utf-8")
    return path


def title_and_description(documentation: str) -> tuple[str, str]:
    """The first sentence of a docstring, and its further paragraphs but for indented ones, each on one line."""
    title, *paragraphs = inspect.cleandoc(documentation).split("\n\n")
    running = [" ".join(p.split("\n")) for p in paragraphs if not p.startswith(" ")]
    return " ".join(title.split()).rstrip(".:"), "\n\n".join(running)


def arguments(documentation: str | None) -> argparse.ArgumentParser:
    """A parser whose help is the program's docstring, with the option --write that every program has."""
    parser = argparse.ArgumentParser(description=documentation, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true", help="write the tables to docs/measured as well")
    return parser


def progress(text: str) -> None:
    """Print to the error stream what is no part of the tables."""
    print(text, file=sys.stderr, flush=True)


def command_line() -> str:
    """The command that this process was started with, from the root of the project, without the folders it used."""
    words = sys.argv[1:]
    shown = [word for k, word in enumerate(words) if word not in FOLDERS and (k == 0 or words[k - 1] not in FOLDERS)]
    return shlex.join(["python", f"tests/benchmarks/{Path(sys.argv[0]).name}", *shown])


def commit() -> str:
    """The commit whose package was measured; with "and changes" where its sources have others."""

    def answer(*words: str) -> str:
        return subprocess.run(["git", *words], cwd=FOLDER, capture_output=True, text=True, check=True).stdout.strip()

    changed = answer("status", "--porcelain", "--", ":/src", ":/plugins")
    return answer("rev-parse", "--short=8", "HEAD") + (" and changes" if changed else "")


def machine() -> str:
    """Processor, cores that this process may use, and versions."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    versions = ", ".join(f"{name} {version(name)}" for name in PACKAGES)
    return f"{processor()}, {cores} cores, Python {platform.python_version()}, {versions}"


def processor() -> str:
    """The model name of the processor."""
    information = Path("/proc/cpuinfo")
    lines = information.read_text().splitlines() if information.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def _markdown_row(cells: Iterable[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def binomial_interval(count: int, trials: int) -> tuple[float, float]:
    """Exact 95 % interval of a frequency (Clopper & Pearson (1934), Biometrika 26, 404)."""
    found = binomtest(count, trials).proportion_ci(0.95, method="exact")
    return float(found.low), float(found.high)
