"""The shape of the sources: no import cycles, one meaning a name, files and signatures of a readable size."""

from __future__ import annotations

import ast
from collections import defaultdict

from helpers import source_tree

MOST_LINES = 600
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
    commands = ("command", "generate", "train", "sweep", "reduce")
    return module.startswith("creepkit.cli.") and function.name in commands


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
