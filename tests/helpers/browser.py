"""Chromium without a window and without a network, for tests of pages."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

from helpers.compilers import BROWSER, compiler_or_skip

FLAGS = (
    *("--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync"),
)


def chromium_or_skip() -> str:
    """The path of Chromium; the test that asks for it is skipped where there is none."""
    return compiler_or_skip(BROWSER)


@contextmanager
def chromium() -> Iterator:
    """A browser of playwright."""
    from playwright.sync_api import sync_playwright

    root = ["--no-sandbox"] if hasattr(os, "geteuid") and os.geteuid() == 0 else []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium_or_skip(), args=[*FLAGS, *root])
        try:
            yield browser
        finally:
            browser.close()
