"""A bulge test with one degree of freedom, as a predictor, and planted bulge tests.

The apex of a pressurised dimple of thickness h follows dD/dt = kappa(D, h) f(k(D, h) P, strain, t), on top of its
elastic deflection; k, kappa and that deflection are fits to finite element results of one dimple (14.69 at h = 0.5 mm
and so on, read as numbers of a test problem, not as truth). Width and shape are smooth functions of D, made up.
"""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from creepkit.kernels import lower
from creepkit.language import Elastic
from creepkit.records import Dimension, History, Prediction, Predictor, PressureJump

END = 4 * 3600.0
GRID = np.concatenate([[0.0], np.geomspace(60.0, 1200.0, 8), np.linspace(1800.0, END, 22)])
"""s; times of the integration, the same whatever frames a history has."""
LIMIT = 2.4
"""mm; a larger dimple has burst."""


def k(D, h):
    """Reference stress over pressure."""
    return 14.69 * (h / 0.5) ** -1.171 * (1 + (D / (0.2195 * (h / 0.5) ** 1.129)) ** 3.081) ** -0.0950


def kappa(D, h):
    """Growth of the apex over that of strain, mm."""
    return 42.3 * (h / 0.5) ** -0.486 * (1 + (D / (0.4133 * (h / 0.5) ** 0.777)) ** 1.856) ** -0.4854


def elastic(P, E, h):
    """Elastic deflection of the apex, mm."""
    x = P / E
    return 749 * (h / 0.5) ** -1.655 * x * (1 + 830 * (h / 0.5) ** -2.65 * x) ** -0.723


