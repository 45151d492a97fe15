"""Texts, lists and comments of a study file that is written for somebody."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from textwrap import wrap

CITATION_LINE = '# citation = "authors (year), title, doi"  # of published data: the methods text cites it'
"""In the table [data]."""


def quoted(text: str) -> str:
    """A text as TOML holds it."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def quoted_list(texts: Iterable[str]) -> str:
    """Texts as a list of TOML."""
    return f"[{', '.join(map(quoted, texts))}]"


def one_line(text: str) -> str:
    """A text without what cannot be seen, of bounded length."""
    return "".join(character if character.isprintable() else "?" for character in text)[:200]


def comment(text: str) -> str:
    """A text as a comment of one line."""
    return f"# {one_line(text)}"


def comments(text: str) -> list[str]:
    """A text as comments of several lines, each of at most 118 characters but for longer words."""
    whole = "".join(character if character.isprintable() else "?" for character in text)[:2000]
    return [f"# {line}" for line in wrap(whole, 116, break_long_words=False, break_on_hyphens=False)]


def study_part(folder: Path) -> list[str]:
    """The beginning of a study file, with the table [study]."""
    return [
        "# A study: from measured files to a report. Carry it out: creepkit run study.toml",
        "# Paths are relative to this file. All tables but [data] may be left out; units stand in names of keys.",
        "",
        "[study]",
        f"title = {quoted(one_line(folder.absolute().name) or 'creep study')}  # say what it is about",
        "seed = 0  # of all random draws",
    ]
