"""TemperatureLaw: a law with temperature-dependent parameters, its plausible forms, validity and JSON file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from creepkit.arrays import ArrayLike, Floats
from creepkit.discovery.combinations import FormWeight, RankedCombinations
from creepkit.discovery.forms import CandidateForm
from creepkit.discovery.regression import (
    INFINITE_FREEDOM,
    FormCombination,
    IsothermalEstimates,
    WhitenedSystem,
    whitened_system,
)
from creepkit.errors import FitError, nearest
from creepkit.files.json_documents import DocumentFormat, write_json
from creepkit.files.reading import FileKind
from creepkit.files.record_codec import RecordCodec, ValueCodec
from creepkit.inverse.adequacy import Adequacy
from creepkit.inverse.identification import Identification
from creepkit.inverse.identification_document import LAW_CODEC, identification_from_json, identification_to_json
from creepkit.inverse.uncertainty.laplace_approximation import Estimate, interval_ends, verdict_of_interval
from creepkit.inverse.uncertainty.mixture_distribution import MixtureDistribution
from creepkit.language import CreepLaw
from creepkit.presentation import Presentable, present
from creepkit.records import LawWithValues

if TYPE_CHECKING:
    from matplotlib.figure import Figure


TEMPERATURE_LAW = DocumentFormat(
    "creepkit-temperature-law",
    2,
    FileKind("a temperature law", FitError, "give a file that TemperatureLaw.save wrote"),
    remedy="run discover again",
)


MAX_COMBINATIONS_WRITTEN = 20
"""Combinations that are written, best first."""


def temperature_law_to_json(temperature_law: TemperatureLaw) -> dict[str, Any]:
    """The result as JSON-able data."""
    estimates = temperature_law.isothermal_estimates
    content = {
        "creepkit": version("creepkit"),
        "law": temperature_law.law,
        "isothermal_law": temperature_law.isothermal_law,
        "T_ref": temperature_law.T_ref,
        "temperature_range": temperature_law.temperature_range,
        "criterion_data": temperature_law.criterion_data,
        "estimates": temperature_law.estimates,
        "plausible_forms": temperature_law.plausible_forms,
        "prior_odds": temperature_law.prior_odds,
        "candidates": [
            {
                "forms": candidate.forms,
                "internal_values": candidate.values,
                "covariance": candidate.covariance,
                "criterion_difference": candidate.criterion_difference,
                "weight": candidate.weight,
            }
            for candidate in temperature_law.candidates[:MAX_COMBINATIONS_WRITTEN]
        ],
        "isothermal_estimates": {
            "temperatures": estimates.temperatures,
            "theta": estimates.theta,
            "covariance": estimates.covariance,
            "overdispersion": temperature_law.combinations.overdispersion,
        },
        "reference": estimates.reference,
        "fit": temperature_law.fit,
        "notes": temperature_law.notes,
    }
    return {**TEMPERATURE_LAW.heading, **CODEC.to_json(content)}


CODEC = RecordCodec(
    values={CreepLaw: LAW_CODEC, Identification: ValueCodec(identification_to_json, identification_from_json)}
)


NOTED_OVERDISPERSION = 1.5
"""Inflation of covariances from which a note is made."""


@dataclass(frozen=True, eq=False)
class TemperatureLaw(Presentable, text="reports.temperature_law:temperature_law_text"):
    """The result of discover() and of refit().

    law : an ordinary law with temperature in it, printed and exported like any other; `valued` has its numbers.
    isothermal_law : the law without temperature. T_ref : K, where its parameters have the values stated.
    estimates : its numbers with 95 % intervals, over all candidates that share the form they belong to.
    temperature_range : K, the temperatures it was found from. criterion_data : "points" when regression on isothermal
        estimates chose the forms, "histories" when the tests themselves did.
    plausible_forms : {parameter: forms that remain, best first}. candidates : combinations of forms, best first.
    prior_odds : {parameter: {form: odds}}. fit : the identification of `law` from all tests, once refitted.
    """

    law: CreepLaw
    isothermal_law: CreepLaw
    T_ref: float
    estimates: tuple[Estimate, ...]
    temperature_range: tuple[float, float]
    criterion_data: Literal["points", "histories"]
    plausible_forms: Mapping[str, tuple[FormWeight, ...]]
    candidates: tuple[FormCombination, ...]
    prior_odds: Mapping[str, Mapping[str, float]]
    isothermal_estimates: IsothermalEstimates
    combinations: RankedCombinations
    fit: Identification | None = None
    notes: tuple[str, ...] = ()

    @property
    def values(self) -> dict[str, float]:
        """{parameter: value} of `law`, in the author's units."""
        return {e.name: e.value for e in self.estimates}

    @property
    def system(self) -> WhitenedSystem:
        """The linear system of all candidate forms on the isothermal estimates, for regressions of one's own."""
        return whitened_system(self.isothermal_estimates, self.combinations.candidates)

    @property
    def adequacy(self) -> Adequacy | None:
        """Whether the law explains all tests to their noise, once it was refitted to them."""
        return None if self.fit is None else self.fit.adequacy

    @property
    def forms(self) -> dict[str, str]:
        """{parameter: name of its best form}."""
        return self.candidates[0].forms

    @property
    def valued(self) -> LawWithValues:
        """The law with its numbers, intervals and range of validity: what every exporter takes."""
        return LawWithValues(self.law, self.values, tuple(export_notes(self)), ranges=self.isothermal_estimates.ranges)

    def estimate(self, name: str) -> Estimate:
        """One number of the law, such as Q, with its interval."""
        if name in self.values:
            return next(one for one in self.estimates if one.name == name)
        raise FitError(f"law '{self.law.name}' has no parameter '{name}': {nearest(name, self.law.names)}")

    def parameters_at(self, T: ArrayLike) -> dict[str, Floats]:
        """{parameter of `isothermal_law`: (temperatures,) its values}; FitError outside the range.

        T : a number or (temperatures,) K.
        """
        temperatures = np.atleast_1d(np.asarray(T, float))
        low, high = self.temperature_range
        if ((temperatures < low - 1e-6) | (temperatures > high + 1e-6)).any():
            raise FitError(f"law '{self.law.name}' holds between {low:.0f} and {high:.0f} K; it was evaluated outside")
        theta = self.candidates[0].theta(temperatures)
        scale = [p.scale for p in self.isothermal_law.params.values()]
        values = np.where([s == "log" for s in scale], np.exp(np.minimum(theta, 700.0)), theta)
        return dict(zip(self.isothermal_law.names, values.T, strict=True))

    def save(self, path: str | Path) -> Path:
        """Write the result as JSON (to a temporary name, then renamed)."""
        return write_json(temperature_law_to_json(self), Path(path), TEMPERATURE_LAW.kind)

    def plot(self, path: str | Path | None = None) -> Figure:
        """Parameters against temperature, with intervals and the curves of the forms that remain."""
        return present("reports.temperature_law:plot_temperature_law", self, path)


