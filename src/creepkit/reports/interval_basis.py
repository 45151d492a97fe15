"""What the intervals of an identification rest on: the weights of the readings, and the form of the law."""

from __future__ import annotations

from typing import TYPE_CHECKING

from creepkit.reports.stress_exponents import constant_load_sentence

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.settings import IdentificationSettings


def interval_basis(fit: Identification) -> list[str]:
    """What intervals rest on, in sentences without full stops.

    That they hold only with the form of the law is not said of a law that the tests reject: none of its values does.
    """
    rejected = fit.adequacy is not None and fit.adequacy.rejects
    conditional = "" if rejected else constant_load_sentence(fit)
    return [_usual_errors(fit, rejected=rejected), _weights(fit.settings), *([conditional] if conditional else [])]


def _usual_errors(fit: Identification, *, rejected: bool) -> str:
    """Which errors of tests the intervals include, of which size, and how wide they are without."""
    included = {one.kind: one.amount for one in fit.unmodelled if one.included}
    if not included:
        return "the intervals take the temperatures, loads and dimensions of the tests as exactly known"
    errors = ", ".join(f"{kind} {amount}" for kind, amount in included.items())
    begin = f"the intervals include errors of the tests that nobody measured (one standard deviation: {errors})"
    if rejected or not fit.estimates:
        return begin
    stress = fit.reference.stress
    with_errors, without = (
        float(one.rate(stress, warn=False)[2] / one.rate(stress, warn=False)[0]) for one in (fit, fit.by_tests_alone)
    )
    return (
        f"{begin}: the rate amid the tests is known to a factor of {with_errors:.3g}, and if all of these were exact "
        f'(usual_errors="none") to {without:.3g}'
    )


def _weights(settings: IdentificationSettings) -> str:
    if settings.weights == "likelihood":
        return (
            'the intervals rest on the likelihood (weights "likelihood"): readings count by their estimated noise, so '
            "that the shape of every curve counts beside the comparison of tests; readings of equal weight "
            '(weights "noise") give other values and, as a rule, wider intervals'
        )
    if settings.weights == "noise":
        return (
            'the intervals rest on readings of equal weight (weights "noise") and all the scatter that was estimated, '
            'with what the law cannot follow; the likelihood (weights "likelihood", the default) gives other values '
            "and, as a rule, narrower intervals"
        )
    weights = settings.weights if isinstance(settings.weights, str) else f"{dict(settings.weights)}"
    return (
        f"the intervals rest on weights of the outputs ({weights}), whose relative squared errors are summed, and the "
        "scatter that was estimated"
    )
