"""How the command line ends where nobody foresaw it: one line, an exit code, no traceback."""

import errno
import os
import shlex
import subprocess
import sys

import pytest

import creepkit as ck
from creepkit.cli.ending import AS_TERMINALS_CAN
from helpers.command_line import creepkit, one_line

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


def test_no_memory_is_no_fault(monkeypatch):
    monkeypatch.setattr(ck, "law", raising(MemoryError()))
    assert "not enough memory" in one_line(creepkit(SIMULATE))


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


def test_a_degree_is_left_out_where_the_encoding_lacks_it():
    assert "850 °C, ü".encode("ascii", AS_TERMINALS_CAN) == b"850 C, \\xfc"
    assert "850 °C".encode("cp1252", AS_TERMINALS_CAN).decode("cp1252") == "850 °C"


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


def test_without_temporary_folder_training_says_what_to_set(monkeypatch):
    none = FileNotFoundError(errno.ENOENT, "No usable temporary directory found in ['/none']")
    monkeypatch.setattr(ck, "law", raising(none))
    assert "set the environment variable TMPDIR" in one_line(creepkit(SIMULATE))
