"""Files that a report carries: how they stand in its HTML, and how they are read from it again.

Each is compressed by zlib and written in base64 into a script element of a type that no browser executes. A manifest
in JSON stands before them: names, sizes and sha256 of the contents. Reading trusts nothing but what agrees with it.
"""

from __future__ import annotations

import base64
import binascii
import hashlib
import json
import re
import unicodedata
import zlib
from collections.abc import Iterable, Sequence
from pathlib import Path, PurePosixPath

from creepkit.errors import ReportError, quoted
from creepkit.files.json_documents import parse_json
from creepkit.files.reading import FileKind, read_text
from creepkit.reports.contents import Attachment

REPORT_FILE = FileKind(
    "a report", ReportError, "give a report.html that creepkit wrote from a study", maximum_bytes=100_000_000
)


MOST_ATTACHMENTS = 10_000
"""Files in one report."""


LARGEST_ATTACHMENT, LARGEST_TOTAL = 50_000_000, 200_000_000
"""Bytes of one file, and of all files of a report, before compression."""


LONGEST_NAME = 400
"""Characters of a name."""


LARGEST_NUMBER = 2**53
"""Above it, a number of bytes is no size."""


DEVICES = re.compile(r"(con|prn|aux|nul|com[0-9\u00b9\u00b2\u00b3]|lpt[0-9\u00b9\u00b2\u00b3])( *\.|$)", re.IGNORECASE)
"""Names that mean a device on Windows, whatever follows their first dot."""


_FORMAT = "creepkit-attachments"
_VERSION = 1
_MANIFEST_START = '<script type="application/json" id="creepkit-attachments">'
_CONTENT_START = '<script type="application/x-creepkit-attachment" data-number="'
_END = "</script>"
_MANIFEST = re.compile(re.escape(_MANIFEST_START) + r"([^<]*)" + re.escape(_END))
_CONTENT = re.compile(re.escape(_CONTENT_START) + r'([0-9]{1,5})">([A-Za-z0-9+/=]*)' + re.escape(_END))


def embed(attachments: Sequence[Attachment]) -> str:
    """HTML that holds files: a manifest, then one element each; "" for none. `read_attachments` reads it.

    ReportError for names that could lie outside a folder, or occur twice, and for files that are too large.
    """
    if not attachments:
        return ""
    problem = problem_of_names([a.name for a in attachments]) or _problem_of_sizes(
        [(a.name, len(a.content)) for a in attachments]
    )
    if problem:
        raise ReportError(f"the report cannot hold its files: {problem}")
    files = [
        {"name": a.name, "bytes": len(a.content), "sha256": hashlib.sha256(a.content).hexdigest()} for a in attachments
    ]
    document = json.dumps({"format": _FORMAT, "version": _VERSION, "files": files}, sort_keys=True)
    # in JSON these may be written as numbers; so no name ends the element or begins a comment in it
    manifest = document.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
    parts = [f"{_MANIFEST_START}{manifest}{_END}"]
    for number, attachment in enumerate(attachments):
        encoded = base64.b64encode(zlib.compress(attachment.content, 9)).decode("ascii")
        parts.append(f'{_CONTENT_START}{number}">{encoded}{_END}')
    return "\n".join(parts) + "\n"


def read_attachments(path: str | Path) -> dict[str, bytes]:
    """{name: content} of the files that a report carries, in their order.

    Names are relative POSIX paths without `..`, so that each lies below the folder into which it is written.
    ReportError, in one sentence, for a file that is no report, a report without files, and anything that does not agree
    with the manifest: numbers, names, sizes, sha256.
    """
    source = Path(path)
    text = read_text(source, REPORT_FILE)
    manifests = _MANIFEST.findall(text)
    if not manifests and _MANIFEST_START not in text and _CONTENT_START not in text:
        raise ReportError(
            f"{source}: holds no files of a study; a report holds them where 'creepkit run study.toml' wrote it"
        )
    if len(manifests) != 1 or text.count(_MANIFEST_START) != 1:
        raise _damaged(source, f"it has {text.count(_MANIFEST_START)} lists of files in place of one")
    files = _listed_files(manifests[0], source)
    contents = _CONTENT.findall(text)
    if len(contents) != len(files) or text.count(_CONTENT_START) != len(files):
        raise _damaged(source, f"it lists {len(files)} files and holds {text.count(_CONTENT_START)}")
    if [int(number) for number, _ in contents] != list(range(len(files))):
        raise _damaged(source, "its files do not stand in the order of its list")
    return {
        name: _decoded(encoded, name, size, digest, source)
        for (name, size, digest), (_, encoded) in zip(files, contents, strict=True)
    }


