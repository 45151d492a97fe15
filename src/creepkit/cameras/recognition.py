"""Which declared format a file has: decided by the names in its head, or for files without one by their kind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from creepkit.cameras.array_files import ArrayTable, is_matlab, matlab_table
from creepkit.cameras.columns import columns_of, count_of_columns, fits
from creepkit.cameras.text_files import FRAME_FILE, FrameText, TextHead, candidate_heads, head_bytes, table_in_file
from creepkit.errors import HistoryError, quoted
from creepkit.files.reading import read_bytes
from creepkit.records.camera_format import CameraFormat
from creepkit.records.plugin_calls import only_one

FEWEST_NAMES = 4
"""Columns of a format that a file must have, of which it lacks others, for that to be said of it."""


@dataclass(frozen=True)
class Recognised:
    """A file's format, and its line of columns. chosen : whether the user named the format."""

    format: CameraFormat
    path: Path
    head: TextHead
    chosen: bool = False

    @property
    def is_text(self) -> bool:
        """Whether its columns stand in a line."""
        return self.head.number > 0

    def table(self, path: Path, *, beginning: bool = False) -> FrameText | ArrayTable:
        """The table of this or another file of the same sequence, or of text its beginning."""
        if self.is_text:
            return table_in_file(path, lambda content: self._head_in(content, path), beginning=beginning)
        return matlab_table(path)

    def _head_in(self, content: bytes, path: Path) -> TextHead:
        heads = candidate_heads(content)
        found = next((head for head in heads if fits(self.format, head.names, any_case=self.chosen)), None)
        if found is None:
            raise HistoryError(
                f"{path}: no line in it names the columns of {self.format}, as one of {self.path.name} does; is it cut "
                "off or damaged?"
            )
        different = {*found.names} ^ {*self.head.names}
        if different:
            one = quoted(sorted(different)[0])
            raise HistoryError(
                f"{found.location(path)}: its columns are not those of {self.path.name} ('{one}' stands in one of them "
                "only); all frames of a sequence must have the same"
            )
        return found


def recognise(path: Path, formats: Sequence[CameraFormat], chosen: bool) -> Recognised:
    """The one format that a file has; HistoryError for none, and for several.

    chosen : whether the one format was named by the user, so that other capitals do.
    """
    beginning = read_bytes(path, FRAME_FILE, first=32)
    if not beginning:
        raise HistoryError(f"{path}: the file is empty; a frame is a table of points")
    if is_matlab(beginning):
        formats = [one for one in formats if chosen or is_for_matlab(one)]
        heads = [TextHead(b"", 0, 0, "", tuple(matlab_table(path).names))]
    elif path.suffix.lower() == ".mat":
        raise HistoryError(f"{path}: does not begin as a MATLAB file of arrays (version 5 or 7.3) does; is it damaged?")
    else:
        formats = [one for one in formats if chosen or not is_for_matlab(one)]
        heads = list(candidate_heads(head_bytes(path)))
    for any_case in (False, True) if chosen else (False,):
        for head in heads:
            accepting = [one for one in formats if fits(one, head.names, any_case=any_case)]
            if accepting:
                one = only_one("camera format", head.location(path), accepting, "format")
                return Recognised(one, path, head, chosen)
    raise _unknown(path, heads, formats, chosen)


def is_for_matlab(format: CameraFormat) -> bool:
    """Whether a format is one of files of MATLAB alone."""
    return all(pattern.endswith(".mat") for pattern in format.patterns)


def _unknown(path: Path, heads: Sequence[TextHead], formats: Sequence[CameraFormat], chosen: bool) -> HistoryError:
    """What is said of a file that no format fits: the column that it lacks where it has most of one."""
    scored = [(count_of_columns(one, head.names), head, one) for head in heads for one in formats]
    count, head, format = max(scored, key=lambda entry: entry[0], default=(0, None, None))
    if head is not None and format is not None and count >= (1 if chosen else FEWEST_NAMES):
        columns_of(format, head.names, head.location(path))  # which says what is missing
    named = next((head for head in heads if not head.names or head.names[0][:1] not in "+-.0123456789"), None)
    listed = "" if named is None else ", ".join(quoted(name) for name in named.names[:12])
    return HistoryError(
        f"{path if named is None else named.location(path)}: no camera format has its columns "
        f"{f'(found: {quoted(listed, 300)})' if listed else '(it has none)'}; known are "
        f"{', '.join(one.name for one in formats) or 'none'}, or name the columns with "
        "format=ck.CameraFormat(...), for creepkit extract with --columns, or load a plugin with --plugin FILE.py"
    )
