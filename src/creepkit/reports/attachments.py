"""Files that a report carries: a zip archive, in base64 in a script element of a type that no browser executes."""

from __future__ import annotations

import base64
import io
import re
import zipfile
import zlib
from collections.abc import Iterable, Sequence
from pathlib import Path

from creepkit.errors import ReportError, quoted
from creepkit.files.reading import FileKind, read_text
from creepkit.reports.contents import Attachment

REPORT_FILE = FileKind(
    "a report", ReportError, "give a report.html that creepkit wrote from a study", maximum_bytes=100_000_000
)


LARGEST_TOTAL = 200_000_000
"""Bytes of all files before compression."""


_PART = r"(?![.~-])[^\\/:*?\"<>|]{1,200}(?<![. ])"
PLAIN_NAME = re.compile(f"{_PART}(/{_PART})*")
"""A relative path that lies below a folder on every system."""


_START, _END = '<script type="application/zip" id="creepkit-attachments">', "</script>"


def embed(attachments: Sequence[Attachment]) -> str:
    """HTML that holds files; "" for none. `read_attachments` reads it.

    ReportError for names that could lie outside a folder, and for files that are too large.
    """
    if not attachments:
        return ""
    problem = _problem([(one.name, len(one.content)) for one in attachments])
    if problem:
        raise ReportError(f"the report cannot hold its files: {problem}")
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as packed:
        for one in attachments:  # of no date, so that the same files are the same page
            packed.writestr(zipfile.ZipInfo(one.name), one.content, zipfile.ZIP_DEFLATED, 9)
    return f"{_START}{base64.b64encode(archive.getvalue()).decode('ascii')}{_END}\n"


def read_attachments(path: str | Path) -> dict[str, bytes]:
    """{name: content} of the files that a report carries, in their order.

    Names are relative POSIX paths without `..`, so that each lies below the folder into which it is written.
    ReportError, in one sentence, for a file that is no report, a report without files, and damaged files.
    """
    source = Path(path)
    text = read_text(source, REPORT_FILE)
    if _START not in text:
        raise ReportError(
            f"{source}: holds no files of a study; a report holds them where 'creepkit run study.toml' wrote it"
        )
    encoded = text.partition(_START)[2].partition(_END)[0]
    try:
        with zipfile.ZipFile(io.BytesIO(base64.b64decode(encoded, validate=True))) as packed:
            listed = packed.infolist()
            problem = _problem([(one.filename, one.file_size) for one in listed])
            if not problem:
                return {one.filename: packed.open(one).read(one.file_size) for one in listed}
    except (ValueError, EOFError, NotImplementedError, RuntimeError, zipfile.BadZipFile, zlib.error):
        problem = "they are damaged"
    raise ReportError(f"{source}: its files cannot be trusted: {problem}; use the report as creepkit wrote it")


def _problem(files: Sequence[tuple[str, int]]) -> str:
    """Why files of these names and sizes cannot be carried; "" where they can."""
    total = sum(size for _, size in files)
    if total > LARGEST_TOTAL:
        return f"its files have {total / 1e6:.4g} MB together, and at most {LARGEST_TOTAL / 1e6:g} are allowed"
    return problem_of_names(name for name, _ in files)


def problem_of_names(names: Iterable[str]) -> str:
    """Why one of these names is not a plain relative POSIX path, as a clause; "" where all are."""
    odd = [quoted(name) for name in names if not (name.isprintable() and PLAIN_NAME.fullmatch(name))]
    return f"the name '{odd[0]}' is not a plain path below a folder, such as data/test_1.csv" if odd else ""
