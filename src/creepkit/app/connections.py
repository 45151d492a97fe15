"""Connections of the page's server: how many there may be, which of them makes place, how much one may send."""

from __future__ import annotations

import socket
import threading
from contextlib import suppress
from http.client import LineTooLong
from typing import Any

MOST_CONNECTIONS = 32
"""At one time; a page holds about six."""


PLACE_WAIT = 1.0
"""s to wait for the place of a connection that was ended."""


LARGEST_HEAD = 128 * 1024
"""Bytes of a request line and its headers."""


class Connections:
    """The connections of a server. One more than there may be takes the place of one that asks for nothing.

    Those that never showed the token go first, and then the one that has waited longest.
    """

    def __init__(self) -> None:
        self._places = threading.BoundedSemaphore(MOST_CONNECTIONS)
        self._lock = threading.Lock()
        self._waiting: dict[socket.socket, bool] = {}

    def enter(self) -> bool:
        """Take a place, if need be from one that waits; False where all are busy."""
        if self._places.acquire(blocking=False):
            return True
        with self._lock:
            waiting = min(self._waiting, key=lambda one: self._waiting[one], default=None)
            if waiting is None:
                return False
            del self._waiting[waiting]
            with suppress(OSError):
                waiting.shutdown(socket.SHUT_RDWR)
        return self._places.acquire(timeout=PLACE_WAIT)

    def leave(self) -> None:
        """Give a place back."""
        self._places.release()

    def waits(self, connection: socket.socket, trusted: bool) -> None:
        """Note that a connection is waited for; trusted : whether it has shown the token."""
        with self._lock:
            self._waiting[connection] = trusted

    def is_busy(self, connection: socket.socket) -> None:
        """Note that a connection is being answered, or gone."""
        with self._lock:
            self._waiting.pop(connection, None)


class BoundedReader:
    """Reads a connection; LineTooLong for a head of more than LARGEST_HEAD bytes."""

    def __init__(self, stream: Any) -> None:
        self._stream, self._left = stream, LARGEST_HEAD

    def begin(self) -> None:
        """Wait for the first byte of a request, and count from it."""
        self._left = LARGEST_HEAD
        self._stream.peek(1)

    def readline(self, limit: int = -1) -> bytes:
        """A line of the head."""
        line: bytes = self._stream.readline(limit if limit >= 0 else self._left + 1)
        self._left -= len(line)
        if self._left < 0:
            raise LineTooLong("head")
        return line

    def read(self, size: int) -> bytes:
        """The body."""
        return bytes(self._stream.read(size))

    def close(self) -> None:
        """Close the stream."""
        self._stream.close()

    @property
    def closed(self) -> bool:
        """Whether it is closed."""
        return bool(self._stream.closed)
