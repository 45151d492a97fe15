"""The commands that need no data: laws, plugins, check, new-law, the global options and the exit codes."""

import json
import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from creepkit.cli.app import COMMANDS, app
from creepkit.registry import default

FALLING = """
from creepkit.language import CreepLaw, Param, hookimpl, parameters, stress

A, n = parameters("A n")
LAW = CreepLaw(
    name="falling",
    title="A rate that falls with stress",
    terms={"falling": A * stress**n},
    params={
        A: Param("rate coefficient", unit="1/s", bounds=(1e-20, 1e-5), scale="log"),
        n: Param("stress exponent", bounds=(-3, -1)),
    },
    references=("nobody",),
)


@hookimpl
def creepkit_laws():
    return [LAW]
"""

COMMAND = """
import typer

from creepkit.language import hookimpl


@hookimpl
def creepkit_commands(app: typer.Typer) -> None:
    @app.command("{name}")
    def command() -> None:
        typer.echo("from a plugin")
"""


@pytest.fixture(autouse=True)
def _own_registry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Each test is a process of its own: a new registry, and an empty folder to work in."""
    monkeypatch.chdir(tmp_path)
    default.cache_clear()
    yield
    default.cache_clear()


def creepkit(*words: str) -> Result:
    return CliRunner().invoke(app, words)


def one_line(result: Result) -> str:
    """The message of an error of ours: exit 1, nothing on stdout, one line on stderr."""
    assert (result.exit_code, result.stdout) == (1, "")
    assert result.stderr.startswith("creepkit: ")
    assert result.stderr.count("\n") == 1
    return result.stderr


# ---- global --------------------------------------------------------------------------------------------------------


def test_help_tells_every_command_in_a_line() -> None:
    result = creepkit("--help")

    assert result.exit_code == 0
    assert all(f"\n  {name} " in result.stdout for name in COMMANDS)
    assert "..." not in result.stdout.split("Commands:")[1]


@pytest.mark.parametrize("words", [(), ("no-such-command",), ("laws", "--no-such"), ("check",), ("new-law", "Bad!")])
def test_wrong_usage_exits_2(words: tuple[str, ...]) -> None:
    assert creepkit(*words).exit_code == 2


def test_a_misspelt_command_is_suggested() -> None:
    assert "Did you mean 'plugins'?" in creepkit("plugin").stderr


def test_version() -> None:
    assert creepkit("--version").stdout.startswith("creepkit 0.")


def test_debug_lets_the_traceback_through() -> None:
    quiet, loud = creepkit("laws", "nortn"), creepkit("--debug", "laws", "nortn")

    assert "did you mean 'norton'?" in one_line(quiet)
    assert loud.exit_code == 1
    assert type(loud.exception).__name__ == "LawError"


# ---- laws ----------------------------------------------------------------------------------------------------------


def test_laws_are_listed_with_their_parameters() -> None:
    result = creepkit("laws")

    assert result.exit_code == 0
    assert "norton" in result.stdout
    assert "A n_0 n_inf C tau_d tau_r" in result.stdout


def test_laws_as_json_hold_what_table_1_says() -> None:
    laws = {law["name"]: law for law in json.loads(creepkit("laws", "--json").stdout)}

    m = laws["strain-hardening"]["parameters"]["m"]
    assert (m["bounds"], m["off"]) == ([-1, 0], 0)
    assert laws["combined"]["parameters"]["A_1"]["bounds"] == [1e-40, 1e-5]
    assert laws["norton"]["provenance"].startswith("plugin 'norton' (creepkit ")


def test_one_law_in_full() -> None:
    shown = creepkit("laws", "norton").stdout

    assert "A*stress**n" in shown
    assert r"A \sigma_e^{n}" in shown
    assert "Norton (1929)" in shown
    assert json.loads(creepkit("laws", "norton", "--json").stdout)["terms"] == {"power law": "A*stress**n"}


# ---- plugins -------------------------------------------------------------------------------------------------------


def test_a_plugin_file_joins_the_laws() -> None:
    Path("mine.py").write_text(FALLING)

    result = creepkit("--plugin", "mine.py", "laws", "falling")

    assert result.exit_code == 0
    assert f"from plugin 'mine' ({Path('mine.py').resolve()})" in result.stdout


def test_a_plugin_file_that_is_asked_for_must_work() -> None:
    Path("mine.py").write_text("A = (\n")

    assert f"({Path('mine.py').resolve()}, line 1)" in one_line(creepkit("--plugin", "mine.py", "laws"))
    assert "plugin file none.py does not exist" in one_line(creepkit("--plugin", "none.py", "laws"))


def test_plugins_are_listed_broken_ones_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    Path("good.py").write_text(FALLING)
    Path("twin.py").write_text(FALLING)
    Path("bad.py").write_text("1 / 0\n")
    monkeypatch.setenv("CREEPKIT_PLUGINS", os.pathsep.join(["good.py", "twin.py", "bad.py"]))

    text, answer = creepkit("plugins"), json.loads(creepkit("plugins", "--json").stdout)

    by_name = {plugin["name"]: plugin for plugin in answer["plugins"]}
    assert by_name["norton"]["offers"] == {"law": ["norton"]}
    assert by_name["good"]["status"] == "ok"
    assert by_name["bad"]["status"] == "broken"
    assert "ZeroDivisionError: division by zero" in by_name["bad"]["problem"]
    assert by_name["bad"]["problem"] in text.stdout
    assert len(answer["clashes"]) == 1
    assert answer["clashes"][0] in text.stdout


def test_a_plugin_adds_a_command() -> None:
    Path("mine.py").write_text(COMMAND.format(name="greet"))

    assert creepkit("--plugin", "mine.py", "greet").stdout == "from a plugin\n"


def test_a_plugin_cannot_take_the_place_of_a_command() -> None:
    Path("mine.py").write_text(COMMAND.format(name="laws"))

    assert "a plugin adds the command 'laws'" in one_line(creepkit("--plugin", "mine.py", "greet"))


# ---- new-law and check ---------------------------------------------------------------------------------------------


def test_a_new_law_is_short_and_passes_the_check() -> None:
    written = creepkit("new-law", "my-law")
    checked = creepkit("check", "my_law.py")

    assert written.exit_code == 0
    assert "creepkit check my_law.py" in written.stdout
    assert len(Path("my_law.py").read_text().splitlines()) <= 25
    assert checked.exit_code == 0, checked.stdout
    assert "my-law" in checked.stdout


def test_a_new_law_never_overwrites() -> None:
    Path("my_law.py").write_text("precious")

    assert "my_law.py exists already" in one_line(creepkit("new-law", "my-law"))
    assert Path("my_law.py").read_text() == "precious"


def test_a_new_law_needs_a_new_name() -> None:
    assert "there is a law 'norton' already" in one_line(creepkit("new-law", "norton"))
    assert not Path("norton.py").exists()


def test_a_law_that_breaks_a_promise_fails_the_check() -> None:
    Path("falling.py").write_text(FALLING)

    result = creepkit("check", "falling.py")

    assert result.exit_code == 1
    assert "stress" in result.stdout
    assert result.stderr == "creepkit: 1 of 1 laws failed the check\n"


def test_a_file_without_laws_cannot_be_checked() -> None:
    Path("commands.py").write_text(COMMAND.format(name="greet"))

    assert "offers no law" in one_line(creepkit("check", "commands.py"))
