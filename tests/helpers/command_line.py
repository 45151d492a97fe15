"""The command line, called as a shell would call it."""

from typer.testing import CliRunner, Result

from creepkit.cli.app import app


def creepkit(*words: str) -> Result:
    """Run `creepkit` with these words."""
    return CliRunner().invoke(app, words)


def one_line(result: Result) -> str:
    """The message of an error of ours: exit 1, nothing on stdout, one line on stderr."""
    assert (result.exit_code, result.stdout) == (1, "")
    assert result.stderr.startswith("creepkit: ")
    assert result.stderr.count("\n") == 1
    return result.stderr
