"""What is stated once for a test beside its frames: numbers, texts, lengths and labels.

Nothing that a file states goes unread, and no key is guessed: an unknown one is an error, never a label. What remarks
beside frames say of load and temperature, and no number does, is asked for: a change, `temp. raised to 620 C`, is a
step; a pause, `70 h cold, unloaded`, in which the clock ran on and nothing crept, two of the load, to none and back.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np

from creepkit.errors import CreepkitError, HistoryError, quoted
from creepkit.files.delimited_text import Dialect, is_number
from creepkit.readers.ends_of_tests import (
    FIRM,
    INTERRUPTED,
    LABEL,
    STOPPED,
    UNCLEAR,
    MarkedTime,
    end_said_by,
    kind_of_column,
    marked_time,
)
from creepkit.readers.frames import TableFrames
from creepkit.readers.questions import Answer, Question, collected, raise_all
from creepkit.readers.table import SourceText
from creepkit.readers.vocabulary import (
    CLOSE_SPELLING,
    SPECIMEN_NAME_PATTERN,
    HeaderVocabulary,
    Terms,
    is_misspelling,
    plain_name,
    split_unit,
    unit_suffix,
    value_in,
)
from creepkit.readers.weak_sources import LOAD_AGREEMENT, TEMPERATURE_AGREEMENT, conditions_in_text
from creepkit.records import History, Program
from creepkit.records.quantities import LENGTH, TEMPERATURE, TIME, QuantityKind
from creepkit.records.units import time_text

_ALLOWED_COMBINATIONS = (
    "give one of stress, stress_steps, stress_program, or stress_1 with stress_2 and jump_time (the same for other "
    "loads; with ramp for a pressure)"
)


_HELD = {
    "strain": re.compile(r"strain|dehnung|relax|extension|displacement|verschiebung|déformation|\bweg"),
    "stress": re.compile(r"(?:true|wahre|vraie).*(?:stress|spannung|contrainte)"),
    "load": re.compile(r"\bloads?\b.*\w\W|\W.*\bload\b|dead|\blast\b|kraft|gewicht|weight"),
}
"""{what was held: words by which laboratories say so}."""


_SMOOTH = re.compile(r"\b(?:smooth|plain|un-?notched|glatt|ungekerbt|lisse|non entaill)")
_NOTCHED = re.compile(r"\bnotch|\bgekerbt|\bkerb|\bentaill|\bk_?t\b")
"""Of what a text calls a specimen: of a bar without a notch, and of one with."""


END_OF_TEST_TERMS = ("ruptured", "stopped")
"""How a test may have ended: by rupture, or before it."""


_OBSERVATION = re.compile(r"[a-z][a-z -]*\d")
"""Beginning of an operator of observation, a form and a number; any other operator is who made the test."""


_T = TypeVar("_T")


TimeValuePairs = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class StatedNumber:
    """A number in creepkit's unit; the key, as it was written, place and unit that it came from."""

    value: float
    key: str
    location: str
    unit: str = ""


def is_control(text: str) -> bool:
    """Whether a text says what was held, such as `constant load`."""
    return any(pattern.search(text.casefold()) for pattern in _HELD.values())


