"""Compile the core: `python src/core/compile.py`, which needs nothing but Python and what it asks for.

The compiler is CXX, or else the first of c++, g++ and clang++ that the machine has, or else, and always on Windows, the
one in the package `ziglang`, which also compiles what interactive pages compute with, for WebAssembly. CMake and Ninja
come from the packages of their names where the machine has none. `--requirements` prints those packages that are
wanted, and missing from the machine.

`hatch_build.py` calls this file when pip installs creepkit or builds a wheel of it, `make core` when sources changed.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import os
import platform
import shlex
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

SOURCES = Path(__file__).parent
ROOT = SOURCES.parents[1]
IN_PLACE = SOURCES.parent / "creepkit" / "core"
COMPILERS = ("c++", "g++", "clang++")
LIBRARY_NAMES = {"darwin": "libcreepkit_core.dylib", "win32": "creepkit_core.dll"}
LIBRARY_NAME = LIBRARY_NAMES.get(sys.platform, "libcreepkit_core.so")
PAGE_FOLDER, PAGE_NAME = SOURCES.parent / "creepkit" / "app", "creepkit_core.wasm"
PAGE_MEMORY = 64 * 2**20  # bytes; webassembly/memory.cpp takes 56 MiB of them
PAGE_OPTIONS = (
    *("-target", "wasm32-wasi", "-mexec-model=reactor", "-std=c++17", "-O2", "-msimd128", "-fvisibility=hidden"),
    *("-Wall", "-Wextra", "-fno-math-errno", "-fno-trapping-math", "-fno-exceptions", "-fno-rtti", "-nostdlib++"),
    *("-Wl,--gc-sections", "-Wl,--export-dynamic", "-Wl,--strip-all", "-Wl,-z,stack-size=1048576"),
    *(f"-Wl,--initial-memory={PAGE_MEMORY}", f"-Wl,--max-memory={PAGE_MEMORY}"),
)


class CompilationError(Exception):
    """The core cannot be compiled; the message is one sentence that says what is missing and what to do."""


NO_PAGE_CORE = "interactive pages will not compute: run 'pip install ziglang', then 'make core'"


def requirements() -> list[str]:
    """The packages to install before the core can be compiled, beside what the machine has."""
    wanted = ["ziglang>=0.13"]  # the one compiler of WebAssembly; of the library too where there is no other
    if shutil.which("cmake") is None:
        wanted.append("cmake>=3.20")
    if shutil.which("make") is None and shutil.which("ninja") is None:
        wanted.append("ninja>=1.10")
    return wanted


def system_compiler() -> list[str] | None:
    """Command of the machine's C++ compiler; None where there is none."""
    if os.environ.get("CXX"):
        return shlex.split(os.environ["CXX"])
    if sys.platform == "win32":  # other compilers bring libraries of their own, which a wheel would have to hold
        return None
    paths = filter(None, map(shutil.which, COMPILERS))
    return next(([path] for path in paths), None)


def compile_core(build: Path, output: Path = IN_PLACE, sanitize: bool = False) -> Path:
    """Compile what changed since the last time and return the library's path.

    build : folder of object files, made if needed. output : folder of the library.
    sanitize : with checks of addresses and of undefined behaviour.
    """
    cmake, compiler = _tool("cmake"), system_compiler()
    _keep_cache_in(build)
    generator = ["Unix Makefiles"]
    if shutil.which("make") is None or sys.platform == "win32":
        generator = ["Ninja", f"-DCMAKE_MAKE_PROGRAM={_tool('ninja')}"]
    options = ["-G", *generator]
    options += [
        f"-DCMAKE_CXX_COMPILER={';'.join(compiler or _zig())}",
        f"-DCREEPKIT_OUTPUT={output.resolve().as_posix()}",
        f"-DCREEPKIT_SANITIZE={'ON' if sanitize else 'OFF'}",
        "-DCMAKE_BUILD_TYPE=Release",
    ]
    if sys.platform == "darwin":
        options.append(f"-DCMAKE_OSX_DEPLOYMENT_TARGET={macos_version()}")
    _remove_other_configuration(build, generator[0], shutil.which((compiler or _zig())[0]) or "")
    _run([cmake, "-S", str(SOURCES), "-B", str(build), *options])
    _run([cmake, "--build", str(build), "--parallel", str(os.cpu_count() or 1)])
    library = output / LIBRARY_NAME
    if not library.is_file():
        raise CompilationError(f"the core of creepkit cannot be compiled: {library} was not written")
    return library


