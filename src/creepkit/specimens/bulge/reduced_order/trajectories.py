"""Trajectories of the reduced-order model: time nodes of each test, and values of all candidates at these nodes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import CubicSpline

from creepkit.arrays import Floats, Ints
from creepkit.errors import SolveError
from creepkit.records import History
from creepkit.specimens.bulge.finite_elements import MODULUS_TEMPERATURE_STEP
from creepkit.specimens.bulge.reduced_order.step_equations import TRAJECTORY_COLUMNS
from creepkit.specimens.bulge.reduced_order.step_solution import NUISANCE_DIRECTIONS, FeatureFactors
from creepkit.specimens.bulge.reduced_order.tables import ReducedOrderTables, build_tables
from creepkit.specimens.bulge.reduced_order.time_integration import integrate_candidates
from creepkit.specimens.bulge.setup import BulgeSetup, set_up_test

if TYPE_CHECKING:
    from creepkit.specimens.bulge.settings import BulgeSettings


if TYPE_CHECKING:
    from creepkit.kernels.interface import CompiledLaw
    from creepkit.language import Elastic
    from creepkit.specimens.bulge.settings import BulgeSettings


FIRST_STEP, STEP_GROWTH, LARGEST_STEP_FRACTION = 2.5, 1.0, 1.0 / 12.0
"""Steps: the first after a change of load, s; later ones over the time since; the longest over the test."""


RAMP_STEPS = 4
"""Steps of a ramp from zero to the largest pressure."""


_OFFSET = 20.0
"""s; creep after a change of load decays over decades of time since then."""


@dataclass(frozen=True, eq=False)
class TimeNodes:
    """The time nodes of a test: nodes (nodes,) with time s, pressure MPa and temperature K; weights of frames.

    frames : (frames, nodes) the values at the history's times as sums of those at nodes.
    """

    setup: BulgeSetup
    times: Floats
    pressure: Floats
    temperature: Floats
    frames: Floats


@lru_cache(maxsize=1024)
def time_nodes(specimen: BulgeSettings, history: History) -> TimeNodes:
    """The time nodes of a test; SolveError, as of the specimen, where the test cannot be simulated."""
    test_setup = set_up_test(specimen, history, {})
    segments, largest = test_setup.load_history.segments, float(test_setup.load_history.pressure.values.max())
    nodes, values, rows, origins = [np.zeros(0)], [np.zeros((0, 2))], [], []
    count, before, origin = 0, np.full(2, np.nan), 0.0
    for start, end, P, P_end, T, T_end in segments[:, :6]:
        moving = P_end != P
        origin = start if moving or before[0] != P else origin
        whole = segments[-1, 1]
        inner = _ramp(start, end, abs(P_end - P) / largest, whole) if moving else _hold(start, end, origin, whole)
        # where nothing jumps the node that ends a segment begins the next one
        old = int((before == (P, T)).all())
        share = ((inner - start) / (end - start))[old:, None]
        nodes.append(inner[old:])
        values.append((1 - share) * [P, T] + share * [P_end, T_end])
        rows.append((count - old, count + inner.size - old - 1))
        origins.append(origin)
        count, before = count + inner.size - old, np.array([P_end, T_end])
        origin = end if moving else origin
    times, columns = np.concatenate(nodes), np.concatenate(values)
    frames = _weights(times, rows, segments[:, 0], np.array(origins), history.times)
    return TimeNodes(test_setup, times, columns[:, 0], columns[:, 1], frames)


def _ramp(start: float, end: float, share: float, whole: float) -> Floats:
    """Nodes of a segment in which the pressure changes by a share of the largest one; whole : s, length of the test."""
    steps = max(RAMP_STEPS * share, (end - start) / max(LARGEST_STEP_FRACTION * whole, FIRST_STEP))
    return np.linspace(start, end, max(1, int(np.ceil(steps))) + 1)


def _hold(start: float, end: float, origin: float, whole: float) -> Floats:
    """Nodes of a segment of constant pressure, in steps that grow with the time since the load changed.

    whole : s, length of the test.
    """
    nodes, longest = [start], max(LARGEST_STEP_FRACTION * whole, FIRST_STEP)
    while nodes[-1] < end:
        nodes.append(nodes[-1] + min(max(STEP_GROWTH * (nodes[-1] - origin), FIRST_STEP), longest))
    nodes[-1] = end
    return np.array(nodes)


def _weights(nodes: Floats, rows: Sequence[tuple[int, int]], starts: Floats, origins: Floats, times: Floats) -> Floats:
    """Weights (times, nodes) of splines in ln(t - t0 + 20 s), one for each segment; before a jump at its very time.

    rows : first and last node of each segment; starts : s; origins : t0, s, when the load changed last.
    """
    out = np.zeros((times.size, nodes.size))
    which = np.maximum(np.searchsorted(starts, times, side="left") - 1, 0)
    for n, (first, last) in enumerate(rows):
        mine, known = which == n, slice(first, last + 1)
        here = np.flatnonzero(mine)
        at_node = np.minimum(first + np.searchsorted(nodes[known], times[here]), last)
        if (nodes[at_node] == times[here]).all():  # as a sampling campaign asks, which needs ends alone
            out[here, at_node] = 1.0
        else:
            spline = CubicSpline(np.log(nodes[known] - origins[n] + _OFFSET), np.eye(last + 1 - first))
            out[mine, known] = spline(np.log(times[mine] - origins[n] + _OFFSET))
    return out


WITHOUT_FEATURES = FeatureFactors(np.zeros(0), np.zeros(0))


_TOLERANCE, _EXACT_TOLERANCE = 1e-5, 1e-11
"""Of ln of increments."""


_BETA = (0.05, 1.0)
"""Exponents of the time transformation; plain time where strain begins faster than time."""


_BETA_STEP = 1e-5


_NO_LOAD = 1e-15
"""P/E of a dimple at rest: its deflection is a million times below the least one measured."""


@dataclass(frozen=True, eq=False)
class Trajectories:
    """Trajectories of candidates in tests, padded to the longest test with its last node.

    values : (candidates, tests, nodes, columns). jacobian : the same with a last axis of P + 3 derivatives, to the
    law's internal parameters and to NUISANCE_DIRECTIONS (apex thickness mm, relative modulus, temperature K), or None.
    schedules : of each test, with nodes and `frames`. status, end_times : (candidates, tests) Status, and s.
    """

    values: Floats
    jacobian: Floats | None
    schedules: tuple[TimeNodes, ...]
    status: Ints
    end_times: Floats

    @property
    def parameters(self) -> int:
        """Number of the law's parameters, P, where there are derivatives."""
        return 0 if self.jacobian is None else self.jacobian.shape[-1] - len(NUISANCE_DIRECTIONS)

    def frames(self, test: int, values: Floats) -> Floats:
        """Values (candidates, nodes, ...) of the nodes of a test at its history's times, (candidates, times, ...)."""
        weights = self.schedules[test].frames
        return np.asarray(np.moveaxis(np.tensordot(weights, values[:, : weights.shape[1]], axes=(1, 1)), 0, 1))


