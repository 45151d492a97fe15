"""The conformance kit: check_law(law) says whether a law is fit for every verb. `creepkit check FILE` runs it.

Points are Sobol samples of the full bounds and of stress 1e-3 to 2000 MPa, strain 1e-12 to 1, time 1e-3 to 1e6 s,
temperature 600 to 1600 K. Stress, strain, time and states are floored at 1e-30 where they are bases of powers, so
that rates at zero strain and zero time are finite.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import mpmath
import numpy as np
import sympy
from scipy.stats import qmc

from creepkit.arrays import Floats
from creepkit.errors import CreepkitError, LawError
from creepkit.kernels.exact import Exact
from creepkit.kernels.interface import POINT_SIZE, CompiledLaw
from creepkit.kernels.lowering import Kernel, lower
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import POINT

VALUE_TOLERANCE = 1e-12
DERIVATIVE_TOLERANCE = 1e-10
STRESS, STRAIN, TIME, WARMTH = (1e-3, 2000.0), (1e-12, 1.0), (1e-3, 1e6), (600.0, 1600.0)
_SMALLEST, _LARGEST = mpmath.mpf("2.3e-308"), mpmath.mpf("1.7e308")


@dataclass(frozen=True)
class Check:
    """One finding: what was checked, whether it holds, and the figure or the sentence that says so."""

    name: str
    ok: bool
    detail: str


@dataclass(frozen=True)
class Report:
    """All findings about one law."""

    law: CreepLaw
    checks: tuple[Check, ...]

    @property
    def ok(self) -> bool:
        """Whether every check holds."""
        return all(check.ok for check in self.checks)

    def __str__(self) -> str:
        lines = [f"{self.law.name}: {'conforms' if self.ok else 'does NOT conform'}"]
        lines += [f"  {'ok  ' if c.ok else 'FAIL'} {c.name}: {c.detail}" for c in self.checks]
        return "\n".join(lines)


@dataclass(frozen=True)
class Samples:
    """points : (samples, 6 + states); theta : (samples, parameters), internal; holds : constraints are met."""

    points: Floats
    theta: Floats
    holds: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]


def check_law(law: CreepLaw, samples: int = 64, seed: int = 0) -> Report:
    """Run every check on a law; never raises for a law that fails one.

    samples : a power of two; parity with 50-digit arithmetic takes about 10 ms a sample.
    """
    checks: list[Check] = []
    for name, check in _CHECKS.items():
        try:
            drawn = sample(law, samples, seed)
            found = list(check(law, drawn))
        except (CreepkitError, ArithmeticError, ValueError, TypeError, AttributeError, NameError) as error:
            found = [Check(name, False, f"{type(error).__name__}: {error}")]
        checks += found
    return Report(law, tuple(checks))


def sample(law: CreepLaw, samples: int, seed: int = 0) -> Samples:
    """Sobol points over the law's bounds and the ranges of this module."""
    size = POINT_SIZE + len(law.states) + len(law.params)
    unit = qmc.Sobol(size, seed=seed).random(samples)
    columns = [_log_between(unit[:, 0], STRESS), _log_between(unit[:, 1], STRAIN), _log_between(unit[:, 2], TIME)]
    columns.append(WARMTH[0] + unit[:, 3] * (WARMTH[1] - WARMTH[0]))
    columns += [columns[0] * (0.4 + 0.6 * unit[:, 4]), columns[0] * (unit[:, 5] - 1 / 3)]
    for u, state in zip(unit.T[POINT_SIZE:], law.states.values(), strict=False):
        end = 1.0 if state.limit is None else state.limit
        columns.append(state.initial + (0.01 + 0.94 * u) * (end - state.initial))
    theta = []
    for u, param in zip(unit.T[POINT_SIZE + len(law.states) :], law.params.values(), strict=True):
        low, high = (param.to_internal(b) for b in param.bounds)
        theta.append(low + u * (high - low))
    points, inner = np.stack(columns, axis=1), np.stack(theta, axis=1) if theta else np.zeros((samples, 0))
    return Samples(points, inner, _constraints_hold(law, points, inner))


# ---- the checks ----------------------------------------------------------------------------------------------------


