"""A study to run, and pages that cost no time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from helpers.study_runs import study_in


@pytest.fixture
def plain_pages(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages with their attachments and failures alone: what else they show takes seconds."""
    from creepkit.reports import html, report
    from creepkit.reports.attachments import embed

    def page(contents: Any) -> str:
        return f"<p>{[one.stage for one in contents.failures]}</p>{embed(contents.attachments)}"

    for module in (html, report):
        monkeypatch.setattr(module, "report_html", page)


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """A study of two alloys, A at 750 C and B at 850 C, of two tests each."""
    return study_in(tmp_path)
