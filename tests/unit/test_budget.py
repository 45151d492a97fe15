"""The size of the code is a design decision: lines of code of each package, no more than stated here.

Rows are rounded up to fifties, so that a small change fits. Whoever raises one says in the same commit what made it
necessary, and what was removed for it. A line of code is neither blank nor comment nor docstring.
"""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from helpers.paths import ROOT

BUDGET = {
    "api": 288,
    "app": 596,
    "cameras": 823,
    "cli": 2129,
    "composition": 410,
    "core": 67,
    "dataset": 713,
    "discovery": 1389,
    "experiments": 1270,
    "exporters": 3354,
    "extraction": 1289,
    "fem": 1440,
    "files": 1313,
    "forecasts": 1183,
    "instruments": 1159,
    "integration": 801,
    "inverse": 9512,
    "jobs": 245,
    "kernels": 1691,
    "language": 1602,
    "law_search": 765,
    "laws": 136,
    "modules": 749,
    "quality": 1242,
    "readers": 7426,
    "records": 2473,
    "registry": 615,
    "reports": 6718,
    "rupture_assessment": 1825,
    "sampling": 956,
    "screening": 571,
    "specimens": 3177,
    "studies": 2802,
    "surrogates": 1394,
    "testing": 1830,
}
"""{package, or modules beside packages: lines}."""

TESTS = 32_084
"""Lines of tests, those of plugins included, without benchmarks."""


def code_lines(path: Path) -> int:
    """Lines that are neither blank nor comment nor docstring."""
    text, documentation = path.read_text(encoding="utf-8"), set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)) and node.body:
            first = node.body[0]
            if (
                isinstance(first, ast.Expr)
                and isinstance(first.value, ast.Constant)
                and isinstance(first.value.value, str)
            ):
                documentation |= set(range(first.lineno, first.end_lineno + 1))
    lines = ((number, line.strip()) for number, line in enumerate(text.splitlines(), 1))
    return sum(bool(line) and not line.startswith("#") and number not in documentation for number, line in lines)


def lines_of(paths: Iterable[Path]) -> int:
    return sum(map(code_lines, paths))


def sizes() -> Counter[str]:
    """{package: lines of code}; modules beside the packages, and programs of the core, count together."""
    found: Counter[str] = Counter()
    for path in (ROOT / "src").rglob("*.py"):
        parts = path.relative_to(ROOT / "src").parts
        found[parts[1] if len(parts) > 2 else "modules"] += code_lines(path)
    return found


def test_every_package_is_within_its_budget() -> None:
    found = sizes()
    above = {name: (size, BUDGET.get(name, 0)) for name, size in found.items() if size > BUDGET.get(name, 0)}
    assert above == {}, "remove as much as was added, or raise the row and say why"


def test_tests_are_within_their_budget() -> None:
    tests = [path for path in (ROOT / "tests").rglob("*.py") if "benchmarks" not in path.parts]
    assert lines_of([*tests, *(ROOT / "plugins").glob("*/tests/**/*.py")]) <= TESTS
