"""What a test needs and a bare machine lacks: it is skipped with the reason, and only there."""

import os
import shutil
import subprocess
import sys

import pytest

import creepkit as ck
from helpers.compilers import COMPILERS, compiler_or_skip
from helpers.source_tree import PACKAGE


def test_a_missing_compiler_skips_the_test_that_asks_for_it(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    for command in COMPILERS:
        with pytest.raises(pytest.skip.Exception, match=f"{command.replace('+', '.')} is not installed"):
            compiler_or_skip(command)


def test_simulation_needs_no_compiler_of_the_machine(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert shutil.which("gcc") is None
    loading = ck.constant_stress(100.0, "stress")
    run = ck.simulate("norton", "uniaxial", {"A": 1e-16, "n": 4.0}, loading=loading, times=[1e5])
    assert run.outputs["strain"][0] == pytest.approx(1e-3, rel=1e-4)


COMPILE_CORE = PACKAGE.parent / "core" / "compile.py"


def _compile_core(path, *options):
    """Run on a machine whose only programs lie in the folder `path`, and whose Python has no packages."""
    environment = {key: value for key, value in os.environ.items() if key != "CXX"} | {"PATH": str(path)}
    command = [sys.executable, "-S", "-E", COMPILE_CORE, *options]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


def test_a_machine_without_tools_is_told_which_packages_compile_the_core(tmp_path):
    run = _compile_core(tmp_path, "--requirements")
    assert [line.partition(">=")[0] for line in run.stdout.split()] == ["ziglang", "cmake", "ninja"]


def test_a_missing_tool_is_named_in_one_sentence_before_anything_is_compiled(tmp_path):
    for tool, missing in (
        ("make", "cmake is missing; install it"),
        ("cmake", "no C++ compiler (c++, g++, clang++) is installed, nor the Python package ziglang"),
    ):
        (tmp_path / tool).symlink_to(sys.executable)  # any program: it is not run
        run = _compile_core(tmp_path)
        assert run.returncode == 1
        assert run.stderr.startswith(f"the core of creepkit cannot be compiled: {missing}")
        assert run.stderr.count("\n") == 1
