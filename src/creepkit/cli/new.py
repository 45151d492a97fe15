"""`creepkit new`: a law, specimen, reader or exporter plugin to start from, as an installable package or one file."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from string import Template
from typing import Annotated

import typer

from creepkit.errors import PluginError, nearest
from creepkit.files.writing import write_text
from creepkit.options import Option
from creepkit.reports.terminal import tell

NAME_PATTERN = re.compile(r"[a-z][a-z0-9]*(-[a-z0-9]+)*")
"""Names of packages: they become modules and classes as well."""


@dataclass(frozen=True)
class PackageKind:
    """What a package offers, and the texts it begins with.

    In the texts $name, $title, $constant, $class_name, $module and $package stand for names made of the plugin's own.

    module : its text. edit : what its author edits first. use : a command that uses it. test : of the module, where its
    promises alone do not show what it does.
    """

    module: str
    edit: str
    use: str
    test: str = ""


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


TEST = """\
from creepkit.testing import check_named


def test_it_keeps_what_every_${noun}_promises() -> None:
    for report in check_named("$name"):
        assert report.passed, str(report)
"""


README = """\
# $package

$title: say here what it is, and where it was published.

    pip install -e .
    pytest
    creepkit check $name
"""


LAW = PackageKind(
    edit="its terms and params",
    use="    creepkit list laws $name\n",
    module='''\
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
''',
)

SPECIMEN = PackageKind(
    edit="its lengths, outputs and one()",
    use="    creepkit list specimens\n",
    module='''\
"""$title: say here in one line what is loaded, and what is observed."""

from dataclasses import dataclass

import numpy as np

import creepkit as ck


@dataclass(frozen=True)
class ${class_name}Specimen(ck.PerTest):
    """A round bar under a force at its ends, observed by its elongation; put your test piece in its place."""

    gauge_length: float = ck.dimension(50.0)  # mm
    diameter: float = ck.dimension(8.0, tolerance=0.002)

    name = "$name"
    title = "$title"
    outputs = (ck.Output("elongation", "length", noise=0.002),)  # mm
    loads = (ck.Load("force", "force"),)  # N

    def one(self, law, values, history, nuisances):
        """One candidate in one test, {output: (times,)}: the elongation, mm, of a bar under dead weight."""
        force = history.loading.program()
        nominal = ck.RecordedLoading(ck.Program(force.times, force.values / self.area), "stress")
        bar = history.replace(loading=nominal, outputs={}, geometry={}, strain_measure="engineering")
        found = ck.specimen("uniaxial").predict(law, law.to_internal(values), [bar])
        elongation = self.gauge_length * found.of(0)[:, 0]
        return ck.OneTest({"elongation": elongation}, ck.Status(int(found.status[0, 0])), found.end_times[0, 0])

    @property
    def area(self):
        """Of the cross-section, mm^2."""
        return np.pi * self.diameter**2 / 4

    def reference_stress(self, history):
        """The von Mises stress, MPa, that stands for a test."""
        return float(np.max(history.loading.program().values)) / self.area


@ck.hookimpl
def creepkit_specimens():
    return [${class_name}Specimen()]
''',
)

READER = PackageKind(
    edit="the names of files and columns",
    use="    creepkit identify FOLDER --law norton\n",
    module='''\
"""$title: say here whose files these are, and what they hold."""

from creepkit.hookspecs import hookimpl
from creepkit.readers.indexed_folders import IndexedFolderReader
from creepkit.readers.vocabulary import HeaderVocabulary

# Where no such declaration fits your files, write a class with the attributes name and title and two methods:
#     accepts(path) -> bool           whether it reads this file or folder, from a few lines of it
#     read(path) -> list[ck.History]  in MPa, mm, s, K and N; creepkit.errors.HistoryError with file and line
# and return an object of it from the hook.

$constant = IndexedFolderReader(
    name="$name",
    title="$title: a folder with tests.csv (one line a test) and a file <bar>.csv for each test",
    key_column="bar",
    index_file="tests.csv",
    frames_file="{key}.csv",
    vocabulary=HeaderVocabulary(
        synonyms={"load_MPa": "stress_MPa", "elongation_pct": "strain_pct"},  # {its name: that of creepkit}
        end_of_test_terms={"broken": "ruptured", "unloaded": "stopped"},
    ),
)


@hookimpl
def creepkit_readers():
    return [$constant]
''',
    test="""\