class StatedConditions:
    """The entries of one test: numbers, texts, geometry and labels; numbers and texts are taken, one by one.

    columns_as_labels : whether entries that resemble no key are labels, as columns of an index are; such keys of a head
        are errors.
    """

    def __init__(
        self,
        entries: Mapping[str, SourceText],
        vocabulary: HeaderVocabulary,
        location: str,
        *,
        columns_as_labels: bool = False,
    ) -> None:
        self.location = location
        self.geometry: dict[str, float] = {}
        self.labels: dict[str, str] = {}
        self.stated: dict[str, Program] = {}
        self._vocabulary = vocabulary
        stated = entries["specimen"].text.casefold() if "specimen" in entries else ""
        self.terms = vocabulary.terms(stated)
        self.default_specimen = vocabulary.default_texts.get("specimen", "")
        self._kinds = self.terms.condition_kinds
        self._text_keys = self.terms.text_keys
        self.end_terms = {word.casefold(): end for word, end in vocabulary.end_of_test_terms.items()}
        self._numbers: dict[str, StatedNumber] = {}
        self._texts: dict[str, SourceText] = {}
        self.assumed: list[str] = []
        self._locations: dict[str, str] = {}
        errors = list[HistoryError]()
        for key, entry in entries.items():
            collected(errors, partial(self._classify, key, entry, columns_as_labels))
        raise_all(errors)

    def take_number(self, quantity: str) -> StatedNumber | None:
        """Take a number, if it was given."""
        return self._numbers.pop(quantity, None)

    def number_of(self, quantity: str) -> StatedNumber | None:
        """A number that nothing has taken yet, if it was given."""
        return self._numbers.get(quantity)

    def take_text(self, key: str, default: str = "") -> str:
        """Take a text; the default stands in for a missing or empty one."""
        entry = self._texts.pop(key, None)
        return default if entry is None else entry.text or default

    def take_entry(self, key: str) -> SourceText | None:
        """Take a text with its place, if it was given."""
        return self._texts.pop(key, None)

    def states(self, key: str) -> bool:
        """Whether a number or text is given that nothing has taken yet."""
        return key in self._numbers or key in self._texts

    def text_of(self, key: str) -> str:
        """A text that nothing has taken yet, "" where it is not given."""
        return self._texts[key].text if key in self._texts else ""

    def states_load(self, quantity: str) -> bool:
        """Whether a load is stated in any form: a number, levels, steps or a program."""
        return any(self.states(f"{quantity}{form}") for form in ("", "_1", "_steps", "_program"))

    def put_number(self, quantity: str, number: StatedNumber) -> None:
        """Add a number that others give; its place is that of the one it was made of."""
        self._numbers[quantity] = number
        self._locations[quantity] = number.location

    def take_choice(self, key: str, allowed: Sequence[str], required: bool) -> str:
        """Take one of the allowed texts; '' when it was not given, or what the layout assumes when it is needed."""
        entry = self._texts.pop(key, None)
        if entry is None and required and key in self._vocabulary.default_texts:
            entry = SourceText(self._vocabulary.default_texts[key], "assumed by the layout")
            self.assumed.append(f"{key} {entry.text}")
        if entry is None:
            return ""
        if entry.text not in allowed:
            written = entry.key or key
            raise HistoryError(f"{entry.location}: {written} is '{entry.text}'; allowed: {', '.join(allowed)}")
        return entry.text

    def take_pairs(self, key: str, kind: QuantityKind) -> TimeValuePairs | None:
        """Take times and values written as `0 s 100 MPa; 1 h 120 MPa`, from time zero on; s and creepkit's unit."""
        entry = self._texts.pop(key, None)
        if entry is None:
            return None
        pairs = tuple(_time_value_pair(item, key, kind, entry) for item in entry.text.split(";"))
        times = [time for time, _ in pairs]
        if times[0] != 0.0 or times != sorted(times):
            description = f"the times of {key} are {', '.join(f'{time:g}' for time in times)} s"
            raise HistoryError(f"{entry.location}: {description}; they must start at 0 and never decrease")
        return pairs

    def record_assumption(self, what: str, *, first: bool = False) -> None:
        """Record in the label "assumed" what the file leaves unsaid; first : before all others."""
        self.assumed.insert(0 if first else len(self.assumed), what)

    def location_of(self, *keys: str) -> str:
        """The place of the first of these numbers and texts that was given, else that of the test."""
        return next((self._locations[key] for key in keys if key in self._locations), self.location)

    def missing_error(self, what: str, advice: str, key: str = "") -> HistoryError:
        """The error that says what is missing, and what was kept as labels; a question where a key states it."""
        label_note = f" (kept as labels: {', '.join(self.labels)})" if self.labels else ""
        sentence = f"no {what}{label_note}; {advice}"
        return self.question(sentence, key) if key else HistoryError(f"{self.location}: {sentence}")

    def question(self, sentence: str, key: str, *choices: Answer, location: str = "", is_free: bool = True) -> Question:
        """The question of a condition, which the key states; choices : likely values."""
        place = location or self.location
        path = Path(re.sub(r"(?:, sheet '.*|:\d+)$", "", place))
        place += f" ({self.labels['format']})" if "format" in self.labels else ""
        return Question(path, place, sentence, key, choices, is_free=is_free)

    def ask_of_label(self, words: re.Pattern[str], sentence: str) -> None:
        """Raise the question whether what a name with these words states is a label, unless an answer says so."""
        if name := next((one for one in self.labels if words.search(one) and one not in self._vocabulary.labels), ""):
            raise self.question(f"'{quoted(name, 60)}' {sentence}, it is a label", "columns", {name: LABEL})

    def ask_of_notch(self) -> None:
        """Raise the question which specimen it is where a label is that of a notched bar, `Kt: 3.6`."""
        for label, text in {} if self.states("specimen") else self.labels.items():
            is_factor = re.fullmatch(r"k_?t", label.casefold()) and is_number(text, Dialect()) and float(text) > 1.1
            is_said = len(text.split()) < 3 and _NOTCHED.search(text.casefold()) and not _SMOOTH.search(text.casefold())
            if (is_factor or is_said) and label not in self._vocabulary.labels:
                what = f"'{quoted(label, 60)}' is '{quoted(text, 40)}', and the stress of a notched bar is no plain one"
                what = f"{what}; leave the test out by its exclude, or which specimen is it?"
                raise self.question(what, "specimen", "notched-bar", History.specimen)

    def all_labels(self) -> dict[str, str]:
        """The labels, with what was assumed; refuses numbers and texts that nothing has used."""
        unread = [(number.location, number.key) for number in self._numbers.values()]
        unread += [(entry.location, entry.key or key) for key, entry in self._texts.items()]
        for location, key in unread:
            if self._vocabulary.synonyms.get(key, key) == "control":
                what = "neither a load nor a true stress was held in this test: leave it out, and state strain_pct"
                raise HistoryError(f"{location}: '{key}': {what} or steps of strain where the strain was held")
            raise HistoryError(f"{location}: '{key}' has no meaning beside the others; {_ALLOWED_COMBINATIONS}")
        earlier = [self.labels["assumed"]] if self.labels.get("assumed") else []
        new = [one for one in self.assumed if not earlier or one not in earlier[0]]
        assumed = ", ".join(dict.fromkeys([*earlier, *new]))
        return {**self.labels, **({"assumed": assumed} if assumed else {})}

    def _classify(self, key: str, entry: SourceText, columns_as_labels: bool) -> None:
        """Put an entry where it belongs."""
        meant, written = self._vocabulary.synonyms.get(key), entry.key or key
        name = self.terms.condition(meant) if meant else key
        found = split_unit(name, self._kinds)
        word, _, rest = name.strip().partition(" ")
        base, _, suffix = name.rpartition("_")
        if name in self._vocabulary.labels or (name == "operator" and not _OBSERVATION.match(entry.text)):
            self._put(self.labels, name, entry.text, entry)
        elif word.casefold() == "label" and rest.strip():
            self._put(self.labels, rest.strip(), entry.text, entry)
        elif word.casefold() == "geometry" and rest.strip():
            self._put_length(_length(rest.strip(), entry, self.terms, is_free=True), entry)
        elif name == "ended":
            self._put(self._texts, "ended", replace(entry, text=self._end(entry.text)), entry)
        elif found and found[0] == "rupture" and (mark := marked_time(entry.text, self.end_terms)).said != "":
            self._put_marked(mark, found[1], entry, written)
        elif name == "specimen":
            self._name_specimen(entry)
        elif name == "control":
            self._put_control(entry)
        elif name in self._text_keys:
            self._put(self._texts, name, entry, entry)
        elif base in self.terms.dimensions and suffix in LENGTH.units:
            self._put_length(_length(name, entry, self.terms, is_free=False), entry)
        elif found and (found[1] in self._kinds[found[0]].units or not self._is_misspelt_text(name)):
            self._put_number(*found, written, entry)
        else:
            _length(name, entry, self.terms, is_free=False)
            misspelt = self._misspelt(key) if key.strip() else ""
            says_end = kind_of_column(key) in (*FIRM, "remark") and not misspelt.startswith("rupture_")
            near = self.terms.suggestion(key) or self.terms.suggestion(base)
            is_asked = columns_as_labels and near and not (says_end or misspelt)
            if is_asked and is_number(entry.text, Dialect(decimal=entry.decimal)):
                near = f"{base}_mm" if base in self.terms.dimensions else near
                what = (
                    f"'{quoted(key, 60)}' holds numbers and is no known name; did you mean '{near}', or is it a label?"
                )
                raise self.question(what, "columns", {key: LABEL}, location=entry.location)
            is_label = says_end or (columns_as_labels and not misspelt)
            if not (key.strip() and is_label):
                meant = misspelt or self.terms.suggestion(key)
                advice = f"did you mean '{meant}'? A label is written" if meant else "a label is written"
                what = f"unknown key '{written}'; {advice} 'label {written or 'NAME'}'"
                raise HistoryError(f"{entry.location}: {what}")
            self._put(self.labels, key, entry.text, entry)

    def _put(self, target: dict[str, _T], key: str, value: _T, entry: SourceText) -> None:
        if key in target:
            raise HistoryError(f"{entry.location}: '{key}' is given twice (perhaps in two units); keep one of them")
        target[key] = value
        self._locations[key] = entry.location

    def _put_length(self, length: tuple[str, float] | None, entry: SourceText) -> None:
        if length is not None:
            self._put(self.geometry, *length, entry)

    def _put_number(self, quantity: str, suffix: str, written: str, entry: SourceText) -> None:
        kind = self._kinds[quantity]
        kind.unit(suffix, entry.location, written)
        value = kind.convert(entry.number(written), suffix, entry.location, written)
        self._put(self._numbers, quantity, StatedNumber(value, written, entry.location, suffix), entry)

    def _end(self, text: str) -> str:
        """A word for how the test ended as one of END_OF_TEST_TERMS, where it is understood."""
        said = self.end_terms.get(text.casefold()) or end_said_by(text)
        return {INTERRUPTED: STOPPED, UNCLEAR: text, "": text}.get(said, said)

    def _put_marked(self, mark: MarkedTime, unit: str, entry: SourceText, written: str) -> None:
        """Put a rupture time that is marked as a run-out, or a word in its place."""
        if mark.said == STOPPED or not mark.number:
            self._put(self._texts, "ended", replace(entry, text=self._end(mark.said)), entry)
        if mark.number:
            text = mark.number if mark.said != UNCLEAR else entry.text
            quantity = "end_time" if mark.said == STOPPED else "rupture"
            self._put_number(quantity, unit, written, replace(entry, text=text))

    def _name_specimen(self, entry: SourceText) -> None:
        """A text that is no name, such as `Round bar, 6 mm`, is a label, unless it is a misspelt name."""
        name = entry.text.casefold()
        is_known, is_smooth = name in self.terms.outputs, _SMOOTH.search(name)
        if not is_known and not is_smooth and _NOTCHED.search(name):
            what = f"'{quoted(entry.text, 60)}' is said of the specimen; which is it?"
            raise self.question(what, "specimen", "notched-bar", History.specimen, location=entry.location)
        if is_known or (SPECIMEN_NAME_PATTERN.fullmatch(entry.text) and not is_smooth):
            self._put(self._texts, "specimen", replace(entry, text=name), entry)
        elif near := get_close_matches(name, self.terms.outputs, 1, cutoff=CLOSE_SPELLING):
            raise HistoryError(f"{entry.location}: there is no specimen '{entry.text}'; did you mean '{near[0]}'?")
        else:
            self._put(self.labels, "specimen", entry.text, entry)

    def _put_control(self, entry: SourceText) -> None:
        """What was held, in a laboratory's words: `constant load`, `strain hold 0.15 %`."""
        plain = entry.text.casefold()
        held = next((held for held, pattern in _HELD.items() if pattern.search(plain)), entry.text)
        if held != entry.text:
            self._put(self.labels, "control", entry.text, entry)
        self._put(self._texts, "control", replace(entry, text=held), entry)

    def _misspelt(self, key: str) -> str:
        """The key, the laboratory's own included, of which an unknown one is a misspelling; "" for none."""
        own = (name for name in self._vocabulary.synonyms if is_misspelling(plain_name(key), plain_name(name)))
        return next(own, "") or self.terms.misspelt(key)

    def _is_misspelt_text(self, name: str) -> bool:
        """Whether what begins like a number, such as `strain_mesure`, is a misspelt text."""
        return any(is_misspelling(plain_name(name), text) for text in self._text_keys)


