"""Signals that end a command: Ctrl-C, those of queues of jobs, containers and closed terminals.

Each is a KeyboardInterrupt in the main thread, so that files which are being written are tidied up. Which signal it was
decides the exit code, 128 and its number as in a shell, and stands in the sentence with which the command ends.
"""

from __future__ import annotations

import _thread
import signal
import sys
import threading
from collections.abc import Callable
from types import FrameType
from typing import Any, TypeVar

SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
"""Names of those that end a command, as far as the system has them."""


NOTHING_KEPT = "files that were there are whole, and the same command starts from the beginning"
"""What is said of a command that declares nothing else."""


SECOND_ATTEMPT = 0.05
"""s after which an interrupt that got lost is sent once more."""


_received = 0
"""Number of the signal that came last; 0 where none came."""

Command = TypeVar("Command", bound=Callable[..., None])


def kept_when_interrupted(sentence: str) -> Callable[[Command], Command]:
    """Declare what an interrupted command leaves, and how it goes on; half a sentence."""

    def declare(command: Command) -> Command:
        command.kept_when_interrupted = sentence  # type: ignore[attr-defined]
        return command

    return declare


def interrupt_at_signals() -> None:
    """Have these signals interrupt the main thread, which calls this, but for those that nohup has switched off."""
    for name in SIGNALS:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _interrupt)
    sys.unraisablehook = _send_lost_interrupt_again


def ignore_signals() -> None:
    """Let no signal end the process any more but SIGKILL."""
    for name in SIGNALS:
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)


def _interrupt(number: int, frame: FrameType | None) -> None:
    global _received
    _received = number
    raise KeyboardInterrupt


def _send_lost_interrupt_again(lost: sys.UnraisableHookArgs) -> None:
    """Python drops what is raised while it tidies an object away: an interrupt that falls into that is repeated."""
    if not issubclass(lost.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(lost)
        return
    again = threading.Timer(SECOND_ATTEMPT, _send_again)
    again.daemon = True
    again.start()


def _send_again() -> None:
    number = signal.Signals(_received or signal.SIGINT)
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, number)  # ends a call of the system that waits, too
    else:
        _thread.interrupt_main(number)


def was_interrupted() -> bool:
    """Whether a signal has come: an error that follows is that of work which was cut off."""
    return _received != 0


def exit_code() -> int:
    """128 and the number of the signal."""
    return 128 + (_received or signal.SIGINT)


def interrupted_sentence(name: str | None, command: Any = None, kept: str = "") -> str:
    """How an interrupted command ends; name : None where it did not begin. kept : what it leaves, if it said so."""
    received = _received or signal.SIGINT
    by = "" if received == signal.SIGINT else f" by {signal.Signals(received).name}"
    if name is None:
        return f"interrupted{by} before it began; the same command starts from the beginning"
    kept = kept or getattr(getattr(command, "callback", None), "kept_when_interrupted", NOTHING_KEPT)
    return f"{name} interrupted{by}; {kept}"
