"""Modules, settings and programs that lie beside the data, and data that are named where code is expected."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import sysconfig
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import packages_distributions
from pathlib import Path

from killed_runs import data_set, planted_tests

from execution_attempts.canaries import LIMIT, Attempt, Control, Found, creepkit, judged, left, planted, run

MODULES, NAMED = "Modules beside the data", "Data named where code is expected"
OWN_BEFORE_US = {"creepkit", "sitecustomize", "usercustomize"}
"""What `python -m creepkit` without -P takes from the working folder, or may, before a line of creepkit runs."""

NETWORK = ("--hidden", "4", "--layers", "1", "--epochs", "1")
COMMANDS = {
    "generate": (
        "surrogate",
        "generate",
        "norton",
        "--specimen",
        "uniaxial",
        "--samples",
        "8",
        "--to",
        "m.h5",
        "--workers",
        "2",
    ),
    "screen": (
        "identify",
        "tests",
        "--by",
        "alloy",
        "--law",
        "norton",
        "--dense",
        "none",
        "--to",
        "screened",
        "--workers",
        "2",
    ),
    "sweep": ("surrogate", "sweep", "data.h5", "--to", "nets", *NETWORK),
    "train": ("surrogate", "train", "data.h5", "--to", "n.safetensors", *NETWORK),
    "identify": ("identify", "tests", "--law", "norton", "--starts", "1", "--to", "identified"),
    "run": ("run", "study.toml"),
    "report": ("report", "fit.json", "--tests", "tests", "--to", "page.html"),
    "app": ("app", "fit.json", "tests", "--to", "app.html"),
    "export": ("export", "fit.json", "--to", "c"),
    "predict": ("predict", "fit.json", "tests", "--plot", "p.svg"),
    "confirm": ("confirm", "fit.json", "tests"),
    "read": ("read", "tests", "--plot", "read.svg"),
    "data": ("data", "data.h5", "--plots", "pictures"),
    "simulate": ("simulate", "norton", "--set", "A=1e-16", "--set", "n=4", "--stress", "60", "--end-h", "10"),
    "check": ("check", "norton"),
    "laws": ("list", "laws", "norton"),
    "plugins": ("plugins",),
}
SHORT = ("generate", "read")
TOLD_APART = ("generate", "screen", "report", "predict", "export", "check", "plugins")
"""Commands of the further ways to start: those with workers, with files of matplotlib, and with modules by name."""

REFUSED = {
    "--plugin x.csv": ("--plugin", "x.csv", "list", "laws"),
    "--plugin without suffix": ("--plugin", "plain", "list", "laws"),
    "--plugin of a folder": ("--plugin", "tests", "list", "laws"),
    "--plugin of a pickle": ("--plugin", "data.pkl", "list", "laws"),
    "--plugin of a module's name": ("--plugin", "json", "list", "laws"),
    "check x.csv": ("check", "x.csv"),
    "check without suffix": ("check", "plain"),
    "check of a shared library": ("check", "x.so"),
    "simulate ./plain": ("simulate", "./plain", "--set", "A=1", "--end-h", "1"),
    "identify --law x.csv": ("identify", "tests", "--law", "x.csv"),
    "identify --reader plain": ("identify", "tests", "--law", "norton", "--reader", "plain"),
    "export --to plain": ("export", "fit.json", "--to", "plain"),
    "simulate --specimen plain": ("simulate", "norton", "--set", "A=1", "--specimen", "plain", "--end-h", "1"),
    "app plain": ("app", "plain", "--to", "p.html"),
    "run plain": ("run", "plain"),
}
NAMES_FIRST = {
    "check norton, a file": ("check", "norton"),
    "laws norton, a file": ("list", "laws", "norton"),
    "specimens bulge, a file": ("list", "specimens", "bulge"),
    "identify --law norton, a file": ("identify", "tests", "--law", "norton", "--starts", "1", "--to", "by_name"),
}
SETTINGS = "backend: module://planted_backend\ntext.usetex: True\nsavefig.directory: .\n"
"""Of matplotlib, which reads this file in the working folder."""

PROGRAMS = ("python", "python3", "gcc", "cc", "gfortran", "g++", "node", "latex", "dvipng", "git", "xdg-open", "ld")


def every_module() -> list[str]:
    """The names of all modules of Python itself and of all that is installed."""
    names = {*sys.stdlib_module_names, *packages_distributions(), "sitecustomize", "usercustomize", "norton"}
    return sorted(name for name in names if name.isidentifier() and name not in sys.builtin_module_names)


def prepare(folder: Path, short: bool) -> None:
    """Data of all kinds, without anything planted; tests alone in the short form."""
    planted_tests(folder)
    (folder / "first").mkdir()
    if short:
        return
    data_set(folder)
    text = '[data]\nfiles = ["tests"]\n[identification]\nlaws = ["norton"]\n[report]\nfile = "report.html"\n'
    (folder / "study.toml").write_text(text)
    fitted = ("identify", "tests/A60.csv", "tests/A80.csv", "tests/A110.csv", "--law", "norton", "--starts", "1")
    done = run(creepkit(*fitted, "--no-sums", "--to", "first"), folder)
    (result,) = [path for path in (folder / "first").rglob("*.json") if "ranking" not in path.name] or [None]
    if result is None:
        raise RuntimeError(done.problem)
    shutil.copy(result, folder / "fit.json")


def plant(folder: Path, without: set[str], kind: str = "module") -> None:
    """Modules of every name beside the data, matplotlib's settings, and programs by the names of compilers."""
    source = planted(folder)
    for name in {*every_module()} - without:
        if kind == "module":
            (folder / f"{name}.py").write_text(source)
        else:
            (folder / name).mkdir(exist_ok=True)
            (folder / name / "__init__.py").write_text(source)
    for place in (folder / "tests", folder / "first"):
        for name in ("json", "numpy", "creepkit", "sitecustomize", "conftest", "torch"):
            (place / f"{name}.py").write_text(source)
    (folder / "planted_backend.py").write_text(source)
    (folder / "matplotlibrc").write_text(SETTINGS)
    (folder / "planted.pth").write_text(f"import os; {source}")
    for name in PROGRAMS:
        if not (folder / name).exists():
            (folder / name).write_text(f"#!/bin/sh\necho {name} >> '{folder / 'executed_canary'}'\n")
            (folder / name).chmod(0o755)


