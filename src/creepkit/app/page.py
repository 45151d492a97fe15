"""The text of an interactive page: its markup, its style, its scripts and its data, in one document.

The scripts are plain ones, joined in the order of SCRIPTS; they share the one name `creepkitPage`. Data stand in
elements that browsers do not run, and whatever of them is shown is shown as text.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from creepkit.app.contents import PageContents
from creepkit.app.documents import contents_document, law_code_name
from creepkit.app.model_data import embedded_json
from creepkit.app.page_models import page_models
from creepkit.app.runtime_files import runtime_script
from creepkit.exporters.javascript import law_expression
from creepkit.records import LawWithValues

FOLDER = Path(__file__).parent / "page_parts"


SCRIPTS = (
    *("numbers", "elements", "chart", "section", "controls", "law_controls", "test_controls", "test_list"),
    *("copies", "misfit", "own_predictions", "engine", "page"),
)
"""Files of the folder, without their ending, each of which may use those before it."""


LARGEST_PAGE = 1_000_000
"""Bytes of a page that stands alone."""


def page_html(contents: PageContents, *, nonce: str = "", endpoint: str = "") -> str:
    """A whole page. nonce : of the policy of a server. endpoint : where it asks for predictions."""
    models = page_models(contents, shown_first=bool(endpoint))
    policy = "" if endpoint else _POLICY_OF_A_FILE
    mark = f' nonce="{nonce}"' if nonce else ""
    replacements = {
        "policy": policy,
        "title": escaped(contents.title),
        "style": f"<style{mark}>\n{_part('style.css')}</style>",
        "fragment": _fragment(contents_document(contents, models), endpoint),
        "scripts": f"<script{mark}>\n{runtime_script()}\n{law_scripts(contents)}\n{model_scripts(models)}</script>",
        "page_scripts": f"<script{mark}>\n{page_scripts()}</script>",
    }
    text = _part("page.html")
    for name, value in replacements.items():
        text = text.replace(f"<!--{name}-->", value, 1)
    return text


_POLICY_OF_A_FILE = (
    '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; script-src '
    "'unsafe-inline' 'wasm-unsafe-eval'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; "
    "form-action 'none'\">"
)
"""A page that is a file loads nothing and sends nothing."""


def page_style() -> str:
    """The style of pages and fragments; every rule begins with .creepkit-page."""
    return _part("style.css")


@cache
def page_scripts() -> str:
    """The scripts of pages and fragments; they start every fragment of the document that they stand in."""
    return "\n".join(_part(f"{name}.js") for name in SCRIPTS)


def law_scripts(contents: PageContents) -> str:
    """The laws as JavaScript, by the names that the data of the page give them."""
    codes = {law_code_name(one): law_expression(LawWithValues(one.law, one.values)) for one in contents.laws}
    lines = [f"globalThis.creepkitLaws[{json.dumps(name)}] = {code};" for name, code in codes.items()]
    return "\n".join(["globalThis.creepkitLaws ??= {};", *lines])


def model_scripts(models: Mapping[str, str]) -> str:
    """Reduced-order models by the names that the data of the page give them."""
    lines = [f"globalThis.creepkitModels[{json.dumps(name)}] = {text};" for name, text in models.items()]
    return "\n".join(["globalThis.creepkitModels ??= {};", *lines])


def page_fragment(contents: PageContents, *, style: bool = True, scripts: bool = True) -> str:
    """The page as part of another document of HTML.

    style, scripts : whether it brings its own style, and its own scripts and reduced-order models; of several fragments
    in one document the first has to. shared_scripts() are the scripts of all of them.
    """
    models = page_models(contents)
    parts = [f"<style>\n{page_style()}</style>"] if style else []
    parts += [f"<script>\n{runtime_script()}\n{model_scripts(models)}</script>"] if scripts else []
    parts.append(f"<script>\n{law_scripts(contents)}</script>")
    parts.append(_fragment(contents_document(contents, models), kind="embedded"))
    parts += [f"<script>\n{page_scripts()}</script>"] if scripts else []
    return "\n".join(parts)


def shared_scripts(contents: PageContents) -> str:
    """What page_fragment(scripts=False) leaves out, as one script that is loaded after the fragments."""
    return "\n".join([runtime_script(), model_scripts(page_models(contents)), page_scripts()])


def _fragment(document: Mapping[str, Any], endpoint: str = "", kind: str = "") -> str:
    data = embedded_json({**document, "endpoint": endpoint})
    note = "This part of the page needs scripts: it computes creep curves while its sliders are moved."
    return (
        f'<div class="{f"creepkit-page {kind}".strip()}"><noscript><p>{note}</p></noscript>'
        f'<script type="application/json" class="creepkit-page-data">{data}</script></div>'
    )


@cache
def _part(name: str) -> str:
    return (FOLDER / name).read_text(encoding="utf-8")


def escaped(text: str) -> str:
    """Text as HTML shows it."""
    for character, name in (("&", "&amp;"), ("<", "&lt;"), (">", "&gt;"), ('"', "&quot;"), ("'", "&#39;")):
        text = text.replace(character, name)
    return text
