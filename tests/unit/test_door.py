"""The public names of the package."""

import ast
import importlib
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import creepkit


def declared() -> dict[str, str]:
    """{name: module} of the imports that a type checker sees."""
    tree = ast.parse(Path(creepkit.__file__).read_text())
    guarded = next(node for node in tree.body if isinstance(node, ast.If))
    imports = [node for node in guarded.body if isinstance(node, ast.ImportFrom)]
    return {alias.asname or alias.name: node.module or "" for node in imports for alias in node.names}


def test_a_type_checker_sees_the_names_that_python_finds() -> None:
    seen = {name: home for name, home in declared().items() if name != "errors"}

    assert seen == creepkit._PUBLIC
    assert set(seen) <= set(dir(creepkit))


@pytest.mark.parametrize(("name", "home"), declared().items())
def test_a_public_name_is_what_its_home_says(name: str, home: str) -> None:
    module = importlib.import_module(home)

    assert getattr(creepkit, name) is getattr(module, name)
    assert inspect.getdoc(getattr(creepkit, name))


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="module 'creepkit' has no attribute 'no_such_name'"):
        creepkit.no_such_name  # noqa: B018


@pytest.mark.parametrize("first", ["import creepkit.laws, creepkit.export, creepkit.specimens", "ck.laws, ck.export"])
def test_a_verb_is_not_shadowed_by_the_package_of_its_name(first: str) -> None:
    code = f"""
import creepkit as ck
{first}
import creepkit.laws, creepkit.export, creepkit.specimens
from creepkit.laws.norton import NORTON
assert callable(ck.laws) and callable(ck.export) and callable(ck.specimens), (ck.laws, ck.export, ck.specimens)
"""
    subprocess.run([sys.executable, "-c", code], check=True)
