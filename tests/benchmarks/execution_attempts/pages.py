"""Hostile names in reports, interactive pages and exported pages, opened in Chromium without their own protection.

The policy that pages state (Content-Security-Policy) is switched off for it, so that a text which became an element or
an attribute does what it would do without the policy. A page that does nothing but show its texts is harmless.
"""

from __future__ import annotations

import html
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import creepkit as ck
from creepkit.errors import CreepkitError
from execution_attempts import texts
from execution_attempts.canaries import Attempt, Control, Found

SECTION = "Hostile names in pages"
SCRIPTS = (
    "</title></script></style><script>window.harmed = 1</script><img src=x onerror='window.harmed = 1'>",
    "\"'><svg onload=window.harmed=1><iframe src=\"javascript:parent.harmed=1\">",
    "x' onmouseover='window.harmed=1' autofocus onfocus='window.harmed=1' style='position:fixed' data-x='",
    'x" onmouseover="window.harmed=1" autofocus onfocus="window.harmed=1" style="position:fixed" data-x="',
    "--></textarea></noscript><script>window.harmed=1</script><link rel=stylesheet href=http://203.0.113.1/a.css>",
    "]]></math><script xmlns='http://www.w3.org/1999/xhtml'>window.harmed=1</script>",
    "${window.harmed = 1} {{constructor.constructor('window.harmed=1')()}} \\u003cscript\\u003ewindow.harmed=1",
    "\u2028window.harmed=1//\u2029`;window.harmed=1;`",
    "<base href=http://203.0.113.1/><meta http-equiv=refresh content='0;url=http://203.0.113.1/'>",
    "url(http://203.0.113.1/x) @import 'http://203.0.113.1/y'; expression(window.harmed=1)",
    "javascript:window.harmed=1",
)  # fmt: skip
ARGUMENTS = (
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync",
)  # fmt: skip
FOUND = """() => {
  const all = [...document.querySelectorAll("*")];
  const address = /^(href|src|srcdoc|action|formaction|data|xlink:href|style)$/;
  const code = (name, value) =>
    name.startsWith("on") || (address.test(name) && /javascript:|203\\.0\\.113/i.test(value));
  return {
    harmed: window.harmed === undefined ? "" : String(window.harmed),
    handlers: all.flatMap((e) => [...e.attributes].filter((a) => code(a.name, a.value)).map((a) => a.name)),
    kinds: [...new Set(all.map((e) => e.localName + " " + [...e.attributes].map((a) => a.name).sort().join()))].sort(),
  };
}"""


def law_named(text: str) -> Any:
    """A law that holds a text wherever a law takes it."""
    return texts.hostile_law(texts.CURVED, texts.EVERYWHERE, text)


def history(text: str) -> Any:
    """A measured test with a text as its name, alloy and source; without it where a history refuses it."""
    run = ck.simulate(
        "norton", "uniaxial", {"A": 1e-16, "n": 4.5}, loading=ck.constant_stress(90.0), times=[0.0, 1e4, 5e4]
    )
    for field in ("name", "alloy", "source"):
        with suppress(CreepkitError):
            run = run.replace(**{field: text})
    return run


def report(text: str) -> str:
    """A report of the tests' own helper with a text in every place that has a name."""
    from creepkit.reports.contents import (
        Attachment,
        Exclusion,
        ExportedFile,
        ReportContents,
        ReportGroup,
        ReportProvenance,
        StageFailure,
    )
    from creepkit.reports.html import report_html

    tests = [history(text), history(f"{text} again")]
    ranking = _ranking(text)
    contents = ReportContents(
        title=text, groups=(ReportGroup(text, ranking),), quality=ck.check_data_quality(tests),
        exclusions=(Exclusion(text, (1, 2), text),), exports=(ExportedFile(f"{text}.py", text, f"# {text}\n"),),
        failures=(StageFailure(text, text),),
        provenance=ReportProvenance({text: text}, 7, {text: {text: [text, 1]}}, {text: text}, (f"run {text}",)),
        attachments=(Attachment("study.toml", text.encode(errors="replace")),), notes=(text,),
    )  # fmt: skip
    return report_html(contents)


def _ranking(text: str) -> Any:
    import numpy as np

    times, rng, histories = np.linspace(0.0, 36000.0, 12), np.random.default_rng(3), []
    for number, stress in enumerate((60.0, 110.0)):
        run = ck.simulate(
            "norton", "uniaxial", {"A": 3e-16, "n": 4.2}, loading=ck.constant_stress(stress), times=times
        )  # fmt: skip
        strain = run.outputs["strain"] + rng.normal(0.0, 2e-6, len(times))
        run = run.replace(outputs={"strain": strain}, name=f"{number}")
        for field, value in (("name", f"{text}{number}"), ("alloy", text), ("source", text)):
            with suppress(CreepkitError):
                run = run.replace(**{field: value})
        histories.append(run)
    return ck.select(["norton"], histories, starts=1, sums=False)


