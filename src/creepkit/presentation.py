"""How records print, plot and save themselves although the modules that do so import the records.

A method of a record says `return present(self, "plot", path)`. The table PRESENTERS names the function that does it,
which takes the record first; its module is imported when it is first asked for. So records import nothing above them,
and `fit.plot()`, `print(fit)` and `fit.save()` work. The same holds for methods that work something out by functions of
higher modules, such as `fit.profile("n")`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib import import_module
from typing import Any, TypeVar

Result = TypeVar("Result")


PRESENTERS: dict[str, dict[str, str]] = {
    # specimens
    "Run": {"text": "creepkit.reports.simulation:run_text"},
    "BulgeRun": {
        "plot": "creepkit.reports.simulation:outputs_figure",
        "section": "creepkit.reports.simulation:section_figure",
    },
    # records of instruments
    "InstrumentRecord": {
        "text": "creepkit.reports.instrument_records:record_text",
        "plot": "creepkit.reports.instrument_records:record_figure",
    },
    "ClockAlignment": {"text": "creepkit.reports.instrument_records:alignment_text"},
    "Imposed": {"text": "creepkit.reports.instrument_records:imposed_text"},
    # extraction
    "Extraction": {
        "text": "creepkit.reports.extraction_text:extraction_text",
        "plot": "creepkit.reports.extraction_plot:extraction_figure",
    },
    # sampling, data sets, surrogates
    "Acceptance": {
        "text": "creepkit.reports.sampling:acceptance_text",
        "plot": "creepkit.reports.sampling:acceptance_figure",
    },
    "DataQuality": {"text": "creepkit.reports.data_quality:data_quality_text"},
    "Dataset": {"text": "creepkit.reports.dataset:dataset_text"},
    "Surrogate": {"text": "creepkit.reports.surrogate:surrogate_text"},
    # inverse
    "Identification": {
        "text": "creepkit.reports.identification_text:identification_text",
        "plot": "creepkit.reports.identification_plot:identification_figure",
        "comments": "creepkit.reports.identification_text:identification_comments",
        "save": "creepkit.inverse.identification_document:write_identification",
        "profile": "creepkit.inverse.uncertainty.profile_likelihood:profile",
        "sample": "creepkit.inverse.uncertainty.posterior:sample_posterior",
        "correlation": "creepkit.inverse.uncertainty.correlation:correlation",
        "undetermined": "creepkit.inverse.uncertainty.correlation:undetermined",
        "forecast": "creepkit.forecasts.forecast:forecast",
        "with_histories": "creepkit.inverse.attached_histories:with_attached",
    },
    "CrossValidation": {"text": "creepkit.reports.confirmation_text:cross_validation_text"},
    "Confirmation": {"text": "creepkit.reports.confirmation_text:confirmation_text"},
    "SearchTrace": {"plot": "creepkit.reports.search:search_figure"},
    "Ranking": {
        "text": "creepkit.reports.ranking:ranking_text",
        "plot": "creepkit.reports.ranking_plot:ranking_figure",
        "save": "creepkit.inverse.ranking_document:write_ranking",
        "forecast": "creepkit.forecasts.forecast:forecast",
        "further_tests": "creepkit.experiments.design:further_tests",
    },
    "Sparsity": {"text": "creepkit.reports.search:sparsity_text"},
    "PenaltyPath": {
        "text": "creepkit.reports.search:penalty_path_text",
        "plot": "creepkit.reports.search:penalty_path_figure",
    },
    "SelectionFrequencies": {"text": "creepkit.reports.search:selection_frequencies_text"},
    "ProfileLikelihood": {
        "text": "creepkit.reports.uncertainty:profile_text",
        "plot": "creepkit.reports.uncertainty:profile_figure",
    },
    "PosteriorSamples": {
        "text": "creepkit.reports.uncertainty:posterior_text",
        "plot": "creepkit.reports.uncertainty:pairs_figure",
    },
    "Correlation": {
        "text": "creepkit.reports.uncertainty:correlation_text",
        "plot": "creepkit.reports.uncertainty:correlation_figure",
    },
    "ModelAverage": {
        "text": "creepkit.reports.uncertainty:model_average_text",
        "forecast": "creepkit.forecasts.forecast:forecast",
    },
    "RateBand": {
        "text": "creepkit.reports.uncertainty:rate_band_text",
        "plot": "creepkit.reports.uncertainty:rate_band_figure",
    },
    # forecasts, rupture assessments, screening, discovery, experiments
    "Forecast": {
        "text": "creepkit.reports.forecast:forecast_text",
        "plot": "creepkit.reports.forecast_plot:forecast_figure",
    },
    "RuptureAssessment": {
        "text": "creepkit.reports.rupture:rupture_text",
        "plot": "creepkit.reports.rupture_plot:rupture_figure",
        "save": "creepkit.rupture_assessment.assessment_document:write_assessment",
    },
    "ScreeningResult": {
        "text": "creepkit.reports.screening:screening_text",
        "plot": "creepkit.reports.screening:plot_screening",
        "to_csv": "creepkit.screening.files:write_csv",
        "to_hdf5": "creepkit.screening.files:write_plate",
    },
    "TemperatureLaw": {
        "text": "creepkit.reports.temperature_law:temperature_law_text",
        "plot": "creepkit.reports.temperature_law:plot_temperature_law",
    },
    "TemperatureStudy": {"text": "creepkit.reports.temperature_law:temperature_study_text"},
    "ModulusEstimates": {"text": "creepkit.reports.temperature_law:modulus_estimates_text"},
    "Design": {
        "text": "creepkit.reports.design:design_text",
        "to_json": "creepkit.reports.design:design_to_json",
        "plot": "creepkit.reports.design:design_figure",
    },
}
"""{class: {verb: "module:function"}}. The verb "text" is what `str` and `print` show; other verbs are methods."""


class Presentable:
    """A record whose text for a terminal is written by the function that the table names under "text"."""

    __slots__ = ()

    def __str__(self) -> str:
        return present(self, "text")


def present(record: object, verb: str, /, *arguments: Any, **options: Any) -> Result:  # type: ignore[type-var]
    """The result of the function that the table names for the class of a record and a verb.

    record : its first argument; a class without an entry of its own uses that of the class it derives from. The result
    has the type that the calling method declares, which a test compares with that of the function.
    """
    for kind in type(record).__mro__:
        functions = PRESENTERS.get(kind.__name__, {})
        if verb in functions:
            result: Result = presenter(functions[verb])(record, *arguments, **options)
            return result
    raise AttributeError(f"no function is registered that gives '{verb}' of a record of class {type(record).__name__}")


@cache
def presenter(name: str) -> Callable[..., Any]:
    """The function that "module:function" names."""
    module, _, function = name.partition(":")
    resolved: Callable[..., Any] = getattr(import_module(module), function)
    return resolved
