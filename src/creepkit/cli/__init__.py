"""The command line: one command a file, and nothing heavy is imported before a command runs."""

from __future__ import annotations

from creepkit.cli.failures import check_working_folder, prepare_streams, print_warnings_plainly, run_to_the_end
from creepkit.cli.interrupts import interrupt_at_signals


def main() -> None:
    """Run the command line; the entry point of the script `creepkit`."""
    run_to_the_end(_run)


def _run() -> None:
    interrupt_at_signals()
    prepare_streams()
    check_working_folder()
    print_warnings_plainly()
    from creepkit.cli.app import app

    app()
