"""Lines of a TOML text: where each key and table stands, for messages; tomllib says where a syntax error is, no more.

The text is one that tomllib has read, so that only its layout is followed: keys, strings, lists and tables in lines.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Mapping

KeyPath = tuple[str | int, ...]
"""Keys from the top on; a number counts the tables of a list of tables, and the items of a list."""


_BARE = re.compile(r"[A-Za-z0-9_-]+")
_STRING = re.compile(r'"""(?:[^\\]|\\.)*?"{3,5}|\'\'\'.*?\'{3,5}|"(?:[^"\\\n]|\\.)*"|\'[^\'\n]*\'', re.DOTALL)
_ESCAPES = {"b": "\b", "t": "\t", "n": "\n", "f": "\f", "r": "\r", '"': '"', "\\": "\\"}


def key_lines(text: str) -> Mapping[KeyPath, int]:
    """{path: line, counted from 1} of every key, table and item of a list in a text that tomllib reads."""
    return _Scanner(text).lines()


def line_of(path: KeyPath, lines: Mapping[KeyPath, int]) -> int:
    """The line of a key, or of the innermost table around it that stands in the text; 1 where none does."""
    for length in range(len(path), 0, -1):
        if path[:length] in lines:
            return lines[path[:length]]
    return 1


class _Scanner:
    """One pass over a text; `at` is the position."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0
        self.line_ends = [position for position, character in enumerate(text) if character == "\n"]
        self.found: dict[KeyPath, int] = {}
        self.counts: dict[KeyPath, int] = {}

    def lines(self) -> dict[KeyPath, int]:
        table: KeyPath = ()
        while True:
            self._skip(newlines=True)
            if self.at >= len(self.text):
                return self.found
            if self.text[self.at] == "[":
                table = self._heading()
            else:
                self._pair(table)

    def _heading(self) -> KeyPath:
        is_list = self.text.startswith("[[", self.at)
        line = self._line()
        self.at += 2 if is_list else 1
        keys = self._keys()
        self._skip()
        self.at += 2 if is_list else 1
        path = self._resolved(keys[:-1])
        for length in range(1, len(path)):
            self.found.setdefault(path[:length], line)
        path = (*path, keys[-1])
        self.found.setdefault(path, line)
        if is_list:
            count = self.counts.get(path, 0)
            self.counts[path] = count + 1
            path = (*path, count)
        elif path in self.counts:
            path = (*path, self.counts[path] - 1)
        self.found[path] = line
        return path

    def _resolved(self, keys: tuple[str, ...]) -> KeyPath:
        """Keys with the number of the last table where one names a list of tables."""
        path: KeyPath = ()
        for key in keys:
            path = (*path, key)
            if path in self.counts:
                path = (*path, self.counts[path] - 1)
        return path

    def _pair(self, table: KeyPath) -> None:
        line, path = self._line(), table
        for key in self._keys():
            path = (*path, key)
            self.found.setdefault(path, line)
        self._skip()
        self.at += 1  # =
        self._value(path)

    def _keys(self) -> tuple[str, ...]:
        keys = []
        while True:
            self._skip()
            string = _STRING.match(self.text, self.at)
            bare = _BARE.match(self.text, self.at)
            if string:
                keys.append(_plain(string[0]))
                self.at = string.end()
            elif bare:
                keys.append(bare[0])
                self.at = bare.end()
            self._skip()
            if not self.text.startswith(".", self.at):
                return tuple(keys)
            self.at += 1

    def _value(self, path: KeyPath) -> None:
        self._skip()
        self.found.setdefault(path, self._line())
        opening = self.text[self.at : self.at + 1]
        if opening in ("[", "{"):
            self._items(path, opening)
            return
        string = _STRING.match(self.text, self.at)
        if string:
            self.at = string.end()
            return
        while self.at < len(self.text) and self.text[self.at] not in ",]}#\r\n":
            self.at += 1

    def _items(self, path: KeyPath, opening: str) -> None:
        self.at += 1
        number = 0
        while True:
            self._skip(newlines=True)
            character = self.text[self.at : self.at + 1]
            if character in ("]", "}", ""):
                self.at += 1
                return
            if character == ",":
                self.at += 1
            elif opening == "{":
                self._pair(path)
            else:
                self._value((*path, number))
                number += 1

    def _skip(self, *, newlines: bool = False) -> None:
        """Go over blanks; with newlines, over line ends and comments too."""
        blanks = " \t\r\n" if newlines else " \t"
        while self.at < len(self.text):
            if self.text[self.at] in blanks:
                self.at += 1
            elif newlines and self.text[self.at] == "#":
                end = self.text.find("\n", self.at)
                self.at = len(self.text) if end < 0 else end
            else:
                return

    def _line(self) -> int:
        return bisect_left(self.line_ends, self.at) + 1


def _plain(string: str) -> str:
    """The text of a key in quotes."""
    if string.startswith("'"):
        return string[1:-1]
    return re.sub(r"\\(.)", lambda match: _ESCAPES.get(match[1], match[0]), string[1:-1])
