"""What a specimen says of how cameras see it, and what it makes of measured points of its surface."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from creepkit.arrays import Bools, Floats, frozen, set_fields


@dataclass(frozen=True)
class SurfaceRegion:
    """Which part of a flat surface moves and which is held, by the distance from the centre of a test piece.

    moving : mm, radius within which the surface moves. held : mm, inner and outer radius of the ring that is clamped,
    from which the rigid motion of a frame is taken. operator : the observation operator of camera points by default.
    """

    moving: float
    held: tuple[float, float]
    operator: str


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """Points of a surface in several frames, in the plane of the plate and about the centre of a test piece.

    places : (points, 2) mm, of the undeformed surface. areas : (points,) mm2 that each stands for.
    heights : (frames, points) mm of displacement normal to the plate; NaN where a subset was lost.
    subset : mm, side of the square over which each height is a mean, along the axes; 0 of points.
    """

    places: Floats
    areas: Floats
    heights: Floats
    subset: float = 0.0


@dataclass(frozen=True, eq=False)
class SurfaceObservation:
    """What an observation operator makes of points.

    operator : its text, as histories carry it. outputs : {name: (frames,)}; NaN where a frame does not show one.
    gains : (frames, outputs, points) derivatives of the outputs to the heights, with the weights of the points held;
        zero of lost points.
    residuals : (frames, points) mm, heights less those of the operator's model; NaN outside of what it uses.
    converged : (frames,) whether the frame was observed at all.
    terms : (points, terms) and
    fitted : (terms, points) of the frame of the greatest leading output, whose residuals change by errors less terms @
    fitted @ errors.
    """

    operator: str
    outputs: Mapping[str, Floats]
    gains: Floats
    residuals: Floats
    converged: Bools
    terms: Floats
    fitted: Floats

    def __post_init__(self) -> None:
        set_fields(self, **{name: frozen(getattr(self, name)) for name in ("gains", "residuals", "terms", "fitted")})
        outputs = MappingProxyType({n: frozen(v) for n, v in self.outputs.items()})
        set_fields(self, converged=frozen(self.converged, dtype=bool), outputs=outputs)
