"""The page of what is said when: every sentence of creepkit.reports.answer with its condition, read from the source."""

import ast
import inspect
from collections.abc import Iterator

from creepkit.reports import answer

HEADINGS = {
    "_held": "A law that its search holds",
    "_contradictions": "What keeps a law from describing the tests",
    "_choice": "What else the tests allow",
    "_precision": "What the tests do not determine",
    "_data": "Data",
    "next_step": "What to do next",
}
"""{function of creepkit.reports.answer: heading of its sentences}, in the order in which cautions are given."""


def findings_page() -> str:
    """The page as reStructuredText."""
    title = "What is said when"
    lines = [
        title,
        "=" * len(title),
        "",
        "Cautions and advice of an answer, the most serious first; in brackets what is put in.",
        "",
    ]
    for name, heading in HEADINGS.items():
        function = ast.parse(inspect.getsource(getattr(answer, name))).body[0]
        lines += [heading, "-" * len(heading), ""]
        lines += [
            f"- {text}{condition and f' — where ``{condition}``'}" for text, condition in _sentences(function, "")
        ]
        lines.append("")
    return "\n".join(lines)


def _sentences(node: ast.AST, condition: str) -> Iterator[tuple[str, str]]:
    """Each sentence below a node, and the condition of the innermost branch that it stands in."""
    if isinstance(node, ast.Yield | ast.Return | ast.YieldFrom) and node.value is not None:
        for one in ast.walk(node.value):
            if isinstance(one, ast.JoinedStr | ast.Constant) and len(text := _text(one)) > 20 and " " in text:
                yield text, condition
                break
        return
    for name, value in ast.iter_fields(node):
        inner = condition
        if isinstance(node, ast.If) and name == "body":
            inner = ast.unparse(node.test)
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST):
                yield from _sentences(child, inner)


def _text(node: ast.JoinedStr | ast.Constant) -> str:
    """A string with the names of what is put into it."""
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else ""
    parts = (one.value if isinstance(one, ast.Constant) else f"[{ast.unparse(one.value)}]" for one in node.values)
    return "".join(parts)
