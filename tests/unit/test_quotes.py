"""Messages shorten what a user or a file wrote by errors.quoted(), which also shows control characters as codes."""

import re

from helpers.paths import ROOT

FIELD = re.compile(r"\{[^{}\n]+:\.\d{2,}\}")
"""A field of a formatted text that cuts a text, as `name:.40` in braces does; numbers have a letter behind it."""

SLICE = re.compile(r"""\{[\w.'()\[\]]*\[:\d\d+\][^{}:]*\}|f"[^"\n]*"\[:\d+\]|repr\([^\n]*\)(\[1:-1\])?\[:\d+\]""")
"""A text cut within a formatted text, behind it, or as Python shows it."""

ALLOWED = {"instruments/reading.py", "errors.py"}
"""What is looked through, not shown; quoted() itself."""


def test_no_message_cuts_a_text_by_a_format():
    sources = [*(ROOT / "src").rglob("*.py"), *(ROOT / "plugins").rglob("*.py")]
    found = [f"{path.relative_to(ROOT)}: {one}" for path in sources for one in FIELD.findall(path.read_text())]
    assert found == []


def test_no_message_cuts_a_text_by_a_slice():
    package = ROOT / "src" / "creepkit"
    sources = [path for path in package.rglob("*.py") if path.relative_to(package).as_posix() not in ALLOWED]
    found = [
        f"{path.name}: {one[0]}" for path in sources for one in SLICE.finditer(path.read_text()) if "hash" not in one[0]
    ]
    assert found == []
