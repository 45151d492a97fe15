"""A bulge test with one degree of freedom, as a predictor, and planted bulge tests.

The apex of a pressurised dimple of thickness h follows dD/dt = kappa(D, h) f(k(D, h) P, strain, t), on top of its
elastic deflection; k, kappa and that deflection are fits to finite element results of one dimple (14.69 at h = 0.5 mm
and so on, read as numbers of a test problem, not as truth). Width and shape are smooth functions of D, made up.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from creepkit.errors import SolveError
from creepkit.kernels import lower
from creepkit.language import CreepLaw, Elastic
from creepkit.records import History, Prediction, PressureJump

NOMINAL = {"thickness": 0.5, "window": 7.5, "modulus": 0.0, "temperature": 0.0}
STEPS, END = 22, 4 * 3600.0
"""Times of the integration after its first minutes, which do not depend on the frames, up to the longest test, s."""
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
class OneDegree:
    """Predictor of amplitude (mm), width (mm) and shape.

    exact : whether it gives derivatives (differences of its own); stand_in : whether it offers a coarser one.
    """

    exact: bool = False
    stand_in: bool = False
    coarseness: float = 1.0
    calls: list[int] = field(default_factory=list)
    name: str = "one-degree"
    outputs: tuple[str, ...] = ("amplitude", "width", "shape")
    effects: tuple[str, ...] = ("thickness", "modulus", "temperature", "window")

    def __post_init__(self) -> None:
        if self.stand_in:
            self.screening = lambda: OneDegree(coarseness=1.1, calls=self.calls)

    def predict(
        self, law: CreepLaw, values: Mapping[str, Any], histories: Sequence[History], *, jacobian: bool = False,
        effects: Mapping[str, np.ndarray] | None = None,
    ) -> Prediction:  # fmt: skip
        kernel = lower(law, "numpy")
        theta = [np.atleast_1d(np.log(values[n]) if p.scale == "log" else values[n]) for n, p in law.table.items()]
        theta = np.stack(np.broadcast_arrays(*theta), axis=-1)
        for kind in effects or {}:
            if kind not in self.effects:
                raise SolveError(f"{self.name} does not know the nuisance '{kind}'")
        if effects:
            count = max(len(theta), *(len(v) for v in effects.values()))
            theta = np.broadcast_to(theta, (count, theta.shape[-1]))
        self.calls.append(len(theta))
        found, ends = self._run(kernel, theta, histories, effects or {})
        slopes, own = None, {}
        if jacobian and self.exact:
            slopes = np.stack(
                [self._slope(kernel, theta, histories, effects or {}, p) for p in range(theta.shape[1])], -1
            )
            own = {kind: self._slope(kernel, theta, histories, effects, kind) for kind in effects or {}}
        lengths = np.array([h.times.size for h in histories])
        status = np.where(np.isfinite(ends), 1, 0)
        return Prediction(found, self.outputs, lengths, status, ends, slopes, effect_jacobian=own)

    def _slope(self, kernel, theta, histories, effects, which):
        sides = []
        for sign in (1, -1):
            moved, other = theta.copy(), dict(effects)
            if isinstance(which, str):
                other[which] = effects[which] + sign * 1e-4
            else:
                moved[:, which] += sign * 1e-4
            sides.append(self._run(kernel, moved, histories, other)[0])
        return (sides[0] - sides[1]) / 2e-4

    def _run(self, kernel, theta, histories, effects):
        longest = max(h.times.size for h in histories)
        out = np.full((len(theta), len(histories), longest, 3), np.nan)
        ends = np.full((len(theta), len(histories)), np.inf)
        for t, history in enumerate(histories):
            own = {kind: np.broadcast_to(v[:, t], (len(theta),)) for kind, v in effects.items()}
            D, end = self._amplitude(kernel, theta, history, own)
            window = own.get("window", NOMINAL["window"]) * np.ones(len(theta)) - 7.5
            out[:, t, : D.shape[1], 0] = D * (1 - 0.004 * window[:, None])
            out[:, t, : D.shape[1], 1] = 3.9 - 0.6 * (1 - np.exp(-D / 0.3)) + 0.03 * window[:, None]
            out[:, t, : D.shape[1], 2] = 2.02 + 0.25 * D + 0.1 * D**2 - 0.02 * window[:, None]
            ends[:, t] = end
        return out, ends

    def _amplitude(self, kernel, theta, history, own):
        """(candidates, times) by Heun's rule."""
        h = own.get("thickness", history.geometry.get("apex_thickness", 0.5)) * np.ones(len(theta))
        T = float(history.temperature) + own.get("temperature", np.zeros(len(theta)))
        E = history.elastic.E * (1 + own.get("modulus", np.zeros(len(theta))))
        program = history.loading.program()
        grid = np.concatenate([[0.0], np.geomspace(60.0, 1200.0, 8), np.linspace(1800.0, END, STEPS)])
        D, eps = np.full((len(theta), grid.size), np.nan), np.full(len(theta), 1e-6)
        creep, end = np.zeros(len(theta)), np.full(len(theta), np.inf)

        def speed(c, e, t):
            P = float(program.at(t))
            total = np.maximum(elastic(P, E, h) + c, 0.03)
            stress = np.maximum(k(np.minimum(total, 2 * LIMIT), h) * P, 1e-3)
            log = kernel.internal_log_rate(stress, e, max(t, 1.0), T, stress, stress / 3, *theta.T)
            f = np.exp(np.minimum(log, 5.0))
            return self.coarseness * kappa(np.minimum(total, 2 * LIMIT), h) * f, f

        for j, t in enumerate(grid):
            if j:
                dt, before = t - grid[j - 1], grid[j - 1]
                a, fa = speed(creep, eps, before)
                b, fb = speed(creep + a * dt, eps + fa * dt, t)
                creep, eps = creep + 0.5 * dt * (a + b), eps + 0.5 * dt * (fa + fb)
                gone = (creep > LIMIT) & np.isinf(end)
                end[gone] = t
            D[:, j] = np.where(np.isinf(end), elastic(float(program.at(t)), E, h) + creep, np.nan)
        return np.stack([np.interp(history.times, grid, d, right=np.nan) for d in D]), end


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
        effects = {"thickness": np.array([[plan.thickness]]), "temperature": np.array([[plan.temperature]])}
        clean = OneDegree().predict(law, own, [bare], effects=effects).of(0)
        noisy = clean + rng.normal(size=clean.shape) * noise
        noisy[:, 0] += plan.offset
        tests.append(bare.replace(outputs=dict(zip(OneDegree.outputs, noisy.T, strict=True))))
    return tests
