"""The observation operator: what is observed of the displacement of the top of a dimple.

Amplitude D_amp, width S_d and shape S_p of a generalised Gaussian, fitted by least squares within a window of the
undeformed radius: as "profile", D exp(-(r/S)^p), the paper's Eq. (3), or as "field", Eq. (7). Or, as "rings", u_z
itself at given undeformed radii, without any assumption of its form. `camera_points` does the
same with measured points.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, get_args

import numpy as np

from creepkit.arrays import ArrayLike, Floats, frozen, set_fields
from creepkit.errors import SolveError, refuse_unknown
from creepkit.fem.surface_interpolation import (
    SurfaceInterpolation,
    checked_surface_radii,
    surface_interpolation_with_slopes,
)
from creepkit.limits import Limits, check_fields, numbers
from creepkit.records import Output
from creepkit.specimens.bulge.outputs import MOST_RINGS, OBSERVED, RING_OUTPUTS

if TYPE_CHECKING:  # heavy, and a list of specimens needs none of it
    from creepkit.fem.time_interpolation import TimeInterpolation
    from creepkit.specimens.bulge.gaussian_fit import GaussianFit


Form = Literal["profile", "field", "rings"]


DEFAULT_WINDOW = 7.5
"""mm, the radius of the paper's cavity."""


DEFAULT_RADII: dict[str, int] = {"profile": 76, "field": 40}
"""Radii observed by default: for the profile 0, 0.1 ... 7.5 mm in the default window."""


_ANGLES = 6
"""Gauss points over an eighth of a turn; S_p from 40 radii by 6 angles lies within 5e-5 of that from 1000 by 40."""


ALLOWED = {"window": numbers(1e-3, 1e4), "points": Limits(8, 2000)}
"""Of an operator that fits: mm, and radii."""


_TEXT = re.compile(r"\s*(\w+)\s+0\s*(?:-|to)\s*(\S+)\s*mm\s*(?:,\s*(\d+)\s+radii\s*)?")


class ProfileSampling(NamedTuple):
    """What follows from an operator and a set of nodes.

    shares : (radii,) the radii that are sampled, as shares of the window. nodes : interpolation from the nodes to them.
    fit : to the displacements there.
    """

    shares: Floats
    nodes: SurfaceInterpolation
    fit: GaussianFit | RingDisplacements


