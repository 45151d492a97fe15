"""What the tests notice: the share of small errors, put into the source one at a time, that make a test fail.

    python tests/benchmarks/mutations.py RESULTS [--like OTHER_RESULTS] [--checkout FOLDER] [--limit SECONDS]

An error is one operator, comparison, number, truth value or returned value of `kernels`, `inverse`, `specimens`, `fem`
or the C++ core, drawn with a fixed seed. The tests of the package run on a copy of the project, those that enter the
function concerned, quickest first, up to a limit of time, until one fails. With --like the errors are those of another
commit, where their line still stands in a function of that name. RESULTS has one line of JSON for each error and is
continued where it was cut.
"""

from __future__ import annotations

import ast
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import measured

SEED = 38
SHARES = {"kernels": 22, "inverse": 30, "specimens": 22, "fem": 16, "core": 10}
TESTS = {
    "kernels": ["tests/unit/kernels", "tests/verification/test_parity.py", "tests/conformance"],
    "inverse": ["tests/unit/inverse", "tests/conformance"],
    "specimens": ["tests/unit/specimens", "tests/conformance"],
    "fem": ["tests/unit/fem", "tests/verification"],
    "core": ["tests/unit/core", "tests/unit/integration", "tests/unit/fem", "tests/unit/specimens"],
}
PYTHON_OPERATORS = {
    ast.Lt: ("<", "<="), ast.LtE: ("<=", "<"), ast.Gt: (">", ">="), ast.GtE: (">=", ">"),
    ast.Eq: ("==", "!="), ast.NotEq: ("!=", "=="), ast.Is: ("is", "is not"), ast.IsNot: ("is not", "is"),
    ast.In: ("in", "not in"), ast.NotIn: ("not in", "in"), ast.Add: ("+", "-"), ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"), ast.Div: ("/", "*"), ast.Pow: ("**", "*"), ast.And: ("and", "or"), ast.Or: ("or", "and"),
}  # fmt: skip
CORE_OPERATORS = {
    " < ": " <= ", " <= ": " < ", " > ": " >= ", " >= ": " > ", " == ": " != ", " != ": " == ", " + ": " - ",
    " - ": " + ", " * ": " / ", " / ": " * ", " && ": " || ", " || ": " && ", "true": "false", "false": "true",
    "0.5": "0.6", "2.0": "3.0",
}  # fmt: skip


@dataclass(frozen=True)
class Mutation:
    """One replaced text: the line and column where it stands, the function's name and the stripped line to find it."""

    package: str
    path: str
    function: str
    text: str
    line: int
    column: int
    before: str
    after: str

    @property
    def key(self) -> str:
        """What tells it from others, on any commit."""
        return f"{self.package}:{self.function}:{self.text}:{self.column}:{self.after}"

    def apply(self, root: Path) -> str:
        """Write the changed file and return what it held."""
        path = root / self.path
        original = path.read_text(encoding="utf-8")
        lines = original.splitlines(keepends=True)
        line = lines[self.line - 1]
        assert line[self.column :].startswith(self.before), f"{self} is not in {line!r}"
        lines[self.line - 1] = line[: self.column] + self.after + line[self.column + len(self.before) :]
        path.write_text("".join(lines), encoding="utf-8")
        return original


# ---- the places -----------------------------------------------------------------------------------------------------


def python_mutations(root: Path, package: str) -> Iterator[Mutation]:
    """Every place of a package, inside functions, that can be changed."""
    for path in sorted((root / "src/creepkit" / package).rglob("*.py")):
        source = path.read_text(encoding="utf-8")
        lines = source.splitlines()
        for function, node in _expressions(ast.parse(source)):
            for line, column, before, after in _changes(node, lines):
                yield Mutation(
                    package, str(path.relative_to(root)), function, lines[line - 1].strip(), line, column, before, after
                )


def _expressions(tree: ast.Module) -> Iterator[tuple[str, ast.AST]]:
    """The nodes within functions, without annotations, defaults and messages of errors."""

    def walk(node: ast.AST, function: str) -> Iterator[tuple[str, ast.AST]]:
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            for statement in node.body:
                yield from walk(statement, node.name)
        elif isinstance(node, ast.AnnAssign):
            if node.value is not None:
                yield from walk(node.value, function)
        elif not isinstance(node, (ast.Raise, ast.JoinedStr)):
            if function:
                yield function, node
            for child in ast.iter_child_nodes(node):
                yield from walk(child, function)

    return walk(tree, "")


