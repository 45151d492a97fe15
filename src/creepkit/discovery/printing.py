"""A temperature law as text: for a terminal, and as comments of what is exported."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from creepkit.language.printing import expression_text

if TYPE_CHECKING:
    from creepkit.discovery.combining import FormWeight
    from creepkit.discovery.trend import TemperatureLaw

MAX_COMBINATIONS_LISTED = 6
CRITERION = {"points": "the quasi AICc of the estimates", "histories": "the BIC of the tests"}
EQUIVALENCE_NOTE = {
    "points": "=: these data cannot tell it from the best",
    "histories": "=: not refitted, another that these data cannot tell from it stood for it",
}


def temperature_law_text(temperature_law: TemperatureLaw) -> str:
    """The law, its numbers, the forms that remain for each parameter, and the combinations."""
    low, high = temperature_law.temperature_range
    return "\n".join([
        f"{temperature_law.law.title or temperature_law.law.name}",
        *(f"  {label}: {expression_text(term)}" for label, term in temperature_law.law.terms.items()),
        "",
        *_parameter_lines(temperature_law),
        "",
        f"  found from {temperature_law.isothermal_estimates.temperatures.size} temperatures, {low:.0f} to {high:.0f} K, and valid between "
        f"them; T_ref = {temperature_law.T_ref:.2f} K",
        f"  forms that remain, weighed by {CRITERION[temperature_law.criterion_data]} ({EQUIVALENCE_NOTE[temperature_law.criterion_data]}):",
        *_form_lines(temperature_law.plausible_forms),
        "",
        *_combination_lines(temperature_law),
        *_prior_lines(temperature_law),
        *(f"  note: {note}" for note in temperature_law.notes),
    ])  # fmt: skip


def export_notes(temperature_law: TemperatureLaw) -> list[str]:
    """What must travel with an exported law."""
    low, high = temperature_law.temperature_range
    parameter_lines = [f"{e.name} = {e.value:.8g} [{e.low:.4g}, {e.high:.4g}] {e.unit}: {e.verdict}" for e in temperature_law.estimates]
    forms = [f"{name}: {', '.join(form.name for form in form_weights)}" for name, form_weights in temperature_law.plausible_forms.items()]
    return [
        f"valid between {low:.0f} and {high:.0f} K; 95 % intervals in brackets",
        *parameter_lines,
        *(f"forms of temperature that remain for {line}" for line in forms),
    ]


def _parameter_lines(temperature_law: TemperatureLaw) -> list[str]:
    width, lines = max(len(e.name) for e in temperature_law.estimates), []
    for e in temperature_law.estimates:
        unit = "" if e.unit == "1" else f" {e.unit}"
        note = "" if e.verdict == "determined" else f"   <- {e.verdict}"
        lines.append(f"  {e.name:{width}} = {e.value:.5g}  [{e.low:.4g}, {e.high:.4g}]{unit}{note}")
    return lines


def _form_lines(plausible_forms: Mapping[str, tuple[FormWeight, ...]]) -> list[str]:
    width = max(len(name) for name in plausible_forms)
    return [f"    {name:{width}}  {', '.join(_form_text(form) for form in form_weights)}" for name, form_weights in plausible_forms.items()]


def _form_text(form: FormWeight) -> str:
    if form.equivalent:
        return f"={form.name} {form.weight:.2f}" if form.weight > 0 else f"={form.name}"
    return f"{form.name} {form.weight:.2f}"


def _combination_lines(temperature_law: TemperatureLaw) -> list[str]:
    """The best combinations: forms, numbers, criterion less the best, weight."""
    lines = ["  combination | numbers | criterion - best | weight"]
    for candidate in temperature_law.candidates[:MAX_COMBINATIONS_LISTED]:
        forms = ", ".join(f"{name}:{form}" for name, form in candidate.forms.items())
        lines.append(f"    {forms} | {len(candidate.internal_values)} | {candidate.criterion_difference:.1f} | {candidate.weight:.3f}")
    remaining = len(temperature_law.candidates) - MAX_COMBINATIONS_LISTED
    return [*lines, f"    and {remaining} more"] if remaining > 0 else lines


def _prior_lines(temperature_law: TemperatureLaw) -> list[str]:
    """The prior: what was believed before, where it is not even."""
    odds_lines = []
    for name, odds_by_form in temperature_law.prior_odds.items():
        if len(odds_by_form) > 1:
            largest = max(odds_by_form.values())
            odds_lines.append(f"{name}: {', '.join(f'{form} {odds / largest:.2g}' for form, odds in odds_by_form.items())}")
    return ["  prior odds, the likeliest as 1:", *(f"    {line}" for line in odds_lines)] if odds_lines else []
