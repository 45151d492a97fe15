"""Remarks that say that a test did not break, beside a time at which it is said to have broken.

How a test ended is read of `ended` (`status`) alone. A remark is a label; one that says `run-out` beside a rupture time
would make a rupture of a test that never broke, so that it is refused until `ended` says which of both holds.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from creepkit.errors import HistoryError, quoted

UNBROKEN_WORDS = (
    *("stopped", "runout", "run-out", "run out", "discontinued", "interrupted", "unbroken"),
    *("censored", "running", "in progress", "unruptured", "not ruptured", "not broken"),
    *("läufer", "durchläufer", "ungebrochen", "nicht gebrochen", "kein bruch", "ohne bruch", "abgebrochen"),
    *("gestoppt", "ausgebaut", "läuft", "läuft noch"),
)
"""What `ended` may say, in small letters, of a test that did not break."""


_PHRASES = re.compile(
    r"\b(?:stopped|run[- ]?outs?|unbroken|unfailed|unruptured|censored|discontinued|suspended"
    r"|(?:not|never|didn't|did not|without|no)(?: yet| a| any)? (?:ruptured?|break|broken?|fail(?:ed|ure)?|fractured?)"
    r"|(?:durch)?läufer|ungebrochen|(?:nicht|kein|keine|keinen|ohne)(?: ge)? ?br(?:ochen|uch)|abgebrochen|gestoppt"
    r"|läuft noch)\b"
)


def unbroken_words(text: str) -> str:
    """The words of a remark by which a test did not break; "" where there are none."""
    plain = " ".join(text.casefold().split())
    if plain.strip(" .!()") in UNBROKEN_WORDS:
        return text.strip()
    found = _PHRASES.search(plain)
    return found[0] if found else ""


def refuse_unbroken(labels: Mapping[str, str], rupture_key: str, location: str) -> None:
    """HistoryError where a label says that a test did not break, which `rupture_key` has as broken."""
    for label, text in labels.items():
        if label != "assumed" and (words := unbroken_words(text)):
            raise HistoryError(
                f"{location}: '{quoted(label)}' says '{quoted(words)}', and '{rupture_key}' makes it a test that "
                "ruptured then; state which holds: name the column 'status', or add one, with 'stopped' or 'ruptured' "
                "(above frames: '# ended: ruptured', or 'stopped' without the time)"
            )
