"""Files that a report carries: what was embedded is read back, and nothing else."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from creepkit.errors import ReportError
from creepkit.reports.attachments import embed, read_attachments
from creepkit.reports.contents import Attachment

FILES = (
    Attachment("study.toml", b"title = '</script><script>alert(1)</script>'\n"),
    Attachment("data/test 1 & <b>2</b>.csv", bytes(range(256)) * 40),
    Attachment("data/Prüfung_β.csv", b""),
)


def page(tmp_path: Path, html: str) -> Path:
    path = tmp_path / "report.html"
    path.write_text(f"<!DOCTYPE html><title>t</title><p>text</p>{html}", encoding="utf-8")
    return path


def test_what_was_embedded_is_read_back(tmp_path: Path) -> None:
    assert read_attachments(page(tmp_path, embed(FILES))) == {a.name: a.content for a in FILES}


def test_no_name_or_content_ends_its_element() -> None:
    html = embed(FILES)
    assert html.count("<script") == html.count("</script>") == 1 + len(FILES)
    assert re.sub(r"</?script[^>]*>", "", html).count("<") == 0


def test_other_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ReportError, match="holds no files of a study"):
        read_attachments(page(tmp_path, ""))
    with pytest.raises(ReportError, match="no such file"):
        read_attachments(tmp_path / "none.html")
    with pytest.raises(ReportError, match="is a folder"):
        read_attachments(tmp_path)
    assert embed([]) == ""
