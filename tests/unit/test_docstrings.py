"""Docstrings: those of public names state the shape of every array, and name only what exists.

An array has an entry `name : (tests, frames) MPa, meaning.` or stands in a sentence as `name (tests, frames)`; what
may be a number says number, scalar or broadcast. What a function returns has its shape in the same docstring.
"""

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import creepkit

ROOT = Path(creepkit.__file__).parent
EXEMPT = ("example_data/",)
"""Data."""
GENERATED = tuple(f"kernels/{kind}_functions.py" for kind in ("llvm", "numpy", "scalar", "torch"))
"""Functions that generated code calls, element by element."""

ARRAY = re.compile(r"\b(Floats|Ints|Bools|NDArray|ndarray|ArrayLike|Tensor)\b")
_SIZE = r"(?:\.{3}|[\w`{}]+(?:[ +*/-]+[\w`{}]+){0,4})"
SHAPE = re.compile(
    rf"\((?:\.{{3}}|{_SIZE},|{_SIZE}(?:,\s+{_SIZE}|\[,\s+{_SIZE}\])+)\)"
    r"|\b(?:numbers?\b(?! of)|scalar|broadcast|any shapes?\b)",
    re.IGNORECASE,
)
ENTRY = re.compile(r"(?:^|(?<=[.;] ))((?:\*{0,2}[A-Za-z_]\w*)(?:,\s+\*{0,2}[A-Za-z_]\w*)*)\s:\s", re.MULTILINE)
ARGUMENT_ENTRY = re.compile(ENTRY.pattern + r"(?:\([^()]*\)|[^.;(])*", re.MULTILINE)
"""What is said of an argument up to the end of the sentence."""

Function = ast.FunctionDef | ast.AsyncFunctionDef


class Documented(NamedTuple):
    """A public class, function or method, its docstring and that of its class."""

    where: str
    node: ast.ClassDef | Function
    text: str
    class_text: str = ""


def modules(exempt: tuple[str, ...]) -> Iterator[tuple[str, ast.Module]]:
    for path in sorted(ROOT.rglob("*.py")):
        name = path.relative_to(ROOT).as_posix()
        if not name.startswith(exempt):
            yield name, ast.parse(path.read_text(encoding="utf-8"))


def public_objects(exempt: tuple[str, ...], private: bool = False) -> Iterator[Documented]:
    for module, tree in modules(exempt):
        for node in tree.body:
            if not isinstance(node, ast.ClassDef | Function) or (node.name.startswith("_") and not private):
                continue
            text = ast.get_docstring(node) or ""
            yield Documented(f"{module}: {node.name}", node, text)
            for member in node.body if isinstance(node, ast.ClassDef) else ():
                if isinstance(member, Function) and (
                    private or not member.name.startswith("_") or member.name in ("__init__", "__call__")
                ):
                    own = ast.get_docstring(member) or ""
                    yield Documented(f"{module}: {node.name}.{member.name}", member, own, text)


def entries(text: str) -> dict[str, str]:
    """{name: what its entry says, up to the next entry or the end of its paragraph}."""
    found: dict[str, str] = {}
    for paragraph in text.split("\n\n"):
        starts = list(ENTRY.finditer(paragraph))
        ends = [s.start() for s in starts[1:]] + [len(paragraph)]
        for start, end in zip(starts, ends, strict=False):
            for name in re.split(r",\s+", start[1]):
                found[name.lstrip("*")] = paragraph[start.end() : end]
    return found


def states_shape(name: str, *texts: str) -> bool:
    for text in texts:
        if SHAPE.search(entries(text).get(name, "")):
            return True
        if any(SHAPE.match(text, m.end()) for m in re.finditer(rf"\b{re.escape(name)}\s", text)):
            return True
    return False


def arguments(node: Function) -> list[ast.arg]:
    every = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
    return every + [a for a in (node.args.vararg, node.args.kwarg) if a is not None]


def is_array(annotation: ast.expr | None) -> bool:
    return annotation is not None and ARRAY.search(ast.unparse(annotation)) is not None


def is_overload(node: Function) -> bool:
    return any("overload" in ast.unparse(d) for d in node.decorator_list)


def arrays_without_shape() -> Iterator[str]:
    for where, node, text, class_text in public_objects((*EXEMPT, *GENERATED)):
        if isinstance(node, ast.ClassDef):
            for field in node.body:
                if not (isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)):
                    continue
                name = field.target.id
                if is_array(field.annotation) and not name.startswith("_") and not states_shape(name, text):
                    yield f"{where}: field {name}"
            continue
        if is_overload(node):
            continue
        for argument in arguments(node):
            if is_array(argument.annotation) and not states_shape(argument.arg, text, class_text):
                yield f"{where}: argument {argument.arg}"
        if is_array(node.returns) and not SHAPE.search(ARGUMENT_ENTRY.sub("", text)):
            yield f"{where}: returns"


def test_the_shape_of_every_array_is_stated() -> None:
    missing = list(arrays_without_shape())
    assert not missing, "no shape of an array is stated in:\n" + "\n".join(missing)
