"""The figures of one page: each with identifiers of its own, numbered in their order."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from markupsafe import Markup

from creepkit.errors import CreepkitError
from creepkit.reports.html.elements import Paragraph, Picture
from creepkit.reports.html.svg import svg_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class PageFigures:
    """Turns figures into pictures of a page, and counts them."""

    def __init__(self, prefix: str = "f") -> None:
        self.count, self.prefix = 0, prefix

    def picture(
        self, draw: Callable[[], Figure], title: str, description: str, caption: str, *, shows_values: bool = False
    ) -> Picture | Paragraph:
        """What `draw` draws with its alternative text (title and description) and a caption, which gets its number.

        Its own heading is left out: the page says the same above it. A figure that cannot be drawn is a paragraph that
        says why.
        """
        try:
            figure = draw()
        except CreepkitError as error:
            return Paragraph(f"{title}: no figure, for {error}", "note")
        self.count += 1
        figure.suptitle("")
        svg = svg_text(figure, f"{self.prefix}{self.count}", title, description)
        return Picture(Markup(svg), f"Figure {self.count}. {caption}", shows_values)
