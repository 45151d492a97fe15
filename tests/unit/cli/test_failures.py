"""How the command line ends where nobody foresaw it: one line, an exit code, no traceback."""

from __future__ import annotations

import importlib
import inspect
import io
import os
import re
import shlex
import subprocess
import sys
import time
import types
from pathlib import Path
from typing import Annotated, Union, get_args, get_origin, get_type_hints

import pytest

import creepkit as ck
from creepkit.cli.app import COMMANDS, STAGES
from creepkit.cli.command_options import OutputPath
from creepkit.options import Option, Options, options_of
from creepkit.reports import terminal
from helpers.command_line import answers, creepkit, one_line

CREEPKIT = (sys.executable, "-m", "creepkit")
SIMULATE = "simulate norton --set A=1 --end-h 1"
LINUX = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="devices and closed streams are those of Linux")


def raising(error):
    """A function that raises it, whatever it is given."""

    def raises(*_, **__):
        raise error

    return raises


def test_a_fault_is_one_line(monkeypatch):
    monkeypatch.setattr(ck, "law", raising(ZeroDivisionError("two\nlines \x1b[2J")))
    said = one_line(creepkit(SIMULATE))
    assert said.startswith("creepkit: internal error (ZeroDivisionError: two lines \\u001b[2J); this is a fault")
    assert isinstance(creepkit(f"--debug {SIMULATE}").exception, ZeroDivisionError)


@LINUX
def test_streams_that_are_closed_full_or_without_reader():
    def ended(shell, code):
        run = subprocess.run(
            ["bash", "-o", "pipefail", "-c", shell, *CREEPKIT], capture_output=True, text=True, check=False
        )
        assert run.returncode in code, run.stderr
        return run.stderr

    assert ended('"$0" "$@" list laws >&-', {0}) == ""
    full = ended('"$0" "$@" list laws >/dev/full', {1})
    assert full.startswith("creepkit: ")
    assert "No space left on device" in full
    assert full.count("\n") == 1
    assert ended('"$0" "$@" list laws | true', {0, 1}) == ""


@pytest.mark.parametrize("encoding", ["ascii", "cp1252"])
def test_a_narrow_encoding_shows_codes(encoding, tmp_path):
    environment = {**os.environ, "PYTHONIOENCODING": encoding, "PYTHONUTF8": "0", "LANG": "C", "LC_ALL": "C"}
    for words in (("list", "laws"), ("read", str(tmp_path / "Prüfung_α.csv")), ("--help",)):
        run = subprocess.run([*CREEPKIT, *words], capture_output=True, env=environment, check=False)
        assert b"Traceback" not in run.stderr
        assert run.returncode == (1 if words[0] == "read" else 0)
        (run.stdout + run.stderr).decode(encoding)


