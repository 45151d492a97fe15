"""From input to pixels on the interactive page, measured in a browser.

    python tests/benchmarks/page_latency.py [--moves N] [--write]

Headless Chromium moves the slider of the stress exponent by the pointer, a step every 16 ms. A latency begins at the
input event and ends at the second frame after the curves were drawn, when they are on the screen; a browser at 60
frames a second needs one to two frames, 17 to 33 ms, for that whatever a page does, and the first row is of a page
that shows a single text. `report --app` has a page that answers bars, and dimples of the lengths that it was given,
itself while a slider moves, and asks its server for all else: "by the server" is a dimple of another thickness, whose
reduced-order model answers and sends the deformed section as JSON. The page in one file computes all in JavaScript.
The limit is 50 ms for the 95th percentile with the reduced-order model. Browser, server and this program share the
cores of the machine; on one that does other work start it as `chrt -f 10 python tests/benchmarks/page_latency.py`,
which is how the table below was made.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from measured import Page, arguments

import creepkit as ck
from creepkit.app.contents import PageContents, page_contents

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from helpers.browser import Tab, browser, tab
from helpers.http_requests import serving

LIMIT = 50.0
"""ms, of the 95th percentile."""
MOVES, PAUSE = 200, 16
"""Steps of the pointer, and ms between them."""
EMPTY = """<!DOCTYPE html><input type=range aria-label=n max=2000><p id=text></p><script>
creepkitPage = { latencies: [] };
document.querySelector("input").addEventListener("input", (event) => {
  const started = performance.now();
  document.querySelector("#text").textContent = event.target.value;
  requestAnimationFrame(() => requestAnimationFrame(() => creepkitPage.latencies.push(performance.now() - started)));
});
</script>"""


def bars() -> PageContents:
    """Nine measured bars under an identified law."""
    tests = ck.read_histories(ck.example_data("planted creep curves"))
    return page_contents("norton", tests)


def dimple() -> PageContents:
    """A planned bulge test, with its deformed section."""
    return page_contents("norton", specimen="bulge")


def measured_dimple() -> PageContents:
    """A measured bulge test of three outputs."""
    return page_contents("norton", ck.read_histories(ck.example_data("planted bulge test")))


CASES: dict[str, Callable[[], PageContents]] = {
    "a planned bar": lambda: page_contents("norton"),
    "nine measured bars": bars,
    "a planned bulge test": dimple,
    "a measured bulge test": measured_dimple,
}


OTHER_THICKNESS = "a planned bulge test, 0.48 mm thick"


def latencies(one: Tab, moves: int) -> list[float]:
    """ms, of each answer that was drawn while the slider moved to and fro about its first place."""
    slider = one.page.get_by_role("slider", name="n", exact=True)
    frame = slider.bounding_box()
    middle, height = frame["x"] + frame["width"] / 2, frame["y"] + frame["height"] / 2
    one.page.mouse.move(middle, height)
    one.page.mouse.down()
    one.page.evaluate("creepkitPage.latencies.length = 0")
    for k in range(moves):
        one.page.mouse.move(middle + 12.0 * np.sin(k / 7.0), height)
        one.page.wait_for_timeout(PAUSE)
    one.page.mouse.up()
    one.page.wait_for_timeout(300)
    found: list[float] = one.page.evaluate("creepkitPage.latencies")
    return found


@contextmanager
def opened(chromium: Any, name: str, how: str, folder: Path) -> Iterator[Tab]:
    """The page of a case, ready."""
    with ExitStack() as stack:
        one = stack.enter_context(tab(chromium, viewport={"width": 1400, "height": 900}))
        if how == "empty":
            (folder / "empty.html").write_text(EMPTY, encoding="utf-8")
            one.page.goto((folder / "empty.html").as_uri())
        elif how in ("server", "asked"):
            server = stack.enter_context(serving(dimple() if how == "asked" else CASES[name]()))
            server.answers.prepare()
            one.open(server.url)
            if how == "asked":
                one.page.evaluate("document.querySelector('details').open = true")
                one.type("apex thickness, mm", "0.48")
        else:
            contents = CASES[name]()
            path = ck.interactive_page(
                contents.laws[0].law, folder / f"{name}.html", tests=contents.histories,
                specimen=contents.specimens[0].name,
            )  # fmt: skip
            one.open(path.as_uri())
        latencies(one, 40)  # what is compiled at first
        yield one
        if one.problems:
            raise RuntimeError(f"{name}, {how}: {one.problems}")


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--moves", type=int, default=MOVES, help="steps of the pointer in each case")
    options = parser.parse_args()
    page = Page("page_latency", __doc__)
    page.table(
        "page", "answered by", "answers drawn", "median, ms", "95th percentile, ms", "95th percentile over limit"
    )
    cases = [("a text alone", "empty"), *((name, how) for name in CASES for how in ("server", "file"))]
    cases.append((OTHER_THICKNESS, "asked"))
    with browser() as chromium, tempfile.TemporaryDirectory() as folder:
        for name, how in cases:
            with opened(chromium, name, how, Path(folder)) as one:
                found = latencies(one, options.moves)
            median, high = np.percentile(found, (50, 95))
            answered = {
                "empty": "nothing", "server": "`creepkit report --app`", "file": "page in one file",
                "asked": "`creepkit report --app`, by the server",
            }[how]  # fmt: skip
            page.row(name, answered, len(found), f"{median:.0f}", f"{high:.0f}", f"{high / LIMIT:.2f}")
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
