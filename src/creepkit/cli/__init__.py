"""The command line: one command a file, and nothing heavy is imported before a command runs."""

from __future__ import annotations

import sys


def main() -> None:
    """Run the command line; the entry point of the script `creepkit`."""
    try:
        from creepkit.cli.app import app

        app()
    except KeyboardInterrupt:  # before the command began, which says so itself
        sys.exit(130)
