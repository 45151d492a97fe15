"""Figures thinned to what a screen shows: few points that cover the same pixels, paths that stay in place."""

from __future__ import annotations

import re

import numpy as np
import pytest

from creepkit.reports.html.compact_svg import relative_path
from creepkit.reports.html.thinning import PIXEL, TOLERANCE, kept_dots, kept_points


def distance_to_line(points: np.ndarray, line: np.ndarray) -> np.ndarray:
    """(points,) the distance of each point to the nearest segment of a polygonal line."""
    start, chord = line[:-1], np.diff(line, axis=0)
    relative = points[:, None] - start
    along = np.clip((relative * chord).sum(-1) / (chord**2).sum(-1), 0.0, 1.0)
    return np.linalg.norm(relative - along[..., None] * chord, axis=-1).min(axis=1)


def test_no_point_of_noise_lies_farther_from_the_line_than_a_pixel() -> None:
    """10,000 points over 300 pixels: at most four of each column stay, and their line covers the others."""
    rng = np.random.default_rng(0)
    points = np.column_stack([np.linspace(0.0, 300.0, 10_000), 100 + 30 * rng.normal(size=10_000)])
    keep = kept_points(points)
    assert keep.sum() <= 4 * 301
    assert distance_to_line(points[::7], points[keep]).max() <= PIXEL + TOLERANCE


def test_a_smooth_curve_stays_within_the_tolerance() -> None:
    x = np.linspace(0.0, 300.0, 10_000)
    points = np.column_stack([x, 100 * np.sin(x / 40.0)])
    keep = kept_points(points)
    assert keep.sum() < 150
    assert distance_to_line(points[::7], points[keep]).max() <= PIXEL + TOLERANCE


def test_gaps_stay_gaps_and_ends_stay() -> None:
    points = np.column_stack([np.arange(100.0), np.zeros(100)])
    points[40:50] = np.nan
    keep = kept_points(points)
    assert np.flatnonzero(keep).tolist() == [0, 39, 40, 50, 99]


def test_of_dots_that_cover_each_other_one_stays() -> None:
    rng = np.random.default_rng(1)
    points = rng.uniform(0.0, 20.0, (10_000, 2))
    keep = kept_dots(points, 2.0)
    assert keep.sum() == 100
    distance = np.abs(points[:, None] - points[keep][None]).max(axis=-1).min(axis=1)
    assert distance.max() < 2.0


def absolute(path: str) -> list[tuple[float, float]]:
    """Points of a path, by the rules of SVG for M, m, L, l, h and z."""
    tokens = re.findall(r"[A-Za-z]|-?\d*\.?\d+", path)
    points, x, y, command, k = [], 0.0, 0.0, "", 0
    start = (0.0, 0.0)
    while k < len(tokens):
        if tokens[k].isalpha():
            command, k = tokens[k], k + 1
        if command == "z":
            x, y = start
        elif command == "h":
            x, k = x + float(tokens[k]), k + 1
        else:
            dx, dy, k = float(tokens[k]), float(tokens[k + 1]), k + 2
            x, y = (dx, dy) if command.isupper() else (x + dx, y + dy)
            if command in "Mm":
                start, command = (x, y), "L" if command == "M" else "l"
        points.append((x, y))
    return points


@pytest.mark.parametrize(
    "path",
    [
        "M1 2L3.5 4.25L3 -7",
        "M1 2L3 4zM5 6L7 8zL1 1",
        "M10 10h0M12.3 9.4h0",
        "M.5-.5L-1-1l2 3l-.4-.4M0 0L9 9",
        "M1 2L3 4 5 6",
    ],
)
def test_relative_paths_have_the_same_points(path: str) -> None:
    found, expected = absolute(relative_path(path)), absolute(path)
    assert np.allclose(found, expected, atol=0.051)