@dataclass(frozen=True, eq=False)
class TrajectoryOptions:
    """How trajectories are simulated; they are the same for any number of threads.

    factors : of stress and strain at which rates are recorded, the features of RateNet.
    exact : whether derivatives are integrated too.
    tables : in place of those of the specimen; a test of another dimple than theirs (but for its apex thickness), or of
        another window, is a SolveError.
    """

    factors: FeatureFactors = WITHOUT_FEATURES
    exact: bool = False
    threads: int = 1
    tables: ReducedOrderTables | None = None


def simulate_trajectories(
    specimen: BulgeSettings,
    law: CompiledLaw,
    theta: Floats,
    histories: Sequence[History],
    *,
    nuisances: Mapping[str, Floats] | None = None,
    options: TrajectoryOptions | None = None,
) -> Trajectories:
    """Integrate candidates, theta (candidates, P) internal values, through all tests.

    nuisances : {kind: (candidates or 1, tests)}, see records.Predictor; "window" too.
    """
    options = options or TrajectoryOptions()
    factors, exact = options.factors, options.exact
    theta = np.array(theta, dtype=float, order="C", ndmin=2)
    broadcast_nuisances = {kind: np.atleast_2d(value) for kind, value in (nuisances or {}).items()}
    schedules = tuple(time_nodes(specimen, history) for history in histories)
    counts = np.array([plan.times.size for plan in schedules], dtype=np.int64)
    rows = max([len(v) for v in broadcast_nuisances.values()], default=1)
    geometries = _dimples(specimen, histories, schedules, broadcast_nuisances, rows, options.tables)
    tests, modulus_changes = _tests(histories, schedules, broadcast_nuisances, geometries, counts, rows)
    shape = (
        len(theta),
        len(schedules),
        int(counts.max()),
        len(TRAJECTORY_COLUMNS) + factors.stress.size * factors.strain.size,
    )
    out = np.zeros(shape)
    changes = np.zeros((*shape, theta.shape[1] + len(NUISANCE_DIRECTIONS)) if exact else (0, *shape[1:], 1))
    status, end_times = np.zeros(shape[:2], dtype=np.int64), np.zeros(shape[:2])
    beta, beta_slopes = _beta(law, theta, exact)

    def part(first: int, last: int) -> None:
        integrate_candidates(
            law.update,
            law.sensitivity,
            law.rate,
            first,
            last,
            theta,
            beta,
            beta_slopes,
            modulus_changes,
            counts,
            tests,
            *geometries.arrays,
            geometries.row,
            geometries.grid,
            np.array(law.initial),
            np.array(law.limits),
            (specimen.deflection_limit, specimen.strain_limit),
            factors,
            _EXACT_TOLERANCE if exact else _TOLERANCE,
            out,
            changes,
            status,
            end_times,
        )

    _in_threads(part, len(theta), options.threads)
    return Trajectories(out, changes if exact else None, schedules, status, end_times)


