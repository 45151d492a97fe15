"""discover: from identifications at single temperatures to the law with temperature in it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from creepkit.discovery.combining import combine
from creepkit.discovery.libraries import CONSTANT, Library, candidates
from creepkit.discovery.points import Points
from creepkit.discovery.refitting import refit
from creepkit.discovery.trend import TemperatureLaw, of_combinations
from creepkit.errors import FitError
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.identification import Identification
from creepkit.inverse.settings import Settings
from creepkit.records import History, Predictor

Prior = Mapping[str, Mapping[str, float]]
Progress = Callable[[str, int, int], None]


def discover(
    fits: Sequence[Identification],
    *,
    forms: Sequence[str] | Mapping[str, Sequence[str]] | None = None,
    prior: Prior | None = None,
    parameters: Sequence[str] | None = None,
    histories: Sequence[History] | None = None,
    using: Predictor | None = None,
    settings: Settings | None = None,
    progress: Progress | None = None,
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
    points = Points.of(fits)
    libraries = libraries_of(points, forms, prior or {}, parameters)
    found = combine(points, libraries, progress)
    odds = {name: {one.name: one.odds for one in own} for name, own in libraries.items()}
    trend = of_combinations(points, found, odds)
    if histories is None:
        return trend
    chosen = using or fits[0].using
    if chosen is None:
        raise FitError("the identifications were loaded from files: give using=, the specimen they were made with")
    return refit(trend, histories, chosen, settings=settings or fits[0].settings, progress=progress)


def libraries_of(
    points: Points,
    forms: Sequence[str] | Mapping[str, Sequence[str]] | None,
    prior: Prior,
    parameters: Sequence[str] | None,
) -> dict[str, list[Library]]:
    """{parameter: its candidate forms}, in the law's order."""
    law = points.law
    for name in (*(parameters or ()), *prior, *(forms if isinstance(forms, Mapping) else ())):
        law.symbol(name)
    coordinates = Coordinates(law, points.reference)
    rates = {law.names[k] for k in coordinates.coefficients}
    found = {}
    for name in law.names:
        wanted = forms.get(name) if isinstance(forms, Mapping) else forms
        if parameters is not None and name not in parameters:
            wanted = (CONSTANT,)
        found[name] = candidates(
            law, name, name in rates, points.reference.temperature, points.temperatures, wanted, prior.get(name)
        )
    return found
