"""How a bulged surface becomes three numbers: amplitude D_amp, width S_d and shape S_p of a generalised Gaussian.

Two forms, fitted by least squares within a window of the undeformed radius:

    "profile"   D exp(-(r/S)^p), the paper's Eq. (3), on radii r = 0 ... window, each of the same weight;
    "field"     D exp(-|x/S|^p - |y/S|^p), Eq. (7), on the profile revolved over the disc r <= window, each mm^2 of the
                same weight, as the dense pixels of cameras give it.

They agree for p = 2 alone: Eq. (7) is not a surface of revolution otherwise. No bulge is such a function exactly, so
form, window and weights decide on some percents of S and p: compare only what one operator saw.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import lru_cache
from numbers import Real
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, get_args

import numpy as np

from creepkit.arrays import ArrayLike, Floats, Ints, frozen
from creepkit.errors import SolveError, nearest
from creepkit.specimens.top_profile import SurfaceInterpolation, checked_surface_radii, surface_interpolation_with_slopes

if TYPE_CHECKING:
    from creepkit.specimens.gaussian_sum import PolarGrid

OBSERVED = ("amplitude", "width", "shape")
"""Columns of what is observed: D_amp in mm, S_d in mm, S_p."""

Form = Literal["profile", "field"]
DEFAULT_RADII: dict[str, int] = {"profile": 76, "field": 40}
"""Radii looked at by default: for the profile 0, 0.1 ... 7.5 mm in the default window."""

_ANGLES = 6
"""Gauss points over an eighth of a turn; S_p from 40 radii by 6 angles lies within 5e-5 of that from 1000 by 40."""

_FEWEST, _MOST = 8, 2000
_TEXT = re.compile(r"\s*(\w+)\s+0\s*(?:-|to)\s*(\S+)\s*mm\s*(?:,\s*(\d+)\s+radii\s*)?")


class ProfileSampling(NamedTuple):
    """What a form, a window and a set of nodes come to: the radii as shares of the window, the way there, the grid."""

    shares: Floats
    nodes: SurfaceInterpolation
    grid: PolarGrid


@dataclass(frozen=True)
class Observation:
    """How a top profile becomes D_amp, S_d, S_p: form, window and grid of the generalised Gaussian fit.

    form : "profile" or "field". window : mm, the largest radius looked at, in the undeformed plate.
    points : radii looked at; None for 76 of a profile and 40 of a field (Gauss points, at 6 angles each).

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
        return self._fit(sampling, _frames(profiles, sampling), slopes=False)[0]

    def observe_with_derivatives(self, radii: ArrayLike, profiles: ArrayLike) -> tuple[Floats, Floats]:
        """As `observe`, and the exact derivatives (frames, 3, nodes) to `profiles`.

        At rest D has the derivatives of the frame that lent its shape (those of D do not change with the size of a
        profile), S and p have none and are given zeros.
        """
        sampling = self._sampling(radii)
        outputs, derivatives = self._fit(sampling, _frames(profiles, sampling), slopes=True)
        return outputs, derivatives @ sampling.nodes.values

    def window_derivatives(self, radii: ArrayLike, profiles: ArrayLike) -> Floats:
        """Derivatives (frames, 3) of what is observed to the window, 1/mm of each."""
        sampling = self._sampling(radii)
        frames = _frames(profiles, sampling)
        outputs, derivatives = self._fit(sampling, frames, slopes=True)
        slopes = self._chain(derivatives, frames @ sampling.nodes.slopes.T * sampling.shares)
        slopes[:, 1] += outputs[:, 1] / self.window
        return slopes

    def node_derivatives(self, radii: ArrayLike, profiles: ArrayLike, shift: ArrayLike) -> Floats:
        """Derivatives (frames, 3) of what is observed when the top nodes move along the radius, keeping their u_z.

        shift : (nodes,) mm for each unit of what moves them, such as the apex thickness of a mesh that follows it.
        """
        sampling = self._sampling(radii)
        frames = _frames(profiles, sampling)
        _, derivatives = self._fit(sampling, frames, slopes=True)
        moved = sampling.nodes.values @ np.asarray(shift, dtype=float)
        return self._chain(derivatives, -(frames @ sampling.nodes.slopes.T) * moved)

    def _sampling(self, radii: ArrayLike) -> ProfileSampling:
        return _sampling_of(self, np.asarray(radii, dtype=float).tobytes())

    def _fit(self, sampling: ProfileSampling, frames: Floats, slopes: bool) -> tuple[Floats, Floats]:
        """What is observed (frames, 3), and its derivatives (frames, 3, radii) to the profile at the radii."""
        from creepkit.specimens import gaussian_fit  # numba is heavy, and a list of specimens needs none of it

        with np.errstate(invalid="ignore"):  # a profile that is not finite becomes NaN, which is the answer to it
            samples = frames @ sampling.nodes.values.T
        fits, states = np.empty((len(samples), 3)), np.empty(len(samples), dtype=np.int64)
        derivatives = np.full((len(samples) if slopes else 0, 3, samples.shape[1]), np.nan)
        gaussian_fit.fit_frames(sampling.grid, samples, fits, states, derivatives)
        fits[:, 1] *= self.window
        derivatives[:, 1] *= self.window
        _fill_rest_shapes(fits, derivatives, np.flatnonzero(states == gaussian_fit.AT_REST), states == gaussian_fit.FITTED)
        return fits, derivatives

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


def _fill_rest_shapes(fits: Floats, derivatives: Floats, resting: Ints, fitted: np.ndarray) -> None:
    """Give frames at rest no amplitude and the shape of the next frame that was fitted, else of the last one."""
    fits[resting, 0] = 0.0
    source_frames = np.flatnonzero(fitted)
    if not (resting.size and source_frames.size):
        return
    source = source_frames[np.minimum(np.searchsorted(source_frames, resting), source_frames.size - 1)]
    fits[resting, 1:] = fits[source, 1:]
    if len(derivatives):
        derivatives[resting, 0] = derivatives[source, 0]
        derivatives[resting, 1:] = 0.0


@lru_cache(maxsize=64)
def _sampling_of(operator: Observation, nodes: bytes) -> ProfileSampling:
    """Where `operator` looks on a surface with these radii."""
    from creepkit.specimens.gaussian_sum import LOG_OF_ZERO, PolarGrid

    radii = checked_surface_radii(np.frombuffer(nodes))
    if radii[0] > 1e-9 or radii[-1] < operator.window * (1 - 1e-9):
        raise SolveError(
            f"observation: the window reaches from 0 to {operator.window:g} mm, but the observed surface from "
            f"{radii[0]:g} to {radii[-1]:g} mm; choose a window within it"
        )
    shares, radial, angles, angular = _disc(operator) if operator.form == "field" else _line(operator)
    with np.errstate(divide="ignore"):
        logarithms = [np.maximum(np.log(values), LOG_OF_ZERO) for values in (shares, np.cos(angles), np.sin(angles))]
    grid = PolarGrid(frozen(logarithms[0]), frozen(radial), frozen(logarithms[1]), frozen(logarithms[2]), frozen(angular))
    return ProfileSampling(frozen(shares), surface_interpolation_with_slopes(radii, operator.window * shares), grid)


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
