"""Interactive pages as files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from creepkit.app.contents import PageSource
from creepkit.checked_arguments import checked
from creepkit.errors import ExportError
from creepkit.files.writing import check_target, write_text

if TYPE_CHECKING:
    from creepkit.app.contents import PageContents
    from creepkit.records import History


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
    from creepkit.app.contents import page_contents

    return write_page(page_contents(source, tests, specimen=specimen, title=title), Path(to), force=force)


def write_page(contents: PageContents, path: Path, *, force: bool = False) -> Path:
    """Write the page of some contents as one file."""
    from creepkit.app.page import LARGEST_PAGE, page_html

    check_target(path, ExportError, force=force)
    text = page_html(contents).encode("utf-8", "replace").decode("utf-8")  # half a character is none
    size = len(text.encode("utf-8"))
    if size > LARGEST_PAGE:
        raise ExportError(
            f"{path}: the page would have {size / 1e6:.1f} MB, allowed is {LARGEST_PAGE / 1e6:g} MB; give fewer tests "
            "or laws"
        )
    return write_text(text, path, ExportError, force=force)
