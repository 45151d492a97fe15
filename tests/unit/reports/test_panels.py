"""Figures divided into panels for narrow screens: whole panels, in order, with the numbers of their axes."""

import re

import pytest
from matplotlib.figure import Figure

from creepkit.reports.html.panels import stacked_panels
from creepkit.reports.html.svg import LEGIBLE, svg_text


def laid_out(**grid):
    figure = Figure(figsize=(9.0, 5.0), layout="constrained")
    panels = figure.subplots(squeeze=False, **grid)
    for axes in panels.flat:
        axes.plot([0.0, 1.0], [0.0, 2.0], label="curve")
        axes.set_xlabel("time, h")
        axes.set_ylabel("strain")
    figure.get_layout_engine().execute(figure)
    return figure, panels


def place_of(axes):
    """left, top, right, bottom in points of 1/72 inch."""
    frame = axes.get_tightbbox()
    height = axes.figure.get_figheight() * 72.0
    left, low, right, high = (72.0 * value / axes.figure.dpi for value in frame.extents)
    return left, height - high, right, height - low


def test_each_panel_is_whole_in_one_part_and_parts_are_read_row_by_row():
    figure, panels = laid_out(nrows=2, ncols=2)
    parts = stacked_panels(figure)
    assert len(parts) == 4
    for axes, part in zip(panels.flat, parts, strict=True):
        left, top, right, bottom = place_of(axes)
        assert part.left <= left < right <= part.right
        assert part.top <= top < bottom <= part.bottom
    area = sum((p.right - p.left) * (p.bottom - p.top) for p in parts)
    assert area == pytest.approx(9.0 * 5.0 * 72.0**2)


def test_panels_that_share_the_numbers_of_an_axis_stay_together():
    figure, _ = laid_out(nrows=1, ncols=3, sharey=True)
    assert len(stacked_panels(figure)) == 1
    figure, _ = laid_out(nrows=2, ncols=2, sharex="col")
    assert len(stacked_panels(figure)) == 2  # a column each


def test_a_legend_of_the_figure_is_a_part_and_a_scale_of_colours_stays():
    figure, panels = laid_out(nrows=1, ncols=2)
    image = panels[0, 1].imshow([[0.0, 1.0]])
    figure.colorbar(image, ax=panels[0, 1])
    figure.legend(loc="outside lower center")
    figure.get_layout_engine().execute(figure)
    parts = stacked_panels(figure)
    assert len(parts) == 3
    assert parts[2].right - parts[2].left == pytest.approx(648.0)
    assert place_of(figure.axes[2])[2] <= parts[1].right


def test_one_column_is_not_divided():
    assert len(stacked_panels(laid_out(nrows=3, ncols=1)[0])) == 1
    assert len(stacked_panels(Figure())) == 1


def test_the_text_of_parts_can_be_read_at_their_least_width():
    text = svg_text(laid_out(nrows=1, ncols=2)[0], "f1", "title", "words")
    assert text.count("<svg") == 3
    assert text.count('href="#f1-w"') == 2
    assert text.count('aria-hidden="true"') == 2
    for legible, natural in re.findall(r"--legible-width:(\d+)px;max-width:(\d+)px", text):
        smallest = min(float(size) for size in re.findall(r"font(?:-size)?:\s*([\d.]+)p?x?", text) or [10.0])
        assert smallest * 4.0 / 3.0 * int(legible) / int(natural) >= LEGIBLE - 0.1