def _table(law: CreepLaw, _: Samples) -> Iterator[Check]:
    used = set().union(*(t.free_symbols for t in (*law.terms.values(), *(z.rate for z in law.states.values()))))
    stray = sorted(map(str, used ^ {*law.params, *law.states} - set(POINT)))
    stray = [s for s in stray if s not in {p.name for p in POINT}]
    yield Check("declared equals used", not stray, ", ".join(stray) or f"{len(law.params)} parameters")
    missing = [what for what, there in (("title", law.title.strip()), ("references", law.references)) if not there]
    missing += [f"unit of {n}" for n, p in law.table.items() if not p.unit]
    yield Check("title, references, units", not missing, f"missing {', '.join(missing)}" if missing else "present")


def _printing(law: CreepLaw, _: Samples) -> Iterator[Check]:
    text = law.latex()
    balanced = text.count("{") == text.count("}") and text.count(r"\left") == text.count(r"\right")
    source = lower(law, "numpy").source
    yield Check("LaTeX and source print", balanced and "def rate" in source, f"{len(text)} and {len(source)} characters")
    again = pickle.loads(pickle.dumps(law))
    yield Check("pickle and equality", again == law and again.fingerprint == law.fingerprint, law.fingerprint)


def _finite(law: CreepLaw, drawn: Samples) -> Iterator[Check]:
    kernel = lower(law, "numpy")
    logs = _log_rate(kernel, drawn.points, drawn.theta)
    good = np.isfinite(logs)
    yield Check("ln rate is finite", bool(good[drawn.holds].all()), _count(good[drawn.holds]))
    for name, column in (("strain", 1), ("time", 2)):
        points = drawn.points.copy()
        points[:, column] = 0.0
        at_zero = np.isfinite(_log_rate(kernel, points, drawn.theta))
        yield Check(f"ln rate is finite at zero {name}", bool(at_zero[drawn.holds].all()), _count(at_zero[drawn.holds]))
    raised = drawn.points.copy()
    raised[:, [0, 4, 5]] *= 1.01
    rise = _log_rate(kernel, raised, drawn.theta) - logs
    up = rise >= -1e-9 * np.maximum(1.0, np.abs(logs))
    yield Check("rate never falls with stress", bool(up[drawn.holds].all()), _count(up[drawn.holds]))


def _parity(law: CreepLaw, drawn: Samples) -> Iterator[Check]:
    exact = Exact(law)
    truth = [exact.rows(p, t) for p, t in zip(drawn.points, drawn.theta, strict=True)]
    tables: dict[str, Callable[[CreepLaw, Samples], tuple[Floats, Floats]]] = {
        "numpy": _array_tables,
        "torch": _torch_tables,
        "numba": _numba_tables,
    }
    for target, table in tables.items():
        rows, logs = table(law, drawn)
        value, slope = _differences(law, truth, rows, logs)
        yield Check(f"{target} value against 50 digits", value <= VALUE_TOLERANCE, f"{value:.1e}")
        yield Check(f"{target} derivatives against 50 digits", slope <= DERIVATIVE_TOLERANCE, f"{slope:.1e}")


def _gradients(law: CreepLaw, drawn: Samples) -> Iterator[Check]:
    import torch

    kernel = lower(law, "torch")
    points = torch.tensor(drawn.points.T[:, drawn.holds])
    theta = torch.tensor(drawn.theta.T[:, drawn.holds])
    points[1:3] = 0.0
    inputs = [*points, *theta]
    for tensor in inputs:
        tensor.requires_grad_()
    total = kernel.internal_log_rate(*inputs).sum()
    found = torch.autograd.grad(total, inputs, allow_unused=True)
    clean = all(bool(torch.isfinite(g).all()) for g in found if g is not None)
    yield Check("torch gradients at zero strain and time", clean, "finite" if clean else "NaN or inf")


