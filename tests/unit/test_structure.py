"""The shape of the sources: no import cycles, one meaning a name, files and signatures of a readable size."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterator

import pytest

from creepkit.records import dimensions_of, outputs_of
from creepkit.registry import default_registry
from helpers import source_tree

MOST_LINES = 400
MOST_PARAMETERS = 8


def test_no_module_imports_itself_by_way_of_others() -> None:
    """Imports within functions and for type checking count as well."""
    assert source_tree.import_cycles() == []


def test_a_public_class_name_has_one_meaning() -> None:
    places = defaultdict(list)
    for name, module in source_tree.public_classes():
        places[name].append(module)
    assert {name: found for name, found in places.items() if len(found) > 1} == {}


def test_no_file_is_too_long_to_read() -> None:
    lengths = {m: len(path.read_text(encoding="utf-8").splitlines()) for m, path in source_tree.modules().items()}
    assert {m: length for m, length in lengths.items() if length > MOST_LINES} == {}


def _is_command(module: str, function: ast.FunctionDef) -> bool:
    """Its parameters are the options of the command line."""
    return module.startswith("creepkit.cli.") and function.name == "command"


def test_no_function_takes_more_than_eight_parameters() -> None:
    wide = {
        f"{module}.{function.name}": source_tree.parameter_count(function)
        for module, function in source_tree.functions()
        if source_tree.parameter_count(function) > MOST_PARAMETERS and not _is_command(module, function)
    }
    assert wide == {}


def test_no_public_name_is_that_of_a_package() -> None:
    """So that `ck.export` is a function, and `import creepkit.exporters` a package, whichever came first."""
    stub = ast.parse((source_tree.PACKAGE / "__init__.pyi").read_text(encoding="utf-8"))
    public = {alias.asname for node in stub.body if isinstance(node, ast.ImportFrom) for alias in node.names}
    packages = {path.parent.name for path in source_tree.PACKAGE.glob("*/__init__.py")}
    assert public & packages == set()


# ---- no specimen is special ------------------------------------------------------------------------------------------

PACKAGES_FOR_ANY_SPECIMEN = ("dataset", "sampling", "surrogates")
"""They read everything of a specimen from its record."""


ORDINARY_WORDS = {"point", "shape", "strain", "stress"}
"""Of the names below, those that mean other things as well."""


def names_of_shipped_specimens() -> set[str]:
    """Names of the specimens that ship, of their outputs and lengths, and what their data sets and surrogates say."""
    names: set[str] = set()
    for entry in default_registry().specimens().values():
        specimen = entry.value
        if not type(specimen).__module__.startswith("creepkit."):
            continue  # of a plugin
        names |= {specimen.name, getattr(specimen, "surrogate_name", specimen.name)}
        names |= {str(output) for output in outputs_of(specimen)}
        names |= {name for length in dimensions_of(specimen) for name in length.names}
        names |= set(getattr(specimen, "dataset_names", {}).values())
    return names - ORDINARY_WORDS


def code_words(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """(line, text) of every identifier and every string that is no docstring."""
    docstrings = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        line = getattr(node, "lineno", 0)
        if isinstance(node, ast.Constant):
            if isinstance(node.value, str) and id(node) not in docstrings:
                yield line, node.value
            continue
        for field in ("id", "attr", "arg", "name", "asname", "module"):
            value = getattr(node, field, None)
            if isinstance(value, str):
                yield line, value


def test_the_names_of_shipped_specimens_are_those_of_their_records() -> None:
    assert {"bulge", "dimple", "uniaxial", "relaxation"} <= names_of_shipped_specimens()
    assert {"amplitude", "width", "apex_thickness", "thickness", "window", "P1", "Tj"} <= names_of_shipped_specimens()
    found = dict(code_words(ast.parse('"""bulge"""\nP1 = f(width=dimple.apex_thickness["the amplitude of"])')))
    assert found.keys() == {2}


@pytest.mark.parametrize("package", PACKAGES_FOR_ANY_SPECIMEN)
def test_a_package_for_any_specimen_names_none(package: str) -> None:
    """Also as parts of longer names, such as LEAST_WIDTH or bulge_stress."""
    words = "|".join(sorted(map(re.escape, names_of_shipped_specimens()), key=len, reverse=True))
    pattern = re.compile(rf"(?<![A-Za-z0-9])({words})(?![A-Za-z0-9])", re.IGNORECASE)
    named = [
        f"{module}:{line}: {match[0]}"
        for module in source_tree.modules()
        if module.split(".")[1:2] == [package]
        for line, text in code_words(source_tree.tree(module))
        if (match := pattern.search(text))
    ]
    assert named == []