def _in_threads(part: Callable[[int, int], None], count: int, threads: int) -> None:
    """Let threads do parts of the candidates."""
    cuts = np.linspace(0, count, min(threads, count) + 1).astype(int)
    if cuts.size == 2:
        part(0, count)
        return
    with ThreadPoolExecutor(cuts.size - 1) as pool:
        list(pool.map(part, map(int, cuts[:-1]), map(int, cuts[1:])))


@dataclass(frozen=True, eq=False)
class _Dimples:
    """Different dimples: their tables, thicknesses, and stacked arrays; row (candidates or 1, tests) which is whose."""

    tables: list[ReducedOrderTables]
    thickness: Floats
    arrays: tuple[Floats, Floats, Floats]
    row: Ints
    grid: tuple[float, float]


def _dimples(
    specimen: BulgeSettings,
    histories: Sequence[History],
    plans: Sequence[TimeNodes],
    nuisances: Mapping[str, Floats],
    rows: int,
    known_tables: ReducedOrderTables | None,
) -> _Dimples:
    """Every different dimple, and which one each candidate has in each test."""
    own_values = np.array(
        [(k, p.setup.observation.window, p.setup.geometry.apex_thickness) for k, p in enumerate(plans)]
    )
    keys = np.broadcast_to(own_values, (rows, len(plans), 3)).copy()
    for column, kind in ((1, "window"), (2, "thickness")):
        if kind in nuisances:
            keys[..., column] = nuisances[kind]
    different, row = np.unique(keys.reshape(-1, 3), axis=0, return_inverse=True)
    if known_tables is None:
        known = [_tables(specimen, plans[int(k)], float(window)) for k, window, _ in different]
    else:
        for k, window, _ in different:
            _refuse_another(known_tables, histories[int(k)], plans[int(k)], float(window))
        known = [known_tables] * len(different)
    result = [t.dimple(float(h)) for t, h in zip(known, different[:, 2], strict=True)]
    arrays = tuple(np.array([getattr(d, name) for d in result]) for name in ("curves", "slopes", "redistribution"))
    grid = (result[0].offset, result[0].step)
    return _Dimples(known, different[:, 2], arrays, row.reshape(rows, len(plans)), grid)  # type: ignore[arg-type]


def _refuse_another(known: ReducedOrderTables, history: History, plan: TimeNodes, window: float) -> None:
    """A test of another dimple than that of the tables."""
    where, tested = history.origin, plan.setup.geometry
    pairs = [(name, getattr(tested, name), getattr(known.geometry, name)) for name in tested.lengths[1:]]
    for name, result, allowed in [*pairs, ("window", window, known.window)]:
        if abs(result - allowed) > 1e-6 * allowed:
            raise SolveError(
                f"{where}: {name} is {result:g} mm, but the tables of the reduced-order model are for "
                f"{allowed:g} mm; make others with 'creepkit reduced-model'"
            )


