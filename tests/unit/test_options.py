"""One declaration of an option is found in Python, on the command line and in a study."""

import inspect
from dataclasses import dataclass, is_dataclass
from typing import Annotated, Any, Literal, get_args

import pytest
import typer
from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError
from typer.testing import CliRunner

import creepkit as ck
from creepkit import checked_arguments
from creepkit.cli.app import built
from creepkit.cli.command_options import checked
from creepkit.errors import ArgumentError
from creepkit.limits import Limits
from creepkit.options import CELSIUS, HOURS, Options, option, options_of, table_of, values_of_table
from creepkit.studies import tables


class Table(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


@checked_arguments.checked
@dataclass(frozen=True)
class Furnace(Options, title="settings of a furnace"):
    runs: int = option(3, "Runs.", Limits(1, 10))
    atmosphere: Literal["air", "argon"] = option("air", "Around the test piece.")
    soak: float = option(7200.0, "Before the load.", Limits(0, 100, whole=False), **HOURS)
    temperatures: tuple[float, ...] = option((), "At which it can be held.", **CELSIUS)
    levels: tuple[float, float] | None = option(None, "Least and greatest load.", unit="MPa")
    constants: dict[str, dict[str, float]] = option(dict, "Given constants.", example="norton.n=5")
    quick: bool = option(False, "Without cooling.")


def answered(record: type[Options], *words: str) -> Any:
    """The values with which a command that has the options of a record is called; else its message."""
    app, given = typer.Typer(), {}

    @app.command()
    @checked
    def command(settings: Annotated[dict[str, Any], record]) -> None:  # type: ignore[valid-type]
        given.update(settings)

    result = CliRunner().invoke(app, words)
    return given if result.exit_code == 0 else str(result.exception)


WORDS = "--runs 5 --atmosphere argon --soak-h 4 --temperatures-c 850,900 --levels-mpa 4:14 --constants a.n=5 --quick"
TABLE = {
    "runs": 5, "atmosphere": "argon", "soak_h": 4, "temperatures_C": [850, 900], "levels_MPa": [4, 14],
    "constants": {"a": {"n": 5}}, "quick": True,
}  # fmt: skip
VALUES = {
    "runs": 5, "atmosphere": "argon", "soak": 14400.0, "temperatures": (1123.15, 1173.15), "levels": (4.0, 14.0),
    "constants": {"a": {"n": 5.0}}, "quick": True,
}  # fmt: skip


def test_the_same_question_in_three_forms_is_the_same_record() -> None:
    assert answered(Furnace, *WORDS.split()) == VALUES
    assert values_of_table(Furnace, table_of(Furnace, Table)(**TABLE)) == VALUES
    assert Furnace().changed(VALUES) == Furnace(**VALUES)
    assert answered(Furnace) == {} == values_of_table(Furnace, table_of(Furnace, Table)())


def test_what_is_not_allowed_is_refused_in_all_three() -> None:
    wrong = {"runs": (11, "11"), "atmosphere": ("neon", "neon"), "soak": (-3600.0, "-1")}
    for name, (value, text) in wrong.items():
        one = next(one for one in options_of(Furnace) if one.name == name)
        with pytest.raises(ArgumentError, match=name):
            Furnace(**{name: value})
        assert one.flag in answered(Furnace, f"{one.flag}={text}")
        with pytest.raises(ValidationError):
            table_of(Furnace, Table)(**{one.key: value})


def test_a_field_more_is_an_argument_an_option_and_a_key() -> None:
    """Each field of IdentificationSettings, with what it allows, in whichever table of a study its key stands."""
    models = (tables.StudyTable, tables.DataTable, tables.IdentificationTable, tables.SelectionTable)
    flags, wrong = {flag for one in built("identify").params for flag in one.opts}, []
    for one in options_of(ck.IdentificationSettings):
        keys = [model.model_fields[one.key] for model in models if one.key in model.model_fields]
        wrong += [one.name] if not keys or one.flag not in flags else []
        known = [inspect.signature(verb).parameters[one.name].default for verb in (ck.identify, ck.select)]
        wrong += [] if known == [one.default] * 2 else [f"{one.name} as an argument"]
        allowed = get_args(one.type) if one.limits is None else (int(one.limits.low), int(one.limits.high))
        refused = ("neon",) if one.limits is None else (int(one.limits.low) - 1, int(one.limits.high) + 1)
        if one.name in ("nuisances", "weights", "usual_errors"):  # which are more than words
            continue
        for key in keys:
            check = TypeAdapter(Annotated[key.annotation, "key", *key.metadata]).validate_python
            for value in allowed:
                check(value)
            for value in refused:
                with pytest.raises(ValidationError):
                    check(value)
    assert wrong == []


def test_a_misspelt_option_is_answered_by_the_nearest() -> None:
    with pytest.raises(ArgumentError, match="settings of a furnace have no 'run'; did you mean 'runs'"):
        Furnace().changed({"run": 2})


def test_every_record_of_options_is_checked() -> None:
    built("identify")  # which imports every command, and with them all records
    records = [one for one in Options.__subclasses__() if one.__module__.startswith("creepkit") and is_dataclass(one)]
    assert len(records) > 15
    assert [one.__name__ for one in records if inspect.unwrap(one.__init__) is one.__init__] == []
