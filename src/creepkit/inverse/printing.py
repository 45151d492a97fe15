"""An identification as text for a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median
from typing import TYPE_CHECKING

from creepkit.inverse.rupture import with_ends
from creepkit.inverse.scales import RUPTURE
from creepkit.language.printing import text_of_expression

if TYPE_CHECKING:
    from creepkit.inverse.findings import NuisanceEstimate, RuptureMisfit
    from creepkit.inverse.identification import Identification

LISTED = 15
"""With more tests than this their rupture times are summed up alone."""
UNITS = {"amplitude": "mm", "width": "mm", "thickness": "mm", "window": "mm", "temperature": "K"}


def text_of(fit: Identification) -> str:
    """The law, its values with 95 % intervals, the scatter between tests, and what is not determined."""
    lines = [
        f"{fit.law.title or fit.law.name}",
        *(f"  {label}: {text_of_expression(term)}" for label, term in fit.law.terms.items()),
        "",
        *_values(fit),
        *_reference(fit),
        "",
        *_strains(fit),
        *_ruptures(fit),
        *_linear_outputs(fit),
        *_table(fit),
    ]
    lines += [f"  {fit.sparsity.verdict}"] if fit.sparsity is not None else []
    lines += [f"  note: {note}" for note in fit.notes]
    return "\n".join(lines)


def _values(fit: Identification) -> list[str]:
    width, lines = max(len(e.name) for e in fit.estimates) if fit.estimates else 4, []
    for e in fit.estimates:
        unit = "" if e.unit == "1" else f" {e.unit}"
        note = "" if e.verdict == "determined" else f"   <- {e.verdict} by these data"
        note = "   <- at its bound" if e.verdict == "at its bound" else note
        lines.append(f"  {e.name:{width}} = {e.value:.5g}  [{e.low:.4g}, {e.high:.4g}]{unit}{note}")
    return lines


def _reference(fit: Identification) -> list[str]:
    r = fit.reference
    rate, low, high = (float(v) for v in fit.rate(r.stress))
    n, less, more = (float(v) for v in fit.local_exponent(r.stress))
    fresh = " of virgin material" if fit.law.states else ""
    return [
        f"  rate{fresh} at {r.stress:.4g} MPa, {r.temperature:.0f} K, strain {r.strain:.2g}, {r.time:.3g} s: "
        f"{rate:.3g} [{low:.3g}, {high:.3g}] 1/s",
        f"  local stress exponent there: {n:.3g} [{less:.3g}, {more:.3g}]",
    ]


def _tests(count: int) -> str:
    return "1 test" if count == 1 else f"{count} tests"


def _strains(fit: Identification) -> list[str]:
    if "strain" not in fit.scatter.outputs:
        return []
    s, mine = fit.scatter["strain"], [m for m in fit.misfits if m.outputs and m.outputs[0].output == "strain"]
    return [
        f"  {_tests(len(mine))}, {sum(m.frames for m in mine)} frames: {_measure(fit)} {fit.rms:.3g}",
        f"  scatter (one sd): rate between tests {100 * fit.scatter.rate:.0f} %, loading strain {s.offset:.2g}, "
        f"frame noise {s.noise:.2g}, what the law cannot follow {100 * s.drift:.1f} % of strain",
    ]


def _measure(fit: Identification) -> str:
    whole = any(m.rupture is not None for m in fit.misfits)
    return "rms distance in ln strain and ln time" if whole else "rms of ln strain"


def _ruptures(fit: Identification) -> list[str]:
    """Rupture times, predicted over measured, and each test's where they are few."""
    ends = with_ends(fit)
    if not ends:
        return []
    ratios, stopped = [r.ratio for _, _, r in ends if not r.stopped], [r for _, _, r in ends if r.stopped]
    line = f"  rupture: {len(ratios)} of {_tests(len(fit.misfits))} broke"
    if ratios:
        inside = sum(r.low <= r.measured <= r.high for _, _, r in ends if not r.stopped)
        line += (
            f"; time predicted over measured {min(ratios):.2g} to {max(ratios):.2g}, median {median(ratios):.3g}; "
            f"{inside} within the 95 % interval of a single test"
        )
    if stopped:
        early = sum(r.predicted < r.measured for r in stopped)
        line += f"; {len(stopped)} stopped before, of which {early or 'none'} should have broken"
    return [line, *(_rupture_table(ends) if len(ends) <= LISTED else [])]


