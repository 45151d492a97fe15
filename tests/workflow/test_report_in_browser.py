"""A report as a colleague opens it: a file in Chromium, without network, with and without scripts, and on paper."""

from __future__ import annotations

import pytest

from creepkit.reports.html import report_html
from helpers.browser import browser as chromium
from helpers.report_pages import contents

WIDTHS = (1280, 390)


@pytest.fixture(scope="module")
def browser():
    with chromium() as opened:
        yield opened


@pytest.fixture(scope="module")
def address(tmp_path_factory) -> str:
    path = tmp_path_factory.mktemp("report") / "report.html"
    path.write_text(report_html(contents(hostile=True)), encoding="utf-8")
    return path.as_uri()


def opened(browser, address, **options):
    """(page, addresses that it asked for, what it said on the console) of a page in a context of its own."""
    page = browser.new_context(offline=True, **options).new_page()
    asked, said = [], []
    page.on("request", lambda request: asked.append(request.url))
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("dialog", lambda dialog: said.append(dialog.message))
    page.goto(address)
    return page, asked, said


@pytest.mark.parametrize("scripts", [True, False], ids=["scripts on", "scripts off"])
def test_it_opens_from_a_file_and_is_whole(browser, address, scripts) -> None:
    page, asked, said = opened(browser, address, java_script_enabled=scripts)
    assert [url for url in asked if not url.startswith("data:")] == [address]
    assert said == []
    assert page.get_by_role("heading", level=1).inner_text().startswith("Creep of")
    assert page.locator("figure.drawing svg").count() == 5
    for section in page.locator("summary").all():
        section.click()
    for figure in page.locator("figure.drawing").get_by_role("img").all():
        box = figure.bounding_box()
        assert box is not None
        assert box["width"] > 300
        assert box["height"] > 100
    for heading in ("Values and verdict", "Tests", "Laws compared", "Data", "Methods text", "What is missing"):
        assert page.get_by_role("heading", name=heading, exact=True).is_visible()
    assert page.locator("math").first.is_visible()
    page.context.close()


def test_the_answer_is_one_screen(browser, tmp_path) -> None:
    """Headline, picture and card within 1400 x 900 pixels; what is not folded is short."""
    path = tmp_path / "report.html"
    path.write_text(report_html(contents()), encoding="utf-8")
    page, _, _ = opened(browser, path.as_uri(), viewport={"width": 1400, "height": 900})
    headline, tests = page.locator(".lead").first.inner_text().splitlines()
    assert len(headline.split()) <= 25
    assert "40–60\xa0MPa" in headline
    assert tests.startswith("2 tests to ")
    for part in (".lead", ".answer .seen svg", ".answer .card dl"):
        box = page.locator(part).first.bounding_box()
        assert box["y"] + box["height"] <= 900
    assert page.locator("#findings .cautions li").count() <= 3
    assert len(page.locator("body").inner_text().split()) <= 700
    assert page.evaluate("document.documentElement.scrollHeight") <= 4 * 900
    page.context.close()


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_fits_its_window_and_is_drawn(browser, address, width, scheme, tmp_path) -> None:
    """No part is wider than the window but what scrolls by itself; the picture is light, or dark, as asked."""
    from PIL import Image

    page, _, _ = opened(browser, address, viewport={"width": width, "height": 900}, color_scheme=scheme)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    picture = tmp_path / "page.png"
    page.screenshot(path=picture)
    grey = Image.open(picture).convert("L")
    levels = grey.histogram()
    mean = sum(level * count for level, count in enumerate(levels)) / sum(levels)
    assert mean > 220 if scheme == "light" else mean < 60
    assert sum(count > 0 for count in levels) > 50  # letters, not a blank page
    page.context.close()


def test_a_file_is_downloaded(browser, address, tmp_path) -> None:
    page, _, _ = opened(browser, address, accept_downloads=True)
    with page.expect_download() as download:
        page.locator(".downloads a").first.click()
    target = tmp_path / "law.py"
    download.value.save_as(target)
    assert download.value.suggested_filename.endswith("law.py")
    assert target.read_text(encoding="utf-8") == contents(hostile=True).exports[0].text
    page.context.close()
