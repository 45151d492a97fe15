"""Lines, bands and dots of a figure reduced to what a screen shows, before it is written as SVG.

Of a line, the points within one column of pixels become the first, the lowest, the highest and the last of them, which
draw the same pixels; of what is left, points nearer to the chord of their neighbours than a third of a pixel go
(Ramer 1972, Douglas and Peucker 1973). Of dots that cover each other one stays.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import Bools, Floats, Ints

if TYPE_CHECKING:
    from matplotlib.collections import PolyCollection
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

FEW_POINTS = 24
"""A line or band of so few points is left as it is."""


PIXEL = 1.0
"""Width of a column, points of 1/72 inch: about a pixel where a figure fills the page."""


TOLERANCE = 0.3
"""Distance from the chord below which a point is left out, in the same unit."""


MOST_MARKS, FEW_MARKS = 3000, 300
"""Marks of a figure above which its collections, but for those of few marks, become pictures of pixels: maps of
measured points."""


def thin_figure(figure: Figure) -> None:
    """Reduce the lines, bands and dots of a figure that has been laid out; its axes stay as they are."""
    from matplotlib.collections import PathCollection, PolyCollection
    from matplotlib.lines import Line2D

    scale = 72.0 / float(figure.dpi)
    for line in figure.findobj(Line2D):
        _thin_line(line, scale)
    for band in figure.findobj(PolyCollection):
        _thin_band(band, scale)
    counts = {marks: np.size(marks.get_offsets()) // 2 for marks in figure.findobj(PathCollection)}
    for marks, count in counts.items():
        if sum(counts.values()) > MOST_MARKS and count > FEW_MARKS:
            marks.set_rasterized(True)


def _thin_line(line: Any, scale: float) -> None:
    typed: Line2D = line
    x, y = np.asarray(typed.get_xdata(orig=False)), np.asarray(typed.get_ydata(orig=False))
    if x.size <= FEW_POINTS or x.size != y.size:
        return
    points = _shown_points(typed, np.column_stack([x, y]), scale)
    drawn = typed.get_linestyle() not in ("None", "none", " ", "")
    keep = kept_points(points) if drawn else kept_dots(points, max(0.5 * float(typed.get_markersize()), PIXEL))
    typed.set_data(x[keep], y[keep])


def _thin_band(band: Any, scale: float) -> None:
    typed: PolyCollection = band
    paths = typed.get_paths()
    if not any(np.shape(path.vertices)[0] > FEW_POINTS for path in paths):
        return
    kept = []
    for path in paths:
        vertices = np.asarray(path.vertices, float)
        kept.append(vertices[kept_points(_shown_points(typed, vertices, scale))])
    typed.set_verts(kept)


def _shown_points(artist: Any, data: Floats, scale: float) -> Floats:
    """(points, 2) where data of an artist stand on the page, in points of 1/72 inch; NaN where they do not."""
    with np.errstate(all="ignore"):
        shown = np.asarray(np.ma.filled(artist.get_transform().transform(np.asarray(data, float)), np.nan), float)
    return np.where(np.isfinite(shown).all(axis=1, keepdims=True), scale * shown, np.nan)


def kept_dots(points: Floats, size: float) -> Bools:
    """(points,) which dots to draw: the first in each square cell of side `size`. points : (points, 2) 1/72 inch."""
    keep = np.zeros(len(points), bool)
    shown = np.flatnonzero(np.isfinite(points).all(axis=1))
    _, first = np.unique(np.floor(points[shown] / size), axis=0, return_index=True)
    keep[shown[first]] = True
    return keep


def kept_points(points: Floats, tolerance: float = TOLERANCE) -> Bools:
    """(points,) which points of a line to draw; gaps (NaN) stay, one point each. points : (points, 2) 1/72 inch."""
    keep = np.zeros(len(points), bool)
    finite = np.isfinite(points).all(axis=1)
    starts = np.flatnonzero(np.diff(np.concatenate([[False], finite])) & finite)
    ends = np.flatnonzero(np.diff(np.concatenate([finite, [False]])) & finite) + 1
    keep[ends[:-1]] = True  # the gaps
    for start, end in zip(starts, ends, strict=True):
        inside = start + _envelope(points[start:end])
        keep[inside[_far_from_chords(points[inside], tolerance)]] = True
    return keep


def _envelope(points: Floats) -> Ints:
    """Positions of the first, lowest, highest and last of the consecutive points of each column of pixels."""
    column = np.floor(points[:, 0] / PIXEL)
    starts = np.concatenate([[0], np.flatnonzero(np.diff(column)) + 1])
    ends = np.concatenate([starts[1:], [len(points)]])
    run = np.repeat(np.arange(starts.size), ends - starts)
    by_height = np.lexsort((points[:, 1], run))
    return np.unique(np.concatenate([starts, ends - 1, by_height[starts], by_height[ends - 1]]))


def _far_from_chords(points: Floats, tolerance: float) -> Bools:
    """(points,) of a polygonal line those that its simplification within a tolerance keeps (Douglas and Peucker)."""
    keep = np.zeros(len(points), bool)
    keep[[0, -1]] = True
    pieces = [(0, len(points) - 1)]
    while pieces:
        first, last = pieces.pop()
        if last - first < 2:
            continue
        origin, chord = points[first], points[last] - points[first]
        relative = points[first + 1 : last] - origin
        length = float(np.hypot(*chord))
        if length > 0:
            along = np.clip(relative @ chord / length**2, 0.0, 1.0)
            relative = relative - along[:, None] * chord
        distance = np.hypot(relative[:, 0], relative[:, 1])
        farthest = int(distance.argmax())
        if distance[farthest] > tolerance:
            middle = first + 1 + farthest
            keep[middle] = True
            pieces += [(first, middle), (middle, last)]
    return keep