@LINUX
def test_without_a_home_or_a_cache_or_a_known_user(tmp_path):
    """As in a container that runs under any number of a user; the cache folder is none."""
    words = shlex.split("simulate norton --set A=1e-16 --set n=4 --stress 60 --end-h 1 --points 3")
    environment = {"PATH": "/usr/bin", "PYTHONPATH": os.environ.get("PYTHONPATH", ""), "CREEPKIT_CACHE": "/proc/none"}
    program = (
        "import pwd, sys\n"
        "def unknown(number): raise KeyError(number)\n"
        "pwd.getpwuid = unknown\n"
        "from creepkit.cli import main; main()"
    )
    start = [sys.executable, "-c", program, *words]
    run = subprocess.run(start, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert "Traceback" not in run.stderr
    assert run.returncode == 0, run.stderr
    assert "time" in run.stdout


# ---- names on terminals ----------------------------------------------------------------------------------------------

# Names of files steer no terminal: whatever commands print of them for people is shown as codes. Texts for programs
# (JSON, CSV, exported laws) are printed as they would stand in a file.


HOSTILE = "\x1b]0;owned\x07\x1b[31mred\rover\n\u202egnp\x9b"
BARS = ck.example_data("planted creep curves")


def test_controls_are_shown_as_codes_and_lines_and_tabs_stay(capsys: pytest.CaptureFixture[str]) -> None:
    terminal.tell("two\tcolumns\nred \x1b[31m \x07 \r \x9b \u202e end")
    terminal.tell_written("a\nb\x1b.csv", ": 2 frames", err=True)
    terminal.print_table("of \x1b[31m [bold]", ["\x07 [red]"], [["cell \x1b[31m [/red]"]])
    terminal.ProgressBar().tick("file \x1b[31m", 1, 1, "\x07")
    terminal.put('{"name": "\x1b"}')
    out, err = capsys.readouterr()
    assert out.startswith("two\tcolumns\nred \\u001b[31m \\u0007 \\u000d \\u009b \\u202e end\nof \\u001b[31m [bold]:\n")
    assert "\\u0007 [red]" in out
    assert "cell \\u001b[31m [/red]" in out
    assert out.endswith('{"name": "\x1b"}')
    assert err == "wrote a\\u000ab\\u001b.csv: 2 frames\nfile \\u001b[31m\n"


@pytest.mark.skipif(os.name == "nt", reason="Windows allows no such names")
@pytest.mark.parametrize(
    "words",
    [
        ("read", "{h}/{h}.csv", "--to", "{h}", "--plot", "{h}.svg"),
        ("read", "{h}/{h}.csv", "broken-{h}.csv"),
        ("simulate", "norton", "--set", "A=1e-15", "--set", "n=4", "--end-h", "9", "--stress", "80", "--to", "{h}.csv"),
        ("identify", "{h}/{h}.csv", "--laws", "norton", "--to", "{h}"),
        ("export", "norton", "--to", "latex", "--set", "A=1e-15", "--set", "n=4", "--output", "{h}.tex"),
        ("report", "norton", "--app", "--tests", "{h}/{h}.csv", "--to", "{h}.html"),
        ("init", "{h}"),
        ("rupture", "{h}/{h}.csv"),
        ("{h}",),
        ("list", "laws", "{h}"),
        ("list", "laws", "norton", "{h}"),
        ("list", "laws", "--{h}"),
        ("simulate", "norton", "--end-h", "{h}"),
    ],
    ids=lambda words: " ".join(words[:3]).replace("{h}", "HOSTILE"),
)  # fmt: skip
def test_no_command_prints_a_name_as_it_is(words: tuple[str, ...], tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    os.mkdir(HOSTILE)
    (tmp_path / HOSTILE / f"{HOSTILE}.csv").write_bytes((BARS / "planted_800C_60MPa.csv").read_bytes())
    (tmp_path / f"broken-{HOSTILE}.csv").write_text("time_h,strain\nnothing,else\n")
    result = creepkit(*(word.format(h=HOSTILE) for word in words))
    printed = result.stdout + result.stderr
    assert printed
    assert "Traceback" not in printed
    assert not set(printed) & set("\x1b\x07\r\x9b\u202e")


def test_a_terminal_is_not_steered_by_tasks_of_a_progress_bar(monkeypatch: pytest.MonkeyPatch) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    stream = Terminal()
    monkeypatch.setattr("sys.stderr", stream)
    with terminal.ProgressBar() as progress:
        progress.tick("red \x1b]0;owned\x07 [/red]", 1, 1)
    assert "\x1b]0;" not in stream.getvalue()
    assert "[/red]" in stream.getvalue()


def test_a_long_part_of_a_stage_is_told_without_a_tick(monkeypatch, capsys) -> None:
    monkeypatch.setattr(terminal.ProgressBar, "LONG_STAGE", 0.05)
    with terminal.ProgressBar() as progress:
        progress.tick("start", 1, 4)
        time.sleep(0.3)
    assert re.search(r"start: 1 of 4, about \d+ s more \(\d+ s so far\)", capsys.readouterr().err)


@pytest.mark.parametrize("target", ["latex", "python", "json"])
def test_texts_for_programs_are_printed_as_a_file_holds_them(target: str, tmp_path) -> None:
    values = ("--set", "A=1e-15", "--set", "n=4")
    printed = creepkit("export", "norton", "--to", target, *values)
    assert creepkit("export", "norton", "--to", target, *values, "--output", str(tmp_path / "law")).exit_code == 0
    assert printed.stdout.rstrip("\n") == (tmp_path / "law").read_text(encoding="utf-8").rstrip("\n")


# ---- declared options ------------------------------------------------------------------------------------------------

# What options declare: limits of every number, places of all that is written; what cannot be meant is refused.


INPUTS = {"surrogate", "times", "record", "compositions", "example"}
"""Options that name files to read."""

UNBOUNDED = {"largest_output"}


def functions():
    """(words of a command, its function) of all commands."""
    for name in COMMANDS:
        module = importlib.import_module(f"creepkit.cli.{name.replace('list', 'listing')}")
        for one, function in getattr(
            module, "COMMANDS", {"": module.command} if hasattr(module, "command") else {}
        ).items():
            yield " ".join(filter(None, (name, one))), function


def parameters():
    """(command, option, its type without None, tuples and lists, what stands beside it) of all options."""
    for command, function in functions():
        for name, hint in get_type_hints(function, include_extras=True).items():
            kind, *beside = get_args(hint) if get_origin(hint) is Annotated else (hint,)
            for record in beside:
                if isinstance(record, type) and issubclass(record, Options):
                    for one in options_of(record):
                        yield command, one.name, one.type, [one]
            while get_origin(kind) in (Union, types.UnionType, list, tuple):
                kind = next(one for one in get_args(kind) if one is not type(None))
            yield command, name, kind, beside


def test_every_number_has_limits():
    without = {
        (command, name)
        for command, name, kind, beside in parameters()
        if kind in (int, float) and not any(isinstance(one, Option) and one.limits for one in beside)
    }
    assert {name for _, name in without} <= UNBOUNDED, without


def test_every_path_that_an_option_names_is_read_or_declared_as_written():
    undeclared = [
        (command, name)
        for command, name, kind, beside in parameters()
        if kind is Path
        and name not in INPUTS
        and "Argument" not in type(next(iter(beside), None)).__name__
        and not any(isinstance(one, OutputPath) for one in beside)
    ]
    assert undeclared == []


def test_a_command_that_writes_has_force_and_no_other_has():
    for command, function in functions():
        hints = get_type_hints(function, include_extras=True).values()
        writes = any(isinstance(one, OutputPath) for hint in hints for one in get_args(hint)[1:])
        assert ("--force " in creepkit(*command.split(), "--help").output) == writes, command


def test_commands_are_in_one_table_by_stage_and_each_has_its_module():
    modules = {path.stem for path in Path(inspect.getfile(OutputPath)).parent.glob("*.py")}
    assert {name.replace("list", "listing") for name in COMMANDS} <= modules
    assert sum(map(len, STAGES.values())) == len(COMMANDS) <= 18


SIMULATION = "simulate norton --set A=1e-16 --set n=4 --stress 100"
GENERATE = "surrogate generate norton --samples 10 --to never.h5"

MEANINGLESS = [
    (f"{SIMULATION} --end-h 1_0", "--end-h 1_0 is not known; write NUMBER"),
    (f"{SIMULATION} --end-h 1e-320", "--end-h is 1e-320; allowed is a number from 1e-09"),
    (f"{SIMULATION} --end-h 10 --set n", "--set A=1e-16 n=4 n is not known; write NAME=NUMBER"),
    (f"{SIMULATION} --end-h 10 --set n=5", "n is given twice"),
    (f"{SIMULATION} --end-h 1 --modulus-gpa nan", "--modulus-gpa nan is not known; write NUMBER"),
    (f"{SIMULATION} --end-h 1 --modulus-gpa 0", "allowed is a number above 0 up to 1000000"),
    (f"{GENERATE} --part -1", "--part -1 is not known; write K/N"),
    (f"{GENERATE} --cluster garbage", "'garbage' is no address of a dask scheduler"),
]


def test_options_that_cannot_be_meant_are_one_sentence() -> None:
    assert answers(MEANINGLESS) == []