def _tables(specimen: BulgeSettings, plan: TimeNodes, window: float) -> ReducedOrderTables:
    """The tables of the dimple of a test, for all its thicknesses."""
    setup, nominal = plan.setup, specimen.geometry.apex_thickness
    room = setup.geometry.plate_thickness - setup.geometry.roof_axial
    geometry = setup.geometry.replace(apex_thickness=min(nominal, room))
    return build_tables(specimen, geometry, setup.observation.replace(window=window))


def _tests(
    histories: Sequence[History],
    plans: Sequence[TimeNodes],
    nuisances: Mapping[str, Floats],
    dimples: _Dimples,
    counts: Ints,
    rows: int,
) -> tuple[Floats, Floats]:
    """Rows of each test as in step_solution, (candidates or 1, tests, 8, nodes), and relative modulus changes."""
    shape = (rows, len(plans))
    out = np.zeros((*shape, 8, int(counts.max())))
    modulus_changes = np.broadcast_to(nuisances.get("modulus", np.zeros((1, 1))), shape).astype(float)
    temperature_changes = np.broadcast_to(nuisances.get("temperature", np.zeros((1, 1))), shape)
    for k, (plan, history) in enumerate(zip(plans, histories, strict=True)):
        assert history.elastic is not None  # time_nodes has checked
        temperature, factor = plan.temperature + temperature_changes[:, k, None], 1.0 + modulus_changes[:, k, None]
        warm, which = np.unique(temperature, return_inverse=True)
        modulus, softening = (
            factor * np.array([f(history.elastic, float(T)) for T in warm])[which.reshape(temperature.shape)]
            for f in (_modulus, _modulus_temperature_slope)
        )
        _refuse_soft(history, modulus)
        lifted = _elastic_deflections(dimples, dimples.row[:, k], np.maximum(plan.pressure / modulus, _NO_LOAD))
        for i, values in enumerate((plan.times, plan.pressure, temperature, modulus, softening, *lifted)):
            out[:, k, i, : counts[k]] = values
        out[:, k, :, counts[k] :] = out[:, k, :, counts[k] - 1, None]
    return out, modulus_changes


def _elastic_deflections(dimples: _Dimples, row: Ints, load: Floats) -> Floats:
    """Elastic deflections at P/E (rows, nodes), and their derivatives to the thickness and to ln of the modulus."""
    out = np.empty((3, *load.shape))
    own_values = [dimples.tables[r] for r in row]
    for known in set(own_values):
        mine = np.array([one is known for one in own_values])
        out[:, mine] = known.elastic_deflection(load[mine], dimples.thickness[row[mine]])
    out[2] *= -1.0
    return out


@lru_cache(maxsize=65536)
def _modulus(elastic: Elastic, temperature: float) -> float:
    return float(elastic.at(temperature).E)


@lru_cache(maxsize=65536)
def _modulus_temperature_slope(elastic: Elastic, temperature: float) -> float:
    """dE/dT, MPa/K."""
    above, below = (
        _modulus(elastic, temperature + step) for step in (MODULUS_TEMPERATURE_STEP, -MODULUS_TEMPERATURE_STEP)
    )
    return (above - below) / (2 * MODULUS_TEMPERATURE_STEP)


def _refuse_soft(history: History, modulus: Floats) -> None:
    if not modulus.min() > 0:
        raise SolveError(f"{history.origin}: the modulus is {modulus.min():g} MPa; it must be above zero")


def _beta(law: CompiledLaw, theta: Floats, exact: bool) -> tuple[Floats, Floats]:
    """Exponents of the time transformation, (candidates,), and their derivatives (candidates, P) where wanted."""
    parameters = theta.shape[1]
    steps = np.concatenate([np.zeros((1, parameters)), *(_BETA_STEP * s * np.eye(parameters) for s in (1, -1))])
    points = theta + steps[: None if exact else 1, None]
    result = np.clip(np.broadcast_to(np.asarray(law.leading_exponent(points), float), points.shape[:2]), *_BETA)
    slopes = np.zeros(theta.shape)
    if exact:
        slopes[:] = (result[1 : 1 + parameters] - result[1 + parameters :]).T / (2 * _BETA_STEP)
    return result[0].copy(), slopes
