"""The command line, called as a shell would call it."""

import shlex
from collections.abc import Iterable

from typer.testing import CliRunner, Result

from creepkit.cli.app import app


def creepkit(*words: object) -> Result:
    """Run `creepkit` with these words, or with those of a single line."""
    line = words[0] if len(words) == 1 and isinstance(words[0], str) and " " in words[0] else None
    return CliRunner().invoke(app, [*map(str, words)] if line is None else shlex.split(line))


def one_line(result: Result) -> str:
    """The message of an error of ours: exit 1, nothing on stdout, one line on stderr."""
    assert (result.exit_code, result.stdout) == (1, "")
    assert result.stderr.startswith("creepkit: ")
    assert result.stderr.count("\n") == 1
    return result.stderr


def answers(table: Iterable[tuple[str, str]]) -> list[str]:
    """{line of words: a part of the one line that it is answered with}: the lines of which that is not so, with what
    was said.
    """
    said = [(line, part, creepkit(line)) for line, part in table]
    wrong = [
        (line, part, one)
        for line, part, one in said
        if (one.exit_code, one.stdout, one.stderr.count("\n")) != (1, "", 1) or part not in one.stderr
    ]
    return [f"creepkit {line}\n  exit {one.exit_code}: {one.output}\n  not: {part}" for line, part, one in wrong]
