"""Compiled code has one folder for each state of the sources."""

import os

import pytest

from creepkit import cli


@pytest.fixture
def sources(tmp_path, monkeypatch):
    """A package of one compiled file, and an empty cache."""
    (tmp_path / "package" / "fem").mkdir(parents=True)
    monkeypatch.setattr(cli, "_SOURCES", tmp_path / "package")
    monkeypatch.setenv("CREEPKIT_CACHE", str(tmp_path / "cache"))
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    source = tmp_path / "package" / "fem" / "band.py"
    source.write_text("a = 1")
    return source


def test_an_edit_moves_the_folder_and_its_undoing_moves_it_back(sources):
    first = cli.numba_cache_folder()
    sources.write_text("a = 2")
    assert cli.numba_cache_folder() != first
    sources.write_text("a = 1")
    assert cli.numba_cache_folder() == first


def test_a_folder_that_was_chosen_stays(sources, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", "elsewhere")
    cli.set_numba_cache()
    assert os.environ["NUMBA_CACHE_DIR"] == "elsewhere"


def test_the_oldest_states_are_forgotten(sources):
    made = cli.numba_cache_folder().parent
    for k in range(5):
        (made / str(k)).mkdir(parents=True)
        os.utime(made / str(k), (k, k))
    cli.set_numba_cache()
    assert os.environ["NUMBA_CACHE_DIR"] == str(cli.numba_cache_folder())
    assert {path.name for path in made.iterdir()} == {"2", "3", "4", cli.numba_cache_folder().name}
