"""How the core is compiled on other systems, as far as Linux can tell: names of the library and of the wheel."""

import importlib.util
import re
import shutil
import subprocess
import sys
import sysconfig

import pytest
from packaging.tags import mac_platforms

from creepkit.core import LIBRARY_NAMES
from helpers.paths import ROOT


def module_of(path):
    specification = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


COMPILATION = module_of(ROOT / "src" / "core" / "compile.py")


def test_the_library_has_one_name_for_its_compilation_and_for_its_use():
    assert COMPILATION.LIBRARY_NAMES == LIBRARY_NAMES


@pytest.mark.skipif(shutil.which("cmake") is None or shutil.which("make") is None, reason="needs cmake and make")
def test_cmake_gives_the_library_of_windows_that_name(gxx, tmp_path):
    """The rules of CMake for Windows, with the machine's compiler, which is not called to link."""
    options = {
        "SYSTEM_NAME": "Windows",
        "SYSTEM_PROCESSOR": "AMD64",
        "CXX_COMPILER": gxx,
        "CXX_COMPILER_WORKS": "1",
        "RC_COMPILER": sys.executable,
    }
    words = ["cmake", "-S", ROOT / "src" / "core", "-B", tmp_path, "-G", "Unix Makefiles"]
    words += [f"-DCMAKE_{name}={value}" for name, value in options.items()]
    run = subprocess.run([*words, f"-DCREEPKIT_OUTPUT={tmp_path}"], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
    (link,) = tmp_path.rglob("creepkit_core.dir/link.txt")
    assert f"-o {LIBRARY_NAMES['win32']} " in re.sub(r"-o \S*/", "-o ", link.read_text(encoding="utf-8"))


def test_on_windows_the_compiler_is_that_of_a_package(monkeypatch):
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.delenv("CXX", raising=False)
    assert COMPILATION.system_compiler() is None
    assert "ziglang>=0.13" in COMPILATION.requirements()


@pytest.mark.parametrize(
    ("python", "processor"),
    [
        ("macosx-10.9-universal2", "arm64"),
        ("macosx-10.9-universal2", "x86_64"),
        ("macosx-10.13-universal2", "x86_64"),
        ("macosx-11.0-arm64", "arm64"),
        ("macosx-12.3-arm64", "arm64"),
    ],
)
def test_pip_of_macos_takes_the_wheel(monkeypatch, python, processor):
    monkeypatch.setattr(sysconfig, "get_platform", lambda: python)
    monkeypatch.setattr("platform.machine", lambda: processor)
    wheel = module_of(ROOT / "hatch_build.py")._platform()
    assert wheel in set(mac_platforms((14, 0), processor))
    assert wheel == f"macosx_{COMPILATION.macos_version()}_{processor}".replace(".", "_")