def temperature_law_from_combinations(
    estimates: IsothermalEstimates, combinations: RankedCombinations, prior_odds: Mapping[str, Mapping[str, float]]
) -> TemperatureLaw:
    """The temperature law that the isothermal estimates alone give."""
    c = combinations.overdispersion
    candidates = tuple(
        replace(
            one,
            covariance=one.covariance * c,
            degrees_of_freedom=INFINITE_FREEDOM if c == 1.0 else float(max(one.rows - one.parameter_count, 1)),
        )
        for one in combinations.combinations
    )
    law, notes = combinations.law, failure_notes(combinations.failed)
    if c > NOTED_OVERDISPERSION:
        notes.append(f"no form follows the points within their errors, which were taken {np.sqrt(c):.2g} times wider")
    return TemperatureLaw(
        law=law,
        isothermal_law=estimates.law,
        T_ref=estimates.reference.temperature,
        estimates=averaged_estimates(law, candidates),
        temperature_range=(float(estimates.temperatures.min()), float(estimates.temperatures.max())),
        criterion_data="points",
        plausible_forms=combinations.plausible_forms,
        candidates=candidates,
        prior_odds=prior_odds,
        isothermal_estimates=estimates,
        combinations=combinations,
        notes=tuple(notes),
    )


def failure_notes(failed: Mapping[tuple[str, ...], str]) -> list[str]:
    """How many combinations of forms failed, with the first of them and its reason, in one sentence; or none."""
    first = next(iter(failed), ())
    count = f"{len(failed)} combination{'s' * (len(failed) > 1)} of forms failed"
    return [f"{count}; the first, {', '.join(first)}, with: {failed[first]}"] if failed else []


def averaged_estimates(law: CreepLaw, candidates: Sequence[FormCombination]) -> tuple[Estimate, ...]:
    """The best candidate's numbers; intervals over all that have the same form of the parameter concerned."""
    best, estimates = candidates[0], {}
    for form in best.candidate_forms:
        same_form = [candidate for candidate in candidates if candidate.forms[form.parameter] == form.name]
        for name in form.parameter_names:
            estimates[name] = _estimate(name, form, same_form)
    return tuple(estimates[name] for name in law.names)


def _estimate(name: str, form: CandidateForm, candidates: Sequence[FormCombination]) -> Estimate:
    param, value = form.table[name], candidates[0].values[name]
    weights = np.array([one.weight for one in candidates])
    values = np.array([one.values[name] for one in candidates])
    standard_deviations = np.array([one.standard_deviation(name) for one in candidates])
    mixture = MixtureDistribution(
        weights / weights.sum(),
        np.maximum([one.degrees_of_freedom for one in candidates], 1.0),
        values,
        np.maximum(standard_deviations, 1e-300),
    )
    _, low, high = (float(end) for end in mixture.interval())
    lower_bound, upper_bound = (param.to_internal(b) for b in param.bounds)
    value, low, high = (float(np.clip(v, lower_bound, upper_bound)) for v in (value, low, high))
    verdict = verdict_of_interval(param, value, (low, high))
    from_internal = param.from_internal
    return Estimate(name, from_internal(value), from_internal(low), from_internal(high), param.unit, verdict)


def export_notes(temperature_law: TemperatureLaw) -> list[str]:
    """Validity, intervals and forms of a law, as comments of an export."""
    low, high = temperature_law.temperature_range
    parameter_lines = [
        f"{e.name} = {e.value:.8g} [{', '.join(interval_ends(temperature_law.law, e))}] {e.unit}: {e.verdict}"
        for e in temperature_law.estimates
    ]
    forms = [
        f"{name}: {', '.join(form.name for form in form_weights)}"
        for name, form_weights in temperature_law.plausible_forms.items()
    ]
    return [
        f"valid between {low:.0f} and {high:.0f} K; 95 % intervals in brackets",
        *parameter_lines,
        *(f"forms of temperature that remain for {line}" for line in forms),
    ]
