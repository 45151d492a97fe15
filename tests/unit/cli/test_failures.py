"""How the command line ends where nobody foresaw it: one line, an exit code, a file for the report, no traceback."""

import errno
import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

import creepkit as ck
from creepkit.cli.failures import AS_TERMINALS_CAN
from helpers.command_line import creepkit, one_line

CREEPKIT = (sys.executable, "-m", "creepkit")
LINUX = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="devices and closed streams are those of Linux")


def test_a_fault_is_one_line_and_a_private_file(monkeypatch, tmp_path):
    def fault(*_, **__):
        raise ZeroDivisionError("two\nlines \x1b[2J")

    monkeypatch.setattr(ck, "law", fault)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    result = creepkit("simulate", "norton", "--set", "A=1", "--end-h", "1")
    assert result.exit_code == 70
    assert result.stderr.count("\n") == 1
    assert result.stderr.startswith(
        "creepkit: internal error (ZeroDivisionError: two lines \\u001b[2J); this is a fault"
    )
    (report,) = tmp_path.glob("creepkit-error-*/report.txt")
    assert str(report) in result.stderr
    assert stat.S_IMODE(report.parent.stat().st_mode) == 0o700
    assert "in fault" in report.read_text()
    assert isinstance(
        creepkit("--debug", "simulate", "norton", "--set", "A=1", "--end-h", "1").exception, ZeroDivisionError
    )


def test_no_memory_is_no_fault(monkeypatch):
    def full(*_, **__):
        raise MemoryError

    monkeypatch.setattr(ck, "law", full)
    assert "not enough memory" in one_line(creepkit("simulate", "norton", "--set", "A=1", "--end-h", "1"))


@LINUX
def test_streams_that_are_closed_full_or_without_reader():
    def ended(shell, code):
        run = subprocess.run(
            ["bash", "-o", "pipefail", "-c", shell, *CREEPKIT], capture_output=True, text=True, check=False
        )
        assert run.returncode in code, run.stderr
        return run.stderr

    assert ended('"$0" "$@" laws >&-', {0}) == ""
    full = ended('"$0" "$@" laws >/dev/full', {1})
    assert full.startswith("creepkit: ")
    assert "No space left on device" in full
    assert full.count("\n") == 1
    assert ended('"$0" "$@" laws | true', {1, 141}) == ""  # rich ends by 1


@LINUX
@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_output_that_the_disk_takes_in_part_is_an_error(unbuffered, tmp_path):
    """A limit on the size of files stands for the disk: it takes 300 bytes, and then none."""
    start = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (300, 300)); from creepkit.cli import main"
    words = ("simulate", "norton", "--set", "A=1e-16", "--set", "n=4", "--stress", "60", "--end-h", "100")
    with (tmp_path / "made.csv").open("wb") as output:
        run = subprocess.run(
            [sys.executable, "-c", f"{start}; main()", *words],
            stdout=output,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONUNBUFFERED": unbuffered},
            check=False,
        )
    assert run.returncode == 1
    assert run.stderr == "creepkit: standard output: File too large; free some space and start again\n"


@pytest.mark.parametrize("encoding", ["ascii", "cp1252"])
def test_a_narrow_encoding_shows_codes(encoding, tmp_path):
    environment = {**os.environ, "PYTHONIOENCODING": encoding, "PYTHONUTF8": "0", "LANG": "C", "LC_ALL": "C"}
    for words in (("laws",), ("read", str(tmp_path / "Prüfung_α.csv")), ("--help",)):
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
    words = (
        "simulate",
        "norton",
        "--set",
        "A=1e-16",
        "--set",
        "n=4",
        "--stress",
        "60",
        "--end-h",
        "1",
        "--points",
        "3",
    )
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


@LINUX
def test_a_working_folder_that_was_deleted_is_said(tmp_path):
    """Intel's MKL in PyTorch ends the process there."""
    gone = 'mkdir gone && cd gone && rmdir "$PWD" && exec "$@"'
    run = subprocess.run(
        ["/bin/sh", "-c", gone, "sh", *CREEPKIT, "laws"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert run.returncode == 1
    assert run.stderr.startswith("creepkit: the working folder has been deleted; change to one")
    assert run.stderr.count("\n") == 1


def test_without_temporary_folder_training_says_what_to_set(monkeypatch):
    def none(*_, **__):
        raise FileNotFoundError(errno.ENOENT, "No usable temporary directory found in ['/none']")

    monkeypatch.setattr(ck, "law", none)
    run = creepkit("simulate", "norton", "--set", "A=1", "--end-h", "1")
    assert "set the environment variable TMPDIR" in one_line(run)


def test_a_report_names_the_address_of_the_project():
    from creepkit.cli.failures import failure_sentence

    sentence, code = failure_sentence(KeyError("x"))
    assert code == 70
    assert "report it " in sentence
    Path(sentence.rpartition("file ")[2]).unlink()
