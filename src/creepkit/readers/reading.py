"""Files, folders and patterns to histories, whichever reader accepts them; and the built-in readers."""

from __future__ import annotations

import gc
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import partial
from glob import glob
from pathlib import Path
from typing import Any, cast

from creepkit.errors import SAID, HistoryError, quoted, restated
from creepkit.files.delimited_text import refuse_unprintable
from creepkit.files.reading import read_bytes
from creepkit.hookspecs import hookimpl
from creepkit.readers.creep_schema_json import CREEP_SCHEMA
from creepkit.readers.history_csv import HISTORY_CSV, TEXT_SUFFIXES
from creepkit.readers.indexed_folders import INDEXED_FILES, INDEXED_TABLE
from creepkit.readers.questions import ANSWERS_FILE, collected, raise_all
from creepkit.readers.spreadsheets import SPREADSHEET, read_sheets
from creepkit.readers.tests_file import answers_of, read_answers
from creepkit.readers.tests_in_rows import TEST_TABLE
from creepkit.readers.text_files import TABLE_FILE
from creepkit.readers.vocabulary import HeaderVocabulary
from creepkit.records import History, Reader, accepts_path, histories_in
from creepkit.records.plugin_calls import named_one, only_one


@hookimpl
def creepkit_readers() -> list[Reader]:
    """Return the built-in readers."""
    return [INDEXED_TABLE, INDEXED_FILES, CREEP_SCHEMA, TEST_TABLE, HISTORY_CSV, SPREADSHEET]


GENERAL_READERS: tuple[tuple[str, ...], ...] = ((HISTORY_CSV.name, SPREADSHEET.name), (TEST_TABLE.name,))
"""Readers that get only the files that no other reader wants, the most general ones first: they accept every file of
their format; a table of tests with frames beside it is an index."""


PathsLike = str | Path | Iterable[str | Path]


def read_histories(
    paths: PathsLike, readers: Sequence[Reader], reader: str | None = None, ignore: Collection[str] = ()
) -> list[History]:
    """Read the histories in files, folders and glob patterns, in the order given and sorted within each.

    reader : the name of the reader to use; None asks each of `readers` which files it accepts. `csv` and `xlsx`
    accept every file of their format, and so get only those that no other reader wants. A folder is read as a whole
    when a reader accepts it, else file by file. What is reached twice is kept once; tests of one name get the name of
    their folder in front. ignore : columns that are left out wherever they stand.
    """
    if reader is not None:
        readers = [named_one("reader", reader, readers)]
    readers = [reader_without(ignore, one) for one in readers] if ignore else readers
    read: dict[tuple[str, str], tuple[Path, History]] = {}
    errors = list[HistoryError]()
    for path in _existing_paths(paths):
        for source in readable_paths(path, readers):
            found = collected(errors, partial(_histories_of, source, readers))
            for history in found or ():
                _check_printable(history, source)
                read.setdefault((history.source or str(source), history.name), (source, history))
    raise_all(errors)
    histories = _with_unique_names(list(read.values()))
    for folder in {path if path.is_dir() else path.parent for path, _ in read.values()}:
        raise_all(_ends_of_nothing(folder))
    return histories


def _ends_of_nothing(folder: Path) -> Iterator[HistoryError]:
    """Texts under `ended` in the answers of a folder that stand in none of its files."""
    file = folder / ANSWERS_FILE
    for pattern, answers in read_answers(file).items() if file.is_file() else ():
        ended = answers["ended"] if isinstance(answers.get("ended"), dict) else {}
        files = [path for path in sorted(folder.glob("*")) if path.is_file() and fnmatchcase(path.name, pattern)]
        texts = [*map(_text_of, files)] if ended else []
        for key in ended:
            plain = " ".join(key.casefold().removeprefix("()").split())
            if texts and not any(plain in text for text in texts):
                what = f"'{quoted(key)}' stands in no file of that name"
                yield HistoryError(f'{file}: ["{quoted(pattern)}"] ended: {what}; correct or remove it')


def _text_of(path: Path) -> str:
    """The words of a file, its name and those of its sheets included, in small letters."""
    if SPREADSHEET.accepts(path):
        words = [text for one in read_sheets(path) for row in one.rows for text in (one.sheet, *row.cells)]
    else:
        content = read_bytes(path, TABLE_FILE)
        words = [content.decode(one, "replace") for one in ("utf-8", "utf-16", "cp1252")]
    return " ".join(" ".join([path.stem, *words]).casefold().split())


def _histories_of(source: Path, readers: Sequence[Reader]) -> list[History]:
    """The histories of a file; its millions of cells are not looked through for cycles, half of the time it takes."""
    reader, was_on = _reader_of(source, answered_readers(source, readers)), gc.isenabled()
    gc.disable()
    try:
        return histories_in(reader, source)
    finally:
        if was_on:
            gc.enable()


