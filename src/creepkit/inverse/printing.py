"""An identification as text for a terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from creepkit.language.printing import text_of_expression

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification


def text_of(fit: Identification) -> str:
    """The law, its values with 95 % intervals, the scatter between tests, and what is not determined."""
    lines = [
        f"{fit.law.title or fit.law.name}",
        *(f"  {label}: {text_of_expression(term)}" for label, term in fit.law.terms.items()),
        "",
    ]
    width = max(len(e.name) for e in fit.estimates) if fit.estimates else 4
    for e in fit.estimates:
        unit = "" if e.unit == "1" else f" {e.unit}"
        note = "" if e.verdict == "determined" else f"   <- {e.verdict} by these data"
        note = "   <- at its bound" if e.verdict == "at its bound" else note
        lines.append(f"  {e.name:{width}} = {e.value:.5g}  [{e.low:.4g}, {e.high:.4g}]{unit}{note}")
    r = fit.reference
    rate, low, high = (float(v) for v in fit.rate(r.stress))
    lines.append(
        f"  rate at {r.stress:.4g} MPa, {r.temperature:.0f} K, strain {r.strain:.2g}, {r.time:.3g} s: "
        f"{rate:.3g} [{low:.3g}, {high:.3g}] 1/s"
    )
    n, low, high = (float(v) for v in fit.local_exponent(r.stress))
    lines.append(f"  local stress exponent there: {n:.3g} [{low:.3g}, {high:.3g}]")
    s = fit.scatter
    frames = sum(m.frames for m in fit.misfits)
    tests = "1 test" if len(fit.misfits) == 1 else f"{len(fit.misfits)} tests"
    lines += [
        "",
        f"  {tests}, {frames} frames: rms of ln strain {fit.rms:.3g}",
        f"  scatter (one sd): rate between tests {100 * s.rate:.0f} %, loading strain {s.offset:.2g}, "
        f"frame noise {s.noise:.2g}, what the law cannot follow {100 * s.drift:.1f} % of strain",
    ]
    lines += [f"  note: {note}" for note in fit.notes]
    return "\n".join(lines)


def notes_of(fit: Identification) -> list[str]:
    """Intervals, validity and provenance as lines, to travel as comments with an exported law."""
    lines = [f"identified with creepkit {fit.provenance.get('creepkit', '')} from {len(fit.misfits)} tests"]
    for e in fit.estimates:
        unit = "" if e.unit == "1" else f" {e.unit}"
        lines.append(f"{e.name} = {e.value:.8g}{unit}, 95 % interval {e.low:.4g} to {e.high:.4g}, {e.verdict}")
    units = {"stress": "MPa", "temperature": "K", "strain": "", "time": "s"}
    covered = (
        f"{name} {low:.4g} to {high:.4g} {units.get(name, '')}".strip() for name, (low, high) in fit.ranges.items()
    )
    lines.append(f"valid within the tests: {', '.join(covered)}")
    lines.append(
        f"rms of ln strain {fit.rms:.3g}; rates of single tests scatter by {100 * fit.scatter.rate:.0f} % (one sd)"
    )
    return [*lines, *fit.notes]
