"""What a test needs and a bare machine lacks: it is skipped with the reason, and only there."""

import shutil

import pytest

import creepkit as ck
from helpers import compilers
from helpers.compilers import COMPILERS, compiler_or_skip, skipped_without_need
from helpers.paths import NO_SHARED_DATA, SHARED


def test_a_missing_compiler_skips_the_test_that_asks_for_it(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    for command in COMPILERS:
        with pytest.raises(pytest.skip.Exception, match=f"{command.replace('+', '.')} is not installed"):
            compiler_or_skip(command)


def test_a_skip_is_needless_where_the_compiler_is_there(monkeypatch):
    monkeypatch.setattr(compilers.shutil, "which", lambda command: "/usr/bin/gcc" if command == "gcc" else None)
    reasons = ["Skipped: gcc is not installed", "Skipped: gfortran is not installed", "Skipped: no time today"]
    assert skipped_without_need(reasons) == [reasons[0], reasons[2]]


def test_a_skip_for_data_is_needless_where_they_are_there():
    assert skipped_without_need([f"Skipped: {NO_SHARED_DATA}"]) == [f"Skipped: {NO_SHARED_DATA}"] * SHARED.is_dir()


def test_simulation_needs_no_compiler_of_the_machine(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert shutil.which("gcc") is None
    loading = ck.constant_stress(100.0, "stress")
    run = ck.simulate("norton", "uniaxial", {"A": 1e-16, "n": 4.0}, loading=loading, times=[1e5])
    assert run.outputs["strain"][0] == pytest.approx(1e-3, rel=1e-4)
