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

pytestmark = pytest.mark.nightly

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
        return f"surrogate train {folder}/data.h5 --to {folder}/out/net.safetensors --epochs 100000"
    if command == "screen":
        return f"identify {PLANTED_BULGE} --by alloy --law combined --dense none --to {folder}/out --workers 1"
    if command == "run":
        shutil.copy(next(PLANTED_BULGE.glob("*.csv")), folder / "test.csv")
        (folder / "study.toml").write_text(STUDY)
        return f"run {folder}/study.toml --to {folder}/out"
    return f"identify {PLANTED_BULGE} --law combined --starts 64 --to {folder}/out"


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
        ("screen", signal.SIGTERM, "interrupted by SIGTERM; what is finished is kept, and the same command"),
        ("run", signal.SIGINT, "interrupted; kept: quality; the same command goes on with identification"),
        ("train", signal.SIGHUP, "interrupted by SIGHUP; what is finished is kept, and the same command goes on"),
    ],
)
def test_an_interrupt_is_one_line_and_leaves_nothing_half_written(command, sent, said, tmp_path):
    (tmp_path / "out").mkdir()
    words = [sys.executable, "-c", f"{HEEDING}{CALLED}", *words_of(command, tmp_path).split()]
    with running(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=tmp_path) as process:
        started(process, tmp_path)
        process.send_signal(sent)
        _, stderr = process.communicate(timeout=DEADLINE)
    assert process.returncode == 128 + sent, stderr
    lines = [
        line for line in stderr.splitlines() if line.startswith(("creepkit:", "Traceback", "Exception", "Aborted"))
    ]
    assert len(lines) == 1
    name = {"screen": "identify", "train": "surrogate"}.get(command, command)
    assert lines[0].startswith(f"creepkit: {name} {said}")
    left = [path.name for path in tmp_path.rglob("*") if path.name.endswith((".part", ".lock"))]
    assert left == (["running.lock"] if command == "run" else [])  # empty, and locked by nobody
