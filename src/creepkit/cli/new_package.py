"""Plugins to start from: an installable package, or one file, from the template of a kind."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from string import Template

import typer

from creepkit.errors import CreepkitError, PluginError
from creepkit.files.writing import write_text
from creepkit.reports.terminal import tell

NAME_PATTERN = re.compile(r"[a-z][a-z0-9]*(-[a-z0-9]+)*")
"""Names of packages: they become modules and classes as well."""


@dataclass(frozen=True)
class PackageKind:
    """What a package offers, and the texts it begins with.

    In the texts $name, $title, $constant, $class_name, $module and $package stand for names made of the plugin's own.

    noun : what is offered: "law". error : raised where there is one of that name already.
    module, test : text of the module, and of its test. edit : what its author edits first.
    use : commands that use it. check : the command that checks $file, the path of the module.
    """

    noun: str
    error: type[CreepkitError]
    module: str
    test: str
    edit: str
    use: str
    check: str

    @property
    def commands(self) -> str:
        """The command that lists all of the kind, as the error about a name that is taken says."""
        return f"ck.available('{self.noun}s')" if self.noun in ("reader", "exporter") else f"creepkit {self.noun}s"


PROJECT = """\
[build-system]
requires = ["hatchling>=1.26"]
build-backend = "hatchling.build"

[project]
name = "$package"
version = "0.1.0"
description = "$title, a plugin of creepkit"
readme = "README.md"
requires-python = ">=3.11"
dependencies = ["creepkit"]

[project.entry-points."creepkit.${noun}s"]
$name = "$module"

[tool.hatch.build]
include = ["$module.py"]
"""


README = """\
# $package

$title: say here what it is, and where it was published.

    pip install -e .
    pytest
$use
"""


def write_plugin(kind: PackageKind, name: str, known: Mapping[str, object], *, one_file: bool) -> None:
    """Write a package, or the module alone, in the working folder, and print what to do next.

    known : the registered ones of the kind, by name. What exists is left as it is: PluginError.
    """
    if not NAME_PATTERN.fullmatch(name):
        raise typer.BadParameter(
            f"'{name}' is not a {kind.noun}'s name: use lower-case words joined by '-', such as my-{kind.noun}"
        )
    if name in known:
        raise kind.error(f"there is a {kind.noun} '{name}' already; choose another name, see {kind.commands}")
    tell(_write_file(kind, name) if one_file else _write_package(kind, name))


def _write_file(kind: PackageKind, name: str) -> str:
    """Write the module alone; say what to do next."""
    path = Path(f"{name.replace('-', '_')}.py")
    _check_absent(path)
    write_text(_filled(kind.module, name), path, PluginError, internal=True)  # that it is absent was checked
    check = _filled(kind.check, name, file=str(path))
    return (
        f"wrote {path}; next: edit {kind.edit}, then run '{check}', "
        f"and 'creepkit --plugin {path}' before any other command"
    )


def _write_package(kind: PackageKind, name: str) -> str:
    """Write a folder with module, project file, README and test; say what to do next."""
    folder, module = Path(name), _names(name)["module"]
    _check_absent(folder)
    if find_spec(module) is not None:
        raise PluginError(f"a module '{module}' is installed already; choose another name than '{name}'")
    use = "".join(f"    {line}\n" for line in _filled(kind.use, name).splitlines())
    texts = {
        f"{module}.py": _filled(kind.module, name),
        "pyproject.toml": _filled(PROJECT, name, noun=kind.noun),
        "README.md": _filled(README, name, use=use.rstrip("\n")),
        f"tests/test_{name.replace('-', '_')}.py": _filled(kind.test, name),
    }
    (folder / "tests").mkdir(parents=True)
    for path, text in texts.items():
        write_text(text, folder / path, PluginError, internal=True)  # in a new folder
    file = folder / f"{module}.py"
    check = _filled(kind.check, name, file=str(file))
    return (
        f"wrote {folder}/ ({', '.join(texts)})\n"
        f"next: edit {kind.edit} in {file}, run '{check}', then 'pip install -e ./{folder}' and 'pytest {folder}': "
        f"from then on every command knows the {kind.noun} '{name}'"
    )


def _names(name: str) -> dict[str, str]:
    """What the texts make of the name of a plugin."""
    words = name.split("-")
    return {
        "name": name,
        "title": " ".join(words).capitalize(),
        "constant": "_".join(words).upper(),
        "class_name": "".join(word.capitalize() for word in words),
        "module": f"creepkit_{'_'.join(words)}",
        "package": f"creepkit-{name}",
    }


def _filled(text: str, name: str, **more: str) -> str:
    return Template(text).substitute(_names(name), **more)


def _check_absent(path: Path) -> None:
    """What exists is left as it is."""
    if os.path.lexists(path):
        raise PluginError(f"{path} exists already; it was left as it is, choose another name or move it")
