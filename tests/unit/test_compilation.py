"""How the core is compiled on other systems, as far as Linux can tell: names of the library and of the wheel."""

import importlib.util
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
