"""What options declare: limits of every number, places of all that is written; what cannot be meant is refused."""

import importlib
import inspect
import types
from pathlib import Path
from typing import Annotated, Union, get_args, get_origin, get_type_hints

from creepkit.cli.app import COMMANDS, STAGES
from creepkit.cli.command_options import OutputPath
from creepkit.options import Option, Options, options_of
from helpers.command_line import answers, creepkit

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


SIMULATE = "simulate norton --set A=1e-16 --set n=4 --stress 100"
GENERATE = "surrogate generate norton --dry-run"

MEANINGLESS = [
    (f"{SIMULATE} --end-h 10 --end-h 20", "--end-h is given twice; keep one of them"),
    (f"{SIMULATE} --end-h 1_0", "--end-h 1_0 is not known; write NUMBER"),
    (f"{SIMULATE} --end-h 1e-320", "--end-h is 1e-320; allowed are numbers from 1e-09"),
    (f"{SIMULATE} --end-h 10 --specimen ''", "--specimen is empty; give a value, or leave the option out"),
    (f"{SIMULATE} --end-h 10 --set n", "--set A=1e-16 n=4 n is not known; write NAME=NUMBER"),
    (f"{SIMULATE} --end-h 10 --set n=5", "n is given twice"),
    (f"{SIMULATE} --end-h 1 --modulus-gpa nan", "--modulus-gpa nan is not known; write NUMBER"),
    (f"{SIMULATE} --end-h 1 --modulus-gpa 0", "allowed are numbers above 0 up to 1000000"),
    (f"{GENERATE} --part -1", "--part -1 is not known; write K/N"),
    (f"{GENERATE} --cluster garbage", "'garbage' is no address of a dask scheduler"),
]


def test_options_that_cannot_be_meant_are_one_sentence() -> None:
    assert answers(MEANINGLESS) == []