from pathlib import Path

import numpy as np

import creepkit as ck


def test_numbers_arrive_in_creepkits_units(tmp_path: Path) -> None:
    (tmp_path / "tests.csv").write_text("bar,load_MPa,temperature_C,ended\\nb7,120,750,unloaded\\n")
    (tmp_path / "b7.csv").write_text("time_h,elongation_pct\\n1,0.02\\n2,0.03\\n")
    report = ck.check_reader(ck.available("readers")["$name"], tmp_path)
    assert report.passed, str(report)

    (bar,) = ck.read_histories(tmp_path, reader="$name")

    np.testing.assert_allclose(bar.times, [3600.0, 7200.0])
    np.testing.assert_allclose(bar.outputs["strain"], [2e-4, 3e-4])
    assert (bar.temperature, bar.unruptured) == (1023.15, True)
""",
)

EXPORTER = PackageKind(
    edit="text()",
    use="    creepkit export norton --to $name --set A=1e-16 --set n=5\n",
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
)


KINDS = {"law": LAW, "specimen": SPECIMEN, "reader": READER, "exporter": EXPORTER}


def command(
    kind: Annotated[str, typer.Argument(metavar="KIND", help="law, specimen, reader or exporter.")],
    name: Annotated[str, typer.Argument(metavar="NAME", help="Its name, such as 'my-law'.")],
    *,
    file: Annotated[bool, Option(help="One file, for --plugin and CREEPKIT_PLUGINS.")] = False,
) -> None:
    """A package that can be installed, with a test; what exists is left as it is."""
    from creepkit.registry import default_registry

    if kind not in KINDS:
        raise PluginError(f"'{kind}' is no kind of plugin; {nearest(kind, KINDS)}")
    chosen = KINDS[kind]
    if not NAME_PATTERN.fullmatch(name):
        raise typer.BadParameter(
            f"'{name}' is not a {kind}'s name: use lower-case words joined by '-', such as my-{kind}"
        )
    if name in getattr(default_registry(), f"{kind}s")():
        every = "targets" if kind == "exporter" else f"{kind}s"
        raise PluginError(f"there is a {kind} '{name}' already; choose another, see creepkit list {every}")
    texts = _names(name)
    path, package, module = Path(f"{name.replace('-', '_')}.py"), Path(name), texts["module"]
    if os.path.lexists(path if file else package):  # it is left as it is
        place = path if file else package
        raise PluginError(f"{place} exists already; it was left as it is, choose another name or move it")
    if file:
        written = {path: chosen.module}
        said = f"wrote {path}; next: edit {chosen.edit}, then run 'creepkit check {path}', "
        said += f"and 'creepkit --plugin {path}' before any other command"
    else:
        if find_spec(module) is not None:
            raise PluginError(f"a module '{module}' is installed already; choose another name than '{name}'")
        written = {
            package / f"{module}.py": chosen.module,
            package / "pyproject.toml": PROJECT,
            package / "README.md": README + chosen.use,
            package / "tests" / f"test_{path.name}": chosen.test or TEST,
        }
        path = package / f"{module}.py"
        said = f"wrote {package}/ ({', '.join(str(one.relative_to(package)) for one in written)})\n"
        said += (
            f"next: edit {chosen.edit} in {path}, run 'creepkit check {path}', then 'pip install -e ./{package}' and "
        )
        said += f"'pytest {package}': from then on every command knows the {kind} '{name}'"
        (package / "tests").mkdir(parents=True)
    for one, text in written.items():
        write_text(Template(text).substitute(texts, noun=kind), one, PluginError, internal=True)  # it was absent
    tell(said)


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
