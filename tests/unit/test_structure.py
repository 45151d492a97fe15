"""The shape of the sources: no import cycles, one meaning a name, files and signatures of a readable size."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterator

import pytest

from creepkit.records import dimensions_of, outputs_of
from creepkit.records.presentable import function_of_reports
from creepkit.registry import default_registry
from helpers import source_tree

MOST_LINES = 600
MOST_PARAMETERS = 8


def test_no_module_imports_itself_by_way_of_others() -> None:
    """Imports within functions and for type checking count as well, less those that pyproject.toml names."""
    assert source_tree.import_cycles() == []


def test_what_shows_and_draws_records_is_there() -> None:
    texts = "".join(path.read_text(encoding="utf-8") for path in source_tree.modules().values())
    names = re.findall(r"\"([\w.]+)\"", " ".join(re.findall(r"\n    (?:shown|drawn)_by = (.*)", texts)))
    assert len(names) > 40
    assert all(callable(function_of_reports(name)) for name in names)


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


# ---- layers name no specimen -----------------------------------------------------------------------------------------

# Above `specimens/` nothing names a particular specimen: what is needed of one stands in its record.


PACKAGES = ("readers", "quality", "extraction", "inverse", "reports", "cli", "experiments", "forecasts")
PACKAGES += ("screening", "discovery", "studies")
"""No string, attribute or keyword of theirs is such a name; sentences may give one as an example."""


PACKAGES_FOR_ANY_SPECIMEN = ("dataset", "sampling", "surrogates")
"""No word of theirs, in names or sentences, is such a name."""


ALLOWED = {
    "creepkit.cli.demo": "it shows a bulge test",
    "creepkit.cli.shared": "what commands take where no specimen is named",
    "creepkit.extraction.options": "the window of a fit to a camera's frames, of any specimen",
    "creepkit.cli.extract": "the same window",
    "creepkit.studies.cameras": "the same window",
    "creepkit.readers.derived_records": "which specimen load and extension are of, where a file states none",
    "creepkit.readers.imposed": "a ramp of strain that is then held is relaxation",
    "creepkit.readers.names": "what laboratories call the sides of a flat bar",
    "creepkit.studies.alloy_table": "heads of a table of dimples",
}


ORDINARY_WORDS = {"point", "shape", "strain", "stress"}
"""Of the names below, those that mean other things as well."""


def names_of_shipped_specimens() -> set[str]:
    """Names of the specimens that ship, of their outputs and lengths, and what their data sets and surrogates say."""
    names: set[str] = set()
    for entry in default_registry().specimens().values():
        specimen = entry.value
        if not type(specimen).__module__.startswith("creepkit."):
            continue  # of a plugin
        names |= {specimen.name, specimen.surrogate_name or specimen.name, *specimen.dataset_names.values()}
        names |= {str(output) for output in outputs_of(specimen)}
        names |= {name for length in dimensions_of(specimen) for name in length.names}
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


def names_used(tree: ast.AST) -> set[str]:
    """Strings, attributes and keywords of a module."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            found.add(node.value)
        elif isinstance(node, ast.Attribute):
            found.add(node.attr)
        elif isinstance(node, ast.keyword) and node.arg:
            found.add(node.arg)
    return found


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_above_the_specimens_reads_their_records(package: str) -> None:
    forbidden = names_of_shipped_specimens() - {"width", "P1", "P2", "Tj"}  # of tables; of a PressureJump
    named = {
        module: sorted(forbidden & names_used(ast.parse(path.read_text(encoding="utf-8"))))
        for module, path in source_tree.modules().items()
        if module.startswith(f"creepkit.{package}.") and module not in ALLOWED
    }
    assert {module: names for module, names in named.items() if names} == {}
