"""The interactive page of the law that was found, as a section of a report: the one part of it that needs scripts."""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

from markupsafe import Markup

from creepkit.errors import CreepkitError
from creepkit.reports.html.elements import Fragment, PageSection

if TYPE_CHECKING:
    from creepkit.reports.html.findings import GroupFindings

LARGEST_FRAGMENT = 1_000_000
"""Bytes of the sliders with the tests behind them; of larger ones a page of their own is made."""


_SCRIPT = re.compile(r"<script>(.*?)</script>", re.DOTALL)
"""Scripts that are executed; those of a type hold data."""


def slider_sections(found: Sequence[GroupFindings]) -> list[PageSection]:
    """The section for the law of one material; none for several, for laws that cannot be shown, and for large data."""
    if len(found) != 1:
        return []
    from creepkit.app.contents import page_contents
    from creepkit.app.page import page_fragment

    one = found[0]
    try:
        fragment = page_fragment(page_contents(one.ranking or one.fit, one.fit.histories), style=False)
    except CreepkitError:
        return []
    if len(fragment.encode()) > LARGEST_FRAGMENT:
        return []
    said = "change its parameters over the tests; computed in the browser"
    return [PageSection("sliders", "The law with sliders", [Fragment(Markup(fragment))], result=said)]


def fragment_style(sections: Sequence[PageSection]) -> str:
    """The style of fragments, which stands in the head of the page; "" for none."""
    if not any(isinstance(block, Fragment) for section in sections for block in section.blocks):
        return ""
    from creepkit.app.page import page_style

    return page_style()


def script_policy(sections: Sequence[PageSection]) -> str:
    """The part of the content security policy that lets the scripts of fragments run, and no other; "" for none."""
    blocks = [block for section in sections for block in section.blocks if isinstance(block, Fragment)]
    scripts = [script for block in blocks for script in _SCRIPT.findall(block.markup)]
    hashes = [f"'sha256-{base64.b64encode(hashlib.sha256(s.encode()).digest()).decode()}'" for s in scripts]
    return f"script-src 'wasm-unsafe-eval' {' '.join(hashes)}; " if hashes else ""