def compile_page_core(build: Path, output: Path = PAGE_FOLDER) -> Path | None:
    """Compile what a page computes with, where sources changed; None where the package ziglang is not installed.

    build : folder of object files. output : folder of the file.
    """
    program, file = _zig_program(), output / PAGE_NAME
    if program is None:
        return None
    parts = ("surface_observation.cpp", "time_interpolation.cpp", "lanes/gaussian_fit.cpp")
    sources = [*sorted((SOURCES / "webassembly").glob("*.cpp")), *(SOURCES / part for part in parts)]
    newest = max(path.stat().st_mtime for path in [Path(__file__), *SOURCES.rglob("*.?pp")])
    if not (file.is_file() and file.stat().st_mtime >= newest):
        _keep_cache_in(build)
        output.mkdir(parents=True, exist_ok=True)
        _run([program, "c++", *PAGE_OPTIONS, "-I", str(SOURCES), "-o", str(file), *map(str, sources)])
    return file


def _keep_cache_in(build: Path) -> None:
    """Tell the compiler of ziglang where to keep what it compiles of its own."""
    for name in ("ZIG_GLOBAL_CACHE_DIR", "ZIG_LOCAL_CACHE_DIR"):
        os.environ.setdefault(name, str(build.resolve() / "zig"))


def macos_version() -> str:
    """The oldest macOS that the library is compiled for: that of this Python, at least 11.0 on Apple silicon."""
    major, minor = sysconfig.get_platform().split("-")[1].split(".")[:2]
    if macos_processor() == "arm64":
        major = str(max(int(major), 11))
    return f"{major}.{minor if major == '10' else 0}"  # from 11 on, names of wheels have no second number but 0


def macos_processor() -> str:
    """The kind of processor that the library is compiled for; a Python of macOS may serve two."""
    name = sysconfig.get_platform().split("-")[2]
    return platform.machine() if name == "universal2" else name


def _remove_other_configuration(build: Path, generator: str, compiler: str) -> None:
    """Remove a folder that was configured for another generator, compiler or clone: CMake can change none of them."""
    cache = build / "CMakeCache.txt"
    if cache.is_file():
        lines = cache.read_text(encoding="utf-8", errors="replace").splitlines()
        values = dict(line.split("=", 1) for line in lines if "=" in line and not line.startswith(("#", "//")))
        entries = {name.partition(":")[0]: value for name, value in values.items()}
        used = shutil.which(entries.get("CMAKE_CXX_COMPILER", ""))
        if (
            entries.get("CMAKE_GENERATOR") != generator
            or entries.get("CMAKE_HOME_DIRECTORY") != SOURCES.resolve().as_posix()
            or not used
            or not compiler
            or not os.path.samefile(used, compiler)
        ):
            shutil.rmtree(build)


def _tool(name: str) -> str:
    """Path of cmake or ninja: the machine's, or the one in the package of that name."""
    path = shutil.which(name) or shutil.which(name, path=str(Path(sys.executable).parent))
    if path is None and importlib.util.find_spec(name):
        package = importlib.import_module(name)
        folder = package.CMAKE_BIN_DIR if name == "cmake" else package.BIN_DIR
        path = shutil.which(name, path=folder)
    if path is None:
        raise CompilationError(
            f"the core of creepkit cannot be compiled: {name} is missing; install it, or run 'pip install {name}'"
        )
    return path


def _zig() -> list[str]:
    """Command of the compiler in the package `ziglang`: C++ without its standard library, for any such processor."""
    program = _zig_program()
    if program is None:
        raise CompilationError(
            f"the core of creepkit cannot be compiled: no C++ compiler ({', '.join(COMPILERS)}) is installed, nor the "
            "Python package ziglang, which has one; install a compiler, run 'pip install ziglang', or install "
            "creepkit from a wheel"
        )
    return [program, "cc", "-mcpu=baseline"]


def _zig_program() -> str | None:
    """Path of the compiler in the package `ziglang`."""
    package = importlib.util.find_spec("ziglang")
    if package is None or package.origin is None:
        return None
    return str(Path(package.origin).with_name("zig.exe" if sys.platform == "win32" else "zig"))


def _run(command: list[str]) -> None:
    """Run it; what it printed is shown when it fails."""
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace")
    if done.returncode:
        sys.stderr.write(done.stdout)
        raise CompilationError(
            f"the core of creepkit cannot be compiled: '{' '.join(command[:3])} ...' failed as printed above; it needs "
            "a compiler of C++17, GCC or Clang, or none at all and 'pip install ziglang'"
        )
    if "warning" in done.stdout:
        sys.stderr.write(done.stdout)


def main() -> int:
    """Compile, or print what is required."""
    parser = argparse.ArgumentParser(description="compile the core of creepkit")
    parser.add_argument("--requirements", action="store_true", help="print the packages that compiling needs")
    parser.add_argument("--sanitize", action="store_true", help="with checks at run time, into build/sanitize")
    arguments = parser.parse_args()
    try:
        if arguments.requirements:
            print("\n".join(requirements()))
        elif arguments.sanitize:
            print(compile_core(ROOT / "build" / "sanitize", ROOT / "build" / "sanitize", sanitize=True))
        else:
            print(compile_core(ROOT / "build" / "core"))
            if compile_page_core(ROOT / "build" / "core") is None:
                print(NO_PAGE_CORE, file=sys.stderr)
    except CompilationError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
