"""discover: from identifications at single temperatures to the law with temperature in it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from creepkit.discovery.combining import rank_combinations
from creepkit.discovery.libraries import CONSTANT, CandidateForm, candidate_forms
from creepkit.discovery.points import IsothermalEstimates
from creepkit.discovery.refitting import refit
from creepkit.discovery.trend import TemperatureLaw, temperature_law_from_combinations
from creepkit.errors import FitError
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.identification import Identification
from creepkit.inverse.settings import IdentificationSettings
from creepkit.records import History, Predictor

PriorOdds = Mapping[str, Mapping[str, float]]
ProgressCallback = Callable[[str, int, int], None]


def discover(
    fits: Sequence[Identification],
    *,
    forms: Sequence[str] | Mapping[str, Sequence[str]] | None = None,
    prior: PriorOdds | None = None,
    parameters: Sequence[str] | None = None,
    histories: Sequence[History] | None = None,
    using: Predictor | None = None,
    settings: IdentificationSettings | None = None,
    progress: ProgressCallback | None = None,
) -> TemperatureLaw:
    """Find closed forms of the parameters against temperature, and judge them by the tests where those are given.

    fits : identifications of one law, each at one temperature; three temperatures or more.
    forms : names of registered temperature forms, or {parameter: names}; by default all that suit a parameter.
    prior : {parameter: {form: odds}} in the place of the default, which counts 1/T four times for the coefficient of a
        rate and shares equal odds among forms of equally many numbers; printed with the answer.
    parameters : those that may depend on temperature; by default all.
    histories : all tests; the forms are then put back into the law and refitted to them (see refit). using, settings :
        the predictor and the settings of that; by default those of the first identification.
    """
    estimates = IsothermalEstimates.from_identifications(fits)
    candidates = candidate_forms_of(estimates, forms, prior or {}, parameters)
    combinations = rank_combinations(estimates, candidates, progress)
    odds = {name: {form.name: form.prior_odds for form in forms_of_parameter} for name, forms_of_parameter in candidates.items()}
    temperature_law = temperature_law_from_combinations(estimates, combinations, odds)
    if histories is None:
        return temperature_law
    predictor = using or fits[0].predictor
    if predictor is None:
        raise FitError("the identifications were loaded from files: give using=, the specimen they were made with")
    return refit(temperature_law, histories, predictor, settings=settings or fits[0].settings, progress=progress)


def candidate_forms_of(
    estimates: IsothermalEstimates,
    forms: Sequence[str] | Mapping[str, Sequence[str]] | None,
    prior: PriorOdds,
    parameters: Sequence[str] | None,
) -> dict[str, list[CandidateForm]]:
    """{parameter: its candidate forms}, in the law's order."""
    law = estimates.law
    for name in (*(parameters or ()), *prior, *(forms if isinstance(forms, Mapping) else ())):
        law.symbol(name)
    coordinates = Coordinates(law, estimates.reference)
    rate_coefficients = {law.names[k] for k in coordinates.coefficients}
    forms_by_parameter = {}
    for name in law.names:
        form_names = forms.get(name) if isinstance(forms, Mapping) else forms
        if parameters is not None and name not in parameters:
            form_names = (CONSTANT,)
        forms_by_parameter[name] = candidate_forms(
            law, name, name in rate_coefficients, estimates.reference.temperature, estimates.temperatures, form_names, prior.get(name)
        )
    return forms_by_parameter
