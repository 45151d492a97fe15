"""`creepkit new-reader`: a reader plugin to start from, as an installable package or as one file."""

from __future__ import annotations

from typing import Annotated

import typer

from creepkit.cli.new_package import PackageKind, write_plugin
from creepkit.errors import HistoryError

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


def command(
    name: Annotated[str, typer.Argument(help="Name of the reader, such as 'our-laboratory'.")],
    file: Annotated[bool, typer.Option("--file", help="One file, for --plugin and CREEPKIT_PLUGINS.")] = False,
) -> None:
    """Write a reader to start from, as a package."""
    from creepkit.registry import default_registry

    write_plugin(READER, name, default_registry().readers(), one_file=file)
