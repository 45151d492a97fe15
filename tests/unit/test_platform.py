"""Systems other than Linux, as far as Linux can stand in for them: what a system lacks is taken away here."""

import ast
import importlib.util
import ntpath
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tomllib
from pathlib import Path, PureWindowsPath

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from packaging.tags import mac_platforms

import creepkit as ck
from creepkit.files.writing import DEVICE_NAMES, file_stem, hashed_stem, numbered_stems
from helpers import source_tree
from helpers.paths import ROOT
from helpers.source_tree import PACKAGE

NOT_ON_WINDOWS = {"fcntl", "grp", "posix", "pty", "pwd", "resource", "syslog", "termios", "tty", "curses", "readline"}
"""Modules of the standard library that Windows lacks."""


UNIX_CALLS = (
    "fork getuid geteuid getgid getegid setsid killpg mkfifo chown lchown statvfs getloadavg sched_getaffinity pread "
    "pwrite O_NOFOLLOW O_NONBLOCK O_CLOEXEC O_DIRECTORY wait openpty nice WIFSIGNALED"
)
"""Names of the module os that Windows lacks, but for those of the test's own libraries."""

HIDDEN = """
import builtins, os, signal, sys
absent = {modules!r}
imported = builtins.__import__
def without(name, *rest, **options):
    if name.partition(".")[0] in absent:
        raise ImportError(name)
    return imported(name, *rest, **options)
for name in absent:
    sys.modules[name] = None
for module, names in ((os, {os_names!r}), (signal, {signal_names!r})):
    for name in names:
        if hasattr(module, name):
            delattr(module, name)
"""


