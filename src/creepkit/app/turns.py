"""Whose answer is worked out: the latest request of each page, and one at a time."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

MOST_CLIENTS = 64
"""Pages whose latest request is remembered."""


MOST_AT_ONCE = 4
"""Answers that are worked out at one time, of which all but one are no longer wanted."""


class Superseded(Exception):
    """A newer request of the same page has come."""


@dataclass(frozen=True, eq=False)
class Turn:
    """A request of a page, by its number there."""

    client: str
    number: int


@dataclass
class Turns:
    """Gives turns to requests of one kind.

    A simulation cannot be stopped within its solver. One that a newer request of its page has made needless does not
    keep that one waiting: it ends beside it, and what it finds is dropped.
    """

    _changed: threading.Condition = field(default_factory=threading.Condition, repr=False)
    _latest: OrderedDict[str, int] = field(default_factory=OrderedDict, repr=False)
    _running: dict[bool, list[Turn]] = field(default_factory=lambda: {False: [], True: []}, repr=False)

    def announce(self, client: str, number: int) -> Turn:
        """Note a request; older ones of its page are superseded from now on."""
        with self._changed:
            self._latest[client] = max(number, self._latest.get(client, 0))
            self._latest.move_to_end(client)
            while len(self._latest) > MOST_CLIENTS:
                self._latest.popitem(last=False)
            self._changed.notify_all()
        return Turn(client, number)

    def check(self, turn: Turn) -> None:
        """Superseded where a newer request of the same page has come."""
        if self._is_old(turn):
            raise Superseded

    @contextmanager
    def taken(self, turn: Turn, exact: bool) -> Iterator[None]:
        """Wait for the turn, and have it; quick and exact answers do not wait for each other."""
        running = self._running[exact]
        with self._changed:
            while len(running) >= MOST_AT_ONCE or not all(map(self._is_old, running)):
                self.check(turn)
                self._changed.wait()
            self.check(turn)
            running.append(turn)
        try:
            yield
        finally:
            with self._changed:
                running.remove(turn)
                self._changed.notify_all()

    def _is_old(self, turn: Turn) -> bool:
        return self._latest.get(turn.client, 0) > turn.number
