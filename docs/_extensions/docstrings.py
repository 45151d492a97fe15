"""Docstrings as they are written in creepkit, turned into reStructuredText; signatures with short names of types.

A docstring is paragraphs of plain text, lines of the form ``name : shape unit, meaning``, lists with hyphens, indented
blocks, and examples after ``>>>``. Nothing in it is markup except backticks, so that a formula such as A*s**n stands as
it is; everything else that reStructuredText would read as markup is escaped here.
"""

import re
from typing import Any

from sphinx.application import Sphinx
from sphinx.ext.autodoc.preserve_defaults import update_default_value

_ENTRY = re.compile(r"^([\w*`][\w*`{}\[\]().,/ -]{0,60}?) : (\S.*)$")
_BULLET = re.compile(r"^- (\S.*)$")
_CODE = re.compile(r"``(.+?)``|`(.+?)`")


def as_restructured_text(lines: list[str]) -> list[str]:
    """Return the lines of a docstring as reStructuredText."""
    result: list[str] = []
    for block in _blocks(lines):
        result += [*_block(block), ""]
    return result


def _blocks(lines: list[str]) -> list[list[str]]:
    """Runs of lines between empty lines; indented runs that follow each other belong together."""
    blocks: list[list[str]] = [[]]
    for line in lines:
        if line.strip():
            blocks[-1].append(line.rstrip())
        elif blocks[-1]:
            blocks.append([])
    merged: list[list[str]] = []
    for block in filter(None, blocks):
        if merged and _is_indented(merged[-1]) and _is_indented(block):
            merged[-1] += ["", *block]
        else:
            merged.append(block)
    return merged


def _is_indented(block: list[str]) -> bool:
    return all(line.startswith(" ") or not line for line in block)


def _block(block: list[str]) -> list[str]:
    if block[0].lstrip().startswith(">>>"):
        return [".. code-block:: pycon", "", *(f"   {line}" for line in block)]
    if _is_indented(block):
        return [".. code-block:: text", "", *(f"   {line}" for line in block)]
    items: list[tuple[str, str]] = []
    for line in block:
        entry, bullet = _ENTRY.match(line), _BULLET.match(line)
        if entry:
            items.append((f"**{_escaped(entry[1].replace('`', ''))}** : ", entry[2]))
        elif bullet:
            items.append(("", bullet[1]))
        elif items:
            head, text = items[-1]
            if not line.startswith(" "):
                items.append(("paragraph", line))
            else:
                items[-1] = (head, f"{text} {line.strip()}")
        else:
            items.append(("paragraph", line))
    return _rendered(items)


def _rendered(items: list[tuple[str, str]]) -> list[str]:
    """Paragraphs and list items, with an empty line wherever one follows the other."""
    lines: list[str] = []
    in_list = False
    for head, text in items:
        is_item = head != "paragraph"
        if is_item != in_list and lines:
            lines.append("")
        lines.append(f"- {head}{_marked(text)}" if is_item else _marked(text))
        in_list = is_item
    return lines


def _marked(text: str) -> str:
    """Code between backticks as literal text, the rest escaped."""
    parts, end = [], 0
    for match in _CODE.finditer(text):
        parts += [_escaped(text[end : match.start()]), rf"\ ``{(match[1] or match[2]).strip()}``\ "]
        end = match.end()
    return "".join([*parts, _escaped(text[end:])]).strip()


def _escaped(text: str) -> str:
    return re.sub(r"([\\*|_`])", r"\\\1", text)


def _process(app: Sphinx, what: str, name: str, item: Any, options: Any, lines: list[str]) -> None:
    lines[:] = as_restructured_text(lines)


def _keep_defaults(app: Sphinx, item: Any, bound_method: bool) -> None:
    """Defaults as the source writes them, unless a decorator gave arguments that are not in the source."""
    if not hasattr(item, "__signature__"):
        update_default_value(item, bound_method)


def _process_signature(
    app: Sphinx, what: str, name: str, item: Any, options: Any, signature: str | None, returns: str | None
) -> tuple[str | None, str | None]:
    """Types without the names of their modules, arrays by their aliases."""
    return _short(signature), _short(returns)


def _short(text: str | None) -> str | None:
    if text is None:
        return None
    text = re.sub(r"~?\b(?:[a-z_]\w*\.)+([A-Za-z_]\w*)", r"\1", text.replace("~", ""))
    for kind, alias in (("float64", "Floats"), ("int64", "Ints"), ("bool", "Bools")):
        text = text.replace(f"ndarray[tuple[Any, ...], dtype[{kind}]]", alias)
    return text.replace("<factory>", "...")


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect to autodoc."""
    app.connect("autodoc-before-process-signature", _keep_defaults)
    app.connect("autodoc-process-docstring", _process)
    app.connect("autodoc-process-signature", _process_signature)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