def _changes(node: ast.AST, lines: list[str]) -> Iterator[tuple[int, int, str, str]]:
    """Line, column, text before and after of the changes that a node admits."""
    if isinstance(node, ast.Compare) and len(node.ops) == 1:
        yield from _between(node.left, node.comparators[0], node.ops[0], lines)
    elif isinstance(node, ast.BinOp):
        yield from _between(node.left, node.right, node.op, lines)
    elif isinstance(node, ast.BoolOp):
        yield from _between(node.values[0], node.values[1], node.op, lines)
    elif isinstance(node, ast.Constant) and isinstance(node.value, (bool, int, float)):
        before = lines[node.lineno - 1][node.col_offset : node.end_col_offset]
        after = str(not node.value) if isinstance(node.value, bool) else repr(node.value + 1)
        yield node.lineno, node.col_offset, before, after
    elif isinstance(node, ast.Return) and node.value is not None and node.lineno == node.end_lineno:
        before = lines[node.lineno - 1][node.col_offset : node.end_col_offset]
        if before != "return None":
            yield node.lineno, node.col_offset, before, "return None"


def _between(
    left: ast.expr, right: ast.expr, operator: ast.AST, lines: list[str]
) -> Iterator[tuple[int, int, str, str]]:
    pair = PYTHON_OPERATORS.get(type(operator))
    if pair and left.end_lineno == right.lineno:
        text = lines[right.lineno - 1].encode()
        start = text[left.end_col_offset : right.col_offset].decode().find(pair[0])
        if start >= 0 and len(text) == len(text.decode()):
            yield right.lineno, left.end_col_offset + start, *pair


def core_mutations(root: Path) -> Iterator[Mutation]:
    """Every place of the C++ core, outside comments and declarations of templates."""
    folder = root / "src/core"
    for path in sorted([*folder.rglob("*.cpp"), *folder.rglob("*.hpp")]):
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            code = line.partition("//")[0]
            if code.lstrip().startswith(("#", "template", "*", "/*", "static_assert")) or "operator" in code:
                continue
            for before, after in CORE_OPERATORS.items():
                for match in re.finditer(re.escape(before), code):
                    relative = str(path.relative_to(root))
                    yield Mutation("core", relative, path.stem, line.strip(), number, match.start(), before, after)


def drawn_mutations(root: Path) -> list[Mutation]:
    """The mutations of all packages, drawn with the seed."""
    drawn = []
    for package, share in SHARES.items():
        places = list(core_mutations(root) if package == "core" else python_mutations(root, package))
        drawn += random.Random(f"{SEED}{package}").sample(places, share)
    return drawn


def same_mutations(root: Path, results: Path) -> list[Mutation]:
    """The mutations of another commit's results whose line still stands in a function of that name."""
    wanted = {Mutation(**row["mutation"]).key for row in map(json.loads, results.read_text().splitlines())}
    found = {}
    for package in SHARES:
        for mutation in core_mutations(root) if package == "core" else python_mutations(root, package):
            if mutation.key in wanted:
                found.setdefault(mutation.key, mutation)
    return list(found.values())


# ---- the copy and its tests -----------------------------------------------------------------------------------------


