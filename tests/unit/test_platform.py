"""Systems other than Linux, as far as Linux can stand in for them: what a system lacks is taken away here."""

import ast
import ntpath
import os
import subprocess
import sys
from pathlib import PureWindowsPath

import pytest
from hypothesis import given
from hypothesis import strategies as st

import creepkit as ck
from creepkit.files.file_names import DEVICE_NAMES, file_stem, hashed_stem, numbered_stems
from helpers import source_tree
from helpers.paths import ROOT

NOT_ON_WINDOWS = {"fcntl", "grp", "posix", "pty", "pwd", "resource", "syslog", "termios", "tty", "curses", "readline"}
"""Modules of the standard library that Windows lacks."""


ONLY_UNIX_CALLS = {
    "os": {
        "fork", "getuid", "geteuid", "getgid", "getegid", "setsid", "killpg", "mkfifo", "chown", "lchown", "statvfs",
        "getloadavg", "sched_getaffinity", "uname", "pread", "pwrite", "O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC",
        "O_DIRECTORY", "sysconf", "wait", "openpty", "nice", "WIFSIGNALED",
    },
    "signal": {"SIGHUP", "SIGKILL", "SIGWINCH", "SIGUSR1", "SIGUSR2", "SIGALRM", "SIGPIPE", "alarm", "pthread_kill"},
    "selectors": {"DefaultSelector", "PollSelector", "EpollSelector"},
}  # fmt: skip
"""Names that Windows lacks, or, of selectors, that wait for sockets only there."""

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


def unguarded(node, guards=()):
    """Names of the module `os` and `signal` that Windows lacks, in code that does not ask for them."""
    if isinstance(node, ast.If | ast.IfExp):
        guards = (*guards, ast.dump(node.test))
    module = node.value.id if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) else ""
    if module and node.attr in ONLY_UNIX_CALLS.get(module, ()) and not any(node.attr in guard for guard in guards):
        yield f"{module}.{node.attr}", node.lineno
    for child in ast.iter_child_nodes(node):
        yield from unguarded(child, guards)


@pytest.mark.parametrize("absent", [sorted(NOT_ON_WINDOWS - {"posix"})], ids=["as on Windows"])
def test_it_works_without_the_modules_that_windows_lacks(absent, tmp_path) -> None:
    head = HIDDEN.format(
        modules=absent,
        os_names=sorted(ONLY_UNIX_CALLS["os"] - {"sysconf", "uname", "fork"}),  # of the test's own libraries
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


@given(st.lists(st.sampled_from(["Norton", "norton", "NORTON", "a/b", "a:b", "CON", "con", "x.", "x", "norton-2"])))
def test_names_differ_by_more_than_case(texts) -> None:
    names = numbered_stems(texts)
    assert len({name.casefold() for name in names}) == len(texts)
    hashed = [hashed_stem(text, others=texts) for text in dict.fromkeys(texts)]
    assert len({name.casefold() for name in hashed}) == len(hashed)


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
    import tomllib

    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wanted = project["optional-dependencies"]
    return {name: [one.partition(">")[0] for one in wanted[name]] for name in wanted if name != "dev"}


def cluster(tmp_path):
    from creepkit.jobs.worker_pools import cluster_workers

    return lambda: cluster_workers(None, "tcp://127.0.0.1:1").__enter__()  # type: ignore[arg-type]


USES = {"cluster": cluster}


@pytest.mark.parametrize("extra", sorted(USES))
def test_an_extra_that_is_missing_is_named_in_a_sentence(extra, tmp_path, monkeypatch) -> None:
    use = USES[extra](tmp_path)
    for module in extras()[extra]:
        monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(ck.errors.CreepkitError, match=rf"pip install 'creepkit\[{extra}\]'"):
        use()


def test_only_declared_packages_are_imported() -> None:
    """What the sources import is of the standard library, declared, or of an extra."""
    import tomllib

    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    declared = {one.partition(">")[0].replace("-", "_") for one in project["dependencies"]}
    declared |= {module for modules in extras().values() for module in modules}
    imported = set()
    for module in set(source_tree.modules()) - {"creepkit.files.locking"}:  # which asks for the system
        for node in ast.walk(source_tree.tree(module)):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [str(node.module)] if isinstance(node, ast.ImportFrom) else []
            imported |= {name.partition(".")[0] for name in names}
    outside = imported - set(sys.stdlib_module_names) - {"creepkit", "__future__"}
    indirect = {"click": "typer", "markupsafe": "jinja2", "mpmath": "sympy", "pydantic_core": "pydantic"}
    assert {indirect.get(name, name) for name in outside} <= declared