def taken_by_python(variables: dict[str, str]) -> set[str]:
    """The modules that `python -m` has imported, from the working folder if they lie there, before it runs one."""
    with tempfile.TemporaryDirectory(prefix="attempts_") as scratch:
        folder = Path(scratch)
        (folder / "started.py").write_text("import sys; print(*(name.partition('.')[0] for name in sys.modules))")
        return {*run([sys.executable, "-m", "started"], folder, variables).output.split()} | OWN_BEFORE_US


def forms(short: bool) -> Iterator[tuple[str, list[str], set[str], dict[str, str]]]:
    """How the command is started: name, words, modules that are not planted for it, variables."""
    script = Path(sysconfig.get_path("scripts")) / "creepkit"
    if script.exists():
        yield "creepkit", [str(script)], set(), {}
    if short and script.exists():
        return
    yield "python -P -m creepkit", [sys.executable, "-P", "-m", "creepkit"], set(), {}
    yield "python -m creepkit", [sys.executable, "-m", "creepkit"], taken_by_python({}), {}
    path = os.environ.get("PYTHONPATH", "")
    relative = {"PYTHONPATH": os.pathsep.join([*([path] if path else []), "", "."])}
    yield "python -m, '.' in PYTHONPATH", [sys.executable, "-m", "creepkit"], taken_by_python(relative), relative


@contextmanager
def folder_of_data(short: bool) -> Iterator[Path]:
    """A folder with data of all kinds."""
    with tempfile.TemporaryDirectory(prefix="attempts_") as scratch:
        folder = Path(scratch).resolve()
        prepare(folder, short)
        yield folder


