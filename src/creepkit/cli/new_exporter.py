"""`creepkit new-exporter`: an exporter plugin to start from, as an installable package or as one file."""

from __future__ import annotations

from typing import Annotated

import typer

from creepkit.cli.new_package import PackageKind, write_plugin
from creepkit.errors import ExportError

EXPORTER = PackageKind(
    "exporter",
    ExportError,
    edit="text()",
    check="creepkit check $file",
    use="creepkit check $name\ncreepkit export norton --to $name --set A=1e-16 --set n=5",
    module='''\
"""$title: say here which program reads the text."""

from creepkit.errors import ExportError
from creepkit.exporters.law_description import comment_lines
from creepkit.hookspecs import hookimpl
from creepkit.records import LawWithValues


class ${class_name}Exporter:
    """A law as its terms and a line for each parameter; put the text that your program reads in its place."""

    name = "$name"
    title = "$title"
    suffix = ".txt"

    def text(self, source: LawWithValues) -> str:
        """Return the text; notes, such as intervals and validity, become comments."""
        law = source.law
        if law.states:
            raise ExportError(f"law '{law.name}' has internal variables, which {self.title} has not; export another")
        if not source.units.is_native:
            raise ExportError(f"{self.title} is in MPa and s; leave the units out")
        lines = comment_lines((source.title, *source.notes), "#")
        lines += [f"rate = {' + '.join(f'({term})' for term in law.terms.values())}"]
        lines += [f"{name} = {value!r}  # {law.table[name].unit}" for name, value in source.values.items()]
        return "\\n".join(lines) + "\\n"


@hookimpl
def creepkit_exporters():
    return [${class_name}Exporter()]
''',
    test="""\
import pytest

import creepkit as ck

VALUES = {"A": 1e-16, "n": 5.0}


def test_it_keeps_what_every_exporter_promises() -> None:
    report = ck.check_exporter(ck.available("exporters")["$name"])
    assert report.passed, str(report)


def test_the_text_says_the_same_as_the_law() -> None:
    text = ck.export("norton", "$name", VALUES)
    space = {"stress": 100.0}
    for line in text.splitlines()[::-1]:  # values before the rate
        exec(line, space)
    assert space["rate"] == pytest.approx(1e-16 * 100.0**5, rel=1e-12)
""",
)


def command(
    name: Annotated[str, typer.Argument(help="Name of the exporter, such as 'our-code'.")],
    file: Annotated[bool, typer.Option("--file", help="One file, for --plugin and CREEPKIT_PLUGINS.")] = False,
) -> None:
    """Write an exporter to start from, as a package."""
    from creepkit.registry import default_registry

    write_plugin(EXPORTER, name, default_registry().exporters(), one_file=file)
