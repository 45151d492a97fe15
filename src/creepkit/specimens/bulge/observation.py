"""The observation operator: amplitude D_amp, width S_d and shape S_p of a generalised Gaussian.

Fitted by least squares to the displacement of the top within a window of the undeformed radius: as "profile", D
exp(-(r/S)^p), the paper's Eq. (3), or as "field", Eq. (7). `field_fit` does the same with measured points.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from numbers import Real
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, get_args

import numpy as np

from creepkit.arrays import ArrayLike, Floats, frozen
from creepkit.errors import SolveError, nearest
from creepkit.fem.mesh import SurfaceInterpolation, checked_surface_radii, surface_interpolation_with_slopes
from creepkit.records import Output

if TYPE_CHECKING:  # heavy, and a list of specimens needs none of it
    from creepkit.fem.time_interpolation import TimeInterpolation
    from creepkit.specimens.bulge.gaussian_fit import GaussianFit

OBSERVED = (
    Output("amplitude", "length", noise=0.0015, weight=0.99, visible=0.02),
    Output("width", "length", grows=False, noise=0.02, weight=0.005),
    Output("shape", "number", grows=False, noise=0.02, weight=0.005),
)
"""Columns of what is observed: D_amp in mm, S_d in mm, S_p. Noise as measured on real dimples; the paper's weights."""


PLOT_RADII = (0.0, 2.0, 4.0)
"""mm, those of the paper's Fig. 7a."""


def profile_displacement(outputs: Mapping[str, Floats], radius: float) -> Floats:
    """D exp(-(r / S)^p), (frames,) mm; NaN where width or shape is not above zero or was not observed.

    outputs : {name: (frames,)}, "amplitude" and "width" in mm, "shape". radius : mm.
    """
    amplitude = np.asarray(outputs["amplitude"], float)
    if radius == 0.0:
        return amplitude
    not_observed = np.full(amplitude.shape, np.nan)
    width, shape = (np.asarray(outputs.get(name, not_observed), float) for name in ("width", "shape"))
    valid = (width > 0) & (shape > 0)
    ratio = np.where(valid, radius / np.where(valid, width, 1.0), np.nan)
    return np.asarray(amplitude * np.exp(-(ratio ** np.where(valid, shape, 1.0))))


Form = Literal["profile", "field"]


DEFAULT_RADII: dict[str, int] = {"profile": 76, "field": 40}
"""Radii observed by default: for the profile 0, 0.1 ... 7.5 mm in the default window."""


_ANGLES = 6
"""Gauss points over an eighth of a turn; S_p from 40 radii by 6 angles lies within 5e-5 of that from 1000 by 40."""


_FEWEST, _MOST = 8, 2000


_TEXT = re.compile(r"\s*(\w+)\s+0\s*(?:-|to)\s*(\S+)\s*mm\s*(?:,\s*(\d+)\s+radii\s*)?")


class ProfileSampling(NamedTuple):
    """What follows from a form, a window and a set of nodes.

    shares : (radii,) the radii that are sampled, as shares of the window. nodes : interpolation from the nodes to them.
    fit : to the displacements there.
    """

    shares: Floats
    nodes: SurfaceInterpolation
    fit: GaussianFit


