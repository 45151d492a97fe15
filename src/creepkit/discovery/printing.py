"""A temperature law as text: for a terminal, and as comments of what is exported."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from creepkit.language.printing import text_of_expression

if TYPE_CHECKING:
    from creepkit.discovery.combining import Form
    from creepkit.discovery.trend import TemperatureLaw

LISTED = 6
CRITERION = {"points": "the quasi AICc of the estimates", "histories": "the BIC of the tests"}
EQUALS = {
    "points": "=: these data cannot tell it from the best",
    "histories": "=: not refitted, another that these data cannot tell from it stood for it",
}


def text_of(trend: TemperatureLaw) -> str:
    """The law, its numbers, the forms that remain for each parameter, and the combinations."""
    low, high = trend.range
    return "\n".join([
        f"{trend.law.title or trend.law.name}",
        *(f"  {label}: {text_of_expression(term)}" for label, term in trend.law.terms.items()),
        "",
        *_numbers(trend),
        "",
        f"  found from {trend.points.temperatures.size} temperatures, {low:.0f} to {high:.0f} K, and valid between "
        f"them; T_ref = {trend.T_ref:.2f} K",
        f"  forms that remain, weighed by {CRITERION[trend.judged_by]} ({EQUALS[trend.judged_by]}):",
        *_sets(trend.sets),
        "",
        *_candidates(trend),
        *_odds(trend),
        *(f"  note: {note}" for note in trend.notes),
    ])  # fmt: skip


def comments_of(trend: TemperatureLaw) -> list[str]:
    """What must travel with an exported law."""
    low, high = trend.range
    told = [f"{e.name} = {e.value:.8g} [{e.low:.4g}, {e.high:.4g}] {e.unit}: {e.verdict}" for e in trend.estimates]
    forms = [f"{name}: {', '.join(form.name for form in own)}" for name, own in trend.sets.items()]
    return [
        f"valid between {low:.0f} and {high:.0f} K; 95 % intervals in brackets",
        *told,
        *(f"forms of temperature that remain for {line}" for line in forms),
    ]


def _numbers(trend: TemperatureLaw) -> list[str]:
    width, lines = max(len(e.name) for e in trend.estimates), []
    for e in trend.estimates:
        unit = "" if e.unit == "1" else f" {e.unit}"
        note = "" if e.verdict == "determined" else f"   <- {e.verdict}"
        lines.append(f"  {e.name:{width}} = {e.value:.5g}  [{e.low:.4g}, {e.high:.4g}]{unit}{note}")
    return lines


def _sets(sets: Mapping[str, tuple[Form, ...]]) -> list[str]:
    width = max(len(name) for name in sets)
    return [f"    {name:{width}}  {', '.join(_form(form) for form in own)}" for name, own in sets.items()]


def _form(form: Form) -> str:
    if form.equivalent:
        return f"={form.name} {form.weight:.2f}" if form.weight > 0 else f"={form.name}"
    return f"{form.name} {form.weight:.2f}"


def _candidates(trend: TemperatureLaw) -> list[str]:
    """The best combinations: forms, numbers, criterion less the best, weight."""
    lines = ["  combination | numbers | criterion - best | weight"]
    for one in trend.candidates[:LISTED]:
        told = ", ".join(f"{name}:{form}" for name, form in one.forms.items())
        lines.append(f"    {told} | {len(one.internal)} | {one.excess:.1f} | {one.weight:.3f}")
    more = len(trend.candidates) - LISTED
    return [*lines, f"    and {more} more"] if more > 0 else lines


def _odds(trend: TemperatureLaw) -> list[str]:
    """The prior: what was believed before, where it is not even."""
    told = []
    for name, own in trend.odds.items():
        if len(own) > 1:
            most = max(own.values())
            told.append(f"{name}: {', '.join(f'{form} {odds / most:.2g}' for form, odds in own.items())}")
    return ["  prior odds, the likeliest as 1:", *(f"    {line}" for line in told)] if told else []