def interactive(text: str) -> str:
    """An interactive page of one file."""
    with tempfile.TemporaryDirectory(prefix="attempts_") as folder:
        tests = [] if text == texts.PLAIN else [history(text)]
        path = ck.interactive_page(law_named(text).law, Path(folder) / "page.html", tests=tests, title=text)
        return path.read_text(encoding="utf-8")


def mathml(text: str) -> str:
    """An exported page of XHTML."""
    return ck.export(law_named(text), "mathml")


def markdown(text: str) -> str:
    """An exported section, by a reader of Markdown that lets HTML through."""
    from markdown_it import MarkdownIt

    reader = MarkdownIt("commonmark", {"html": True}).enable("table")
    return f"<!doctype html><meta charset=utf-8>{reader.render(ck.export(law_named(text), 'markdown'))}"


PAGES: dict[str, tuple[str, Callable[[str], str]]] = {
    "a report": (".html", report),
    "an interactive page": (".html", interactive),
    "MathML": (".xhtml", mathml),
    "Markdown, HTML allowed": (".html", markdown),
}


def seen(browser: Any, path: Path) -> tuple[dict[str, Any], list[str]]:
    """What stands in a page that was opened and touched, and the addresses it asked for beside its own."""
    from playwright.sync_api import Error

    context = browser.new_context(bypass_csp=True, offline=True)
    try:
        page, asked = context.new_page(), []
        page.on("request", lambda request: asked.append(request.url))
        page.on("dialog", lambda dialog: dialog.dismiss())
        page.goto(path.as_uri())
        page.mouse.move(200, 200)
        page.wait_for_timeout(150)
        outside = [url for url in asked if not url.startswith(("data:", "blob:", "about:")) and url != path.as_uri()]
        try:
            return page.evaluate(FOUND), outside
        except Error as error:  # a text had the browser leave the page meanwhile
            return {"harmed": str(error).partition("\n")[0], "handlers": []}, outside
    finally:
        context.close()


def outcome_of(found: dict[str, Any], outside: list[str]) -> tuple[str, str]:
    """Executed where anything of a text acted, or could."""
    if found["harmed"] or found["handlers"] or outside:
        return "executed", f"{found['harmed']} {found['handlers'][:5]} {outside[:3]}"
    return "harmless", ""


def attempts(short: bool) -> Found:
    """Every page with each text; nothing where there is no Chromium or playwright."""
    program = shutil.which("chromium")
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        return
    if program is None:
        return
    with sync_playwright() as playwright, tempfile.TemporaryDirectory(prefix="attempts_") as scratch:
        browser = playwright.chromium.launch(executable_path=program, args=list(ARGUMENTS))
        try:
            for name, (suffix, make) in PAGES.items():
                if short and name not in ("MathML", "an interactive page"):
                    continue
                for number, text in enumerate(SCRIPTS[:1] if short else SCRIPTS):
                    path = Path(scratch) / f"page{number}{suffix}"
                    try:
                        path.write_text(make(text), encoding="utf-8")
                    except CreepkitError:
                        yield Attempt(SECTION, name, "refused")
                        continue
                    yield Attempt(SECTION, name, *outcome_of(*seen(browser, path)))
            yield from _controls(browser, Path(scratch), short)
        finally:
            browser.close()


def _controls(browser: Any, folder: Path, short: bool) -> Iterator[Control]:
    """Pages that show texts as they are, as an element and as an attribute."""
    noticed = 0
    chosen = SCRIPTS[:2] if short else SCRIPTS
    for number, text in enumerate(chosen):
        path = folder / f"naive{number}.html"
        path.write_text(
            "<!doctype html><meta charset=utf-8>"
            "<meta http-equiv=Content-Security-Policy content=\"default-src 'none'\">"
            f"<title>{text}</title><style>p {{ background: {text} }}</style>"
            f"<p title='{text}'>{text}</p><p title=\"{text}\">x</p><a href=\"{html.escape(text)}\">x</a>",
            encoding="utf-8", errors="replace",
        )  # fmt: skip
        noticed += outcome_of(*seen(browser, path))[0] == "executed"
    yield Control(SECTION, "pages that show texts as they are", len(chosen), noticed, 2 if short else 8)