@dataclass(frozen=True)
class Observation:
    """How a top profile becomes D_amp, S_d, S_p: form, window and grid of the generalised Gaussian fit.

    form : "profile" or "field". window : mm, the largest radius observed, in the undeformed plate.
    points : observed radii; None for 76 of a profile and 40 of a field (Gauss points, at 6 angles each).

    The radii are fixed shares of the window, so that what is observed changes smoothly with it.
    """

    form: Form = "profile"
    window: float = 7.5
    points: int | None = None

    def __post_init__(self) -> None:
        if self.form not in get_args(Form):
            raise SolveError(f"observation: no form is called '{self.form}'; {nearest(str(self.form), get_args(Form))}")
        if not _lies_within(self.window, 1e-3, 1e4):
            raise SolveError(f"observation: window is {self.window!r}; allowed is a length of 0.001 to 10000 mm")
        points = DEFAULT_RADII[self.form] if self.points is None else self.points
        if not _lies_within(points, _FEWEST, _MOST) or points != int(points):
            raise SolveError(f"observation: points is {points!r}; allowed are whole numbers, {_FEWEST} to {_MOST}")
        object.__setattr__(self, "window", float(self.window))
        object.__setattr__(self, "points", int(points))

    @classmethod
    def from_text(cls, text: str) -> Observation:
        """The operator that `str` wrote, as in 'profile 0-7.5 mm' or 'field 0-5 mm, 30 radii'."""
        result = _TEXT.fullmatch(text)
        try:
            if result is None:
                raise ValueError(text)
            window, points = float(result[2]), None if result[3] is None else int(result[3])
        except ValueError as error:
            raise SolveError(
                f"observation: '{text}' is not understood; write a form and a window, as in 'profile 0-7.5 mm' or "
                "'field 0-5 mm'"
            ) from error
        return cls(result[1], window, points)  # type: ignore[arg-type]

    def __str__(self) -> str:
        window = repr(self.window).removesuffix(".0")
        radii = "" if self.points == DEFAULT_RADII[self.form] else f", {self.points} radii"
        return f"{self.form} 0-{window} mm{radii}"

    def replace(self, **changes: Any) -> Observation:
        """The same operator with some fields changed; a new form has its own points unless they are given too."""
        if "form" in changes:
            changes = {"points": None, **changes}
        return replace(self, **changes)

    def observe(self, radii: ArrayLike, profiles: ArrayLike) -> Floats:
        """D_amp in mm, S_d in mm and S_p, (frames, 3).

        radii : (nodes,) mm, of the undeformed top's corner and middle nodes in turn, from the axis outwards.
        profiles : (frames, nodes) u_z in mm.

        A frame at rest (below 1e-9 mm everywhere) has D = 0 and the S and p of the next frame that was fitted, else of
        the last one: at t = 0 they stand for the limit of what follows. A frame without a fit worth the name is NaN.
        """
        sampling = self._sampling(radii)
        return sampling.fit.observe(_frames(profiles, sampling), derivatives=False)[0]

    def observe_at_times(
        self, radii: ArrayLike, profiles: ArrayLike, steps: TimeInterpolation, times: ArrayLike
    ) -> Floats:
        """As `observe` of the accepted steps of a simulation, interpolated to `times`: (times, 3).

        radii : (nodes,) mm at rest. profiles : (steps, nodes) mm. times : (times,) s.
        """
        sampling = self._sampling(radii)
        asked = np.atleast_1d(np.asarray(times, dtype=float))
        return sampling.fit.observe_at_times(_frames(profiles, sampling), steps, asked)[0]

    def observe_with_derivatives(self, radii: ArrayLike, profiles: ArrayLike) -> tuple[Floats, Floats]:
        """As `observe`, and the exact derivatives (frames, 3, nodes); radii (nodes,) mm, profiles (frames, nodes) mm.

        At rest D has the derivatives of the frame that lent its shape (those of D do not change with the size of a
        profile), S and p have none and are given zeros.
        """
        sampling = self._sampling(radii)
        outputs, derivatives = sampling.fit.observe(_frames(profiles, sampling), derivatives=True)
        return outputs, derivatives @ sampling.nodes.values

    def window_derivatives(self, radii: ArrayLike, profiles: ArrayLike) -> Floats:
        """Derivatives (frames, 3) of what is observed to the window, 1/mm of each.

        radii : (nodes,) mm at rest. profiles : (frames, nodes) mm.
        """
        sampling = self._sampling(radii)
        frames = _frames(profiles, sampling)
        outputs, derivatives = sampling.fit.observe(frames, derivatives=True)
        slopes = self._chain(derivatives, frames @ sampling.nodes.slopes.T * sampling.shares)
        slopes[:, 1] += outputs[:, 1] / self.window
        return slopes

    def node_derivatives(self, radii: ArrayLike, profiles: ArrayLike, shift: ArrayLike) -> Floats:
        """Derivatives (frames, 3) of what is observed when the top nodes move along the radius, keeping their u_z.

        radii : (nodes,) mm at rest. profiles : (frames, nodes) mm.
        shift : (nodes,) mm for each unit of what moves them, such as the apex thickness of a mesh that follows it.
        """
        sampling = self._sampling(radii)
        frames = _frames(profiles, sampling)
        _, derivatives = sampling.fit.observe(frames, derivatives=True)
        moved = sampling.nodes.values @ np.asarray(shift, dtype=float)
        return self._chain(derivatives, -(frames @ sampling.nodes.slopes.T) * moved)

    def _sampling(self, radii: ArrayLike) -> ProfileSampling:
        return _sampling_of(self, np.asarray(radii, dtype=float).tobytes())

    @staticmethod
    def _chain(derivatives: Floats, change: Floats) -> Floats:
        """Change (frames, 3) of what is observed with a change (frames, radii) of the profile."""
        return np.asarray(np.einsum("fvi,fi->fv", derivatives, change))


def _lies_within(value: object, least: float, most: float) -> bool:
    return isinstance(value, Real) and least <= float(value) <= most


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
