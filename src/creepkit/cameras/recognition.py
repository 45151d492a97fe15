"""Which declared format a file has: decided by the names in its head, or for files without one by their kind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path

from creepkit.cameras.array_files import ArrayTable, is_matlab, matlab_table, row_table
from creepkit.cameras.columns import columns_of, count_of_columns, fits, looks_planar
from creepkit.cameras.text_files import FRAME_FILE, TextHead, candidate_heads, head_bytes
from creepkit.errors import HistoryError, quoted
from creepkit.files.reading import read_bytes
from creepkit.records.camera_format import CameraFormat


@dataclass(frozen=True)
class Recognised:
    """A file's format; and of text its line of columns. chosen : whether the user named the format."""

    format: CameraFormat
    path: Path
    head: TextHead | None = None
    chosen: bool = False

    def find_head(self, content: bytes, path: Path) -> TextHead:
        """The line of columns in the beginning of another file of the same sequence."""
        assert self.head is not None
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

    def array_table(self, path: Path) -> ArrayTable:
        """The table of a file that is no text."""
        return row_table(path, self.format.layout) if self.format.layout else matlab_table(path)


def recognise(path: Path, formats: Sequence[CameraFormat], chosen: bool) -> Recognised:
    """The one format that a file has; HistoryError for none, and for several.

    chosen : whether the one format was named by the user, so that other capitals do.
    """
    beginning = read_bytes(path, FRAME_FILE, first=32)
    if not beginning:
        raise HistoryError(f"{path}: the file is empty; a frame is a table of points")
    by_layout = [one for one in formats if one.layout and (chosen or _named_like(path, one))]
    if by_layout:
        return Recognised(_only(path, by_layout), path, None, chosen)
    if is_matlab(beginning):
        return _recognised_arrays(path, formats, chosen)
    if path.suffix.lower() == ".mat":
        raise HistoryError(f"{path}: does not begin as a MATLAB file of arrays (version 5 or 7.3) does; is it damaged?")
    return _recognised_text(path, [one for one in formats if chosen or not (one.layout or is_for_matlab(one))], chosen)


def is_for_matlab(format: CameraFormat) -> bool:
    """Whether a format is one of files of MATLAB alone."""
    return all(pattern.endswith(".mat") for pattern in format.patterns)


def _named_like(path: Path, format: CameraFormat) -> bool:
    return any(fnmatch(path.name.lower(), pattern.lower()) for pattern in format.patterns)


def _only(place: Path | str, accepting: Sequence[CameraFormat]) -> CameraFormat:
    if len(accepting) > 1:
        names = " and ".join(f"'{one.name}'" for one in accepting)
        raise HistoryError(f"{place}: the camera formats {names} both fit it; say which one with format=")
    return accepting[0]


def _recognised_arrays(path: Path, formats: Sequence[CameraFormat], chosen: bool) -> Recognised:
    candidates = [one for one in formats if chosen or is_for_matlab(one)]
    names = matlab_table(path).names
    accepting = [one for one in candidates if fits(one, names, any_case=chosen)]
    if not accepting:
        if len(candidates) == 1:
            columns_of(candidates[0], names, str(path))
        raise HistoryError(f"{path}: {_unknown(names, formats, 'arrays')}")
    return Recognised(_only(path, accepting), path, None, chosen)


def _recognised_text(path: Path, formats: Sequence[CameraFormat], chosen: bool) -> Recognised:
    content = head_bytes(path)
    for any_case in (False, True) if chosen else (False,):
        for head in candidate_heads(content):
            accepting = [one for one in formats if fits(one, head.names, any_case=any_case)]
            if accepting:
                return Recognised(_only(head.location(path), accepting), path, head, chosen)
    heads = list(candidate_heads(content))
    _explain_near_misses(path, heads, formats, chosen)
    first = next((head for head in heads if not _begins_with_number(head)), None)
    place = f"{path}" if first is None else first.location(path)
    raise HistoryError(f"{place}: {_unknown(() if first is None else first.names, formats, 'columns')}")


def _begins_with_number(head: TextHead) -> bool:
    return head.names[0][:1] in "+-.0123456789" if head.names[0] else False


def _explain_near_misses(path: Path, heads: Sequence[TextHead], formats: Sequence[CameraFormat], chosen: bool) -> None:
    """HistoryError for a line that has most columns of a format, or all of a two-dimensional one."""
    planar = next((head for head in heads if any(looks_planar(one, head.names) for one in formats)), None)
    if planar is not None:
        raise HistoryError(
            f"{planar.location(path)}: a table of a two-dimensional correlation, which has no out-of-plane "
            "displacement; export a stereo one, or name x, y, u and v alone with format=ck.CameraFormat(...)"
        )
    scored: list[tuple[int, TextHead, CameraFormat]] = [
        (count_of_columns(one, head.names), head, one) for head in heads for one in formats
    ]
    best = max(scored, key=lambda entry: entry[0], default=None)
    if best is not None and best[0] >= (1 if chosen else 4):
        columns_of(best[2], best[1].names, best[1].location(path))


def _unknown(names: Sequence[str], formats: Sequence[CameraFormat], what: str) -> str:
    listed = ", ".join(quoted(name) for name in names[:12])
    found = f"(found: {quoted(listed, 300)})" if listed else "(it has none)"
    known = ", ".join(one.name for one in formats)
    return (
        f"no camera format has its {what} {found}; known are {known or 'none'}, or name the columns with "
        "format=ck.CameraFormat(...), for creepkit extract with --columns, or load a plugin with --plugin FILE.py"
    )
