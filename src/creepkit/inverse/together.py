"""What predicts which history: several specimens as one predictor, what a predictor offers, its cheap stand-in."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from creepkit.arrays import ArrayLike
from creepkit.errors import FitError, SolveError
from creepkit.language import CreepLaw
from creepkit.records import Effects, History, Life, Prediction, Predictor, Screened, Status, WholeLife


@dataclass(frozen=True)
class Together:
    """Predictors of different specimens as one: each history goes to the predictor of its specimen."""

    predictors: Mapping[str, Predictor]

    @property
    def name(self) -> str:
        """The names of all, joined."""
        return " + ".join(getattr(p, "name", type(p).__name__) for p in self.predictors.values())

    def of(self, history: History) -> Predictor:
        """The predictor of one history."""
        if history.specimen not in self.predictors:
            raise FitError(
                f"history '{history.name}' is of specimen '{history.specimen}', for which using= names no predictor; "
                f"it names {', '.join(self.predictors)}"
            )
        return self.predictors[history.specimen]

    def predict(
        self,
        law: CreepLaw,
        values: Mapping[str, ArrayLike],
        histories: Sequence[History],
        *,
        jacobian: bool = False,
        effects: Effects | None = None,
    ) -> Prediction:
        """Predict each group of histories with its predictor; outputs that a test does not have are NaN."""
        parts = []
        for predictor, tests in self.groups(histories):
            own = {k: v[:, tests] for k, v in (effects or {}).items() if offers(predictor, k)}
            mine = [histories[k] for k in tests]
            found = predict(predictor, law, values, mine, jacobian=jacobian, effects=own)
            parts.append((tests, found))
        for kind in effects or {}:
            if not any(offers(self.of(h), kind) for h in histories):
                raise SolveError(f"none of the predictors {self.name} knows the nuisance '{kind}'")
        return self.joined(parts, histories)

    def groups(self, histories: Sequence[History]) -> list[tuple[Predictor, list[int]]]:
        """Each predictor with the positions of its histories."""
        chosen = [self.of(h) for h in histories]
        distinct = list({id(p): p for p in chosen}.values())
        return [(one, [k for k, p in enumerate(chosen) if p is one]) for one in distinct]

    @staticmethod
    def joined(parts: Sequence[tuple[list[int], Prediction]], histories: Sequence[History]) -> Prediction:
        """The predictions of groups as one."""
        return _joined(parts, histories)


def _joined(parts: Sequence[tuple[list[int], Prediction]], histories: Sequence[History]) -> Prediction:
    """One prediction in the order of the histories, with the union of outputs."""
    outputs = tuple(dict.fromkeys(name for _, found in parts for name in found.outputs))
    candidates, longest = len(parts[0][1].values), max(h.times.size for h in histories)
    shape = (candidates, len(histories), longest, len(outputs))
    values, status = np.full(shape, np.nan), np.full(shape[:2], int(Status.COMPLETE))
    ends = np.full(shape[:2], np.inf)
    exact = all(found.jacobian is not None for _, found in parts)
    jacobian = None
    kinds = {kind for _, found in parts for kind in found.effect_jacobian}
    slopes = {kind: np.zeros(shape) for kind in kinds}
    for tests, found in parts:
        columns = [outputs.index(name) for name in found.outputs]
        place = np.ix_(range(candidates), tests, range(found.values.shape[2]), columns)
        values[place] = found.values
        status[:, tests], ends[:, tests] = found.status, found.end_times
        for kind, slope in found.effect_jacobian.items():
            slopes[kind][place] = slope
        if exact and found.jacobian is not None:
            jacobian = np.full((*shape, found.jacobian.shape[-1]), np.nan) if jacobian is None else jacobian
            jacobian[place] = found.jacobian
    lengths = np.array([h.times.size for h in histories], np.int64)
    times = tuple(h.times for h in histories)
    return Prediction(values, outputs, lengths, status, ends, jacobian, times, slopes, _joined_life(parts, shape))


def _joined_life(parts: Sequence[tuple[list[int], Prediction]], shape: tuple[int, ...]) -> Life | None:
    """The lives of groups as one, if they have any; shape : (candidates, tests, times, outputs)."""
    lives = [(tests, found.life) for tests, found in parts if found.life is not None]
    if len(lives) < len(parts):
        return None

    def gathered(name: str, axes: int, fill: float) -> Any:
        arrays = [getattr(life, name) for _, life in lives]
        if any(array is None for array in arrays):
            return None
        out = np.full((*shape[:axes], *arrays[0].shape[axes:]), fill)
        for (tests, _), array in zip(lives, arrays, strict=True):
            if axes == 3:
                out[:, tests, : array.shape[2]] = array
            else:
                out[:, tests] = array
        return out

    horizon = np.zeros(shape[1])
    for tests, life in lives:
        horizon[tests] = life.horizon
    return Life(
        gathered("arrivals", 3, np.nan), gathered("slopes", 3, np.inf), gathered("ruptures", 2, np.nan), horizon,
        gathered("arrival_jacobian", 3, np.nan), gathered("rupture_jacobian", 2, np.nan),
    )  # fmt: skip


def predict(
    using: Predictor, law: CreepLaw, values: Mapping[str, ArrayLike], histories: Sequence[History], *,
    jacobian: bool = False, effects: Effects | None = None,
) -> Prediction:  # fmt: skip
    """Predict, mentioning effects only where there are any: a closed form need not know of them."""
    if effects:
        return using.predict(law, values, histories, jacobian=jacobian, effects=effects)
    return using.predict(law, values, histories, jacobian=jacobian)


def errors_of(using: Predictor) -> dict[str, float]:
    """{output: standard deviation} of what a predictor says that it is wrong by; the largest of several predictors."""
    found: dict[str, float] = {}
    for one in using.predictors.values() if isinstance(using, Together) else (using,):
        for name, size in getattr(one, "error", {}).items():
            found[name] = max(size, found.get(name, 0.0))
    return found


def offers(using: Predictor, kind: str) -> bool:
    """Whether a predictor knows an explicit nuisance: it names those it does in `effects`."""
    return kind in getattr(using, "effects", ())


def lasts(using: Predictor, history: History) -> bool:
    """Whether the predictor of a history follows specimens to their rupture."""
    return isinstance(predictor_of(using, history), WholeLife)


def predictor_of(using: Predictor, history: History) -> Predictor:
    """Which predictor a history goes to."""
    return using.of(history) if isinstance(using, Together) else using


def outputs_of(using: Predictor, history: History) -> tuple[str, ...]:
    """What is both measured and predicted of a history, in the predictor's order; the first grows with creep."""
    known: Iterable[str] = getattr(predictor_of(using, history), "outputs", tuple(history.outputs))
    return tuple(name for name in known if name in history.outputs)


def screening_of(using: Predictor) -> Predictor | None:
    """The cheap stand-in of a predictor, or None where it needs none."""
    if isinstance(using, Together):
        cheap = {name: screening_of(p) or p for name, p in using.predictors.items()}
        changed = any(cheap[name] is not p for name, p in using.predictors.items())
        return Together(cheap) if changed else None
    return using.screening() if isinstance(using, Screened) else None
