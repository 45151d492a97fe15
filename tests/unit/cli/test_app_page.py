"""`creepkit app`: what it shows, the address that it prints, and how it ends."""

import os
import re
import select
import signal
import socket
import subprocess
import sys

import pytest

import creepkit as ck
from helpers.command_line import creepkit, one_line
from helpers.running_programs import running
from helpers.source_tree import PACKAGE

BARS = ck.example_data("planted creep curves")
PROGRAM = (
    "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); from creepkit.cli import main; main()"
)


def test_the_page_as_one_file(tmp_path):
    result = creepkit("app", "norton", str(BARS / "planted_800C_60MPa.csv"), "--to", str(tmp_path / "page.html"))
    assert result.exit_code == 0, result.stderr
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "planted_800C_60MPa" in text
    assert len(text) < 1_000_000
    (tmp_path / "page.html").write_text("edited", encoding="utf-8")
    again = creepkit("app", "norton", "--to", str(tmp_path / "page.html"))
    assert "creepkit did not write it as it is now" in one_line(again)
    assert creepkit("app", "norton", "--to", str(tmp_path / "page.html"), "--force").exit_code == 0


def test_sums_results_and_exported_laws(tmp_path):
    ck.export("norton", "json", {"A": 3e-16, "n": 4.25}, to=tmp_path / "law.json")
    for source, shown in (("norton+strain-hardening", "strain"), (str(tmp_path / "law.json"), "4.25")):
        path = tmp_path / "page.html"
        assert creepkit("app", source, "--to", str(path), "--force").exit_code == 0
        assert shown in path.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("nortom",), "norton"),
        (("norton", "hyperbolic-sine"), "name one"),
        (("norton", "no/such/file.csv"), "file.csv"),
        (("norton", "--specimen", "bulg"), "bulge"),
        (("norton", "--specimen", "point"), "point"),
    ],
)
def test_mistakes_are_one_sentence(words, said, tmp_path):
    assert said in one_line(creepkit("app", *words, "--to", str(tmp_path / "page.html")))


def test_a_port_that_is_taken(tmp_path):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        assert f"--port {port}" in one_line(creepkit("app", "norton", "--no-browser", "--port", port))


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="signals are those of Linux")
def test_it_prints_its_address_and_ctrl_c_ends_it():
    words = [sys.executable, "-c", PROGRAM, "app", "norton", "--no-browser"]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(PACKAGE.parent), os.environ.get("PYTHONPATH", "")])}
    with running(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment) as process:
        ready, _, _ = select.select([process.stdout], [], [], 120.0)
        line = process.stdout.readline() if ready else ""
        assert re.fullmatch(r"the page: http://127\.0\.0\.1:\d+/[\w-]{32}/\n", line)
        process.send_signal(signal.SIGINT)
        rest, errors = process.communicate(timeout=60)
    assert process.returncode == 0
    assert rest == ""
    assert errors.splitlines() == ["Ctrl-C ends it", "ended"]
