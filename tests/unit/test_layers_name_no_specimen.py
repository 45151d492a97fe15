"""Above `specimens/` nothing names a particular specimen: what is needed of one stands in its record."""

import ast

import pytest

from creepkit.records import dimensions_of, outputs_of
from creepkit.registry import default_registry
from helpers import source_tree

PACKAGES = ("readers", "quality", "inverse", "report", "cli", "experiments", "forecasts", "screening", "discovery")

ORDINARY_WORDS = {"point", "strain", "stress", "shape", "width"}
"""Names of specimens and outputs that are words of mechanics and of plots as well."""

ALLOWED = {
    "creepkit.cli.demo": "it shows a bulge test",
    "creepkit.cli.planned_test": "the specimen of a test that names none",
    "creepkit.screening.planted": "the paper's plate of bulge tests",
}


def names_of_shipped_specimens() -> set[str]:
    """Names of specimens, their outputs and lengths."""
    shipped = [e.value for e in default_registry().specimens().values() if e.provenance.origin.startswith("creepkit ")]
    assert {"bulge", "uniaxial", "relaxation", "point"} <= {one.name for one in shipped}
    lengths = {name for one in shipped for d in dimensions_of(one) for name in d.names}
    return {one.name for one in shipped} | {str(o) for one in shipped for o in outputs_of(one)} | lengths


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
def test_no_specimen_output_or_length_is_named(package: str) -> None:
    forbidden = names_of_shipped_specimens() - ORDINARY_WORDS
    named = {
        module: sorted(forbidden & names_used(ast.parse(path.read_text(encoding="utf-8"))))
        for module, path in source_tree.modules().items()
        if module.startswith(f"creepkit.{package}.") and module not in ALLOWED
    }
    assert {module: names for module, names in named.items() if names} == {}
