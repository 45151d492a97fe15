"""What ends the command line beside errors of ours: a fault of creepkit, no memory, no reader of the output, a signal.

A fault of creepkit is one line, exit code 70, and a file with all that a report needs; nothing is sent anywhere.
"""

from __future__ import annotations

import atexit
import codecs
import io
import os
import platform
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TextIO

from creepkit.cli.interrupts import exit_code, ignore_signals, interrupted_sentence, was_interrupted
from creepkit.errors import printable

FAULT, NO_READER = 70, 141
"""Exit codes: EX_SOFTWARE of sysexits.h; and 128 + SIGPIPE, with which the shell reports programs of a closed pipe."""


def failure_sentence(error: BaseException) -> tuple[str, int]:
    """One line about an exception that nobody foresaw, and the exit code."""
    if isinstance(error, MemoryError):
        return "there is not enough memory for this; give less at once, or take a machine with more", 1
    what = " ".join(str(error).split())[:200]
    kind = type(error).__name__
    where = _written_report(error)
    file = f" with the file {where}" if where else "; --debug shows more, and no file could be written"
    what = f"internal error ({kind}{': ' if what else ''}{what})"
    return f"{what}; this is a fault of creepkit: report it {_address()}{file}", FAULT


def _written_report(error: BaseException) -> Path | None:
    """A file in a folder of its own, which nobody else can read; None where none can be written."""
    try:
        path = Path(tempfile.mkdtemp(prefix="creepkit-error-")) / "report.txt"
        lines = [
            f"creepkit {_version()}, Python {sys.version.split()[0]}, {platform.platform()}",
            f"command: {' '.join(map(repr, sys.argv))}",
            "",
            *traceback.format_exception(error),
        ]
        path.write_text("\n".join(lines), encoding="utf-8", errors="backslashreplace")
    except Exception:  # a second failure must not hide the first
        return None
    return path


def _version() -> str:
    import creepkit

    return str(creepkit.__version__)


def _address() -> str:
    """Where faults are reported, as the installed package says."""
    from importlib.metadata import PackageNotFoundError, metadata

    try:
        urls = [text.partition(", ") for text in metadata("creepkit").get_all("Project-URL") or ()]
    except PackageNotFoundError:
        urls = []
    known = {name.strip().lower(): url for name, _, url in urls}
    for name in ("issues", "bug tracker", "repository", "source", "homepage"):
        if name in known:
            return f"at {known[name]}"
    return "to its authors"


AS_TERMINALS_CAN = "creepkit.terminal"
"""Name of how characters that an encoding lacks are written: 850 °C as 850 C, others as their codes."""


def _replaced(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    lacking = error.object[error.start : error.end]
    return lacking.replace("\N{DEGREE SIGN}", "").encode("ascii", "backslashreplace").decode("ascii"), error.end


codecs.register_error(AS_TERMINALS_CAN, _replaced)


def prepare_streams() -> None:
    """Have all three standard streams open, write all of a text or fail, and write what an encoding lacks as its code.

    A stream that the shell closed is /dev/null: else the next file that is opened would take its number, and what C
    libraries print would go into that file. A stream without buffer (PYTHONUNBUFFERED) drops without a word what the
    system did not take at once, as on a disk that gets full: it gets a buffer that is emptied at every line end.
    """
    try:
        while (descriptor := os.open(os.devnull, os.O_RDWR)) <= 2:
            pass
        os.close(descriptor)
    except OSError:
        pass
    if sys.stdin is None:
        sys.stdin = open(os.devnull, encoding="utf-8")  # noqa: SIM115 (open to the end)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        stream = getattr(sys, name)
        if isinstance(stream, io.TextIOWrapper) and isinstance(stream.buffer, io.RawIOBase):
            whole = io.BufferedWriter(stream.buffer)
            setattr(sys, name, stream := io.TextIOWrapper(whole, stream.encoding, line_buffering=True))
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors=AS_TERMINALS_CAN)


def check_working_folder() -> None:
    """SystemExit, after a sentence, where the working folder has been deleted: libraries fail there without one."""
    try:
        os.getcwd()
    except FileNotFoundError:
        say("the working folder has been deleted; change to one that exists (cd), and run the command again")
        raise SystemExit(1) from None
    except OSError:  # it is there, and cannot be named
        pass


def print_warnings_plainly() -> None:
    """Have warnings of creepkit printed as one line without the place in the code."""
    others = warnings.formatwarning

    def formatted(
        message: Warning | str, category: type[Warning], filename: str, lineno: int, line: str | None = None
    ) -> str:
        if category.__module__ == "creepkit.errors":
            return f"creepkit: {printable(' '.join(str(message).split()))}\n"
        return others(message, category, filename, lineno, line)

    warnings.formatwarning = formatted


def run_to_the_end(run: Callable[[], None]) -> None:
    """Run the command line; SystemExit with the code of its end, after all of its output is written."""
    code: object = 0
    try:
        run()
    except SystemExit as end:
        code = exit_code() if was_interrupted() and end.code in (1, 130) else end.code
    except KeyboardInterrupt:  # before the command began, which says so itself
        code = _said_interrupted()
    except BrokenPipeError:
        code = NO_READER
    except Exception as error:
        if "--debug" in sys.argv:
            raise
        if was_interrupted():  # as an import that was cut off, which raises something else
            code = _said_interrupted()
        else:
            sentence, code = failure_sentence(error)
            say(sentence)
    try:
        sys.stdout.flush()
    except KeyboardInterrupt:  # while nobody reads
        code = exit_code()
    except BrokenPipeError:
        code = NO_READER
    except OSError as error:
        if not code:
            say(output_sentence(error))
        code = code or 1
    else:
        ignore_signals()  # all is done; Python would print a traceback while it tidies up
    for stream in (sys.stdout, sys.stderr):
        _drop_what_cannot_be_written(stream)
    if was_interrupted() and isinstance(code, int):
        atexit._run_exitfuncs()
        os._exit(code)  # libraries that were cut off amid a call, as torch, may abort while the interpreter tidies up
    exec("")  # Python ends by SIGINT where a text that exec ran was ever interrupted, unless another ran afterwards
    sys.exit(code)  # type: ignore[arg-type]


def _drop_what_cannot_be_written(stream: TextIO) -> None:
    """Python flushes once more at its end, and would print a traceback or end with code 120."""
    try:
        stream.flush()
    except (OSError, ValueError, KeyboardInterrupt):
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def output_sentence(error: OSError) -> str:
    """What is said of standard output that cannot be written."""
    return f"standard output: {error.strerror}; free some space and start again"


def _said_interrupted() -> int:
    say(interrupted_sentence(None))
    return exit_code()


def say(sentence: str) -> None:
    """Write a line on stderr, if it can be written; what could steer a terminal as its code."""
    try:
        sys.stderr.write(f"creepkit: {printable(sentence)}\n")
        sys.stderr.flush()
    except OSError:
        pass
