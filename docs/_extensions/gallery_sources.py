"""Copies the numbered examples to build/gallery, the folder that sphinx-gallery reads.

The folder examples/ also holds scripts for a cluster, with a README of their own, which are no part of the gallery.
A docstring whose first paragraph is not underlined becomes a title, so that every page of the gallery has one.
"""

import ast
import re
import shutil
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.config import Config

EXAMPLES = Path(__file__).parents[2] / "examples"
TARGET = Path(__file__).parents[2] / "build" / "gallery"

HEADER = """\
Examples
========

Numbered scripts that run as they stand; the tests run each of them. They are shown here with their source.
"""


def copy_examples(app: Sphinx, config: Config) -> None:
    """Write build/gallery anew."""
    shutil.rmtree(TARGET, ignore_errors=True)
    TARGET.mkdir(parents=True)
    for script in sorted(EXAMPLES.glob("[0-9]*.py")):
        (TARGET / script.name).write_text(with_title(script.read_text(encoding="utf-8")), encoding="utf-8")
    (TARGET / "GALLERY_HEADER.rst").write_text(HEADER, encoding="utf-8")


def with_title(source: str) -> str:
    """Return the script with a docstring that begins with an underlined title."""
    docstring = ast.get_docstring(ast.parse(source), clean=False) or ""
    title, _, rest = docstring.partition("\n\n")
    if re.search(r"^[=\-*#~]{3,}$", title, flags=re.MULTILINE):
        return source
    title = " ".join(title.split()).rstrip(".")
    return source.replace(docstring, f"\n{title}\n{'=' * len(title)}\n\n{rest}", 1)


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect before sphinx-gallery looks for its folder."""
    app.connect("config-inited", copy_examples, priority=1)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