def served(words: list[str], folder: Path, variables: dict[str, str]) -> tuple[str, str]:
    """Outcome of `app` as a server, asked for its page and ended by Ctrl-C."""
    import urllib.request

    process = subprocess.Popen(
        [*words, "app", "fit.json", "tests", "--no-browser"], cwd=folder, env={**os.environ, **variables},
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        if "http" in line:
            urllib.request.urlopen(line[line.index("http") :].strip(), timeout=LIMIT).read()
            time.sleep(2.0)  # it prepares answers
        process.send_signal(signal.SIGINT)
        _, problem = process.communicate(timeout=LIMIT)
    finally:
        if process.poll() is None:
            process.kill()
    if said := left(folder):
        return "executed", said[:300]
    if "http" not in line or "Traceback" in problem:
        return "traceback", problem[-400:]
    return "harmless", ""


def attempts(short: bool) -> Found:
    """All commands in folders of planted modules, and data that are named as code."""
    with folder_of_data(short) as clean:
        for number, (name, words, without, variables) in enumerate(forms(short)):
            first = number == 0
            for kind in ("module", "package") if first and not short else ("module",):
                with tempfile.TemporaryDirectory(prefix="attempts_") as scratch:
                    folder = Path(scratch).resolve() / "data"
                    shutil.copytree(clean, folder)
                    plant(folder, without, kind)
                    for command, arguments in COMMANDS.items():
                        if command not in (SHORT if short else COMMANDS if first else TOLD_APART):
                            continue
                        outcome, detail = judged(run([*words, *arguments], folder, variables), folder, refused=False)
                        yield Attempt(MODULES, name, outcome, f"{command}, {kind}: {detail}")
                    if not short and first and kind == "module":
                        outcome, detail = served(words, folder, variables)
                        yield Attempt(MODULES, name, outcome, f"app as a server: {detail}")
        yield from _named(clean, short)
        yield from _controls(clean)


def _named(clean: Path, short: bool) -> Found:
    with tempfile.TemporaryDirectory(prefix="attempts_") as scratch:
        folder = Path(scratch).resolve() / "data"
        shutil.copytree(clean, folder)
        source = planted(folder)
        for name in ("x.csv", "plain", "norton", "bulge", "csv", "c"):
            (folder / name).write_text(source)
        _write_pickle(folder / "data.pkl", folder)
        (folder / "x.so").write_bytes(b"\x7fELF")
        for name, words in {**REFUSED, **NAMES_FIRST}.items():
            if short and name not in ("--plugin x.csv", "check norton, a file"):
                continue
            outcome, detail = judged(run(creepkit(*words), folder), folder, refused=name in REFUSED)
            yield Attempt(NAMED, name, outcome, detail)


def _write_pickle(path: Path, folder: Path) -> None:
    """A pickle that makes the canary when it is loaded."""
    from execution_attempts.pickles import pickle_that_runs

    path.write_bytes(pickle_that_runs(folder))


def _controls(clean: Path) -> Found:
    """Processes that import from their working folder, run files whatever their name, and load pickles."""
    with tempfile.TemporaryDirectory(prefix="attempts_") as scratch:
        folder = Path(scratch).resolve() / "data"
        shutil.copytree(clean, folder)
        plant(folder, set())
        _write_pickle(folder / "data.pkl", folder)
        run([sys.executable, "-c", "import json"], folder)
        yield Control(MODULES, "`python -c 'import json'` in the folder", 1, int(bool(left(folder))))
        run([sys.executable, "-m", "creepkit", "laws"], folder)
        yield Control(MODULES, "`python -m creepkit` beside a creepkit.py", 1, int(bool(left(folder))))
        run(["gcc", "x.c"], folder, {"PATH": f".:{os.environ['PATH']}"})
        yield Control(MODULES, "gcc by a PATH that begins with the folder", 1, int(bool(left(folder))))
        (folder / "x.csv").write_text(planted(folder))
        run([sys.executable, "x.csv"], folder)
        yield Control(NAMED, "`python x.csv`", 1, int(bool(left(folder))))
        run([sys.executable, "-I", "-c", "import pickle; pickle.load(open('data.pkl', 'rb'))"], folder)
        yield Control(NAMED, "`pickle.load` of data.pkl", 1, int(bool(left(folder))))
