"""What cannot be meant on the command line is refused before anything begins; names of laws come before files."""

from pathlib import Path

import pytest

from creepkit.cli.options import is_file_name
from helpers.command_line import creepkit, one_line

SIMULATE = ["simulate", "norton", "--set", "A=1e-16", "--set", "n=4", "--stress", "100"]
GENERATE = ["generate", "norton", "--dry-run"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([*SIMULATE, "--end-h", "10", "--end-h", "20"], "--end-h is given twice; keep one of them"),
        ([*SIMULATE, "--end-h", "1_0"], "--end-h 1_0: write a number without underscores"),
        ([*SIMULATE, "--end-h", "1e-320"], "--end-h 9.99988867183e-321: allowed are numbers from 1e-09"),
        ([*SIMULATE, "--end-h", "10", "--specimen", ""], "--specimen is empty; give a value, or leave the option out"),
        ([*SIMULATE, "--end-h", "10", "--set", "n"], "--set n: write NAME=NUMBER"),
        ([*SIMULATE, "--end-h", "10", "--set", "n=5"], "n is given twice"),
        ([*GENERATE, "--part", "-1"], "--part -1 is not K/N"),
        ([*GENERATE, "--cluster", "garbage"], "'garbage' is no address of a dask scheduler"),
    ],
)
def test_options_that_cannot_be_meant_are_one_sentence(words: list[str], message: str) -> None:
    assert message in one_line(creepkit(*words))


@pytest.mark.parametrize("command", ["identify", "discover", "screen"])
def test_commands_that_identify_take_rupture_times(command: str) -> None:
    assert "--rupture-times" in creepkit(command, "--help").output


def test_a_registered_law_comes_before_a_file_of_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    values = ("--set", "A=1e-16", "--set", "n=4")
    expected = creepkit("export", "norton", *values, "--to", "latex").output
    for name in ("norton", "norton+strain-hardening"):
        Path(name).write_text("{}")
    assert creepkit("export", "norton", *values, "--to", "latex").output == expected
    assert "./norton: this is not an identification" in one_line(creepkit("export", "./norton", "--to", "latex"))
    named = {"norton": False, "norton+strain-hardening": False, "./norton": True, "fit.json": True, "unknown": False}
    assert {word: is_file_name(word) for word in named} == named