def _rupture_table(ends: Sequence[tuple[str, str, RuptureMisfit]]) -> list[str]:
    width, wide = max(len(name) for name, _, _ in ends), max(len(condition) for _, condition, _ in ends)
    lines = [f"  {'test':{width}}  {'condition':{wide}} {'lasted, h':>11} {'predicted':>10}  [95 %]"]
    for name, condition, r in ends:
        lasted = f"{'> ' if r.stopped else ''}{r.measured / 3600:.4g}"
        low, time, high = (v / 3600 for v in (r.low, r.predicted, r.high))
        lines.append(f"  {name:{width}}  {condition:{wide}} {lasted:>11} {time:>10.4g}  [{low:.4g}, {high:.4g}]")
    return lines


def _linear_outputs(fit: Identification) -> list[str]:
    """Errors of outputs that are compared as they are, over all used frames of all tests."""
    lines = []
    for name, e in fit.errors.items():
        if name in ("strain", RUPTURE):
            continue
        unit, s = f" {UNITS[name]}" if name in UNITS else "", fit.scatter[name]
        lines.append(
            f"  {name}: relative squared error {e.rse:.3g}, rms {e.mse**0.5:.3g}{unit} ({100 * e.relative:.2g} %), "
            f"noise {s.noise:.2g}{unit}, offsets {s.offset:.2g}{unit}, reduced chi-square {e.chi_square:.3g}"
        )
    if lines and "strain" not in fit.errors:
        count = _tests(len(fit.misfits))
        lines.append(f"  {count}; scatter of the rate between tests (one sd) {100 * fit.scatter.rate:.0f} %")
    return lines


def _table(fit: Identification) -> list[str]:
    """One line a test: its error, its offset and weight, and what was found of its nuisances."""
    bulges = [m for m in fit.misfits if m.outputs and m.outputs[0].output != "strain"]
    own = {(n.kind, n.member): n for n in fit.nuisances if n.scope == "test"}
    kinds = list(dict.fromkeys(n.kind for n in fit.nuisances if n.scope == "test"))
    if not (bulges or kinds):
        return _shared(fit)
    width = max(len(m.name) for m in fit.misfits)
    head = f"  {'test':{width}}  {'condition':22} {'error':>9} {'chi2':>8} {'offset':>9} {'rate':>6} {'weight':>6}"
    lines = ["", head + "".join(f" {kind + _unit(kind):>18}" for kind in kinds)]
    for m in fit.misfits:
        first = m.outputs[0]
        found = [own.get((kind, m.name)) for kind in kinds]
        lines.append(
            f"  {m.name:{width}}  {m.condition:22} {first.errors.rse:9.2g} {first.errors.chi_square:8.3g} "
            f"{first.offset:9.2g} {m.rate_factor:6.2f} {m.weight:6.2f}"
            + "".join(f" {'-' if n is None else _plus_minus(n):>18}" for n in found)
        )
    return [*lines, *_shared(fit)]


def _shared(fit: Identification) -> list[str]:
    """Nuisances that tests share, and spreads that were estimated."""
    lines = [
        f"  {n.kind} of {n.member or 'one alloy'}{_unit(n.kind)}: {_plus_minus(n)}"
        for n in fit.nuisances
        if n.scope != "test"
    ]
    for nuisance in fit.settings.nuisances:
        found = [n.spread for n in fit.nuisances if n.kind == nuisance.kind]
        if nuisance.sd is None and found:
            lines.append(f"  {nuisance.kind}: spread estimated as {found[0]:.3g}{_unit(nuisance.kind)}")
    return lines


def _plus_minus(n: NuisanceEstimate) -> str:
    return f"{n.value:.4g} +- {n.sd:.2g}"


def _unit(kind: str) -> str:
    return f", {UNITS[kind]}" if kind in UNITS else ""


def notes_of(fit: Identification) -> list[str]:
    """Intervals, validity and provenance as lines, to travel as comments with an exported law."""
    lines = [f"identified with creepkit {fit.provenance.get('creepkit', '')} from {_tests(len(fit.misfits))}"]
    for e in fit.estimates:
        unit = "" if e.unit == "1" else f" {e.unit}"
        lines.append(f"{e.name} = {e.value:.8g}{unit}, 95 % interval {e.low:.4g} to {e.high:.4g}, {e.verdict}")
    units = {"stress": "MPa", "temperature": "K", "strain": "", "time": "s"}
    covered = (
        f"{name} {low:.4g} to {high:.4g} {units.get(name, '')}".strip() for name, (low, high) in fit.ranges.items()
    )
    lines.append(f"valid within the tests: {', '.join(covered)}")
    scatter = f"rates of single tests scatter by {100 * fit.scatter.rate:.0f} % (one sd)"
    met = [f"rms of ln strain {fit.rms:.3g}"] if "strain" in fit.errors else []
    met += [f"relative squared error of {name} {e.rse:.3g}" for name, e in fit.errors.items() if name != "strain"]
    return [*lines, "; ".join([*met, scatter]), *fit.notes]
