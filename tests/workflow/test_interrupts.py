"""A signal ends a command with one line, which says what is kept, and 128 + its number; no file is half written."""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import creepkit as ck
from creepkit.cli.demo import PLANTED_BULGE
from helpers.planted_datasets import bars
from helpers.running_programs import running

HEEDING = (
    "import signal\nsignal.signal(signal.SIGINT, signal.default_int_handler)\n"
    "for name in {'SIGTERM', 'SIGHUP'} & set(dir(signal)): signal.signal(getattr(signal, name), signal.SIG_DFL)\n"
)
"""A run of the tests in the background of a shell, or under nohup, has switched off what these tests send."""


CALLED = "from creepkit.cli import main; main()"
DEADLINE = 120.0
"""s in which a command must begin its work, and end when it is told to."""


STUDY = """[data]
files = ["test.csv"]
[identification]
laws = ["combined"]
starts = 64
"""


def words_of(command, folder):
    """The words of a command that works for minutes."""
    if command == "train":
        ck.write_dataset(bars(), folder / "data.h5")
        return ("train", folder / "data.h5", "--to", folder / "out" / "net.safetensors", "--epochs", "100000")
    if command == "screen":
        return (
            "screen",
            PLANTED_BULGE,
            "--law",
            "combined",
            "--dense",
            "none",
            "--to",
            folder / "out",
            "--workers",
            "1",
        )
    if command == "run":
        shutil.copy(next(PLANTED_BULGE.glob("*.csv")), folder / "test.csv")
        (folder / "study.toml").write_text(STUDY)
        return ("run", folder / "study.toml", "--to", folder / "out")
    return ("identify", PLANTED_BULGE, "--law", "combined", "--starts", "64", "--to", folder / "out")


def started(process, folder):
    """Wait until a command works: it has written something, or used seconds of processor time."""
    begin = time.monotonic()
    while time.monotonic() - begin < DEADLINE:
        fields = Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
        if (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK") > 6.0:
            return
        time.sleep(0.1)
    raise AssertionError("the command did not begin to work")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="processor time is read from /proc")
@pytest.mark.parametrize(
    ("command", "sent", "said"),
    [
        ("identify", signal.SIGINT, "interrupted; files that were there are whole, and the same command starts"),
        ("screen", signal.SIGTERM, "interrupted by SIGTERM; alloys that are finished are kept, and the same command"),
        ("run", signal.SIGINT, "interrupted; kept: quality; the same command goes on with identification"),
        ("train", signal.SIGHUP, "interrupted by SIGHUP; the last checkpoint is kept, and the same command goes on"),
    ],
)
def test_an_interrupt_is_one_line_and_leaves_nothing_half_written(command, sent, said, tmp_path):
    (tmp_path / "out").mkdir()
    words = [sys.executable, "-c", f"{HEEDING}{CALLED}", *map(str, words_of(command, tmp_path))]
    with running(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=tmp_path) as process:
        started(process, tmp_path)
        process.send_signal(sent)
        _, stderr = process.communicate(timeout=DEADLINE)
    assert process.returncode == 128 + sent, stderr
    lines = [
        line for line in stderr.splitlines() if line.startswith(("creepkit:", "Traceback", "Exception", "Aborted"))
    ]
    assert len(lines) == 1
    assert lines[0].startswith(f"creepkit: {command} {said}")
    left = [path.name for path in tmp_path.rglob("*") if path.name.endswith((".part", ".lock"))]
    assert left == (["running.lock"] if command == "run" else [])  # empty, and locked by nobody