@contextmanager
def errors_located_at(location: str) -> Iterator[None]:
    """Give a complaint of a record about its fields the place in the file that they came from."""
    try:
        yield
    except HistoryError:  # names a place already
        raise
    except CreepkitError as error:
        raise HistoryError(f"{location}: {error}") from error


def _length(stem: str, entry: SourceText, terms: Terms, is_free: bool) -> tuple[str, float] | None:
    """A length of the test piece, in any unit; HistoryError where it is nearly one.

    is_free : whether another measure may be stated, `geometry facets`, as a bare number too; else None where it is no
    length.
    """
    base, _, suffix = stem.rpartition("_")
    has_unit = bool(base) and suffix in LENGTH.units
    known = terms.own_dimensions or (terms.dimensions if is_free else ())
    if has_unit and base in terms.dimensions:
        return terms.dimensions[base], LENGTH.convert(entry.number(entry.key or stem), suffix, entry.location, stem)
    has_other = base in terms.dimensions and not has_unit and unit_suffix(suffix) is not None
    if not is_free and (has_other or any(stem == one or (base == one and not has_unit) for one in known)):
        one, units = stem if stem in known else base, ", ".join(LENGTH.units)
        raise HistoryError(f"{entry.location}: '{stem}' needs a unit of length: write {one}_mm (or {units})")
    name = base if has_unit else stem
    if (has_unit or is_free) and name not in known and (near := get_close_matches(name, known, 1, CLOSE_SPELLING)):
        what = f"no length of the test piece is called '{name}'; did you mean '{near[0]}'? (known: {', '.join(known)})"
        raise HistoryError(f"{entry.location}: {what}")
    if not is_free:
        return None
    number = entry.number(stem)
    return (base, LENGTH.convert(number, suffix, entry.location, stem)) if has_unit else (stem, number)


