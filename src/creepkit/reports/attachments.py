"""Files that a report carries: a zip archive, in base64 in a script element of a type that no browser executes."""

from __future__ import annotations

import base64
import io
import re
import unicodedata
import zipfile
import zlib
from collections.abc import Iterable, Sequence
from pathlib import Path, PurePosixPath

from creepkit.errors import ReportError, quoted
from creepkit.files.reading import FileKind, read_text
from creepkit.reports.contents import Attachment

REPORT_FILE = FileKind(
    "a report", ReportError, "give a report.html that creepkit wrote from a study", maximum_bytes=100_000_000
)


MOST_ATTACHMENTS, LARGEST_TOTAL = 10_000, 200_000_000
"""Files in one report, and their bytes before compression."""


LONGEST_NAME = 400
"""Characters of a name."""


DEVICES = re.compile(r"(con|prn|aux|nul|com[0-9\u00b9\u00b2\u00b3]|lpt[0-9\u00b9\u00b2\u00b3])( *\.|$)", re.IGNORECASE)
"""Names that mean a device on Windows, whatever follows their first dot."""


_START, _END = '<script type="application/zip" id="creepkit-attachments">', "</script>"


def embed(attachments: Sequence[Attachment]) -> str:
    """HTML that holds files; "" for none. `read_attachments` reads it.

    ReportError for names that could lie outside a folder, or occur twice, and for files that are too large.
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
    if len(files) > MOST_ATTACHMENTS:
        return f"there are {len(files)} files, and at most {MOST_ATTACHMENTS} are allowed"
    if total > LARGEST_TOTAL:
        return f"its files have {total / 1e6:.4g} MB together, and at most {LARGEST_TOTAL / 1e6:g} are allowed"
    return problem_of_names([name for name, _ in files])


def problem_of_names(names: Iterable[str]) -> str:
    """Why these names cannot be written below one folder on every system; "" where they can."""
    seen: set[PurePosixPath] = set()
    folders: set[PurePosixPath] = set()
    for name in names:
        problem = problem_of_name(name)
        if problem:
            return problem
        path = PurePosixPath(same_name(name))
        if path in seen:
            return f"the name '{quoted(name)}' occurs twice"
        seen.add(path)
        folders.update(path.parents)
    clash = sorted(str(path) for path in seen & folders)
    return f"'{quoted(clash[0])}' is a file and a folder" if clash else ""


def same_name(name: str) -> str:
    """What two names share that are one file on some system: upper and lower case, and accents, as one."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", name).casefold())


def problem_of_name(name: str) -> str:
    """Why a name is not a plain relative POSIX path, as a clause; "" where it is one."""
    if len(name) > LONGEST_NAME:
        return f"the name '{quoted(name)}' has {len(name)} characters, and at most {LONGEST_NAME} are allowed"
    parts = name.split("/")
    plain = (
        name.isprintable()  # no control characters, no marks that turn the direction of writing, no lone surrogates
        and "\\" not in name
        and not re.match("[A-Za-z]:", name)  # a drive
        and all(part not in ("", ".", "..") for part in parts)
        and all(len(part.encode("utf-8", "replace")) <= 255 for part in parts)
        and not any(part.startswith((".", "-", "~")) or part.endswith((".", " ")) for part in parts)
        and not any(DEVICES.match(part) for part in parts)
    )
    return "" if plain else f"the name '{quoted(name)}' is not a plain path below a folder, such as data/test_1.csv"
