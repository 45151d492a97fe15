"""What is known of a test beside its frames, sorted by meaning; nothing that was said goes unread."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TypeVar

from creepkit.errors import CreepkitError, HistoryError
from creepkit.readers.tables import Entry
from creepkit.readers.units import LENGTH, TIME, Kind, split
from creepkit.readers.words import SPECIMEN_NAME, TEXTS, Words

_GROUPS = (
    "give one of stress, stress_steps, stress_program, or stress_1 with stress_2 and jump_time (the same for pressure, "
    "there with ramp)"
)
ENDINGS = ("ruptured", "stopped")
"""How a test may have ended: by rupture, or before it."""

_T = TypeVar("_T")
Pairs = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Amount:
    """A number in creepkit's unit, and the key and place that it came from."""

    value: float
    key: str
    place: str


class Conditions:
    """The entries of one test: numbers, texts, geometry and labels; numbers and texts are taken, one by one."""

    def __init__(self, entries: Mapping[str, Entry], words: Words, place: str) -> None:
        self.place = place
        self.geometry: dict[str, float] = {}
        self.labels: dict[str, str] = {}
        self._words = words
        self._kinds = words.conditions
        self._endings = {**{word: word for word in ENDINGS}, **words.endings}
        self._numbers: dict[str, Amount] = {}
        self._texts: dict[str, Entry] = {}
        self._assumed: list[str] = []
        self._places: dict[str, str] = {}
        for key, entry in entries.items():
            self._sort(key, entry)

    def number(self, quantity: str) -> Amount | None:
        """Take a number, if it was given."""
        return self._numbers.pop(quantity, None)

    def text(self, key: str, default: str = "") -> str:
        """Take a text; the default stands in for a missing or empty one."""
        entry = self._texts.pop(key, None)
        return default if entry is None else entry.text or default

    def choice(self, key: str, allowed: Sequence[str], needed: bool) -> str:
        """Take one of the allowed texts; '' when it was not given, or what the layout assumes when it is needed."""
        entry = self._texts.pop(key, None)
        if entry is None and needed and key in self._words.assumed:
            entry = Entry(self._words.assumed[key], "assumed by the layout")
            self._assumed.append(f"{key} {entry.text}")
        if entry is None:
            return ""
        if entry.text not in allowed:
            raise HistoryError(f"{entry.place}: {key} is '{entry.text}'; allowed: {', '.join(allowed)}")
        return entry.text

    def pairs(self, key: str, kind: Kind) -> Pairs | None:
        """Take times and values written as `0 s 100 MPa; 1 h 120 MPa`, from time zero on; s and creepkit's unit."""
        entry = self._texts.pop(key, None)
        if entry is None:
            return None
        pairs = tuple(_pair(item, key, kind, entry.place) for item in entry.text.split(";"))
        times = [time for time, _ in pairs]
        if times[0] != 0.0 or times != sorted(times):
            found = f"the times of {key} are {', '.join(f'{time:g}' for time in times)} s"
            raise HistoryError(f"{entry.place}: {found}; they must start at 0 and never decrease")
        return pairs

    def assume(self, what: str) -> None:
        """Record in the label "assumed" what the file leaves unsaid."""
        self._assumed.append(what)

    def where(self, *keys: str) -> str:
        """The place of the first of these numbers and texts that was given, else that of the test."""
        return next((self._places[key] for key in keys if key in self._places), self.place)

    def missing(self, what: str, advice: str) -> HistoryError:
        """The error that says what is missing, and which keys were kept as labels (perhaps misspelt)."""
        kept = f" (keys not understood: {', '.join(self.labels)})" if self.labels else ""
        return HistoryError(f"{self.place}: no {what}{kept}; {advice}")

    def all_labels(self) -> dict[str, str]:
        """The labels, with what was assumed; refuses numbers and texts that nobody took."""
        left = [(amount.place, amount.key) for amount in self._numbers.values()]
        left += [(entry.place, key) for key, entry in self._texts.items()]
        for place, key in left:
            raise HistoryError(f"{place}: '{key}' has no meaning beside the other conditions; {_GROUPS}")
        assumed = {"assumed": ", ".join(self._assumed)} if self._assumed else {}
        return {**self.labels, **assumed}

    def _sort(self, key: str, entry: Entry) -> None:
        name = self._words.rename.get(key, key)
        found = split(name, self._kinds)
        if name.startswith("label "):
            _put(self.labels, name.removeprefix("label ").strip(), entry.text, entry.place)
        elif name.startswith("geometry "):
            _put(self.geometry, *_measure(name, entry), entry.place)
        elif name == "ended" or (found and found[0] == "rupture" and entry.text in self._endings):
            _put(self._texts, "ended", Entry(self._endings.get(entry.text, entry.text), entry.place), entry.place)
        elif name in TEXTS and (name != "specimen" or SPECIMEN_NAME.fullmatch(entry.text)):
            _put(self._texts, name, entry, entry.place)
            self._places[name] = entry.place
        elif found is None:
            _put(self.labels, name, entry.text, entry.place)
        else:
            _put(self._numbers, found[0], self._amount(found, key, entry), entry.place)
            self._places[found[0]] = entry.place

    def _amount(self, found: tuple[str, str], key: str, entry: Entry) -> Amount:
        quantity, suffix = found
        kind = self._kinds[quantity]
        kind.unit(suffix, entry.place, key)
        return Amount(kind.convert(entry.number(key), suffix, entry.place, key), key, entry.place)


@contextmanager
def placed(place: str) -> Iterator[None]:
    """Give a complaint of a record about its fields the place in the file that they came from."""
    try:
        yield
    except HistoryError:  # speaks of a place already
        raise
    except CreepkitError as error:
        raise HistoryError(f"{place}: {error}") from error


def _put(there: dict[str, _T], key: str, value: _T, place: str) -> None:
    if key in there:
        raise HistoryError(f"{place}: '{key}' is given twice (perhaps in two units); keep one of them")
    there[key] = value


def _measure(name: str, entry: Entry) -> tuple[str, float]:
    """A measure of the specimen, `geometry apex_thickness_mm`: a length in any unit, or a bare number."""
    stem = name.removeprefix("geometry ").strip()
    base, _, suffix = stem.rpartition("_")
    number = entry.number(stem)
    if base and suffix in LENGTH.units:
        return base, LENGTH.convert(number, suffix, entry.place, stem)
    return stem, number


def _pair(item: str, key: str, kind: Kind, place: str) -> tuple[float, float]:
    words = item.split()
    if len(words) == 3 and "" in kind.units:
        words.append("")
    if len(words) != 4:
        example = f"0 s 100 {next(iter(kind.units))}" if "" not in kind.units else "0 s 0.002, or 0 s 0.2 pct"
        raise HistoryError(f"{place}: {key} holds '{item.strip()}'; write time and value with units, such as {example}")
    time, value = (Entry(word, place).number(key) for word in (words[0], words[2]))
    return TIME.convert(time, words[1], place, key), kind.convert(value, words[3], place, key)