def _time_value_pair(item: str, key: str, kind: QuantityKind, entry: SourceText) -> tuple[float, float]:
    """Time and value of `1 h 120 MPa`; units are spelled as in names of columns, `°C` or `deg C`."""
    location, parts = entry.location, item.split(maxsplit=3)
    if len(parts) == 3 and "" in kind.units:
        parts.append("")
    if len(parts) != 4 or (" " in parts[3] and unit_suffix(parts[3]) is None):
        example = f"0 s 100 {next(iter(kind.units))}" if "" not in kind.units else "0 s 0.002, or 0 s 0.2 pct"
        raise HistoryError(f"{location}: {key} holds '{item.strip()}'; write time and value with units: {example}")
    time, value = (replace(entry, text=word).number(key) for word in (parts[0], parts[2]))
    units = ((parts[1], TIME), (parts[3], kind))
    time_unit, unit = (one if one in of.units else unit_suffix(one) or one for one, of in units)
    return TIME.convert(time, time_unit, location, key), kind.convert(value, unit, location, key)


# ---- correlations of noise -------------------------------------------------------------------------------------------


KEY = "noise_correlation"


def read_noise_correlation(conditions: StatedConditions) -> dict[tuple[str, str], float]:
    """{(output, output): correlation} as the head states them; the history refuses what cannot be one."""
    entry, correlations = conditions.take_entry(KEY) or SourceText("", ""), dict[tuple[str, str], float]()
    for item in filter(None, entry.text.split(";")):
        first, second, number = words if len(words := item.split()) == 3 else ("", "", "")
        if not number or {(first, second), (second, first)} & correlations.keys():
            what = f"{entry.location}: {KEY} holds '{item.strip()}'; write two outputs and a number between -1 and 1"
            raise HistoryError(f"{what}, each pair once, as in 'amplitude width -0.31; amplitude shape 0.2'")
        correlations[first, second] = replace(entry, text=number).number(f"{KEY} of {first} {second}")
    return correlations


