"""Files of another user, for tests that run as one user alone."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from creepkit.files import owners


def give_to_another_user(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Have a file or folder that is there count as one of a user who is neither this one nor root."""
    place, is_ours = path.lstat().st_ino, owners.is_ours
    monkeypatch.setattr(owners, "is_ours", lambda status: status.st_ino != place and is_ours(status))
    monkeypatch.setattr(owners, "_owner_of_new_files", lambda folder: None)
    monkeypatch.setattr(owners, "_user_name", lambda number: "mallory")


HAS_OWNERS = pytest.mark.skipif(not hasattr(os, "geteuid"), reason="files have no owners here")
