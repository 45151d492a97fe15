"""Takes the pictures of reports that the tutorials show, in Chromium and without a network, into docs/pictures/studies.

`make docs` builds the reports first; the pictures are committed, so that the documentation is built without a browser.
To take them anew, with Chromium on PATH and the Python package playwright::

    make docs
    .venv/bin/python docs/screenshots.py [--to FOLDER]

A part of a report that is missing, or an error in the browser's console, ends the program with exit code 1: with
another folder than the committed one it is a test of the reports as they are built.
"""

import argparse
import io
import os
import shutil
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

DOCS = Path(__file__).parent
REPORTS = DOCS.parent / "build" / "site" / "reports"
TARGET = DOCS / "pictures" / "studies"

SHOTS = {
    "hardening_findings": ("strain_or_time_hardening/constant_loads", "#findings", 640),
    "hardening_design": ("strain_or_time_hardening/constant_loads", "#design", 730),
    "hardening_map": ("strain_or_time_hardening/constant_loads", "#design figure", 900),
    "hardening_decided": ("strain_or_time_hardening/with_step", "#findings", 560),
    "spreadsheet_findings": ("spreadsheet_to_abaqus/report", "#findings", 900),
    "spreadsheet_forecast": ("spreadsheet_to_abaqus/report", "#forecasts", 1100),
    "plate_findings": ("plate_of_dimples/report", "#findings", 1100),
    "plate_alloy": ("plate_of_dimples/report", "#m1", 1100),
}
"""{picture: (report, element, the most of its height in pixels)}."""


WIDTH, MARGIN, COLOURS, MOST_BYTES = 1100, 16, 128, 150_000
"""Pixels of the window and around an element; colours of a picture; bytes of the largest."""

WIDE = {"plate_findings": 1280}
"""Pixels of the window of pictures whose tables are wider."""

FLAGS = [
    *("--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync"),
    *(["--no-sandbox"] if hasattr(os, "geteuid") and os.geteuid() == 0 else []),
]


def main() -> None:
    """Write every picture; an error where a report, or a part of it, is missing."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--to", type=Path, default=TARGET, help="folder of the pictures; the committed one by default")
    target = parser.parse_args().to
    chromium = shutil.which("chromium")
    if chromium is None:
        raise SystemExit("there is no chromium on PATH; the committed pictures stay as they are")
    target.mkdir(parents=True, exist_ok=True)
    errors: list[str] = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
        page = browser.new_context(
            viewport={"width": WIDTH, "height": WIDTH}, color_scheme="light", offline=True
        ).new_page()
        page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: errors.append(str(error)))
        for name, (report, element, most) in SHOTS.items():
            path = target / f"{name}.png"
            width = WIDE.get(name, WIDTH)
            page.set_viewport_size({"width": width, "height": WIDTH})
            page.goto((REPORTS / f"{report}.html").as_uri())
            opened = "name => document.querySelectorAll(`${name}, ${name} *`).forEach(part => part.open = true)"
            page.evaluate(opened, element.split()[0])
            place = page.locator(element).first.bounding_box()
            clip = {
                "x": max(place["x"] - MARGIN, 0),
                "y": place["y"],
                "width": min(place["width"] + 2 * MARGIN, width),
                "height": min(place["height"] + MARGIN, most),
            }
            path.write_bytes(reduced(page.screenshot(clip=clip, full_page=True)))
            print(f"{name}: {path.stat().st_size / 1000:.0f} kB")
        browser.close()
    if errors:
        raise SystemExit("errors in the browser's console: " + "; ".join(errors))


def reduced(png: bytes) -> bytes:
    """A picture in few colours."""
    picture = (
        Image.open(io.BytesIO(png))
        .convert("RGB")
        .quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    )
    stream = io.BytesIO()
    picture.save(stream, "PNG", optimize=True)
    if stream.tell() > MOST_BYTES:
        raise ValueError(f"a picture has {stream.tell()} bytes, more than {MOST_BYTES}; choose a smaller part")
    return stream.getvalue()


if __name__ == "__main__":
    main()
