"""`creepkit new-law`: a law plugin to start from, as an installable package or as one file."""

from __future__ import annotations

import re
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Annotated

import typer

from creepkit.errors import LawError, PluginError
from creepkit.files.writing import write_text

if TYPE_CHECKING:
    from string import Template


LAW_TEMPLATE = Template('''\
"""$title: say here in one line what the law describes."""

from creepkit.language import CreepLaw, Param, hookimpl, parameters, stress

A, n = parameters("A n")

$constant = CreepLaw(
    name="$name",
    title="$title",
    terms={"power law": A * stress**n},
    params={
        A: Param("rate coefficient", unit="1/s", bounds=(1e-40, 1e-5), scale="log", off=0.0),
        n: Param("stress exponent", bounds=(1, 8)),
    },
    references=("Author (year), journal volume, page",),
)


@hookimpl
def creepkit_laws():
    return [$constant]
''')


PROJECT_TEMPLATE = Template("""\
[build-system]
requires = ["hatchling>=1.26"]
build-backend = "hatchling.build"

[project]
name = "$package"
version = "0.1.0"
description = "$title, a creep law as a plugin of creepkit"
readme = "README.md"
requires-python = ">=3.11"
dependencies = ["creepkit"]

[project.entry-points.creepkit]
$name = "$module"

[tool.hatch.build]
include = ["$module.py"]
""")


README_TEMPLATE = Template("""\
# $package

$title: say here what it describes, and where it was published.

    pip install -e .
    creepkit laws $name
    creepkit check $name
    pytest
""")


TEST_TEMPLATE = Template("""\
import creepkit
from creepkit.testing import check_law


def test_it_keeps_what_every_law_promises() -> None:
    report = check_law(creepkit.law("$name"))
    assert report.passed, str(report)
""")


def command(
    name: Annotated[str, typer.Argument(help="Name of the law, such as 'my-law'.")],
    file: Annotated[bool, typer.Option("--file", help="One file, for --plugin and CREEPKIT_PLUGINS.")] = False,
) -> None:
    """Write a law of some 20 lines to start from, as a package."""
    from creepkit import registry

    if not re.fullmatch(r"[a-z][a-z0-9]*(-[a-z0-9]+)*", name):
        raise typer.BadParameter(f"'{name}' is not a law's name: use lower-case words joined by '-', such as my-law")
    if name in registry.default_registry().laws():
        raise LawError(f"there is a law '{name}' already; choose another name, see 'creepkit laws'")
    typer.echo(_write_file(name) if file else _write_package(name))


def _write_file(name: str) -> str:
    """Write the law alone; say what to do next."""
    path = Path(f"{name.replace('-', '_')}.py")
    _check_absent(path)
    write_text(_fill_template(LAW_TEMPLATE, name), path, LawError)
    return (
        f"wrote {path}; next: edit its terms and params, then run 'creepkit check {path}', "
        f"and 'creepkit --plugin {path}' before any other command"
    )


def _write_package(name: str) -> str:
    """Write a folder with the law, its project file, README and test; say what to do next."""
    folder, module = Path(name), _module_name(name)
    _check_absent(folder)
    (folder / "tests").mkdir(parents=True)
    texts = {
        f"{module}.py": LAW_TEMPLATE,
        "pyproject.toml": PROJECT_TEMPLATE,
        "README.md": README_TEMPLATE,
        f"tests/test_{name.replace('-', '_')}.py": TEST_TEMPLATE,
    }
    for path, text in texts.items():
        write_text(_fill_template(text, name), folder / path, LawError)
    law = folder / f"{module}.py"
    return (
        f"wrote {folder}/ ({', '.join(texts)})\n"
        f"next: edit the terms and params in {law}, run 'creepkit check {law}', then 'pip install -e ./{folder}': "
        f"from then on every command knows the law '{name}'"
    )


def _module_name(name: str) -> str:
    return f"creepkit_{name.replace('-', '_')}"


def _fill_template(text: Template, name: str) -> str:
    title = name.replace("-", " ").capitalize()
    constant = name.replace("-", "_").upper()
    return text.substitute(
        name=name, title=title, constant=constant, module=_module_name(name), package=f"creepkit-{name}"
    )


def _check_absent(path: Path) -> None:
    """What exists is left as it is."""
    if path.exists():
        raise PluginError(f"{path} exists already; it was left as it is, choose another name or move it")
