"""The command line: one command a file, and nothing heavy is imported before a command runs."""

from __future__ import annotations


def main() -> None:
    """Run the command line; the entry point of the script `creepkit`."""
    from creepkit.cli.ending import run_to_the_end

    run_to_the_end(_run)


def _run() -> None:
    from creepkit.cli.app import app

    app()
