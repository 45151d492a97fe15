"""From input to pixels on the interactive page, measured in a browser.

    python tests/benchmarks/page_latency.py [--moves N] [--write]

Headless Chromium moves the slider of the stress exponent by the pointer, a step every 16 ms. A latency begins at the
input event and ends when the curves are on the screen, at the second frame after they were drawn: 17 to 33 ms at 60
frames a second whatever a page does, as the first row shows. Dimples are simulated by the core in WebAssembly. The
limit is 50 ms for the 95th percentile. Started as `chrt -f 10 python tests/benchmarks/page_latency.py`.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from measured import Page, arguments

import creepkit as ck

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from helpers.browser import Tab, browser, tab

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


BARS, DIMPLE = "planted creep curves", "planted bulge test"
CASES: dict[str, tuple[str, str | None, str | None]] = {
    "a planned bar": ("norton", None, None),
    "a planned bar, law with damage": ("kachanov-rabotnov", None, None),
    "nine measured bars": ("norton", None, BARS),
    "nine measured bars, law of four terms": ("theta-projection", None, BARS),
    "a planned bulge test": ("norton", "bulge", None),
    "a planned bulge test, law with damage": ("kachanov-rabotnov", "bulge", None),
    "a measured bulge test": ("norton", None, DIMPLE),
    "a measured bulge test, hyperbolic sine": ("hyperbolic-sine", None, DIMPLE),
}
"""{page: law, specimen of the planned test, example data of measured tests}."""


def latencies(one: Tab, moves: int) -> list[float]:
    """ms, of each answer that was drawn while the slider moved to and fro about its first place."""
    sliders = one.page.get_by_role("slider")
    slider = sliders.nth(min(1, sliders.count() - 1))  # an exponent, of most laws
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
def opened(chromium: Any, name: str, folder: Path) -> Iterator[Tab]:
    """The page of a case, ready."""
    path = folder / "page.html"
    with tab(chromium, viewport={"width": 1400, "height": 900}) as one:
        if name not in CASES:
            path.write_text(EMPTY, encoding="utf-8")
            one.page.goto(path.as_uri())
        else:
            law, specimen, data = CASES[name]
            tests = ck.read_histories(ck.example_data(data)) if data else []
            one.open(ck.interactive_page(law, path, tests=tests, specimen=specimen, force=True).as_uri())
        latencies(one, 40)  # what is compiled at first
        yield one
        if one.problems:
            raise RuntimeError(f"{name}: {one.problems}")


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--moves", type=int, default=MOVES, help="steps of the pointer in each case")
    options = parser.parse_args()
    page = Page("page_latency", __doc__)
    page.table("page", "answers drawn", "median, ms", "95th percentile, ms", "95th percentile over limit")
    with browser() as chromium, tempfile.TemporaryDirectory() as folder:
        for name in ("a text alone", *CASES):
            with opened(chromium, name, Path(folder)) as one:
                found = latencies(one, options.moves)
            median, high = np.percentile(found, (50, 95))
            page.row(name, len(found), f"{median:.0f}", f"{high:.0f}", f"{high / LIMIT:.2f}")
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
