"""Axes of figures: round labels at both ends, whatever the range; figures in few bytes."""

import re
from itertools import pairwise

import numpy as np
import pytest

from creepkit.reports.figures import empty_figure, logarithmic_labels, set_range
from creepkit.reports.svg import kept_dots, svg_text

RANGES = [(80.0, 125.0), (32.0, 175.0), (0.011, 1100.0), (3e-11, 3e-6), (1e-14, 1e2), (1.0, 1.0), (0.99, 1.01)]


@pytest.mark.parametrize(("low", "high"), RANGES)
def test_labels_of_a_logarithmic_axis_enclose_the_data_and_are_few(low, high):
    labels = logarithmic_labels(low, high)
    assert labels[0] <= low * (1 + 1e-9)
    assert labels[-1] >= high * (1 - 1e-9)
    assert 2 <= labels.size <= 8
    assert (np.diff(labels) > 0).all()


@pytest.mark.parametrize(("low", "high"), RANGES)
@pytest.mark.parametrize("which", ["x", "y"])
def test_an_axis_has_a_written_label_within_three_per_cent_of_either_end(low, high, which):
    figure = empty_figure(4.0, 3.0)
    axes = figure.subplots()
    set_range(axes, which, low, high, logarithmic=True)
    figure.canvas.draw()
    axis = axes.xaxis if which == "x" else axes.yaxis
    ends = np.log(axes.get_xlim() if which == "x" else axes.get_ylim())
    written = np.log(
        [v for v, label in zip(axis.get_ticklocs(), axis.get_ticklabels(), strict=True) if label.get_text()]
    )
    tolerance = 0.031 * np.ptp(ends)
    assert written.min() - ends[0] <= tolerance
    assert ends[1] - written.max() <= tolerance
    assert ends[0] <= np.log(low) + 1e-9
    assert ends[1] >= np.log(high) - 1e-9


def test_of_dots_that_cover_each_other_one_stays() -> None:
    points = np.random.default_rng(1).uniform(0.0, 20.0, (10_000, 2))
    keep = kept_dots(points, 2.0)
    assert keep.sum() == 100
    assert np.abs(points[:, None] - points[keep][None]).max(axis=-1).min(axis=1).max() < 2.0


def test_a_figure_in_few_bytes_has_its_lines_and_bands_where_they_were() -> None:
    """A sine of 10,000 points and a band about it on a logarithmic axis: what is written lies within a pixel."""
    figure = empty_figure(6.0, 4.0)
    axes = figure.subplots()
    x = np.geomspace(1.0, 1e3, 10_000)
    y = 10 + 5 * np.sin(4 * np.log(x))
    axes.plot(x, y, color="red")
    band = axes.fill_between(x, y - 1, y + 1)
    axes.set_xscale("log")
    svg = svg_text(figure, "f1", "title", "description")
    assert len(svg) < 60_000
    (name,) = re.findall(r"\.(\w+)\{[^}]*stroke:#ff0000", svg)
    (path,) = re.findall(rf'<path d="([^"]*)"[^>]*class="{name}"', svg)
    written = 72 / figure.dpi * np.array([1, -1]) * np.array(re.findall(r"-?[\d.]+", path), float).reshape(-1, 2)
    (edge,) = (axes.transData.transform(one.vertices) for one in band.get_paths())
    for shown, curves in ((np.add(written, [0.0, 288.0]), [y]), (edge, [y - 1, y + 1])):
        assert len(shown) < 500
        expected = np.concatenate([axes.transData.transform(np.column_stack([x, one])) for one in curves])
        assert np.linalg.norm(shown[:, None] - expected, axis=-1).min(axis=1).max() < 1.0
        between = np.concatenate([np.linspace(a, b, 200) for a, b in pairwise(shown)])
        assert np.linalg.norm(expected[::100, None] - between, axis=-1).min(axis=1).max() < 1.0