def _switches(law: CreepLaw, drawn: Samples) -> Iterator[Check]:
    kernel = lower(law, "numpy")
    worst, told = 0.0, []
    for name, param in law.table.items():
        if param.off is None:
            continue
        values = {n: np.exp(t) if p.scale == "log" else t for (n, p), t in zip(law.table.items(), drawn.theta.T, strict=True)}
        off = kernel.rate({**values, name: param.off}, **_point(law, drawn.points))
        try:
            fixed = law.fix(**{name: param.off})
        except LawError:
            expected = np.zeros(len(drawn.points))
        else:
            rest = {n: values[n] for n in fixed.names}
            inner = [s for s in law.states if s in fixed.states]
            expected = lower(fixed, "numpy").rate(rest, **_point(fixed, drawn.points, law, inner))
        with np.errstate(all="ignore"):
            gap = np.abs(off - expected) / np.maximum(np.abs(expected), 1e-300)
            gap = gap[np.isfinite(off) & np.isfinite(expected)]
        worst = max(worst, float(gap.max(initial=0.0)))
        told.append(name)
    yield Check("off equals fix", worst <= 1e-11, f"{', '.join(told) or 'no switches'}, {worst:.1e}")


def _leading(law: CreepLaw, drawn: Samples) -> Iterator[Check]:
    """d ln f / d ln t of each term of the author's expression at t = 1e-12 s against the derived exponent."""
    compiled = lower(law, "numba")
    beta = compiled.leading(drawn.theta)
    worst = 0.0
    slopes = [sympy.log(e) for e in law.terms.values()]
    variables = (*POINT, *law.states, *law.params)
    at = sympy.Symbol("time", real=True), sympy.Symbol("strain", real=True)
    functions = [sympy.lambdify(variables, [v * sympy.diff(s, v) for v in at], "mpmath") for s in slopes]
    for k in np.flatnonzero(drawn.holds)[:16]:
        with mpmath.workdps(60):
            point = [mpmath.mpf(float(v)) for v in drawn.points[k]]
            point[1], point[2] = mpmath.mpf("1e-40"), mpmath.mpf("1e-12")
            numbers = [
                mpmath.exp(mpmath.mpf(float(t))) if p.scale == "log" else mpmath.mpf(float(t))
                for p, t in zip(law.params.values(), drawn.theta[k], strict=True)
            ]
            pairs = [function(*point, *numbers) for function in functions]
            truth = min((1 + a) / (1 - b) for a, b in pairs)
        worst = max(worst, abs(float(truth) - float(beta[k])))
    yield Check("leading exponent of time", worst <= 1e-6, f"{worst:.1e}")


_CHECKS: dict[str, Callable[[CreepLaw, Samples], Iterator[Check]]] = {
    "table": _table,
    "printing": _printing,
    "finite and monotone": _finite,
    "parity": _parity,
    "torch gradients": _gradients,
    "switches": _switches,
    "leading exponent": _leading,
}


# ---- evaluation ----------------------------------------------------------------------------------------------------


def _array_tables(law: CreepLaw, drawn: Samples) -> tuple[Floats, Floats]:
    kernel = lower(law, "numpy")
    with np.errstate(all="ignore"):
        return _stacked(kernel, list(drawn.points.T), list(drawn.theta.T), len(drawn.points))


def _torch_tables(law: CreepLaw, drawn: Samples) -> tuple[Floats, Floats]:
    import torch

    points, theta = torch.tensor(drawn.points.T), torch.tensor(drawn.theta.T)
    return _stacked(lower(law, "torch"), list(points), list(theta), len(drawn.points))


def _stacked(kernel: Kernel, points: list[object], theta: list[object], size: int) -> tuple[Floats, Floats]:
    """(samples, 1 + states, columns) of values and derivatives, and the log rates."""
    law = kernel.law
    found = kernel.internal_derivatives(*points, *theta)
    names = [*found.point, *found.params]
    rows = [[found.rate, *(found[name] for name in names)]]
    values = kernel.internal_rates(*points, *theta)[1:]
    for value, state in zip(values, law.states, strict=True):
        rows.append([value, *(found.state_rates[state.name][name] for name in names)])
    wide = [[np.broadcast_to(np.asarray(v, float), (size,)) for v in row] for row in rows]
    logs = np.broadcast_to(np.asarray(kernel.internal_log_rate(*points, *theta), float), (size,))
    return np.moveaxis(np.array(wide), -1, 0), logs


