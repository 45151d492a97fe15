"""Messages shorten what a user or a file wrote by errors.quoted(), which also shows control characters as codes."""

import re

from helpers.paths import ROOT

FIELD = re.compile(r"\{[^{}\n]+:\.\d{2,}\}")
"""A field of a formatted text that cuts a text, as `name:.40` in braces does; numbers have a letter behind it."""


def test_no_message_cuts_a_text_by_a_format():
    sources = [*(ROOT / "src").rglob("*.py"), *(ROOT / "plugins").rglob("*.py")]
    found = [f"{path.relative_to(ROOT)}: {one}" for path in sources for one in FIELD.findall(path.read_text())]
    assert found == []
