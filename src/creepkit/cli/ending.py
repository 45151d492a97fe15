"""How the command line ends: signals, a fault of creepkit, an output that nobody reads or that cannot be written.

Ctrl-C, SIGTERM and SIGHUP are a KeyboardInterrupt in the main thread, so that files which are being written are tidied
up. The exit code is then 128 and the number of the signal, as in a shell.
"""

from __future__ import annotations

import codecs
import os
import signal
import sys
import warnings
from collections.abc import Callable
from types import FrameType

from creepkit.errors import CreepkitError, printable

NOTHING_KEPT = "files that were there are whole, and the same command starts from the beginning"

AS_TERMINALS_CAN = "creepkit.terminal"
"""Name of how characters that an encoding lacks are written: 850 °C as 850 C, others as their codes."""


_received = 0
"""Number of the signal that came last; 0 where none came."""


def _replaced(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    lacking = error.object[error.start : error.end]
    return lacking.replace("\N{DEGREE SIGN}", "").encode("ascii", "backslashreplace").decode("ascii"), error.end


codecs.register_error(AS_TERMINALS_CAN, _replaced)


def run_to_the_end(run: Callable[[], None]) -> None:
    """Run the command line; SystemExit with the code of its end, after all of its output is written."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:  # as nohup leaves it
            signal.signal(number, _interrupt)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # the shell closed it
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        if hasattr(stream := getattr(sys, name), "reconfigure"):
            stream.reconfigure(errors=AS_TERMINALS_CAN)
    warnings.formatwarning = _formatted
    code: object = 0
    try:
        run()
    except SystemExit as end:
        code = end.code
    except KeyboardInterrupt:
        say(interrupted_sentence(""))
        code = exit_code_of_signal()
    except BrokenPipeError:
        code = 1
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # Python flushes once more at its end
        code = code or 1
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if not code:
            say(f"standard output: {error.strerror}; free some space and start again")
        code = code or 1
    sys.exit(code)  # type: ignore[arg-type]


def _interrupt(number: int, frame: FrameType | None) -> None:
    global _received
    _received = number
    raise KeyboardInterrupt


def exit_code_of_signal() -> int:
    """128 and the number of the signal that came."""
    return 128 + (_received or signal.SIGINT)


def interrupted_sentence(command: str, kept: str = "") -> str:
    """How an interrupted command ends; kept : what it leaves, and how it goes on."""
    received = _received or signal.SIGINT
    by = "" if received == signal.SIGINT else f" by {signal.Signals(received).name}"
    return f"{command} interrupted{by}; {kept or NOTHING_KEPT}".strip()


def sentence_of(error: Exception) -> str:
    """What is said of an error: what it says itself, with advice where it is the system's."""
    if isinstance(error, MemoryError):
        return "there is not enough memory for this; give less at once, or take a machine with more"
    if isinstance(error, CreepkitError):
        return str(error)
    if isinstance(error, OSError) and error.strerror:
        if error.strerror.startswith("No usable temporary directory"):  # PyTorch wants one to train networks
            return f"{error.strerror}; set the environment variable TMPDIR to a folder that you can write to"
        place = f"{error.filename}: " if error.filename is not None else ""
        return f"{place}{error.strerror}; check the name, who may read and write there, and the space of the disk"
    what = " ".join(str(error).split())[:200]
    return (
        f"internal error ({type(error).__name__}{': ' if what else ''}{what}); this is a fault of creepkit: run it "
        "again with 'creepkit --debug ...', and report what it prints"
    )


def _formatted(
    message: Warning | str, category: type[Warning], filename: str, lineno: int, line: str | None = None
) -> str:
    """A warning of creepkit as one line without the place in the code."""
    if category.__module__ == "creepkit.errors":
        return f"creepkit: {printable(' '.join(str(message).split()))}\n"
    return f"{filename}:{lineno}: {category.__name__}: {message}\n"


def say(sentence: str) -> None:
    """Write a line on stderr, if it can be written; what could steer a terminal as its code."""
    try:
        sys.stderr.write(f"creepkit: {printable(' '.join(sentence.split()))}\n")
        sys.stderr.flush()
    except OSError:
        pass