def _listed_files(manifest: str, source: Path) -> list[tuple[str, int, str]]:
    """(name, bytes, sha256) of the files in the manifest."""
    document = parse_json(manifest, f"{source}: its list of files", REPORT_FILE)
    if not isinstance(document, dict) or set(document) != {"format", "version", "files"}:
        raise _damaged(source, "its list of files has other keys than format, version and files")
    if document["format"] != _FORMAT or document["version"] != _VERSION or isinstance(document["version"], bool):
        raise ReportError(
            f"{source}: its files are of version '{quoted(document['version'], 20)}' of the format, and this creepkit "
            f"reads version {_VERSION}; run the study again with this creepkit, or use the one that wrote the report"
        )
    listed = document["files"]
    if not isinstance(listed, list) or not listed:
        raise _damaged(source, "its list names no file")
    files: list[tuple[str, int, str]] = []
    for entry in listed:
        if not isinstance(entry, dict) or set(entry) != {"name", "bytes", "sha256"}:
            raise _damaged(source, "an entry of its list has other keys than name, bytes and sha256")
        name, size, digest = entry["name"], entry["bytes"], entry["sha256"]
        whole = isinstance(size, int) and not isinstance(size, bool) and 0 <= size <= LARGEST_NUMBER
        hexadecimal = isinstance(digest, str) and re.fullmatch("[0-9a-f]{64}", digest) is not None
        if not isinstance(name, str) or not whole or not hexadecimal:
            raise _damaged(source, "an entry of its list is not a name, a number of bytes and a sha256")
        files.append((name, size, digest))
    problem = problem_of_names([name for name, _, _ in files]) or _problem_of_sizes(
        [(name, size) for name, size, _ in files]
    )
    if problem:
        raise _damaged(source, problem)
    return files


def _decoded(encoded: str, name: str, size: int, digest: str, source: Path) -> bytes:
    """The content of one file; never more than one byte beyond its stated size is decompressed."""
    decompressor = zlib.decompressobj()
    try:
        content = decompressor.decompress(base64.b64decode(encoded, validate=True), size + 1)
    except (binascii.Error, zlib.error):
        raise _damaged(source, f"'{name}' cannot be decompressed") from None
    whole = decompressor.eof and not decompressor.unused_data and len(content) == size
    if not whole or hashlib.sha256(content).hexdigest() != digest:
        raise _damaged(source, f"'{name}' is not the file whose size and sha256 are listed")
    return content


def _problem_of_sizes(sizes: Sequence[tuple[str, int]]) -> str:
    if len(sizes) > MOST_ATTACHMENTS:
        return f"there are {len(sizes)} files, and at most {MOST_ATTACHMENTS} are allowed"
    for name, size in sizes:
        if size > LARGEST_ATTACHMENT:
            return f"'{name}' has {size / 1e6:.4g} MB, and at most {LARGEST_ATTACHMENT / 1e6:g} are allowed"
    total = sum(size for _, size in sizes)
    if total > LARGEST_TOTAL:
        return f"its files have {total / 1e6:.4g} MB together, and at most {LARGEST_TOTAL / 1e6:g} are allowed"
    return ""


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


def _damaged(source: Path, problem: str) -> ReportError:
    return ReportError(f"{source}: its files cannot be trusted: {problem}; use the report as creepkit wrote it")