def copy_of(checkout: Path, folder: Path) -> Path:
    """Copy the tracked files of a checkout, with its compiled core, into a folder."""
    shutil.rmtree(folder, ignore_errors=True)
    tracked = subprocess.run(["git", "ls-files", "-z"], cwd=checkout, capture_output=True, check=True, text=True).stdout
    built = [*checkout.glob("src/creepkit/core/*.so"), *checkout.glob("src/creepkit/app/*.wasm")]
    for name in [*filter(None, tracked.split("\0")), *(str(path.relative_to(checkout)) for path in built)]:
        if (checkout / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(checkout / name, folder / name)
    subprocess.run(["git", "init", "--quiet"], cwd=folder, check=True)
    return folder


def compiled_core(root: Path, library: Path) -> bool:
    """Compile the core in seconds: lightly optimised, for one width of vectors. False where it does not compile."""
    sources = root / "src/core"
    flags = ["-O1", "-std=c++17", "-fPIC", "-fno-exceptions", "-fno-rtti", "-fvisibility=hidden"]
    objects = library.parent / "objects"
    objects.mkdir(exist_ok=True)
    made = []
    for path in sorted([*sources.glob("*.cpp"), *sources.glob("lanes/*.cpp")]):
        lanes = ["-DCREEPKIT_LANES=2", "-Dcreepkit=creepkit_lanes_2"] if path.parent.name == "lanes" else []
        made.append(objects / f"{path.parent.name}_{path.stem}.o")
        dependencies = made[-1].with_suffix(".d")
        used = dependencies.read_text().replace("\\\n", " ").split()[1:] if dependencies.exists() else []
        if used and all(Path(name).stat().st_mtime < made[-1].stat().st_mtime for name in used):
            continue
        command = ["g++", *flags, *lanes, f"-I{sources}", "-MMD", "-c", str(path), "-o", str(made[-1])]
        if subprocess.run(command, capture_output=True).returncode:
            return False
    linked = subprocess.run(["g++", "-shared", *map(str, made), "-o", str(library)], capture_output=True)
    return linked.returncode == 0


def tests_run(root: Path, paths: list[str], seconds: float, environment: dict[str, str], *options: str) -> int | None:
    """Run tests of the copy and return pytest's exit code; None where the limit of time ended them."""
    set_up = {"PYTHONPATH": os.pathsep.join([str(root / "src"), str(Path(__file__).parent)]), "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "pytest", "-q", "-p", "mutations", "-p", "no:cacheprovider", *options, *paths]
    process = subprocess.Popen(
        command, cwd=root, env={**os.environ, **set_up, **environment}, stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL, start_new_session=True,
    )  # fmt: skip
    try:
        return process.wait(seconds)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        return None


def existing(root: Path, paths: list[str]) -> list[str]:
    """The paths that this commit has."""
    return [path for path in paths if (root / path).exists()]


def probed(root: Path, package: str, mutations: list[Mutation], folder: Path) -> tuple[dict[str, float], dict]:
    """Run a package's tests once: seconds of those that pass, and which of them enter each mutation's function."""
    originals = {}
    for number, mutation in sorted(enumerate(mutations), key=lambda pair: -pair[1].line):
        if package == "core":
            break
        path = root / mutation.path
        source = path.read_text(encoding="utf-8")
        originals.setdefault(path, (source, path.stat()))
        path.write_text(_with_call(source, mutation, number), encoding="utf-8")
    log = folder / f"{package}.probe"
    log.unlink(missing_ok=True)
    environment = {"MUTATIONS_LOG": str(log), "CREEPKIT_CACHE": str(folder / "cache" / package)}
    if package == "core":
        environment["CREEPKIT_CORE"] = str(folder / "libcreepkit_core.so")
    try:
        tests_run(root, existing(root, TESTS[package]), 3600, environment, "-m", "not long_when_sanitized")
    finally:
        for path, (source, status) in originals.items():
            path.write_text(source, encoding="utf-8")
            os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))
    durations: dict[str, float] = {}
    entered: dict[int, set[str]] = {}
    for kind, *values in map(json.loads, log.read_text().splitlines()):
        if kind == "passed":
            durations[values[0]] = values[1]
        elif kind == "entered":
            entered.setdefault(values[0], set()).add(values[1])
    return durations, entered


def _with_call(source: str, mutation: Mutation, number: int) -> str:
    """The source with a call of `enter` at the beginning of the innermost function around a mutation."""
    functions = [
        node
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.FunctionDef) and node.lineno <= mutation.line <= node.end_lineno
    ]
    body = max(functions, key=lambda node: node.lineno).body
    is_documented = isinstance(body[0], ast.Expr) and isinstance(body[0].value, ast.Constant) and len(body) > 1
    first = body[1 if is_documented else 0]
    lines = source.splitlines(keepends=True)
    lines.insert(first.lineno - 1, " " * first.col_offset + f"__import__('mutations').enter({number})\n")
    return "".join(lines)


# ---- within pytest --------------------------------------------------------------------------------------------------

_ENTERED: set[tuple[int, str]] = set()


def enter(number: int) -> None:
    """Log, once for each test, that the function of a mutation runs."""
    test = os.environ.get("PYTEST_CURRENT_TEST", "").rpartition(" ")[0]
    if (number, test) not in _ENTERED and "MUTATIONS_LOG" in os.environ:
        _ENTERED.add((number, test))
        _log("entered", number, test)


def _log(*row: object) -> None:
    with open(os.environ["MUTATIONS_LOG"], "a", encoding="utf-8") as file:
        file.write(json.dumps(row) + "\n")


def pytest_runtest_logreport(report: object) -> None:
    """Log the seconds of a test that passes, or which test fails."""
    if "MUTATIONS_LOG" in os.environ and report.failed:
        _log("failed", report.nodeid)
    elif "MUTATIONS_LOG" in os.environ and report.when == "call" and report.passed:
        _log("passed", report.nodeid, report.duration)


def pytest_collection_modifyitems(config: object, items: list) -> None:
    """Keep the tests of the file that MUTATIONS_TESTS names, in its order."""
    if "MUTATIONS_TESTS" in os.environ:
        order = {name: k for k, name in enumerate(json.loads(Path(os.environ["MUTATIONS_TESTS"]).read_text()))}
        items[:] = sorted((item for item in items if item.nodeid in order), key=lambda item: order[item.nodeid])