@dataclass(frozen=True)
class Observation:
    """How a top profile becomes outputs: D_amp, S_d, S_p of a generalised Gaussian fit, or u_z on rings.

    form : "profile", "field" or "rings". window : mm, the largest radius of a fit, in the undeformed plate.
    points : radii of a fit; None for 76 of a profile and 40 of a field (Gauss points, at 6 angles each).
    radii : mm, one to eight increasing radii of the undeformed plate, of the form "rings" alone, which has no window.

    The radii of a fit are fixed shares of the window, so that what is observed changes smoothly with it.
    """

    form: Form = "profile"
    window: float = DEFAULT_WINDOW
    points: int | None = None
    radii: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        refuse_unknown(self.form, get_args(Form), SolveError, f"observation: no form is called '{self.form}'")
        if self.form == "rings":
            self._check_rings()
            return
        if len(self.radii):
            raise SolveError(f"observation: a {self.form} has a window and no radii; write form='rings' for these")
        points = DEFAULT_RADII[self.form] if self.points is None else self.points
        set_fields(self, points=points)
        check_fields(self, ALLOWED, "observation: ", SolveError)
        set_fields(self, window=float(self.window), points=int(points))

    def _check_rings(self) -> None:
        if self.window != DEFAULT_WINDOW or self.points is not None:
            raise SolveError("observation: rings are observed at their radii alone; leave window and points out")
        object.__setattr__(self, "radii", checked_ring_radii(self.radii))

    @classmethod
    def from_text(cls, text: str) -> Observation:
        """The operator that `str` wrote, as in 'profile 0-7.5 mm', 'field 0-5 mm, 30 radii' or 'rings 0, 2, 4 mm'."""
        result, words = _TEXT.fullmatch(text), text.split()
        try:
            if words[:1] == ["rings"] and words[-1] == "mm" and "_" not in text:
                return cls("rings", radii=tuple(float(radius) for radius in " ".join(words[1:-1]).split(",")))
            if result is None or result[1] == "rings":
                raise ValueError(text)
            window, points = float(result[2]), None if result[3] is None else int(result[3])
        except ValueError as error:
            raise SolveError(
                f"observation: '{text}' is not understood; write a form and a window, as in 'profile 0-7.5 mm' or "
                "'field 0-5 mm', or radii, as in 'rings 0, 2, 4 mm'"
            ) from error
        return cls(result[1], window, points)  # type: ignore[arg-type]

    def __str__(self) -> str:
        if self.form == "rings":
            return f"rings {', '.join(map(_length_text, self.radii))} mm"
        radii = "" if self.points == DEFAULT_RADII[self.form] else f", {self.points} radii"
        return f"{self.form} 0-{_length_text(self.window)} mm{radii}"

    def replace(self, **changes: Any) -> Observation:
        """The same operator with some fields changed; a new form has its own points and radii unless given too."""
        if "form" in changes:
            changes = {"points": None, "radii": (), **changes}
            if "rings" in (self.form, changes["form"]):
                changes = {"window": DEFAULT_WINDOW, **changes}
        return replace(self, **changes)

    def within(self, window: float) -> Observation:
        """The same operator in another window, mm; rings have none and stay."""
        return self if self.form == "rings" else self.replace(window=float(window))

    @property
    def outputs(self) -> tuple[Output, ...]:
        """Names of what is observed."""
        return RING_OUTPUTS[: len(self.radii)] if self.form == "rings" else OBSERVED

    def observe(self, radii: ArrayLike, profiles: ArrayLike) -> Floats:
        """Outputs of frames, (frames, outputs): D_amp in mm, S_d in mm and S_p, or u_z in mm on each ring.

        radii : (nodes,) mm, of the undeformed top's corner and middle nodes in turn, from the axis outwards.
        profiles : (frames, nodes) u_z in mm.

        In a fit a frame at rest (below 1e-9 mm everywhere) has D = 0 and the S and p of the next frame that was fitted,
        else of the last one: at t = 0 they stand for the limit of what follows. A frame without a fit worth the name is
        NaN.
        """
        sampling = self.sampling(radii)
        return sampling.fit.observe(_frames(profiles, sampling), derivatives=False)[0]

    def observe_at_times(
        self, radii: ArrayLike, profiles: ArrayLike, steps: TimeInterpolation, times: ArrayLike
    ) -> Floats:
        """As `observe` of the accepted steps of a simulation, interpolated to `times`: (times, outputs).

        radii : (nodes,) mm at rest. profiles : (steps, nodes) mm. times : (times,) s.
        """
        sampling = self.sampling(radii)
        asked = np.atleast_1d(np.asarray(times, dtype=float))
        return sampling.fit.observe_at_times(_frames(profiles, sampling), steps, asked)[0]

    def observe_with_derivatives(self, radii: ArrayLike, profiles: ArrayLike) -> tuple[Floats, Floats]:
        """As `observe`, and the exact derivatives (frames, outputs, nodes).

        radii : (nodes,) mm. profiles : (frames, nodes) mm.

        At rest D has the derivatives of the frame that lent its shape (those of D do not change with the size of a
        profile), S and p have none and are given zeros.
        """
        sampling = self.sampling(radii)
        outputs, derivatives = sampling.fit.observe(_frames(profiles, sampling), derivatives=True)
        return outputs, derivatives @ sampling.nodes.values

    def window_derivatives(self, radii: ArrayLike, profiles: ArrayLike) -> Floats:
        """Derivatives (frames, outputs) of what is observed to the window, 1/mm of each; zero of rings.

        radii : (nodes,) mm at rest. profiles : (frames, nodes) mm.
        """
        if self.form == "rings":
            return np.zeros((len(np.asarray(profiles)), len(self.radii)))
        sampling = self.sampling(radii)
        frames = _frames(profiles, sampling)
        outputs, derivatives = sampling.fit.observe(frames, derivatives=True)
        slopes = _chain(derivatives, frames @ sampling.nodes.slopes.T * sampling.shares)
        slopes[:, 1] += outputs[:, 1] / self.window
        return slopes

    def node_derivatives(self, radii: ArrayLike, profiles: ArrayLike, shift: ArrayLike) -> Floats:
        """Derivatives (frames, outputs) of what is observed when top nodes move along the radius, keeping their u_z.

        radii : (nodes,) mm at rest. profiles : (frames, nodes) mm.
        shift : (nodes,) mm for each unit of what moves them, such as the apex thickness of a mesh that follows it.
        """
        sampling = self.sampling(radii)
        frames = _frames(profiles, sampling)
        _, derivatives = sampling.fit.observe(frames, derivatives=True)
        moved = sampling.nodes.values @ np.asarray(shift, dtype=float)
        return _chain(derivatives, -(frames @ sampling.nodes.slopes.T) * moved)

    def sampling(self, radii: ArrayLike) -> ProfileSampling:
        """Where the operator observes a surface; radii : (nodes,) mm, of its nodes at rest."""
        return _sampling_of(self, np.asarray(radii, dtype=float).tobytes())


