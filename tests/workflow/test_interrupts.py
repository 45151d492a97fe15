"""Ctrl-C ends a command with one line and exit code 130, and leaves no file half written."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import creepkit as ck
from creepkit.cli.demo import PLANTED_BULGE
from helpers.planted_datasets import bars

PROGRAM = (
    "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); from creepkit.cli import main; main()"
)
DEADLINE = 120.0
"""s in which a command must begin its work, and end when it is told to."""


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
@pytest.mark.parametrize("command", ["identify", "screen", "train"])
def test_an_interrupt_is_one_line_and_leaves_nothing_half_written(command, tmp_path):
    (tmp_path / "out").mkdir()
    words = [sys.executable, "-c", PROGRAM, *map(str, words_of(command, tmp_path))]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path) as process:
        started(process, tmp_path)
        process.send_signal(signal.SIGINT)
        _, stderr = process.communicate(timeout=DEADLINE)
    assert process.returncode == 130, stderr
    lines = [
        line for line in stderr.splitlines() if line.startswith(("creepkit:", "Traceback", "Exception", "Aborted"))
    ]
    assert lines == [f"creepkit: {command} interrupted"]
    assert [path for path in tmp_path.rglob("*") if path.name.endswith((".part", ".lock"))] == []


def test_to_be_ended_by_the_system_is_an_interrupt():
    """As a queue of jobs or a container ends a process."""
    end = "import os, signal; import creepkit.cli.app as app; app.app = lambda: os.kill(os.getpid(), signal.SIGTERM); "
    process = subprocess.run([sys.executable, "-c", f"{end}from creepkit.cli import main; main()"], timeout=DEADLINE)
    assert process.returncode == 130
