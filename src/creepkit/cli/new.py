"""`creepkit new`: a law, specimen, reader or exporter plugin to start from, as an installable package or one file."""

from __future__ import annotations

import os
import re
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from string import Template
from typing import Annotated

import typer

from creepkit.errors import PluginError, nearest
from creepkit.files.writing import write_text
from creepkit.options import Option
from creepkit.registry import default_registry, kinds
from creepkit.reports.terminal import tell

NAME_PATTERN = re.compile(r"[a-z][a-z0-9]*(-[a-z0-9]+)*")
"""Names of packages: they become modules and classes as well."""


KINDS = {one.label: one for one in kinds.KINDS if one.edit}
"""{kind: its row}. Its texts are those of the folder new_plugin."""


def command(
    kind: Annotated[str, typer.Argument(metavar="KIND", help=f"One of {', '.join(KINDS)}.")],
    name: Annotated[str, typer.Argument(metavar="NAME", help="Its name, such as 'my-law'.")],
    *,
    file: Annotated[bool, Option(help="One file, for --plugin and CREEPKIT_PLUGINS.")] = False,
) -> None:
    """A package that can be installed, with a test; what exists is left as it is."""
    if kind not in KINDS:
        pages = "the pages on plugins show how others are written"
        raise PluginError(f"there is no '{kind}' to start from; {nearest(kind, KINDS)}; {pages}")
    if not NAME_PATTERN.fullmatch(name):
        raise typer.BadParameter(
            f"'{name}' is not a {kind}'s name: use lower-case words joined by '-', such as my-{kind}"
        )
    row, words = KINDS[kind], name.split("-")
    if name in default_registry().all(row):
        every = row.listed or row.plural
        raise PluginError(f"there is a {kind} '{name}' already; choose another, see creepkit list {every}")
    known = {
        "name": name,
        "noun": kind,
        "title": " ".join(words).capitalize(),
        "constant": "_".join(words).upper(),
        "class_name": "".join(word.capitalize() for word in words),
        "module": f"creepkit_{'_'.join(words)}",
        "package": f"creepkit-{name}",
        "use": Template(row.use).substitute(name=name),
    }
    place = Path(f"{'_'.join(words)}.py") if file else Path(name)
    if os.path.lexists(place):  # it is left as it is
        raise PluginError(f"{place} exists already; it was left as it is, choose another name or move it")
    if not file and find_spec(known["module"]) is not None:
        raise PluginError(f"a module '{known['module']}' is installed already; choose another name than '{name}'")
    texts = {path.name.removesuffix(".txt"): path for path in files("creepkit.cli").joinpath("new_plugin").iterdir()}
    module = place if file else place / f"{known['module']}.py"
    written = {module: texts[f"{kind}.py"]}
    if not file:
        written |= {place / one: texts[one] for one in ("pyproject.toml", "README.md")}
        written[place / "tests" / f"test_{'_'.join(words)}.py"] = texts.get(f"test_{kind}.py", texts["test.py"])
        (place / "tests").mkdir(parents=True)
    for path, text in written.items():
        write_text(Template(text.read_text("utf-8")).substitute(known), path, PluginError, internal=True)
    tell(f"wrote {', '.join(map(str, written))}")
    tell(f"next: edit {row.edit} in {module}, run 'creepkit check {module}', then")
    if file:
        tell(f"'creepkit --plugin {module}' before any other command")
    else:
        tell(f"'pip install -e ./{place}' and 'pytest {place}': from then on every command knows the {kind} '{name}'")