def _chain(derivatives: Floats, change: Floats) -> Floats:
    """Change (frames, outputs) of what is observed with a change (frames, radii) of the profile."""
    return np.asarray(np.einsum("fvi,fi->fv", derivatives, change))


def _length_text(length: float) -> str:
    return repr(length).removesuffix(".0")


def _frames(profiles: ArrayLike, sampling: ProfileSampling) -> Floats:
    frames = np.asarray(profiles, dtype=float)
    nodes = sampling.nodes.values.shape[1]
    if frames.ndim != 2 or frames.shape[1] != nodes:
        raise SolveError(
            f"profiles have the shape {frames.shape}; expected (frames, {nodes}), a column for each radius"
        )
    return frames


@lru_cache(maxsize=64)
def _sampling_of(operator: Observation, nodes: bytes) -> ProfileSampling:
    """Where `operator` observes a surface with these radii."""
    from creepkit.specimens.bulge.gaussian_fit import LOG_OF_ZERO, GaussianFit, PolarGrid

    radii = checked_surface_radii(np.frombuffer(nodes))
    if operator.form == "rings":
        rings = np.array(operator.radii)
        at_rings = surface_interpolation_with_slopes(radii, rings)
        return ProfileSampling(frozen(rings / operator.window), at_rings, RingDisplacements(at_rings.values))
    if radii[0] > 1e-9 or radii[-1] < operator.window * (1 - 1e-9):
        raise SolveError(
            f"observation: the window reaches from 0 to {operator.window:g} mm, but the observed surface from "
            f"{radii[0]:g} to {radii[-1]:g} mm; choose a window within it"
        )
    shares, radial, angles, angular = _disc(operator) if operator.form == "field" else _line(operator)
    with np.errstate(divide="ignore"):
        logarithms = [np.maximum(np.log(values), LOG_OF_ZERO) for values in (shares, np.cos(angles), np.sin(angles))]
    grid = PolarGrid(
        frozen(logarithms[0]), frozen(radial), frozen(logarithms[1]), frozen(logarithms[2]), frozen(angular)
    )
    interpolation = surface_interpolation_with_slopes(radii, operator.window * shares)
    return ProfileSampling(frozen(shares), interpolation, GaussianFit(grid, interpolation.values, operator.window))


def _line(operator: Observation) -> tuple[Floats, Floats, Floats, Floats]:
    """Shares of the window and their weights, angles and their weights: equidistant radii at the angle 0."""
    assert operator.points is not None
    return np.linspace(0.0, 1.0, operator.points), np.ones(operator.points), np.zeros(1), np.ones(1)


def _disc(operator: Observation) -> tuple[Floats, Floats, Floats, Floats]:
    """As `_line`, for the disc: Gauss points from the middle to the edge, and over one of eight equal sectors."""
    assert operator.points is not None
    place, weight = np.polynomial.legendre.leggauss(operator.points)
    turn, share = np.polynomial.legendre.leggauss(_ANGLES)
    shares = 0.5 * (place + 1.0)
    return shares, weight * shares, np.pi / 8.0 * (turn + 1.0), share


def checked_ring_radii(radii: Sequence[Any]) -> tuple[float, ...]:
    """Radii of rings, mm; SolveError unless there are one to eight, not negative and increasing."""
    in_range = all(r in numbers(0.0, 1e4) for r in radii)
    if not (in_range and 1 <= len(radii) <= MOST_RINGS and all(a < b for a, b in pairwise(radii))):
        raise SolveError(
            f"observation: rings have the radii {tuple(radii)}; allowed are one to {MOST_RINGS} increasing radii in "
            "mm, as in radii=(0, 2, 4)"
        )
    return tuple(float(r) for r in radii)


@dataclass(frozen=True, eq=False)
class RingDisplacements:
    """u_z on rings, which needs no fit.

    nodes : (radii, nodes) from the displacements of the nodes to those at the radii.
    """

    nodes: Floats

    def observe(self, profiles: Floats, derivatives: bool) -> tuple[Floats, Floats]:
        """u_z (frames, radii) mm; derivatives (frames or 0, radii, radii), of each to itself.

        profiles : (frames, nodes) mm.
        """
        rings = len(self.nodes)
        own = np.broadcast_to(np.eye(rings), (len(profiles) if derivatives else 0, rings, rings))
        return np.asarray(profiles @ self.nodes.T), own

    def observe_at_times(self, profiles: Floats, steps: TimeInterpolation, times: Floats) -> tuple[Floats, Floats]:
        """As `observe` of the accepted steps, interpolated: (times, radii), and derivatives to nothing.

        profiles : (steps, nodes) mm. times : (times,) s.
        """
        outputs = steps.interpolate(self.observe(profiles, derivatives=False)[0], times)
        return outputs, np.empty((*outputs.shape, 0))