def noise_correlation_text(correlations: Mapping[tuple[str, str], float]) -> str:
    """The text of the key, from which the same numbers are read."""
    return "; ".join(f"{first} {second} {float(value)!r}" for (first, second), value in correlations.items())


# ---- what remarks say ------------------------------------------------------------------------------------------------


_DURATION = re.compile(r"\d+(?:[.,]\d+)? ?[^\W\d_]+(?![\w/])")
_OFF = re.compile(
    r"\bcold\b|\bcooled|unload|without load|\bno load|(?:load|furnace|power|heating) (?:was |were )?(?:off|removed)"
    r"|\bkalt\b|abgekühlt|entlastet|unbelastet|ohne last|ofen (?:war )?aus|\bfroid|décharg|(?:hors|sans) charge",
    re.IGNORECASE,
)
"""Of a remark that a bar was cold or unloaded."""


_CHANGE = re.compile(
    r"rais|increas|chang|reduc|lower|decreas|\bset\b|\bstep|\bnow\b|erhöh|gesenkt|geändert|umgestellt|\bauf\b|augment"
    r"|\bport[ée]|baiss|diminu|passé|→|->",
    re.IGNORECASE,
)
_FROM = re.compile(r"(?:\b(?:from|von|de)\s+)?[\d.,]+\s*(?:°?[A-Za-z]{1,3})?\s+(?=(?:to|auf|à)\s+\d)")
"""Of a remark on a change, and what it says of before."""


