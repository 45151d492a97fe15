"""The command line: one command a file, and nothing heavy is imported before a command runs."""

from __future__ import annotations

import signal
from types import FrameType

from creepkit.cli.failures import prepare_streams, print_warnings_plainly, run_to_the_end
from creepkit.import_path import leave_settings_of_working_folder_out


def main() -> None:
    """Run the command line; the entry point of the script `creepkit`."""
    prepare_streams()
    print_warnings_plainly()
    run_to_the_end(_run)


def _run() -> None:
    for name in ("SIGTERM", "SIGHUP"):  # as Ctrl-C: a line, nothing half written
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:  # of nohup
            signal.signal(number, _terminate)
    leave_settings_of_working_folder_out()
    from creepkit.cli.app import app

    app()


def _terminate(number: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt
