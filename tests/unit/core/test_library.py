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


def test_a_missing_function_is_reported_with_the_remedy():
    with pytest.raises(CreepkitError, match="has no function creepkit_nothing .*; run 'make core'"):
        core.function("creepkit_nothing")


def test_another_library_is_named_by_an_absolute_path(monkeypatch, tmp_path, not_loaded_yet):
    for path in ("libcreepkit_core.so", tmp_path, tmp_path / "nothing.so"):
        monkeypatch.setenv("CREEPKIT_CORE", str(path))
        with pytest.raises(CreepkitError, match="which is not the absolute path of a regular file"):
            core.library()


def test_a_file_that_is_no_library_is_reported(monkeypatch, tmp_path, not_loaded_yet):
    (tmp_path / "text.so").write_text("no library")
    monkeypatch.setenv("CREEPKIT_CORE", str(tmp_path / "text.so"))
    with pytest.raises(CreepkitError, match="the compiled core of creepkit cannot be loaded: "):
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


@pytest.mark.parametrize("wanted", ["16", "3", "", "many"])
def test_other_widths_of_vectors_are_refused(monkeypatch, not_loaded_yet, wanted):
    monkeypatch.setenv("CREEPKIT_LANES", wanted)
    with pytest.raises(CreepkitError, match=f"CREEPKIT_LANES is '{wanted}'"):
        core.library()