def ask_of_remarks(conditions: StatedConditions, frames: TableFrames, quantity: str, value: float) -> None:
    """Ask when a quantity, of which one value is stated, was another one as remarks say.

    A reading beside such a remark was taken before a change. A pause lies in the gap before it, or in that behind it,
    by which the clock ran on.
    """
    kind = TEMPERATURE if quantity == "temperature" else conditions.terms.load_kinds[quantity]
    tolerance = TEMPERATURE_AGREEMENT if kind is TEMPERATURE else LOAD_AGREEMENT * value
    times, steps, said = frames.times, [(0.0, 0.0, value)], dict[str, str]()
    for label, text in conditions.labels.items():
        line = int(label[5:]) if label.startswith("line ") and label[5:].isdecimal() else -1
        k, found = int(np.searchsorted(frames.lines, line)), list[tuple[float, float, float]]()
        if line <= frames.lines[0]:
            continue
        stated = conditions_in_text(_FROM.sub("", text), "", conditions.terms) if _CHANGE.search(text) else ()
        for level in (value_in(one.text, kind) or value for one in stated if one.key == quantity):
            is_beside = k < times.size and frames.lines[k] == line
            early, late = times[[max(k - 1, 0), min(k, times.size - 1)]][:: -1 if is_beside else 1]
            found += [(early, late, level)] * (abs(level - steps[-1][2]) > tolerance)
        lasted = [one for one in (value_in(one, TIME) for one in _DURATION.findall(text)) if one]
        if kind is not TEMPERATURE and _OFF.search(text) and len(lasted) == 1:
            gaps = [n for n in (k, k + 1) if 0 < n < times.size and times[n] - times[n - 1] >= 0.999 * lasted[0]]
            for start in [times[n] - lasted[0] if n == k else times[n - 1] for n in gaps[:1]]:
                found += [(start, start, 0.0), (start + lasted[0], start + lasted[0], steps[-1][2])]
        steps += found
        said |= {text: frames.table.location(line)} if found else {}
    if said:
        (text, place), unit = next(iter(said.items())), next(iter(kind.units))
        what = f"'{quoted(text, 60)}' says that the {quantity} changed, and {value:.6g} {unit} is stated; when was it?"
        likely = ["; ".join(f"{time_text(one[k])} {one[2]:.6g} {unit}" for one in steps) for k in (0, 1)]
        answers = dict.fromkeys([*likely, f"0 s {value:.6g} {unit}"])
        raise conditions.question(what, f"{quantity}_steps", *answers, location=place)