def ended(program):
    """Exit code and stderr of a Python program that runs the command line."""
    words = [sys.executable, "-c", f"{HEEDING}import os\nimport creepkit.cli.app as app\n{program}"]
    run = subprocess.run(words, timeout=DEADLINE, capture_output=True, text=True, check=False)
    return run.returncode, run.stderr


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="signals are those of POSIX")
def test_a_signal_before_the_command_began():
    """As a queue of jobs or a container ends a process."""
    for name, code in (("SIGTERM", 143), ("SIGHUP", 129)):
        killed = ended(f"app.app = lambda: os.kill(os.getpid(), signal.{name}); {CALLED}")
        assert killed == (
            code,
            f"creepkit: interrupted by {name} before it began; the same command starts from the beginning\n",
        )


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="signals are those of POSIX")
def test_what_a_signal_turns_into_another_error_is_an_interrupt_all_the_same():
    """Imports that are cut off raise errors of their own."""
    program = (
        "def cut_off():\n    try: os.kill(os.getpid(), signal.SIGTERM)\n"
        "    except BaseException: raise ImportError('of half a library')\n"
        f"app.app = cut_off\n{CALLED}"
    )
    code, stderr = ended(program)
    assert code == 143
    assert stderr.startswith("creepkit: interrupted by SIGTERM")
    assert stderr.count("\n") == 1


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="signals are those of POSIX")
def test_a_signal_while_an_object_is_tidied_away_is_not_lost():
    """As ZipFile.__del__ of a spreadsheet that is read: Python drops what is raised there."""
    program = (
        "import time\nclass Tidied:\n    def __del__(self): os.kill(os.getpid(), signal.SIGTERM); time.sleep(0.1)\n"
        f"def work(): Tidied(); time.sleep({DEADLINE})\napp.app = work\n{CALLED}"
    )
    code, stderr = ended(program)
    assert code == 143
    assert "Exception ignored" not in stderr
    assert stderr.count("\n") == 1


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="signals are those of POSIX")
def test_a_library_that_aborts_while_the_interpreter_ends_changes_no_exit_code():
    """As torch does where a signal cut its training off; what is registered to be tidied up still is."""
    program = (
        "import atexit, sys\nclass Library:\n    def __del__(self): os.abort()\nkept = Library()\n"
        "atexit.register(lambda: print('tidied up', file=sys.stderr))\n"
        f"app.app = lambda: os.kill(os.getpid(), signal.SIGTERM)\n{CALLED}"
    )
    code, stderr = ended(program)
    assert (code, stderr.splitlines()[-1]) == (143, "tidied up")


def test_nohup_is_heeded():
    program = (
        f"signal.signal(signal.SIGINT, signal.SIG_IGN)\napp.app = lambda: os.kill(os.getpid(), signal.SIGINT)\n{CALLED}"
    )
    assert ended(program) == (0, "")


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="signals are those of POSIX")
def test_an_interrupt_while_the_command_line_is_read_or_a_text_is_executed():
    """typer ends the first by 130 without a word; Python itself ends by SIGINT after the second."""
    reading = "import typer.core\ntyper.core.TyperGroup.parse_args = lambda *_: os.kill(os.getpid(), signal.SIGTERM)"
    code, stderr = ended(f"{reading}\n{CALLED}")
    assert code == 143
    assert stderr.startswith("creepkit: interrupted by SIGTERM before it began")
    executed = "app.app = lambda: exec('import os, signal; os.kill(os.getpid(), signal.SIGINT)')"
    code, stderr = ended(f"{executed}\n{CALLED}")
    assert code == 130
    assert stderr.startswith("creepkit: interrupted before it began")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="of Linux alone")
def test_streams_that_cannot_be_written():
    """A full disk is no fault of creepkit, whatever is printed; where no sentence can be written, the code says it."""
    with open("/dev/full", "w") as full:
        for word in ("--version", "--help", "laws"):
            words = [sys.executable, "-m", "creepkit", word]
            run = subprocess.run(words, timeout=DEADLINE, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
            assert run.returncode == 1
            assert run.stderr.startswith("creepkit: standard output: No space left on device;")
        assert subprocess.run(words, timeout=DEADLINE, stdout=full, stderr=full, check=False).returncode == 1


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="signals are those of POSIX")
def test_ctrl_c_while_the_package_is_imported_prints_no_traceback(tmp_path):
    (tmp_path / "lazy_loader.py").write_text("import os, signal\nos.kill(os.getpid(), signal.SIGINT)\n")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])}
    heeding = f"{HEEDING}import os, sys\nos.execv(sys.executable, [sys.executable, '-m', 'creepkit', 'laws'])"
    words = [sys.executable, "-c", heeding]
    run = subprocess.run(words, env=environment, timeout=DEADLINE, capture_output=True, text=True, check=False)
    assert (run.returncode, run.stdout, run.stderr) == (-signal.SIGINT, "", "")
