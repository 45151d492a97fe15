"""The rate of a law at one point of stress, strain, time and temperature, for many rows of parameters at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.kernels import lower
from creepkit.language import CreepLaw


@dataclass(frozen=True, eq=False)
class RateArguments:
    """Where rates are stated: stress MPa, strain, time s, temperature K; numbers, or arrays that fit the rows."""

    stress: ArrayLike
    strain: ArrayLike
    time: ArrayLike
    temperature: ArrayLike


def log10_rate(law: CreepLaw, parameters: Floats, arguments: RateArguments) -> Floats:
    """Return log10 of the rate, 1/s, of rows of the author's parameters, (rows,)."""
    return np.asarray(ln_rate(law, internal_parameters(law, parameters), arguments) / np.log(10.0))


def ln_rate(law: CreepLaw, theta: Floats, arguments: RateArguments, states: Sequence[ArrayLike] | None = None) -> Floats:
    """Return ln of the rate of rows of internal parameters, (rows,): simple tension; states : by default virgin."""
    stress = np.asarray(arguments.stress, float)
    states = [state.initial for state in law.states.values()] if states is None else states
    variables: list[Any] = [stress, arguments.strain, arguments.time, arguments.temperature, stress, stress / 3.0, *states]
    shape = np.broadcast_shapes(theta.shape[:-1], *(np.shape(v) for v in variables))
    columns = [np.broadcast_to(np.asarray(v, float), shape) for v in (*variables, *np.moveaxis(theta, -1, 0))]
    return np.asarray(lower(law, "numpy").internal_log_rate(*columns), float)


def internal_parameters(law: CreepLaw, parameters: Floats) -> Floats:
    """The kernels' form of the author's parameters (rows, parameters): ln where the scale is log, -inf of 0."""
    on_log_scale, theta = is_log_scale(law), np.array(parameters, float)
    with np.errstate(divide="ignore"):
        theta[:, on_log_scale] = np.log(theta[:, on_log_scale])
    return theta


def author_parameters(law: CreepLaw, theta: Floats) -> Floats:
    """The author's parameters of internal ones (rows, parameters)."""
    on_log_scale, values = is_log_scale(law), np.array(theta, float)
    with np.errstate(over="ignore"):
        values[:, on_log_scale] = np.exp(values[:, on_log_scale])
    return values


def is_log_scale(law: CreepLaw) -> Any:
    """Which parameters have a log scale, (parameters,)."""
    return np.array([param.scale == "log" for param in law.params.values()], bool)
