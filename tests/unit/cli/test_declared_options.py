"""What options declare: limits of every number, places of everything that is written, and what holds without words."""

import types
from pathlib import Path
from typing import Annotated, Union, get_args, get_origin, get_type_hints

import pytest

from creepkit import limits
from creepkit.cli.app import COMMANDS
from creepkit.cli.declared_options import OutputPath
from helpers.command_line import creepkit, one_line

READ = {
    ("generate", "to"), ("train", "to"),  # see OutputPath("resumed")
}  # fmt: skip

INPUTS = {"surrogate", "times", "record", "compositions", "plugin", "example"}
"""Options that name files to read."""


def parameters():
    """(command, option, its type without None and lists, what stands beside it) of all options of all commands."""
    for command, function in COMMANDS.items():
        for name, hint in get_type_hints(function, include_extras=True).items():
            kind, *beside = get_args(hint) if get_origin(hint) is Annotated else (hint,)
            while get_origin(kind) in (Union, types.UnionType, list):
                kind = next(one for one in get_args(kind) if one is not type(None))
            yield command, name, kind, beside


def test_every_number_has_limits():
    without = [
        (command, name)
        for command, name, kind, beside in parameters()
        if kind in (int, float) and not any(isinstance(one, limits.Limits) for one in beside)
    ]
    assert without == []


def test_every_path_that_an_option_names_is_read_or_declared_as_written():
    undeclared = [
        (command, name)
        for command, name, kind, beside in parameters()
        if kind is Path
        and name not in INPUTS
        and "Option" in type(next(iter(beside), None)).__name__
        and not any(isinstance(one, OutputPath) for one in beside)
    ]
    assert undeclared == []


def test_a_command_that_writes_has_force_and_no_other_has():
    for command in COMMANDS:
        writes = any(
            isinstance(one, OutputPath) for name, _, _, beside in parameters() if name == command for one in beside
        )
        shown = creepkit(command, "--help").output
        assert ("--force " in shown) == writes, command


@pytest.mark.parametrize("value", ["1e9", "nan", "-inf", "0"])
def test_a_number_beyond_its_limits_is_one_line(value):
    message = one_line(creepkit("simulate", "norton", "--set", "A=1e-9", "--end-h", "1", "--modulus-gpa", value))
    assert message.endswith("allowed are numbers above 0 up to 1000000\n")