@dataclass
class OneDegree(Predictor):
    """Predictor of amplitude (mm), width (mm) and shape.

    exact : whether it gives derivatives (differences of its own); stand_in : whether it offers a coarser one.
    """

    exact: bool = False
    stand_in: bool = False
    coarseness: float = 1.0
    calls: list[int] = field(default_factory=list)
    name: str = "one-degree"
    outputs: tuple[str, ...] = ("amplitude", "width", "shape")
    nuisances: tuple[str, ...] = ("thickness", "modulus", "temperature", "window")

    dimensions: ClassVar = (Dimension("apex_thickness", 0.5, alias="thickness"), Dimension("window", 7.5))

    def reference_stress(self, history: History) -> np.ndarray:
        """(levels,) MPa, of each pressure."""
        levels = np.unique(history.loading.program().values)
        return 12.5 * levels[levels > 0]

    def growth_per_strain(self, history: History) -> float:
        """mm of amplitude for a unit of strain."""
        return 30.0

    def __post_init__(self) -> None:
        if self.stand_in:
            self.reduced_order_model = lambda: OneDegree(coarseness=1.1, calls=self.calls)

    def predict_batch(self, law, theta, histories, nuisances, sensitivities):
        self.calls.append(len(theta))
        found, ends = self._run(law, theta, histories, nuisances)
        exact = sensitivities and self.exact
        slopes, changes = self._slopes(law, theta, histories, nuisances) if exact else (None, {})
        lengths = np.array([h.times.size for h in histories])
        status = np.where(np.isfinite(ends), 1, 0)
        return Prediction(found, self.outputs, lengths, status, ends, slopes, nuisance_jacobian=changes)

    def _slopes(self, law, theta, histories, nuisances):
        """Central differences of all candidates, in one batch: (parameters), then (kinds)."""
        (candidates, size), step = theta.shape, 1e-4
        count = size + len(nuisances)
        points = np.repeat(theta[None], 2 * count, axis=0)
        moved = {kind: np.repeat(v[None], 2 * count, axis=0) for kind, v in nuisances.items()}
        for k in range(count):
            for row, sign in ((k, 1), (count + k, -1)):
                if k < size:
                    points[row, :, k] += sign * step
                else:
                    moved[list(nuisances)[k - size]][row] += sign * step
        flat = {kind: v.reshape(-1, v.shape[-1]) for kind, v in moved.items()}
        found = self._run(law, points.reshape(-1, size), histories, flat)[0]
        up, down = np.split(found.reshape(2 * count, candidates, *found.shape[1:]), 2)
        slope = (up - down) / (2 * step)
        own = {kind: slope[size + k] for k, kind in enumerate(nuisances)}
        return np.moveaxis(slope[:size], 0, -1), own

    def _run(self, law, theta, histories, nuisances):
        shape = len(theta), len(histories)
        D, ends = self._amplitude(law, theta, histories, nuisances)
        window = np.broadcast_to(nuisances.get("window", 7.5), shape) - 7.5
        out = np.full((*shape, max(h.times.size for h in histories), 3), np.nan)
        for t, history in enumerate(histories):
            d = np.stack([np.interp(history.times, GRID, each, right=np.nan) for each in D[:, t]])
            off, size = window[:, t, None], history.times.size
            out[:, t, :size, 0] = d * (1 - 0.004 * off)
            out[:, t, :size, 1] = 3.9 - 0.6 * (1 - np.exp(-d / 0.3)) + 0.03 * off
            out[:, t, :size, 2] = 2.02 + 0.25 * d + 0.1 * d**2 - 0.02 * off
        return out, ends

    def _amplitude(self, law, theta, histories, own):
        """(candidates, tests, grid) by Heun's rule, NaN after a burst; and when that was."""
        shape = len(theta), len(histories)
        nominal = np.array([h.geometry.get("apex_thickness", 0.5) for h in histories])
        h = np.broadcast_to(own.get("thickness", nominal), shape)
        T = np.array([float(test.temperature) for test in histories]) + own.get("temperature", np.zeros(shape))
        E = np.array([test.elastic.E for test in histories]) * (1 + own.get("modulus", np.zeros(shape)))
        pressures = np.stack([test.loading.program().at(GRID) for test in histories], axis=1)
        kernel, columns = lower(law, "numpy"), theta.T[..., None]

        def speed(c, e, P, t):
            D = np.clip(elastic(P, E, h) + c, 0.03, 2 * LIMIT)
            stress = np.maximum(k(D, h) * P, 1e-3)
            log = kernel.internal_log_rate(stress, e, max(t, 1.0), T, stress, stress / 3, *columns)
            f = np.exp(np.minimum(log, 5.0))
            return self.coarseness * kappa(D, h) * f, f

        creep, strain, end = np.zeros(shape), np.full(shape, 1e-6), np.full(shape, np.inf)
        D = np.empty((*shape, GRID.size))
        for j, (t, P) in enumerate(zip(GRID, pressures, strict=True)):
            if j:
                dt = t - GRID[j - 1]
                a, fa = speed(creep, strain, pressures[j - 1], GRID[j - 1])
                b, fb = speed(creep + a * dt, strain + fa * dt, P, t)
                creep, strain = creep + 0.5 * dt * (a + b), strain + 0.5 * dt * (fa + fb)
                end = np.where((creep > LIMIT) & np.isinf(end), t, end)
            D[..., j] = np.where(np.isinf(end), elastic(P, E, h) + creep, np.nan)
        return D, end


@dataclass(frozen=True)
class Plan:
    """One planted test: temperature C, pressures MPa, and what is off about it."""

    celsius: float
    P1: float = 8.0
    P2: float = 8.0
    thickness: float = 0.5
    offset: float = 0.0
    rate: float = 1.0
    temperature: float = 0.0


def planted(law, values, plans, *, seed=0, noise=(1.5e-3, 0.02, 0.02), frames=48):
    """Bulge tests of `plans` with white noise; noise : of amplitude mm, width mm, shape."""
    rng, tests = np.random.default_rng(seed), []
    times = np.linspace(150.0, END, frames)
    coefficient = next(n for n, p in law.table.items() if p.scale == "log")
    for j, plan in enumerate(plans):
        bare = History(
            f"test_{j:02d}", times, {}, PressureJump(plan.P1, plan.P2, 2 * 3600.0), plan.celsius + 273.15,
            specimen="one-degree", elastic=Elastic(180e3 - 100 * plan.celsius),
        )  # fmt: skip
        own = {**values, coefficient: values[coefficient] * plan.rate}
        nuisances = {"thickness": np.array([[plan.thickness]]), "temperature": np.array([[plan.temperature]])}
        clean = OneDegree().predict(law, law.to_internal(own), [bare], nuisances=nuisances).of(0)
        noisy = clean + rng.normal(size=clean.shape) * noise
        noisy[:, 0] += plan.offset
        tests.append(bare.replace(outputs=dict(zip(OneDegree.outputs, noisy.T, strict=True))))
    return tests
