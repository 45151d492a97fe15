"""The command line: one command a file, and nothing heavy is imported before a command runs."""

from __future__ import annotations


def main() -> None:
    """Run the command line; the entry point of the script `creepkit`."""
    from creepkit.cli.app import app
    from creepkit.cli.compiled import set_numba_cache

    set_numba_cache()
    app()
