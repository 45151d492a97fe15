"""Structure of the source in numbers.

    python tests/benchmarks/structure.py [ROOT] [--verbose] [--write]

Counted under ROOT/src, by default this project. A cycle is a set of modules that import each other, imports inside
functions and for types included. Parameters are counted without `self`. Public functions and classes are those of
modules whose names do not begin with an underscore, public methods included. The counts before the reorganisation
are on the page "Structure in numbers" of the design. With --verbose every case is named.
"""

from __future__ import annotations

import ast
import statistics
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from measured import Page, arguments, progress

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = "creepkit"
MOST_PARAMETERS = 8
MOST_LINES = 400


@dataclass(frozen=True)
class SourceModule:
    """One module: its name, number of lines, syntax tree, and the comments that switch off the formatter."""

    name: str
    lines: int
    tree: ast.Module
    unformatted: int


@dataclass(frozen=True)
class Count:
    """One number of the table, and the cases behind it."""

    what: str
    number: float
    cases: tuple[str, ...] = ()


def read_modules(root: Path) -> dict[str, SourceModule]:
    """{module name: module} of every Python file under root/src."""
    modules = {}
    for path in sorted((root / "src").rglob("*.py")):
        parts = path.relative_to(root / "src").with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        text = path.read_text(encoding="utf-8")
        modules[name] = SourceModule(name, len(text.splitlines()), ast.parse(text), text.count("fmt: skip"))
    return modules


def import_graph(modules: dict[str, SourceModule]) -> dict[str, set[str]]:
    """{module: modules that it imports anywhere}; the top-level package, which imports nothing eagerly, is left out."""
    graph = {}
    for name, module in modules.items():
        imported = {target for target in _imports(module.tree, modules) if target not in (name, PACKAGE)}
        graph[name] = imported
    graph.pop(PACKAGE, None)
    return graph


def _imports(tree: ast.Module, modules: dict[str, SourceModule]) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                full = f"{node.module}.{alias.name}"
                target = full if full in modules else node.module
                if target in modules:
                    yield target
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in modules)


def cycles(graph: dict[str, set[str]]) -> list[list[str]]:
    """Strongly connected components of more than one module."""
    remaining, components = set(graph), []
    while remaining:
        start = min(remaining)
        component = _reachable(graph, start) & _reachable(_reversed(graph), start)
        remaining -= component
        if len(component) > 1:
            components.append(sorted(component))
    return sorted(components)


def _reachable(graph: dict[str, set[str]], start: str) -> set[str]:
    found, queue = {start}, [start]
    while queue:
        for target in graph.get(queue.pop(), ()):
            if target in graph and target not in found:
                found.add(target)
                queue.append(target)
    return found


def _reversed(graph: dict[str, set[str]]) -> dict[str, set[str]]:
    importers: dict[str, set[str]] = {name: set() for name in graph}
    for name, targets in graph.items():
        for target in targets & graph.keys():
            importers[target].add(name)
    return importers


def class_names_with_two_meanings(modules: dict[str, SourceModule]) -> dict[str, list[str]]:
    """{public class name: modules that define it} of names that stand in more than one."""
    places = defaultdict(list)
    for module in modules.values():
        for node in ast.walk(module.tree):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places[node.name].append(module.name)
    return {name: where for name, where in sorted(places.items()) if len(where) > 1}


def _functions(module: SourceModule) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef]:
    return (node for node in ast.walk(module.tree) if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)))


def parameter_count(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Number of parameters, without self and cls."""
    positional = [argument.arg for argument in (*function.args.posonlyargs, *function.args.args)]
    return len(positional) + len(function.args.kwonlyargs) - (positional[:1] in (["self"], ["cls"]))


def counts(root: Path) -> list[Count]:
    """All counts of one tree."""
    modules = read_modules(root)
    graph = import_graph(modules)
    lines = {name: module.lines for name, module in modules.items()}
    wide = [
        f"{m.name}.{f.name}" for m in modules.values() for f in _functions(m) if parameter_count(f) > MOST_PARAMETERS
    ]
    local = [f"{m.name}.{f.name}" for m in modules.values() for f in _functions(m) if _has_import(f)]
    twice = class_names_with_two_meanings(modules)
    components = cycles(graph)
    importers = Counter(target for targets in graph.values() for target in targets)
    public = [(m.name, node) for m in modules.values() for node in _public(m.tree)]
    documented = [node for _, node in public if ast.get_docstring(node)]
    return [
        Count("Python files", len(modules)),
        Count("lines", sum(lines.values())),
        Count("lines of a file, median", statistics.median(lines.values())),
        Count("lines of the longest file", max(lines.values())),
        Count(f"files above {MOST_LINES} lines", *_cases(n for n, k in lines.items() if k > MOST_LINES)),
        Count("import cycles", *_cases(", ".join(component) for component in components)),
        Count(
            "public class names with more than one meaning", *_cases(f"{n}: {', '.join(w)}" for n, w in twice.items())
        ),
        Count(f"functions with more than {MOST_PARAMETERS} parameters", *_cases(wide)),
        Count("functions with imports inside", *_cases(local)),
        Count("modules with one importer", sum(1 for name in graph if importers[name] == 1)),
        Count("comments fmt: skip", sum(module.unformatted for module in modules.values())),
        Count("public functions and classes", len(public)),
        Count("public functions and classes with a docstring", len(documented)),
    ]


def _cases(items: Iterator[str] | list[str]) -> tuple[int, tuple[str, ...]]:
    named = tuple(sorted(items))
    return len(named), named


def _has_import(function: ast.AST) -> bool:
    return any(isinstance(node, (ast.Import, ast.ImportFrom)) for node in ast.walk(function))


def _public(tree: ast.Module) -> Iterator[ast.FunctionDef | ast.ClassDef]:
    """Public functions and classes of a module, with the public methods of the classes."""
    for node in tree.body:
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)) and not node.name.startswith("_"):
            yield node
            if isinstance(node, ast.ClassDef):
                members = (n for n in node.body if isinstance(n, ast.FunctionDef))
                yield from (member for member in members if not member.name.startswith("_"))


def main() -> None:
    """Print the table, and write its page on request."""
    parser = arguments(__doc__)
    parser.add_argument("root", nargs="?", type=Path, default=ROOT)
    parser.add_argument("--verbose", action="store_true", help="name every case")
    options = parser.parse_args()
    page = Page("structure", __doc__)
    page.table("count, under src", "number")
    rows = counts(options.root)
    for row in rows:
        page.row(row.what, f"{row.number:,g}")
    if options.verbose:
        progress("\n".join(f"{row.what}: {case}" for row in rows for case in row.cases))
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
