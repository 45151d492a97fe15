"""A stereo camera that watches a simulated dimple: grid of subsets, rigid motion, drift, lost subsets, noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

import creepkit as ck
from creepkit.arrays import Floats
from creepkit.fem.surface_interpolation import surface_interpolation
from creepkit.records import CameraFrame, Frames
from creepkit.specimens.bulge.observation import Observation

LAW = dict(A=1e-16, n=5.2)


@dataclass(frozen=True)
class Dimple:
    """A simulated top: times (frames,) s, radii (nodes,) mm, rise and widening (frames, nodes) mm, frames at rest."""

    times: Floats
    radii: Floats
    rise: Floats
    widening: Floats

    def truth(self, operator: str = "field 0-7.5 mm") -> Floats:
        return Observation.from_text(operator).observe(self.radii, self.rise)


def simulated_dimple(
    frames=60, rest=25, interval=150.0, pressure=8.0, A=1e-16, n=5.2, law="norton", refinement=1.0, specimen=None
) -> Dimple:
    """A dimple that creeps after `rest` frames without load.

    refinement : of the mesh; with 1 the surface kinks where elements meet, by 1 um in a dome of 1 mm.
    """
    loaded = interval * np.arange(1, frames - rest + 1)
    run = ck.simulate(
        law, specimen or ck.specimen("bulge").replace(refinement=refinement), dict(A=A, n=n), times=loaded,
        loading=ck.PressureJump(pressure, pressure, 1e9),
        temperature=1050.0, elastic=ck.Elastic(E=1e5, nu=0.3),
    )  # fmt: skip
    top = run.test.model.top
    rise = run._at(np.asarray(run.simulation.displacements[:, top, 1]), loaded)
    widening = run._at(np.asarray(run.simulation.displacements[:, top, 0]), loaded)
    zeros = np.zeros((rest, rise.shape[1]))
    times = interval * np.arange(frames)
    return Dimple(times, run.test.piece.top_radii, np.vstack([zeros, rise]), np.vstack([zeros, widening]))


@dataclass(frozen=True)
class VirtualCamera:
    """How frames are made; lengths in mm, angles in degrees.

    points : about how many, spacing apart. subset : side of the square over which a displacement is a mean.
    noise : of z; a third of it in x and y. correlation : of the noise, in spacings.
    memory : correlation of the noise of
    successive frames, of a first-order autoregression. lost : share of lost subsets, half
    of them for good. motion, turn : largest rigid motion. centers : of the dimples, in the plate.
    """

    points: int = 2500
    spacing: float = 0.56
    subset: float = 1.2
    noise: float = 1.5e-3
    correlation: float = 0.9
    memory: float = 0.0
    lost: float = 0.05
    motion: float = 0.3
    turn: float = 0.2
    tilt: float = 3.0
    centers: tuple[tuple[float, float], ...] = ((0.4, -0.7),)
    seed: int = 1

    def frames(self, *dimples: Dimple, name: str = "virtual") -> Frames:
        """A sequence that makes each frame when it is asked for; a dimple for each centre."""
        side = int(np.ceil(np.sqrt(self.points)))
        axis = self.spacing * (np.arange(side) - 0.5 * (side - 1))
        x, y = (grid.ravel() for grid in np.meshgrid(axis, axis))
        chosen = np.sort(np.argsort(np.maximum(np.abs(x), np.abs(y)), kind="stable")[: self.points])
        flat = np.stack([x, y, np.zeros_like(x)], axis=1)
        tilt = rotation(np.radians([self.tilt, -0.5 * self.tilt, 0.0]))
        points = flat @ tilt.T + np.array([12.0, -7.0, 400.0])
        first = np.random.default_rng([self.seed, 0])
        reference = self._noise(first, side)
        gone = self._blobs(first, side, 0.5 * self.lost)
        direction, axis_of_turn = first.normal(size=3), first.normal(size=3)
        direction, axis_of_turn = (v / np.linalg.norm(v) for v in (direction, axis_of_turn))
        maps = [self._maps(flat, d.radii, c) for d, c in zip(dimples, self.centers, strict=True)]
        times = dimples[0].times

        def frame(index: int) -> CameraFrame:
            random = np.random.default_rng([self.seed, index + 1])
            u = np.zeros_like(flat)
            for dimple, (up, out) in zip(dimples, maps, strict=True):
                u[:, 2] += up @ dimple.rise[index]
                u[:, 0] += out[0] @ dimple.widening[index]
                u[:, 1] += out[1] @ dimple.widening[index]
            phase = index / max(times.size - 1, 1)
            walk = 0.0 if index == 0 else phase + 0.03 * np.sin(17.0 * phase) + 0.01 * random.normal()
            turn = rotation(np.radians(self.turn) * walk * axis_of_turn)
            moved = (
                (flat + u) @ tilt.T @ turn.T
                + np.array([12.0, -7.0, 400.0]) @ np.eye(3)
                + self.motion * walk * direction
            )
            noise = self._noise(random, side) if not self.memory else self._innovation(index, side)
            for lag in range(1, 9 if self.memory else 1):  # what is left of earlier frames, to 0.4 % of it
                noise += self.memory**lag * self._innovation(index - lag, side)
            noise = (noise * np.sqrt(1.0 - self.memory**2) - reference) * (index > 0)
            displacements = moved - points + noise @ tilt.T
            lost = gone | (self._blobs(random, side, 0.5 * self.lost) if self.lost else False)
            valid = ~lost[chosen]
            return CameraFrame(
                points[chosen], np.where(valid[:, None], displacements[chosen], 0.0), valid, float(times[index]),
                f"{name}, frame {index}",
            )  # fmt: skip

        return Frames(name, times, frame, "virtual camera")

    def _innovation(self, index: int, side: int) -> Floats:
        """Noise that begins in a frame; those before the first count from 10^6 on."""
        return self._noise(np.random.default_rng([self.seed, index % 10**6, 1]), side)

    def _noise(self, random: np.random.Generator, side: int) -> Floats:
        white = random.normal(size=(3, side, side))
        smooth = (
            gaussian_filter(white, (0, self.correlation, self.correlation), mode="wrap") if self.correlation else white
        )
        smooth *= 1.0 / (2.0 * np.sqrt(np.pi) * self.correlation) ** -1 if self.correlation > 0.4 else 1.0
        return (smooth * np.array([1 / 3, 1 / 3, 1.0])[:, None, None] * self.noise).reshape(3, -1).T

    def _blobs(self, random: np.random.Generator, side: int, share: float) -> np.ndarray:
        field = gaussian_filter(random.normal(size=(side, side)), 1.0, mode="wrap").ravel()
        return field < np.quantile(field, share) if share > 0 else np.zeros(field.size, bool)

    def _maps(self, flat: Floats, radii: Floats, center: tuple[float, float]) -> tuple[Floats, Floats]:
        """From nodes of the top to means over subsets of u_z and of u_x, u_y; all zero beyond the last radius."""
        from scipy.sparse import csr_matrix

        places, shares = np.polynomial.legendre.leggauss(3)
        up, out = 0.0, [0.0, 0.0]
        for px, wx in zip(places, shares / 2, strict=True):
            for py, wy in zip(places, shares / 2, strict=True):
                dx = flat[:, 0] + 0.5 * self.subset * px - center[0]
                dy = flat[:, 1] + 0.5 * self.subset * py - center[1]
                r = np.hypot(dx, dy)
                inside = r < radii[-1]
                rows = wx * wy * inside[:, None] * surface_interpolation(radii, np.where(inside, r, 0.0))
                up = up + csr_matrix(rows)
                out = [
                    o + csr_matrix(rows * (d / np.maximum(r, 1e-12))[:, None])
                    for o, d in zip(out, (dx, dy), strict=True)
                ]
        return up, out


def rotation(vector: Floats) -> Floats:
    """The rotation by a vector, rad."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_rotvec(vector).as_matrix()
