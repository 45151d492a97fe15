"""A trained ParameterGru as a predictor: candidates and tests in one batch, derivatives carried forward in time."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import torch

from creepkit.arrays import ArrayLike, Floats, Ints
from creepkit.records import Effects, History, Prediction, Status
from creepkit.surrogate.course_inputs import CourseInputs
from creepkit.surrogate.law_inputs import LawInputs
from creepkit.surrogate.matching import check_asked, frames_of, seen, seen_slope, weights_between
from creepkit.surrogate.parameter_gru import ParameterGru, held, stand_in_of, tests_of
from creepkit.surrogate.parameter_module import ParameterModule
from creepkit.surrogate.recipe import Samples
from creepkit.surrogate.recurrent_tangent import recurrent
from creepkit.surrogate.reduction import completed
from creepkit.surrogate.surrogate import Surrogate

if TYPE_CHECKING:
    from creepkit.language import CreepLaw

EFFECTS = {"modulus": "modulus", "apex_thickness": "thickness", "temperature": "temperature"}
"""{input: the nuisance that moves it}."""
AT_ONCE = 2**24
"""Numbers in the inputs of a batch."""


@dataclass(frozen=True, eq=False)
class Asked:
    """What is asked of the network: candidates x tests.

    theta : (candidates, parameters) internal. rows : (candidates, columns) of the law, as the network sees them.
    numbers : (candidates, tests, constants). series : (tests, frames, series). base : (candidates, tests, frames).
    slopes : {effect: (candidates, tests, constants)} derivatives of the numbers.
    """

    theta: Floats
    rows: Floats
    numbers: Floats
    series: Floats
    base: Floats | None
    slopes: Mapping[str, Floats]

    def batch(self, part: slice) -> Samples:
        """Some candidates, each with every test: what the module eats, a row for each pair."""
        numbers = self.numbers[part]
        count, tests = numbers.shape[:2]
        rows = np.repeat(self.rows[part], tests, axis=0)
        made = {
            "constants": np.concatenate([rows, numbers.reshape(count * tests, -1)], axis=1),
            "series": np.tile(self.series, (count, 1, 1)),
        }
        if self.base is not None:
            made["base"] = self.base[part].reshape(count * tests, -1)
        return {name: torch.from_numpy(np.array(array)) for name, array in made.items()}


class ParameterSurrogate(Surrogate):
    """The network on the frames it was trained at, and between them linear in time."""

    recipe: ParameterGru

    @property
    def effects(self) -> tuple[str, ...]:  # type: ignore[override]
        """The nuisances whose inputs were varied."""
        return tuple(EFFECTS[name] for name in self._tests.constants)

    def predict(
        self,
        law: CreepLaw,
        values: Mapping[str, ArrayLike],
        histories: Sequence[History],
        *,
        jacobian: bool = False,
        effects: Effects | None = None,
    ) -> Prediction:
        """Predict each history's outputs at its times; see records.Predictor and Surrogate.predict."""
        effects = effects or {}
        check_asked(self.told, histories, effects, self.effects)
        whole = completed(self.told.law, law, values, self._middle)
        frames = frames_of(self.told.grid, histories)
        asked = self._asked(whole, histories, frames, effects)
        own = [self.told.law.names.index(name) for name in law.names]
        shown = self._values(asked)
        slopes = self._slopes(asked, own) if jacobian and self.recipe.base == "none" else None
        return self._prediction(asked, histories, frames, shown, slopes, tuple(effects))

    # ---- what the network is asked ---------------------------------------------------------------------------------

    @cached_property
    def _tests(self) -> CourseInputs:
        return tests_of(self.recipe, self.specimen, self.told.conditions, self.told.grid.relative)

    @cached_property
    def _law(self) -> LawInputs:
        return LawInputs(self.told.law)

    @cached_property
    def _middle(self) -> dict[str, float]:
        """Values of parameters whose term is switched off: any will do, the middle of the bounds is inside."""
        return {name: param.center for name, param in self.told.law.table.items()}

    @cached_property
    def _double(self) -> ParameterModule:
        """The network in float64: derivatives by differences need the digits."""
        module = copy.deepcopy(self.module).double()
        assert isinstance(module, ParameterModule)
        return module

    def _asked(
        self, values: Mapping[str, Any], histories: Sequence[History], frames: Sequence[Floats], effects: Effects
    ) -> Asked:
        theta = self._law.internal(values)
        count = max([len(theta), *(len(v) for v in effects.values())])
        theta = np.broadcast_to(theta, (count, theta.shape[1]))
        assumed = {kind: np.broadcast_to(v, (count, len(histories))) for kind, v in effects.items()}
        moved = [
            self._tests.moved(h, {kind: v[:, k] for kind, v in assumed.items()}, count) for k, h in enumerate(histories)
        ]
        return Asked(
            theta=theta,
            rows=self._law.rows(theta),
            numbers=np.stack([numbers for numbers, _ in moved], axis=1),
            series=np.stack([self._tests.over_time(h, t) for h, t in zip(histories, frames, strict=True)]),
            base=self._base(values, histories, frames, effects, count) if self.recipe.base != "none" else None,
            slopes={kind: np.stack([slopes[kind] for _, slopes in moved], axis=1) for kind in assumed},
        )

    def _base(
        self, values: Mapping[str, Any], histories: Sequence[History], frames: Sequence[Floats], effects: Effects,
        count: int,
    ) -> Floats:  # fmt: skip
        """(candidates, tests, frames) what the specimen's stand-in predicts of the first output."""
        plans = [h.replace(times=t, outputs={}) for h, t in zip(histories, frames, strict=True)]
        found = stand_in_of(self.specimen).predict(self.told.law, values, plans, effects=effects)
        first = held(found.values[..., found.outputs.index(self.outputs[0])])
        return np.broadcast_to(first, (count, *first.shape[1:]))

    # ---- what it answers -------------------------------------------------------------------------------------------

    @torch.no_grad()
    def _values(self, asked: Asked) -> Floats:
        """(candidates, tests, frames, outputs)."""
        wide = 4 * self._double.network.hidden_size
        parts = [self._double(asked.batch(part)).numpy() for part in _parts(asked, wide)]
        return np.concatenate(parts).reshape(*asked.numbers.shape[:2], *parts[0].shape[1:])

    @torch.no_grad()
    def _slopes(self, asked: Asked, own: Sequence[int]) -> Floats:
        """(candidates, tests, frames, outputs, directions): to the parameters `own`, then to the effects."""
        wide = (len(own) + len(asked.slopes)) * self._double.network.hidden_size * 4
        parts = [self._slopes_of(asked, part, own) for part in _parts(asked, wide)]
        return np.concatenate(parts).reshape(*asked.numbers.shape[:2], *parts[0].shape[1:])

    def _slopes_of(self, asked: Asked, part: slice, own: Sequence[int]) -> Floats:
        net = self._double
        inputs = net.inputs(asked.batch(part))
        columns, tests = asked.rows.shape[1], asked.numbers.shape[1]
        moving = np.zeros((len(inputs), len(own) + len(asked.slopes), inputs.shape[2]))
        law = np.repeat(self._law.slopes(asked.theta[part])[:, :, list(own)], tests, axis=0)
        moving[:, : len(own), :columns] = np.swapaxes(law, 1, 2)
        reach = slice(columns, columns + asked.numbers.shape[2])
        for k, slopes in enumerate(asked.slopes.values()):
            moving[:, len(own) + k, reach] = slopes[part].reshape(len(inputs), -1)
        moving[:, :, : reach.stop] /= net.constants.deviation.numpy()
        directions = torch.from_numpy(moving)[:, :, None].expand(-1, -1, inputs.shape[1], -1)
        state, changes = recurrent(net.network, inputs, directions)
        shown = net.decoded_slopes(net.head(state))[:, None] * (changes @ net.head.weight.T)
        return shown.movedim(1, -1).numpy()

    def _prediction(
        self, asked: Asked, histories: Sequence[History], frames: Sequence[Floats], shown: Floats,
        slopes: Floats | None, kinds: tuple[str, ...],
    ) -> Prediction:  # fmt: skip
        """At the times of the histories, as their instruments show it."""
        lengths = np.array([h.times.size for h in histories], dtype=np.int64)
        shape = (*shown.shape[:2], int(lengths.max(initial=0)), shown.shape[3])
        values = np.full(shape, np.nan)
        wide = None if slopes is None else np.full((*shape, slopes.shape[-1]), np.nan)
        for k, (history, known) in enumerate(zip(histories, frames, strict=True)):
            weights = weights_between(known, history.times)
            plain = np.einsum("tf,cfo->cto", weights, shown[:, k])
            values[:, k, : lengths[k]] = seen(self.specimen, history, plain)
            if wide is not None and slopes is not None:
                change = np.einsum("tf,cfod->ctod", weights, slopes[:, k])
                wide[:, k, : lengths[k]] = change * seen_slope(self.specimen, history, plain)[..., None]
        count = 0 if wide is None else wide.shape[-1] - len(kinds)
        ends = np.broadcast_to([h.times[-1] for h in histories], shown.shape[:2]).astype(float)
        return Prediction(
            values=values, outputs=self.outputs, lengths=lengths, status=self._status(asked, histories, frames),
            end_times=ends, jacobian=None if wide is None else wide[..., :count],
            times=tuple(h.times for h in histories),
            effect_jacobian={} if wide is None else {kind: wide[..., count + k] for k, kind in enumerate(kinds)},
        )  # fmt: skip

    def _status(self, asked: Asked, histories: Sequence[History], frames: Sequence[Floats]) -> Ints:
        """(candidates, tests): complete, or outside the domain."""
        outside = np.zeros(asked.numbers.shape[:2], bool)
        if self.told.domain is not None:
            outside = self.told.domain.outside(self._guarded(asked, histories, frames))
        return np.where(outside, int(Status.OUTSIDE_DOMAIN), int(Status.COMPLETE)).astype(np.int64)

    def _guarded(self, asked: Asked, histories: Sequence[History], frames: Sequence[Floats]) -> Floats:
        """(candidates, tests, inputs) what the guard sees."""
        count, tests, constants = asked.numbers.shape
        of_tests = np.stack([self._tests.domain(h, t) for h, t in zip(histories, frames, strict=True)])
        rest = np.broadcast_to(of_tests[None, :, constants:], (count, tests, of_tests.shape[1] - constants))
        rows = np.broadcast_to(asked.rows[:, None], (count, tests, asked.rows.shape[1]))
        return np.concatenate([rows, asked.numbers, rest], axis=2)


def _parts(asked: Asked, wide: int) -> list[slice]:
    """Candidates in groups whose largest tensors are not too large."""
    count, tests = asked.numbers.shape[:2]
    step = max(1, AT_ONCE // (tests * asked.series.shape[1] * wide))
    return [slice(first, first + step) for first in range(0, count, step)]
