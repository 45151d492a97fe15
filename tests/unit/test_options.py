"""One declaration of an option is found in Python, on the command line and in a study."""

import inspect
from dataclasses import dataclass, fields, make_dataclass
from typing import Annotated, Any, Literal

import pytest
import typer
from pydantic import BaseModel, ConfigDict, ValidationError
from typer.testing import CliRunner

import creepkit as ck
from creepkit.cli.command_options import checked
from creepkit.errors import FitError
from creepkit.limits import Limits
from creepkit.options import CELSIUS, HOURS, Options, option, options_of, table_of, takes_options, values_of_table


class Table(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


@dataclass(frozen=True)
class Furnace(Options, title="settings of a furnace", error=FitError):
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
        with pytest.raises(FitError, match=name):
            Furnace(**{name: value})
        assert one.flag in answered(Furnace, f"{one.flag}={text}")
        with pytest.raises(ValidationError):
            table_of(Furnace, Table)(**{one.key: value})


def test_a_field_more_is_an_argument_an_option_and_a_key() -> None:
    """As if a line were added to IdentificationSettings."""
    line = ("patience", int, option(15, "Steps without gain.", Limits(1, 100)))
    record = make_dataclass("Settings", [line], bases=(ck.IdentificationSettings,), frozen=True)

    @takes_options(record)
    def identify(law: str, **changes: Any) -> None: ...

    assert inspect.signature(identify).parameters["patience"].default == 15
    assert record().changed({"patience": 20}).patience == 20
    assert answered(record, "--patience", "20", "--starts", "2") == {"patience": 20, "starts": 2}
    assert "allowed are whole numbers from 1 to 100" in answered(record, "--patience", "0")
    table = table_of(record, Table, types={tuple[ck.Nuisance, ...]: Any})
    assert values_of_table(record, table(patience=20)) == {"patience": 20}


def test_public_functions_show_their_options_with_defaults() -> None:
    for function in (ck.identify, ck.select):
        parameters = inspect.signature(function).parameters
        assert "changes" not in parameters
        for one in fields(ck.IdentificationSettings):
            assert parameters[one.name].default == one.default, one.name


def test_a_misspelt_option_is_answered_by_the_nearest() -> None:
    with pytest.raises(FitError, match="settings of a furnace have no 'run'; did you mean 'runs'"):
        Furnace().changed({"run": 2})
