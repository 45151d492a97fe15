"""The sources of creepkit as syntax trees: modules, the imports between them, classes and functions."""

from __future__ import annotations

import ast
import tomllib
from fnmatch import fnmatch
from functools import cache
from pathlib import Path

import creepkit
from helpers.paths import ROOT

PACKAGE = Path(creepkit.__file__).parent


@cache
def modules() -> dict[str, Path]:
    """{dotted name: file} of every module; a package goes by its own name."""
    paths = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
        paths[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return paths


@cache
def tree(module: str) -> ast.Module:
    """The syntax tree of a module."""
    return ast.parse(modules()[module].read_text(encoding="utf-8"))


@cache
def imported_modules(module: str) -> set[str]:
    """The modules of creepkit that one imports anywhere: in functions and for type checking too."""
    names = set()
    for node in ast.walk(tree(module)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module} has a relative import"
            submodules = {f"{node.module}.{alias.name}" for alias in node.names}
            names |= submodules & modules().keys() or {str(node.module)}
    return names & modules().keys() - {module, "creepkit"}


@cache
def upward_imports() -> tuple[str, ...]:
    """Patterns "module -> module" of the imports that the contracts of import-linter name as exceptions."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    return tuple(line for contract in contracts["contracts"] for line in contract.get("ignore_imports", ()))


def import_cycles() -> list[list[str]]:
    """Sets of modules each of which is reached from every other, by Tarjan's algorithm."""
    order: dict[str, int] = {}
    lowest: dict[str, int] = {}
    stack: list[str] = []
    cycles = []

    def visit(module: str) -> None:
        order[module] = lowest[module] = len(order)
        stack.append(module)
        allowed = {o for o in imported_modules(module) if any(fnmatch(f"{module} -> {o}", p) for p in upward_imports())}
        for other in imported_modules(module) - allowed:
            if other not in order:
                visit(other)
            if other in stack:
                lowest[module] = min(lowest[module], lowest[other])
        if lowest[module] == order[module]:
            position = stack.index(module)
            component = stack[position:]
            del stack[position:]
            if len(component) > 1:
                cycles.append(sorted(component))

    for module in modules():
        if module not in order:
            visit(module)
    return cycles


@cache
def public_classes(base: str | None = None) -> tuple[tuple[str, str], ...]:
    """(name, module) of every class without a leading underscore; those that name `base` as a base, where given."""
    return tuple(
        (node.name, module)
        for module in modules()
        for node in ast.walk(tree(module))
        if isinstance(node, ast.ClassDef)
        and not node.name.startswith("_")
        and (base is None or base in {b.id for b in node.bases if isinstance(b, ast.Name)})
    )


@cache
def functions() -> tuple[tuple[str, ast.FunctionDef], ...]:
    """(module, definition) of every function and method."""
    return tuple(
        (module, node) for module in modules() for node in ast.walk(tree(module)) if isinstance(node, ast.FunctionDef)
    )


def parameter_count(function: ast.FunctionDef) -> int:
    """The number of named parameters, `self` and `cls` apart."""
    names = [argument.arg for argument in (*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs)]
    return len(names) - (names[:1] in (["self"], ["cls"]))
