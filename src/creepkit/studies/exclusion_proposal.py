"""What a proposed study leaves out of the tests: suspect frames and copies, and further tests as comments."""

from __future__ import annotations

from creepkit.quality import FRAME_FLAG_KINDS, DataQuality
from creepkit.quality.flags import frame_ranges_text
from creepkit.records import SECONDS_PER_HOUR
from creepkit.studies.toml_text import comments, one_line, quoted

MOST_REMARKS = 20
"""Files that were not read, and flags, that the comments name."""


def left_out_lines(quality: DataQuality) -> list[str]:
    """What is left out of the tests: of each its suspect frames with their kind, and copies of other tests."""
    flags = [one for one in quality if one.kind in FRAME_FLAG_KINDS]
    lines = [f"left out of {one.history}: {frame_ranges_text(one.frames)} ({one.kind}: {one.reason})" for one in flags]
    lines += [f"left out: {one.history} ({one.reason})" for one in quality if one.kind == "copy"]
    more = len(lines) - MOST_REMARKS
    return [*lines[:MOST_REMARKS], *([f"left out: parts of {more} more tests"] if more > 0 else [])]


def exclude_part(quality: DataQuality) -> list[str]:
    """Copies of tests, left out; proposals for other suspect tests, as comments.

    Suspect frames are left out by [data] suspect_frames.
    """
    copies = [one for one in quality if one.kind == "copy"]
    lines = []
    flags = [one for one in quality if len(one.tests) == 1 and one.kind not in ("copy", *FRAME_FLAG_KINDS)]
    for flag in flags[:MOST_REMARKS]:
        lines += [*comments(str(flag)), "# [[exclude]]", f"# test = {quoted(one_line(flag.history))}"]
        if flag.frames:
            text = frame_ranges_text(flag.frames).partition(" ")[2]
            lines.append(f"# frames = {quoted(text)}")
        elif flag.time is not None:
            lines.append(f"# from_h = {flag.time / SECONDS_PER_HOUR:.6g}")
        lines += [f"# reason = {quoted(flag.kind)}", "#"]
    if copies:
        tables = [
            ["[[exclude]]", f"test = {quoted(one_line(one.history))}", f"reason = {quoted(one_line(one.reason))}"]
            for one in copies
        ]
        return [*(line for table in tables for line in (*table, "")), *lines][:-1]
    if not lines:
        return ["# [[exclude]]", '# test = "name of a test"', '# frames = "97-191, 193"', '# reason = "why"']
    return lines[:-1]
