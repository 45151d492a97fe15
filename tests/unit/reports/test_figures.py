"""Axes of figures: round labels at both ends, whatever the range."""

import numpy as np
import pytest

from creepkit.reports.figures import empty_figure, logarithmic_labels, set_range

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