def test_it_works_without_the_modules_that_windows_lacks(tmp_path) -> None:
    head = HIDDEN.format(
        modules=sorted(NOT_ON_WINDOWS - {"posix"}),
        os_names=sorted(set(UNIX_CALLS.split()) - {"fork"}),
        signal_names=["SIGHUP", "SIGUSR1", "SIGUSR2", "SIGALRM", "SIGPIPE", "SIGWINCH"],
    )
    program = head + (
        "from pathlib import Path\n"
        "from typer.testing import CliRunner\n"
        "from creepkit.cli.app import app\n"
        "steps = [['list', 'laws'],\n"
        "         ['surrogate', 'generate', 'norton', '--specimen', 'uniaxial', '--samples', '4',\n"
        "          '--interval', '2400', '--seed', '1', '--workers', '1', '--to', 'set.h5'],\n"
        "         ['read', 'set.h5'], ['report', 'norton', '--app', '--to', 'page.html']]\n"
        "for words in steps:\n"
        "    result = CliRunner().invoke(app, words)\n"
        "    assert result.exit_code == 0, (words, result.output, result.exception)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "set.h5").is_file()


# ---- names of files ------------------------------------------------------------------------------------------------


def is_savable(name: str) -> bool:
    """Whether Windows can save a file of this name, by the rules that Microsoft states for names."""
    is_reserved = getattr(ntpath, "isreserved", None) or (lambda one: PureWindowsPath(one).is_reserved())  # from 3.13
    reserved = is_reserved(name) or name.split(".")[0].casefold() in DEVICE_NAMES
    return not (reserved or set(name) & set('<>:"/\\|?*') or name.endswith((".", " ")) or len(name) > 200)


@given(st.text(max_size=300), st.sampled_from([".json", ".csv"]))
def test_any_text_gives_a_name_that_any_system_can_save(text, suffix) -> None:
    for stem in (file_stem(text), hashed_stem(text), *numbered_stems([text, text.upper()])):
        assert stem
        assert is_savable(stem + suffix)
        assert not any(ord(sign) < 32 for sign in stem)


# ---- terminals -----------------------------------------------------------------------------------------------------

ONCE_EACH = (
    ["--help"],
    ["list", "laws"],
    ["list", "specimens"],
    ["list", "plugins"],
    ["list", "laws", "combined"],
    ["export", "norton", "--to", "list"],
)


@pytest.mark.parametrize("encoding", ["cp1252", "ascii"])
def test_what_is_printed_fits_into_old_encodings(encoding, tmp_path) -> None:
    program = (
        "import json, sys\nfrom creepkit.cli.app import app\n"
        f"for words in {ONCE_EACH!r}:\n"
        "    try:\n        app(words)\n    except SystemExit as end:\n        assert not end.code, (words, end.code)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, "PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"},
        cwd=tmp_path,
        capture_output=True,
    )
    assert done.returncode == 0, done.stderr.decode(encoding, "replace")
    assert done.stdout.decode(encoding)


# ---- what may be missing -------------------------------------------------------------------------------------------


def extras() -> dict[str, list[str]]:
    """{extra: modules} of pyproject.toml; those for developers apart."""
    wanted = PROJECT["optional-dependencies"]
    return {name: [one.partition(">")[0] for one in wanted[name]] for name in wanted if name != "dev"}


def test_an_extra_that_is_missing_is_named_in_a_sentence(monkeypatch) -> None:
    from creepkit.jobs.worker_pools import cluster_workers

    for module in extras()["cluster"]:
        monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(ck.errors.CreepkitError, match=r"pip install 'creepkit\[cluster\]'"):
        cluster_workers(None, "tcp://127.0.0.1:1").__enter__()  # type: ignore[arg-type]


def test_only_declared_packages_are_imported() -> None:
    """What the sources import is of the standard library, declared, or of an extra."""
    declared = {one.partition(">")[0].replace("-", "_") for one in PROJECT["dependencies"]}
    declared |= {module for modules in extras().values() for module in modules}
    imported = set()
    for module in set(source_tree.modules()) - {"creepkit.files.locking"}:  # which asks for the system
        for node in ast.walk(source_tree.tree(module)):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [str(node.module)] if isinstance(node, ast.ImportFrom) else []
            imported |= {name.partition(".")[0] for name in names}
    outside = imported - set(sys.stdlib_module_names) - {"creepkit", "__future__"}
    called = {"click": "typer", "markupsafe": "jinja2", "mpmath": "sympy", "pydantic_core": "pydantic"}
    assert {{**called, "sklearn": "scikit_learn"}.get(name, name) for name in outside} <= declared


# ---- bare machine ----------------------------------------------------------------------------------------------------

# What a test needs and a bare machine lacks: it is skipped with the reason, and only there.


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


# ---- compilation -----------------------------------------------------------------------------------------------------

# How the core is compiled on other systems, as far as Linux can tell: names of the library and of the wheel.


def module_of(path):
    specification = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


COMPILATION = module_of(ROOT / "src" / "core" / "compile.py")


def test_on_windows_the_compiler_is_that_of_a_package(monkeypatch):
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.delenv("CXX", raising=False)
    assert COMPILATION.system_compiler() is None
    assert "ziglang>=0.13" in COMPILATION.requirements()


def test_pip_of_macos_takes_the_wheel(monkeypatch):
    for python, processor in (("macosx-10.9-universal2", "x86_64"), ("macosx-11.0-arm64", "arm64")):
        monkeypatch.setattr(sysconfig, "get_platform", lambda python=python: python)
        monkeypatch.setattr("platform.machine", lambda processor=processor: processor)
        wheel = module_of(ROOT / "hatch_build.py")._platform()
        assert wheel in set(mac_platforms((14, 0), processor))
        assert wheel == f"macosx_{COMPILATION.macos_version()}_{processor}".replace(".", "_")


# ---- release files ---------------------------------------------------------------------------------------------------

# What is published beside the code says the same as the code: versions, systems, steps, licence.


PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


JOBS = yaml.safe_load((ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8"))["jobs"]


def text(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def test_versions_of_python_agree_everywhere() -> None:
    listed = " ".join(PROJECT["classifiers"])
    pythons = re.findall(r"Programming Language :: Python :: (3\.\d+)", listed)
    assert PROJECT["requires-python"] == f">={pythons[0]}"
    assert JOBS["tests"]["strategy"]["matrix"]["python"] == pythons
    assert re.search(r"^PYTHONS := (.*)$", text("Makefile"), re.M)[1].split() == [f"python{one}" for one in pythons]
    assert tomllib.loads(text("pyproject.toml"))["tool"]["mypy"]["python_version"] == pythons[0]
    assert f"Python {pythons[0]}, " in text("README.md")


@pytest.mark.parametrize("name", ["CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md"])
def test_links_lead_somewhere(name: str) -> None:
    for link in re.findall(r"\]\(([^)\s]+)\)", text(name)):
        assert link.startswith("https://") or (ROOT / Path(link.partition("#")[0])).exists(), link
