"""Where the panels of a figure lie, so that a narrow screen may show one below the other at their own size."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NARROW_PART = 90.0
"""Points of 1/72 inch: what is narrower, such as the scale of colours, stays with its neighbour."""


class Place(NamedTuple):
    """A rectangle of the figure, points of 1/72 inch from its upper left corner."""

    left: float
    top: float
    right: float
    bottom: float


def stacked_panels(figure: Figure) -> list[Place]:
    """The parts of a figure in the order of reading; one for a figure that cannot be divided.

    It is cut along straight lines that no panel, label or legend crosses. Panels that leave their numbers to a
    neighbour's axis stay with it.
    """
    width, height = (float(72.0 * inches) for inches in figure.get_size_inches())
    groups = _kept_together(figure, height)
    return _divided(groups, Place(0.0, 0.0, width, height)) if groups else [Place(0.0, 0.0, width, height)]


def _divided(groups: Sequence[Place], frame: Place) -> list[Place]:
    """Parts of a frame: rows first, for they are one below the other already, and columns of each row."""
    for low, high in ((1, 3), (0, 2)):
        bundles = _bundles(groups, low, high)
        if low == 0:
            bundles = _without_narrow(bundles)
        if len(bundles) < 2:
            continue
        cuts = [frame[low], *((_end(a, high) + _start(b, low)) / 2 for a, b in pairwise(bundles))]
        ends = [*cuts[1:], frame[high]]
        frames = [_with(frame, low, start, end) for start, end in zip(cuts, ends, strict=True)]
        parts = [_divided(bundle, part) for bundle, part in zip(bundles, frames, strict=True)]
        # rows without columns are one part, drawn as they are
        return (
            [frame] if low == 1 and all(len(part) == 1 for part in parts) else [one for part in parts for one in part]
        )
    return [frame]


def _bundles(groups: Sequence[Place], low: int, high: int) -> list[list[Place]]:
    """Groups that overlap along one direction, in its order."""
    bundles: list[list[Place]] = []
    for group in sorted(groups, key=lambda place: place[low]):
        if bundles and group[low] < _end(bundles[-1], high):
            bundles[-1].append(group)
        else:
            bundles.append([group])
    return bundles


def _without_narrow(bundles: Sequence[list[Place]]) -> list[list[Place]]:
    """Bundles side by side, of which what is narrow has joined the one before."""
    joined: list[list[Place]] = []
    for bundle in bundles:
        if joined and min(_width(bundle), _width(joined[-1])) < NARROW_PART:
            joined[-1] = [*joined[-1], *bundle]
        else:
            joined.append(bundle)
    return joined


def _start(bundle: Sequence[Place], low: int) -> float:
    return min(place[low] for place in bundle)


def _end(bundle: Sequence[Place], high: int) -> float:
    return max(place[high] for place in bundle)


def _width(bundle: Sequence[Place]) -> float:
    return _end(bundle, 2) - _start(bundle, 0)


def _with(frame: Place, low: int, start: float, end: float) -> Place:
    return Place(start, frame.top, end, frame.bottom) if low == 0 else Place(frame.left, start, frame.right, end)


def _kept_together(figure: Figure, height: float) -> list[Place]:
    """Panels with their labels, united where one has the numbers of the other; and what belongs to the whole figure."""
    shown = [axes for axes in figure.axes if axes.get_visible()]
    found = [_place(axes.get_tightbbox(), figure, height) for axes in shown]
    alone: list[Any] = []
    for part in [figure, *_subfigures(figure)]:
        alone += [*part.legends, *(text for text in part.texts if text.get_text())]
    groups = [place for place in (_place(one.get_window_extent(), figure, height) for one in alone) if place]
    labels: list[Place] = []
    for part in [figure, *_subfigures(figure)]:
        common = [getattr(part, name, None) for name in ("_supxlabel", "_supylabel")]
        if any(text is not None and text.get_text() for text in common):
            labels.append(_union([p for a, p in zip(shown, found, strict=True) if p and a.figure is part]))
    for k, (axes, place) in enumerate(zip(shown, found, strict=True)):
        if place is None:
            continue
        for name, low, high in (("x", 0, 2), ("y", 1, 3)):
            if _has_numbers(axes, name):
                continue
            siblings = getattr(axes, f"get_shared_{name}_axes")().get_siblings(axes)
            for j, other in enumerate(shown):
                mine = found[j]
                if j != k and other in siblings and mine and min(mine[high], place[high]) > max(mine[low], place[low]):
                    labels.append(_union([place, mine]))
    return _united([*groups, *(place for place in found if place), *labels])


def _subfigures(figure: Any) -> list[Any]:
    return [one for part in figure.subfigs for one in (part, *_subfigures(part))]


def _has_numbers(axes: Any, name: str) -> bool:
    shown = getattr(axes, f"{name}axis").get_tick_params(which="major")
    return bool(shown.get("labelbottom" if name == "x" else "labelleft", True) or shown.get("labelright", False))


def _place(frame: Any, figure: Figure, height: float) -> Place | None:
    if frame is None or frame.width <= 0 or frame.height <= 0:
        return None
    left, low, right, high = (float(72.0 * pixels / figure.dpi) for pixels in frame.extents)
    return Place(left, height - high, right, height - low)


def _union(places: Sequence[Place]) -> Place:
    return Place(
        min(p.left for p in places), min(p.top for p in places),
        max(p.right for p in places), max(p.bottom for p in places),
    )  # fmt: skip


def _united(places: Sequence[Place]) -> list[Place]:
    """Places that overlap become one, until none do."""
    united: list[Place] = []
    for place in places:
        while True:
            over = [p for p in united if min(p.right, place.right) - max(p.left, place.left) > 1.0
                    and min(p.bottom, place.bottom) - max(p.top, place.top) > 1.0]  # fmt: skip
            if not over:
                break
            united = [p for p in united if p not in over]
            place = _union([place, *over])
        united.append(place)
    return united
