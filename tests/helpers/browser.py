"""A browser that tests drive: Debian's Chromium, without a window and without a network but for this machine."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from helpers.compilers import compiler_or_skip

ARGUMENTS = (
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync",
)  # fmt: skip


SETTLED = "[...document.querySelectorAll('.creepkit-page')].every((root) => root.dataset.exact === 'true')"
MOST_WAITS = 500


@dataclass
class Tab:
    """A page of the browser, with what went wrong in it and what it asked for."""

    page: Any
    problems: list[str] = field(default_factory=list)
    requested: list[str] = field(default_factory=list)

    def open(self, url: str) -> Any:
        """Go to an address, and wait until the page of a law has drawn an exact answer."""
        response = self.page.goto(url)
        self.settle()
        return response

    def settle(self) -> None:
        """Wait until the last input has been answered exactly; the policy of pages forbids what playwright waits by."""
        for _ in range(MOST_WAITS):
            if self.page.evaluate(SETTLED):
                return
            self.page.wait_for_timeout(20)
        raise TimeoutError(f"the page has no exact answer: {self.problems}")

    def type(self, name: str, text: str) -> None:
        """Type a number into the field of this label, leave it, and wait for the answer."""
        self.page.evaluate(
            "document.querySelectorAll('.creepkit-page').forEach((root) => (root.dataset.exact = 'false'))"
        )
        entry = self.page.get_by_role("textbox", name=name, exact=True).first
        entry.fill(text)
        entry.blur()
        self.settle()

    def curves(self) -> list[str]:
        """The paths of all curves that are drawn."""
        found: list[str] = self.page.eval_on_selector_all("path.line", "paths => paths.map((p) => p.getAttribute('d'))")
        return found


@contextmanager
def browser() -> Iterator[Any]:
    """A Chromium; a test is skipped where there is none."""
    program = compiler_or_skip("chromium")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=program, args=list(ARGUMENTS))
        try:
            yield started
        finally:
            started.close()


@contextmanager
def tab(started: Any, **settings: Any) -> Iterator[Tab]:
    """A page in a context of its own; settings : of the context, such as viewport and color_scheme."""
    context = started.new_context(**settings)
    try:
        page = context.new_page()
        one = Tab(page)
        page.on("console", lambda message: message.type in ("error", "warning") and one.problems.append(message.text))
        page.on("pageerror", lambda error: one.problems.append(str(error)))
        page.on("request", lambda request: one.requested.append(request.url))
        yield one
    finally:
        context.close()
