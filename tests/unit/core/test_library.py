"""Which library is loaded, and what is said of one that does not fit."""

import pytest

from creepkit import core
from creepkit.errors import CreepkitError


@pytest.fixture
def not_loaded_yet():
    """As in a new process."""
    core.library.cache_clear()
    yield
    core.library.cache_clear()


def test_the_library_beside_the_sources_has_their_interface(monkeypatch, not_loaded_yet):
    monkeypatch.delenv("CREEPKIT_CORE", raising=False)
    assert core.library().creepkit_core_version() == core.INTERFACE_VERSION


def test_a_library_of_other_sources_is_refused(monkeypatch, not_loaded_yet):
    monkeypatch.setattr(core, "INTERFACE_VERSION", 0)
    with pytest.raises(CreepkitError, match=r"has interface \d+, but this Python code needs 0 .*; run 'make core'"):
        core.library()


def test_every_width_of_vectors_up_to_the_processors_can_be_chosen(monkeypatch, not_loaded_yet):
    monkeypatch.delenv("CREEPKIT_LANES", raising=False)
    most = core.library().creepkit_core_lanes()
    assert most in (2, 4, 8)
    for lanes in (2, 4, 8):
        core.library.cache_clear()
        monkeypatch.setenv("CREEPKIT_LANES", str(lanes))
        if lanes <= most:
            assert core.library().creepkit_core_lanes() == lanes
        else:
            with pytest.raises(CreepkitError, match=f"CREEPKIT_LANES is '{lanes}', but .* {most} numbers at most"):
                core.library()
