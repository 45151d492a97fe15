"""Commands that plugins add: run, listed by --help without importing other plugins, and told when they fail."""

import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from helpers.command_line import creepkit

COMMAND = """
import typer

from creepkit.language import hookimpl


@hookimpl
def creepkit_commands(app: typer.Typer) -> None:
    @app.command("{name}")
    def command() -> None:
        \"\"\"Say {name} to the world.\"\"\"
        typer.echo("from a plugin")
"""

OTHER = """
from pathlib import Path

from creepkit.language import hookimpl

Path("imported").touch()


@hookimpl
def creepkit_exporters():
    return []
"""

Install = Callable[..., None]

pytestmark = pytest.mark.usefixtures("own_registry")


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Leave a distribution of {module: text} on the path, as pip would; the first is that of its entry point."""
    installed: list[str] = []

    def install(name: str, group: str = "commands", **texts: str) -> None:
        site = tmp_path / "site" / name
        info = site / f"{name}-1.0.dist-info"
        info.mkdir(parents=True)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(f"[creepkit.{group}]\n{name} = {next(iter(texts)).replace('__', '.')}\n")
        for module, text in texts.items():
            file = site / f"{module.replace('__', '/')}.py"
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
        monkeypatch.syspath_prepend(site)
        installed.extend(module.replace("__", ".") for module in texts)

    yield install
    for module in installed:
        for name in (module, module.partition(".")[0]):
            sys.modules.pop(name, None)


def section(text: str, title: str) -> list[str]:
    """The lines below a title of a help text."""
    return text.split(f"{title}:\n")[1].split("\n\n")[0].splitlines() if f"{title}:" in text else []


def test_help_lists_commands_of_plugins_in_a_section_of_their_own(install: Install, monkeypatch) -> None:
    Path("mine.py").write_text(COMMAND.format(name="greet"))
    Path("named.py").write_text(COMMAND.format(name="welcome"))
    install("rolling", rolling=COMMAND.format(name="roll"))
    monkeypatch.setenv("CREEPKIT_PLUGINS", "mine.py")

    text = creepkit("--plugin", "named.py", "--help").stdout

    assert section(text, "Commands of plugins") == [
        "  greet    Say greet to the world.",
        "  roll     Say roll to the world.",
        "  welcome  Say welcome to the world.",
    ]
    assert "greet" not in text.split("Commands of plugins")[0]
    assert "Plugins that failed" not in text
    assert "Commands of plugins" in creepkit().output, "without words the help is shown"


def test_help_imports_no_plugin_that_adds_no_command(install: Install) -> None:
    install("reading", "exporters", reading=OTHER)
    install("inside", "exporters", inside__part=OTHER, inside____init__=OTHER)
    install("rolling", rolling=COMMAND.format(name="roll"))

    assert "roll" in creepkit("--help").stdout
    assert not Path("imported").exists()
    assert creepkit("roll").exit_code == 0
    assert not Path("imported").exists()


def test_a_hook_in_a_module_inside_a_package_is_seen(install: Install) -> None:
    install("packed", packed__commands=COMMAND.format(name="pack"), packed____init__="")
    assert "  pack  Say pack to the world." in creepkit("--help").stdout.splitlines()


def test_a_plugin_that_fails_is_told_in_a_line_and_the_others_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    Path("good.py").write_text(COMMAND.format(name="greet"))
    Path("bad.py").write_text("creepkit_commands = 1 / 0\n")
    Path("raising.py").write_text(COMMAND.format(name="half") + "    app.no_such_method()\n")
    Path("signature.py").write_text(COMMAND.format(name="odd").replace("def command()", "def command(x: int | str)"))
    monkeypatch.setenv("CREEPKIT_PLUGINS", os.pathsep.join(["bad.py", "raising.py", "signature.py", "good.py"]))

    helped = creepkit("--help")
    missed = creepkit("no-such")

    assert helped.exit_code == 0
    assert section(helped.stdout, "Commands of plugins") == ["  greet  Say greet to the world."]
    bad, raising, signature = section(helped.stdout, "Plugins that failed")
    assert "ZeroDivisionError: division by zero" in bad
    assert "creepkit_commands raised AttributeError" in raising
    assert "plugin 'signature'" in signature
    assert missed.exit_code == 2
    assert missed.stderr.splitlines()[:3] == [f"creepkit: {line.strip()}" for line in (bad, raising, signature)]
    assert creepkit("greet").stderr == "", "what is asked for works, so nothing is to be said"


def test_a_plugin_file_that_is_missing_is_told_in_the_help() -> None:
    assert section(creepkit("--plugin", "none.py", "--help").stdout, "Plugins that failed") == [
        "  plugin file none.py does not exist; name a Python file with hooks in it"
    ]


def test_a_plugin_cannot_take_the_place_of_a_command(monkeypatch: pytest.MonkeyPatch) -> None:
    Path("mine.py").write_text(COMMAND.format(name="list"))
    Path("first.py").write_text(COMMAND.format(name="greet"))
    Path("second.py").write_text(COMMAND.format(name="greet").replace("from a", "from another"))
    monkeypatch.setenv("CREEPKIT_PLUGINS", os.pathsep.join(["mine.py", "first.py", "second.py"]))

    laws, greet = section(creepkit("--help").stdout, "Plugins that failed")

    assert "adds the command 'list', which creepkit has already; rename it" in laws
    assert f"plugin 'second' ({Path('second.py').resolve()}) adds the command 'greet', which another plugin" in greet
    assert creepkit("greet").stdout == "from a plugin\n"
    assert "norton" in creepkit("list", "laws").stdout


@pytest.mark.parametrize(("files", "advice"), [("none.py", "correct or unset it"), ("a.py,b.py", "separate several")])
def test_a_file_of_the_environment_that_is_not_there_is_one_sentence(
    files: str, advice: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CREEPKIT_PLUGINS", files)
    result = creepkit("list", "laws")
    assert (result.exit_code, result.stdout) == (1, "")
    assert f"CREEPKIT_PLUGINS names the file {files}, which does not exist; {advice}" in result.stderr


EXECUTED = "from pathlib import Path\nPath('executed').touch()\n"


@pytest.mark.parametrize("name", ["measured.csv", "norton", "plugin", "plugin.py.txt", "plugin.pyc"])
def test_no_file_is_executed_but_one_whose_name_ends_in_py(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    Path(name).write_text(EXECUTED)

    option = creepkit("--plugin", name, "list", "laws")
    monkeypatch.setenv("CREEPKIT_PLUGINS", name)
    variable = creepkit("list", "laws")

    for result in (option, variable):
        assert (result.exit_code, result.stdout, result.stderr.count("\n")) == (1, "", 1)
        assert "only files whose names end in .py are" in result.stderr
    assert not Path("executed").exists()
