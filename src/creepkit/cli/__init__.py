"""The command line: one command a file, and nothing heavy is imported before a command runs."""

from __future__ import annotations

import signal
import sys
from types import FrameType


def main() -> None:
    """Run the command line; the entry point of the script `creepkit`."""
    try:
        signal.signal(signal.SIGTERM, _terminate)  # as Ctrl-C: a line, nothing half written
        from creepkit.cli.app import app

        app()
    except KeyboardInterrupt:  # before the command began, which says so itself
        sys.exit(130)


def _terminate(number: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt
