"""What unit tests share."""

from collections.abc import Iterator
from pathlib import Path

import pytest


@pytest.fixture
def own_registry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A test that is a process of its own: a new registry, and an empty folder to work in."""
    from creepkit.registry import default_registry

    monkeypatch.chdir(tmp_path)
    default_registry.cache_clear()
    yield
    default_registry.cache_clear()