# ---- the program ----------------------------------------------------------------------------------------------------


def selected(durations: dict[str, float], tests: set[str], limit: float) -> list[str]:
    """The tests that enter a function, quickest first, up to a limit of seconds in all."""
    chosen, total = [], 0.0
    for name in sorted(tests & durations.keys(), key=durations.__getitem__):
        total += durations[name]
        if total > limit:
            break
        chosen.append(name)
    return chosen


def verdict(root: Path, mutation: Mutation, tests: list[str], seconds: float, folder: Path) -> tuple[str, str]:
    """Whether the tests kill a mutation, and which of them does, if one.

    The first is: killed, killed by the limit of time, not compiled, not entered or survived.
    """
    if not tests:
        return "not entered", ""
    path, listed, log = root / mutation.path, folder / "tests.json", folder / "mutant.log"
    listed.write_text(json.dumps(tests))
    log.write_text("")
    cache = folder / "cache" / ("mutant" if mutation.package == "kernels" else mutation.package)
    if mutation.package == "kernels":
        shutil.rmtree(cache, ignore_errors=True)
    environment = {
        "MUTATIONS_TESTS": str(listed), "MUTATIONS_LOG": str(log), "CREEPKIT_CACHE": str(cache),
        "PYTHONDONTWRITEBYTECODE": "1",
    }  # fmt: skip
    status = path.stat()
    original = mutation.apply(root)
    try:
        if mutation.package == "core":
            environment["CREEPKIT_CORE"] = str(folder / "libcreepkit_core.so")
            if not compiled_core(root, folder / "libcreepkit_core.so"):
                return "not compiled", ""
        files = sorted({name.partition("::")[0] for name in tests})
        code = tests_run(root, files, seconds, environment, "-x")
    finally:
        path.write_text(original, encoding="utf-8")
        if mutation.package != "core":  # what was compiled of it is older than the file again
            os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))
    failed = [values[0] for kind, *values in map(json.loads, log.read_text().splitlines()) if kind == "failed"]
    result = "killed by the limit of time" if code is None else "survived" if code in (0, 5) else "killed"
    return result, failed[0] if failed else ""


def main() -> None:
    parser = measured.arguments(__doc__)
    parser.add_argument("results", type=Path)
    parser.add_argument("--like", type=Path)
    parser.add_argument("--checkout", type=Path, default=Path(__file__).resolve().parents[2])
    parser.add_argument("--limit", type=float, default=150, help="seconds of tests for one mutation")
    options = parser.parse_args()
    folder = options.results.resolve().with_suffix(".work")
    folder.mkdir(parents=True, exist_ok=True)
    root = copy_of(options.checkout.resolve(), folder / "copy")
    mutations = same_mutations(root, options.like) if options.like else drawn_mutations(root)
    done = options.results.read_text().splitlines() if options.results.exists() else []
    keys = {Mutation(**json.loads(line)["mutation"]).key for line in done}
    for package in SHARES:
        left = [mutation for mutation in mutations if mutation.package == package and mutation.key not in keys]
        if left and (package != "core" or compiled_core(root, folder / "libcreepkit_core.so")):
            durations, entered = probed(root, package, left, folder)
            for number, mutation in enumerate(left):
                tests = durations.keys() if package == "core" else entered.get(number, set())
                chosen, start = selected(durations, set(tests), options.limit), time.monotonic()
                seconds = 60 + 3 * sum(durations[name] for name in chosen)
                result, killer = verdict(root, mutation, chosen, seconds, folder)
                row = {"mutation": asdict(mutation), "verdict": result, "tests": len(chosen), "killer": killer}
                with options.results.open("a") as file:
                    file.write(json.dumps({**row, "seconds": round(time.monotonic() - start, 1)}) + "\n")
                measured.progress(f"{mutation.key}: {result}")
    page = shares(options.results)
    if options.write:
        page.write()


def shares(results: Path) -> measured.Page:
    """The table: errors of each package, and how many of them make a test fail."""
    rows = [json.loads(line) for line in results.read_text().splitlines()]
    page = measured.Page("mutations", __doc__)
    page.table("package", "errors", "noticed", "in functions that no test enters")
    for package in SHARES:
        of_package = [row["verdict"] for row in rows if row["mutation"]["package"] == package]
        tried = [result for result in of_package if result != "not compiled"]
        noticed = sum(result.startswith("killed") for result in tried)
        page.row(package, len(tried), noticed, tried.count("not entered"))
    return page


if __name__ == "__main__":
    main()