def answered_readers(path: Path, readers: Sequence[Reader]) -> Sequence[Reader]:
    """The readers with what the file of answers beside a path says of it."""
    answers = answers_of(path)
    return [_with_vocabulary(one, answers.added_to) for one in readers] if any(answers) else readers


def _check_printable(history: History, path: Path) -> None:
    """Refuse texts of a test that would steer a terminal, as those of a document with escapes may."""
    for text in (history.name, history.alloy, *history.labels, *history.labels.values(), *history.geometry):
        refuse_unprintable(text, lambda _: str(path))


def reader_without(ignored: Collection[str], reader: Reader) -> Reader:
    """The reader that leaves columns out, where its laboratory's names are declared; the same one where they are not.

    ignored : names of columns as they are written, or but for capitals and unit.
    """
    if not all(str(name).strip() for name in ignored):
        raise HistoryError(f"ignore is {quoted(repr(ignored), 60)}; give names of columns, such as ['load_kN', 'date']")
    return _with_vocabulary(reader, lambda vocabulary: replace(vocabulary, ignored=tuple(ignored)))


def _with_vocabulary(reader: Reader, changed: Callable[[HeaderVocabulary], HeaderVocabulary]) -> Reader:
    vocabulary = getattr(reader, "vocabulary", None)
    if not hasattr(reader, "__dataclass_fields__") or not isinstance(vocabulary, HeaderVocabulary):
        return reader
    return cast(Reader, replace(cast(Any, reader), vocabulary=changed(vocabulary)))


def _existing_paths(paths: PathsLike) -> list[Path]:
    """The paths that exist, with `~` and patterns expanded, each once."""
    path_list = [paths] if isinstance(paths, (str, Path)) else list(paths)
    if not path_list:
        raise HistoryError("no file, folder or pattern was given to read histories from")
    results: dict[Path, None] = {}
    for item in path_list:
        path = Path(item).expanduser()
        matches = (
            [path] if path.exists() else [Path(match) for match in sorted(glob(str(path))) if Path(match).exists()]
        )
        if not matches and path.is_symlink():
            raise HistoryError(f"{path}: is a link to {path.readlink()}, which does not exist; name the file itself")
        if not matches:
            raise HistoryError(f"{path}: no such file or folder, and no file matches it as a pattern")
        results.update(dict.fromkeys(matches))
    return list(results)


def readable_paths(path: Path, readers: Sequence[Reader]) -> list[Path]:
    """The paths to read: the path itself, or the files in a folder that no reader accepts as a whole."""
    if path.is_file() or any(accepts_path(reader, path) for reader in readers):
        return [path]
    if not path.is_dir():
        what = "is no regular file but a device, a pipe or the like" if path.exists() else "no such file or folder"
        raise HistoryError(f"{path}: {what}; name a file or a folder")
    with restated(OSError, HistoryError, f"{path}: the folder cannot be read ({SAID}); name another one"):
        entries = sorted(path.iterdir())
    visible = [file for file in entries if file.is_file() and file.name[0] != "."]
    visible = [file for file in visible if file.name != ANSWERS_FILE]
    files = [file for file in visible if any(accepts_path(reader, file) for reader in answered_readers(file, readers))]
    return files or [path]


def _reader_of(path: Path, readers: Sequence[Reader]) -> Reader:
    """The one reader for a path; a reader that is the only one is not asked."""
    if len(readers) == 1:
        return readers[0]
    accepting = [reader for reader in readers if accepts_path(reader, path)]
    for general in GENERAL_READERS:
        if len(accepting) > 1:
            accepting = [reader for reader in accepting if reader.name not in general]
    if not accepting and path.suffix.lower() in TEXT_SUFFIXES:  # whose error says what it lacks
        accepting = [reader for reader in readers if reader.name == HISTORY_CSV.name]
    if not accepting and path.is_dir():
        raise HistoryError(
            f"{path}: the folder holds no file of tests; put tables there (.csv, .txt, .xlsx), or name one"
        )
    if not accepting:
        raise HistoryError(f"{path}: no reader understands it; known are {', '.join(one.name for one in readers)}")
    return only_one("reader", path, accepting, "reader")


def _with_unique_names(read: Sequence[tuple[Path, History]]) -> list[History]:
    """The histories with names of their own: the folder's name in front where a name comes twice."""
    counts = Counter(history.name for _, history in read)
    histories = [
        h.replace(name=f"{(p if p.is_dir() else p.absolute().parent).name}/{h.name}") if counts[h.name] > 1 else h
        for p, h in read
    ]
    seen: dict[str, str] = {}
    for history in histories:
        if history.name in seen:
            both = f"{seen[history.name]} and {history.source}"
            raise HistoryError(f"two tests are called '{history.name}', in {both}; rename one of them")
        seen[history.name] = history.source
    return histories
