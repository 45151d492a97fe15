"""The text of an interactive page: its markup, its style, its scripts and its data, in one document.

The scripts are plain ones, joined in the order of SCRIPTS; they share the one name `creepkitPage`. Data stand in
elements that browsers do not run, and whatever of them is shown is shown as text.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import cache
from html import escape
from pathlib import Path

from creepkit.app.contents import PageContents, PageSource, page_contents
from creepkit.app.documents import contents_document
from creepkit.app.models import page_models
from creepkit.app.runtime_files import runtime_script
from creepkit.checked_arguments import checked
from creepkit.errors import ExportError
from creepkit.exporters.javascript import law_expression, script_safe_json
from creepkit.files.writing import check_target, write_text
from creepkit.records import History, LawWithValues

SCRIPTS = (
    *("numbers", "elements", "chart", "section", "controls", "law_controls", "test_controls", "test_list"),
    *("copies", "misfit", "predictions", "page"),
)
"""Files of the folder page_parts, without their ending, each of which may use those before it."""


LARGEST_PAGE = 1_000_000
"""Bytes of a page."""


POLICY = (
    '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; script-src '
    "'unsafe-inline' 'wasm-unsafe-eval'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; "
    "form-action 'none'\">"
)
"""A page loads nothing and sends nothing."""


@checked
def interactive_page(
    source: PageSource,
    to: str | Path = "page.html",
    *,
    tests: Sequence[History] = (),
    specimen: str | None = None,
    title: str = "",
    force: bool = False,
) -> Path:
    """Write a page of HTML on which a law's parameters are moved by sliders, and return its path.

    It is one file that needs no network: curves are computed in the browser.

    source : a law or its name, a law with values, an identification or a ranking.
    tests : measured ones that are laid over; by default those that an identification holds.
    specimen : which is shown first. title : of the page.
    force : whether a file that creepkit did not write is replaced.

    Raises ExportError for a law that cannot be written as JavaScript, for a page that is too large, and for a file that
    cannot be written. The page shows MPa, hours, mm and kelvin.
    """
    path = Path(to)
    contents = page_contents(source, tests, specimen=specimen, title=title)
    check_target(path, ExportError, force=force)
    text = page_html(contents).encode("utf-8", "replace").decode("utf-8")  # half a character is none
    size = len(text.encode("utf-8"))
    if size > LARGEST_PAGE:
        raise ExportError(
            f"{path}: the page would have {size / 1e6:.1f} MB, allowed is {LARGEST_PAGE / 1e6:g} MB; give fewer tests "
            "or laws"
        )
    return write_text(text, path, ExportError, force=force)


def page_html(contents: PageContents) -> str:
    """A whole page; CreepkitError where the core in WebAssembly is missing."""
    replacements = {
        "policy": POLICY,
        "title": escape(contents.title),
        "style": f"<style>\n{page_style()}</style>",
        "fragment": page_fragment(contents, style=False, kind=""),
    }
    text = _part("page.html")
    for name, value in replacements.items():
        text = text.replace(f"<!--{name}-->", value, 1)
    return text


def page_fragment(contents: PageContents, *, style: bool = True, scripts: bool = True, kind: str = "embedded") -> str:
    """The page as part of another document of HTML.

    style, scripts : whether it brings its own style, and its own scripts and reduced-order models; of several fragments
    in one document the first has to. shared_scripts() are the scripts of all of them. kind : class of the element.
    """
    models = page_models(contents)
    data = script_safe_json(contents_document(contents, models))
    note = "This part of the page needs scripts: it computes creep curves while its sliders are moved."
    parts = [
        f"<style>\n{page_style()}</style>" if style else "",
        f"<script>\n{runtime_script()}\n{_model_scripts(models)}</script>" if scripts else "",
        f"<script>\n{_law_scripts(contents)}</script>",
        f'<div class="{f"creepkit-page {kind}".strip()}"><noscript><p>{note}</p></noscript>'
        f'<script type="application/json" class="creepkit-page-data">{data}</script></div>',
        f"<script>\n{_page_scripts()}</script>" if scripts else "",
    ]
    return "\n".join(filter(None, parts))


def shared_scripts(contents: PageContents) -> str:
    """What page_fragment(scripts=False) leaves out, as one script that is loaded after the fragments."""
    return "\n".join([runtime_script(), _model_scripts(page_models(contents)), _page_scripts()])


def page_style() -> str:
    """The style of pages and fragments; every rule begins with .creepkit-page."""
    return _part("style.css")


@cache
def _page_scripts() -> str:
    """The scripts of pages and fragments; they start every fragment of the document that they stand in."""
    return "\n".join(_part(f"{name}.js") for name in SCRIPTS)


def _law_scripts(contents: PageContents) -> str:
    """The laws as JavaScript, by the names that the data of the page give them."""
    codes = {one.law.fingerprint: law_expression(LawWithValues(one.law, one.values)) for one in contents.laws}
    return _assignments("creepkitLaws", codes)


def _model_scripts(models: Mapping[str, str]) -> str:
    """Reduced-order models by the names that the data of the page give them."""
    return _assignments("creepkitModels", models)


def _assignments(place: str, values: Mapping[str, str]) -> str:
    lines = [f"globalThis.{place}[{json.dumps(name)}] = {text};" for name, text in values.items()]
    return "\n".join([f"globalThis.{place} ??= {{}};", *lines])


@cache
def _part(name: str) -> str:
    return (Path(__file__).parent / "page_parts" / name).read_text(encoding="utf-8")
