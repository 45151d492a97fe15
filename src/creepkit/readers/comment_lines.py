"""The `# key: value` lines of a table: above it those of its head, below its first row comments."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from creepkit.errors import HistoryError, quoted
from creepkit.files.delimited_text import ERROR_VALUES, Dialect
from creepkit.readers.table_limits import refuse_many
from creepkit.readers.text_tables import SourceText
from creepkit.readers.vocabulary import plain_name

DECIMAL_SIGNS: Mapping[str, str] = {".": ".", ",": ",", "point": ".", "comma": ","}
"""What `# decimal:` may say."""


BEFORE_COMMENT = frozenset(' \t"\ufeff#/')
"""Characters with which a comment may begin."""


def is_comment(line: str) -> bool:
    """Whether a line, or the first cell of a row, is a comment."""
    text = line.lstrip(' \t"\ufeff')
    return text.startswith(("#", "//")) and not text.startswith(ERROR_VALUES)


def entry_of(line: str) -> tuple[str, bool, str]:
    """Key, whether there is a colon, and text of a comment, which a spreadsheet may have put in quotes."""
    text = line.strip().strip("\ufeff")
    if text.startswith('"') and text.endswith('"'):
        text = text[1:-1].replace('""', '"')
    key, colon, value = text.lstrip("#/").partition(":")
    return key.strip(), bool(colon), value.strip()


def stated_decimal(path: Path, head: Sequence[str]) -> str | None:
    """The decimal sign that `# decimal:` states in a head."""
    for number, line in enumerate(head, 1):
        key, colon, text = entry_of(line)
        if colon and plain_name(key) == "decimal":
            sign = text if text in DECIMAL_SIGNS else text.rstrip(";,\t ")
            if sign not in DECIMAL_SIGNS:
                raise HistoryError(f"{path}:{number}: decimal is '{quoted(text)}'; allowed: point, comma")
            return DECIMAL_SIGNS[sign]
    return None


def head_entries(path: Path, lines: Sequence[str], names: Sequence[str], dialect: Dialect) -> dict[str, SourceText]:
    """The `# key: value` lines; a comment without a colon is a remark.

    A spreadsheet writes them with an empty cell for each further column; these cells are cut off.
    """
    padding = dialect.delimiter * (len(names) - 1)
    comments = [line.rstrip(" ") for line in lines if line.strip()]
    is_padded = len(names) > 1 and all(line.endswith(padding) for line in comments)
    header: dict[str, SourceText] = {}
    for number, line in enumerate(lines, 1):
        key, colon, text = entry_of(line.rstrip(" ").removesuffix(padding) if is_padded else line)
        if not colon or plain_name(key) == "decimal":
            continue
        if key in header:
            first = header[key].location.rpartition(":")[2]
            raise HistoryError(f"{path}:{number}: '{key}' was already given in line {first}; keep one of them")
        header[key] = SourceText(text, f"{path}:{number}", dialect.decimal)
        refuse_many(f"{path}:{number}", 0, len(header))
    return header


def late_entries(
    path: Path, comments: Iterable[tuple[int, str]], dialect: Dialect
) -> list[tuple[int, str, SourceText]]:
    """Line, key and entry of the `# key: value` lines among comments."""
    found = ((line, *entry_of(comment)) for line, comment in comments)
    return [(k, key, SourceText(text, f"{path}:{k}", dialect.decimal)) for k, key, colon, text in found if colon]
