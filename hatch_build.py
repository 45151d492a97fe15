"""The part of the build that hatchling does not know: compile the core, and name the wheel after the platform.

The core is compiled twice: as a library of this platform, and in WebAssembly for interactive pages.

The library is loaded by ctypes, so one wheel serves every version of Python: py3-none-PLATFORM.
"""

from __future__ import annotations

import importlib.util
import shutil
import sys
import sysconfig
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

ROOT = Path(__file__).parent


def _compilation() -> Any:
    """The module src/core/compile.py, which is no part of the package."""
    specification = importlib.util.spec_from_file_location("compile_core", ROOT / "src" / "core" / "compile.py")
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def _platform() -> str:
    """As the name of a wheel has it."""
    name = sysconfig.get_platform()
    if name.startswith("macosx"):
        compilation = _compilation()
        name = f"macosx-{compilation.macos_version()}-{compilation.macos_processor()}"
    return name.replace("-", "_").replace(".", "_")


class CoreBuildHook(BuildHookInterface):
    """Compile the core before a wheel is written: in place for an editable one, else into the wheel."""

    def dependencies(self) -> list[str]:
        """Packages that the compilation needs on this machine."""
        return list(_compilation().requirements())

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile; `version` is "editable" or "standard"."""
        compilation = _compilation()
        build, wheel = ROOT / "build" / "core", ROOT / "build" / "wheel"
        try:
            if version == "editable":
                compilation.compile_core(build)
                page_core = compilation.compile_page_core(build)
            else:
                library = compilation.compile_core(build, wheel)
                build_data["force_include"][str(library)] = f"creepkit/core/{library.name}"
                page_core = compilation.compile_page_core(build, wheel)
                if page_core:
                    build_data["force_include"][str(page_core)] = f"creepkit/app/{page_core.name}"
            if not page_core:
                self.app.display_warning(compilation.NO_PAGE_CORE)
        except compilation.CompilationError as error:
            sys.exit(str(error))
        build_data["tag"], build_data["pure_python"] = f"py3-none-{_platform()}", False

    def clean(self, versions: list[str]) -> None:
        """Remove what was compiled."""
        for name in ("core", "wheel", "sanitize"):
            shutil.rmtree(ROOT / "build" / name, ignore_errors=True)
