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

from creepkit.errors import CreepkitError, ExportError, HistoryError, LawError, PluginError, SolveError, nearest
from creepkit.files.writing import write_text
from creepkit.options import Option
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
    def listed(self) -> str:
        """What `creepkit list` calls all of the kind."""
        return "targets" if self.noun == "exporter" else f"{self.noun}s"


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


LAW = PackageKind(
    "law",
    LawError,
    edit="its terms and params",
    check="creepkit check $file",
    use="creepkit list laws $name\ncreepkit check $name",
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
    test="""\
import creepkit as ck


def test_it_keeps_what_every_law_promises() -> None:
    report = ck.check_law(ck.law("$name"))
    assert report.passed, str(report)
""",
)

SPECIMEN = PackageKind(
    "specimen",
    SolveError,
    edit="its lengths, outputs and one()",
    check="creepkit check $file",
    use="creepkit list specimens\ncreepkit check $name",
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
    test='''\
import numpy as np
import pytest

import creepkit as ck

VALUES = {"A": 1e-16, "n": 4.0}
TIMES = np.linspace(3600.0, 3.6e6, 20)


def simulated(force: float) -> ck.History:
    return ck.simulate("norton", "$name", VALUES, loading=ck.constant_load("force", force), times=TIMES)


def test_it_keeps_what_every_specimen_promises() -> None:
    report = ck.check_specimen(ck.specimen("$name"))
    assert report.passed, str(report)


def test_it_is_the_closed_form_of_norton_creep_under_dead_weight() -> None:
    """d(ln l)/dt = A (s l/L)^n has the solution l = L (1 - n A s^n t)^(-1/n)."""
    specimen = ck.specimen("$name")
    stress = specimen.reference_stress(simulated(4000.0))
    stretch = (1 - VALUES["n"] * VALUES["A"] * stress ** VALUES["n"] * TIMES) ** (-1 / VALUES["n"])
    elongation = specimen.gauge_length * (stretch - 1)
    np.testing.assert_allclose(simulated(4000.0).outputs["elongation"], elongation, rtol=1e-5)


def test_the_values_that_made_a_test_are_found_from_it() -> None:
    tests = [simulated(force).replace(name=f"{force:g} N") for force in (3000.0, 4000.0, 5000.0)]
    fit = ck.identify("norton", tests, "$name", starts=1, nuisances=[])
    assert fit.values["n"] == pytest.approx(VALUES["n"], rel=1e-3)
''',
)

READER = PackageKind(
    "reader",
    HistoryError,
    edit="the names of files and columns",
    check="creepkit check $file",
    use="creepkit check $name\ncreepkit identify FOLDER --law norton",
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
    assert bar.loading.program().values.tolist() == [120.0]
    assert bar.temperature == 1023.15
    assert bar.unruptured
""",
)

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


KINDS = {kind.noun: kind for kind in (LAW, SPECIMEN, READER, EXPORTER)}


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
        raise chosen.error(f"there is a {kind} '{name}' already; choose another, see creepkit list {chosen.listed}")
    tell(_write_file(chosen, name) if file else _write_package(chosen, name))


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