def _numba_tables(law: CreepLaw, drawn: Samples) -> tuple[Floats, Floats]:
    compiled = lower(law, "numba")
    inner, width, count = compiled.states, POINT_SIZE + compiled.states, len(law.params)
    rows = []
    logs = []
    for point, theta in zip(drawn.points, drawn.theta, strict=True):
        out = call(compiled, "sensitivity", point[None], theta)[0]
        values, rest = out[: 1 + inner], out[1 + inner :]
        to_point = rest[: (1 + inner) * width].reshape(1 + inner, width)
        to_theta = rest[(1 + inner) * width :].reshape(1 + inner, count)
        rows.append(np.hstack([values[:, None], to_point, to_theta]))
        logs.append(call(compiled, "update", point[None], theta)[0, 0])
    return np.array(rows), np.array(logs)


def call(compiled: CompiledLaw, entry: str, points: Floats, theta: Floats) -> Floats:
    """Call a compiled entry through its C pointer: points (rows, 6 + states), theta (parameters,)."""
    import ctypes

    inner = 1 + compiled.states
    columns = {"rate": 1, "update": 1 + points.shape[1], "sensitivity": 1 + points.shape[1] + theta.size}[entry]
    out = np.empty((len(points), inner * columns))
    double = ctypes.POINTER(ctypes.c_double)
    kind = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64, double, double, double)
    arrays = [np.ascontiguousarray(points), np.ascontiguousarray(theta), out]
    kind(getattr(compiled, entry).address)(len(points), *(a.ctypes.data_as(double) for a in arrays))
    return out


def _differences(law: CreepLaw, truth: list[list[list[object]]], rows: Floats, logs: Floats) -> tuple[float, float]:
    """Largest relative difference of values and of derivatives; ln rate where the rate is not representable."""
    value, slope = 0.0, 0.0
    for true, got, log in zip(truth, rows, logs, strict=True):
        for k, (line, numbers) in enumerate(zip(true, got, strict=True)):
            if _representable(line[0]):
                value = max(value, _relative(line[0], numbers[0]))
            if k == 0:
                exact_log = mpmath.log(line[0])
                value = max(value, float(abs(exact_log - mpmath.mpf(float(log))) / max(1, abs(exact_log))))
            pairs = zip(line[1:], numbers[1:], strict=True)
            slope = max([slope, *(_relative(a, b) for a, b in pairs if _representable(a))])
    return value, slope


def _representable(value: object) -> bool:
    return value == 0 or bool(_SMALLEST < abs(value) < _LARGEST)  # type: ignore[arg-type]


def _relative(true: object, got: float) -> float:
    if not np.isfinite(got):
        return float("inf")
    if true == 0:
        return 0.0 if got == 0 else float("inf")
    with mpmath.workdps(50):
        return float(abs(mpmath.mpf(float(got)) / true - 1))


def _log_rate(kernel: Kernel, points: Floats, theta: Floats) -> Floats:
    out = kernel.internal_log_rate(*points.T, *theta.T)
    return np.broadcast_to(np.asarray(out, float), (len(points),))


def _point(
    law: CreepLaw, points: Floats, of: CreepLaw | None = None, kept: list[sympy.Symbol] | None = None
) -> dict[str, Floats]:
    owner = of or law
    names = [s.name for s in (*POINT, *owner.states)]
    wanted = {s.name for s in (*POINT, *(law.states if kept is None else kept))}
    return {n: column for n, column in zip(names, points.T, strict=True) if n in wanted}


def _constraints_hold(law: CreepLaw, points: Floats, theta: Floats) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Where every constraint of the law holds."""
    values = [np.exp(t) if p.scale == "log" else t for p, t in zip(law.params.values(), theta.T, strict=True)]
    holds = np.ones(len(points), bool)
    for relation in law.constraints:
        test = sympy.lambdify((*POINT, *law.states, *law.params), relation, "numpy")
        holds &= np.broadcast_to(np.asarray(test(*points.T, *values), bool), holds.shape)
    return holds


def _log_between(u: Floats, bounds: tuple[float, float]) -> Floats:
    low, high = np.log(bounds)
    return np.asarray(np.exp(low + u * (high - low)))


def _count(good: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> str:
    return f"{int(good.sum())} of {good.size} points"
