"""Records as pandas DataFrames; needs pandas (`pip install 'creepkit[notebook]'`)."""

from __future__ import annotations

from collections.abc import Mapping
from functools import singledispatch
from pathlib import Path
from typing import TYPE_CHECKING, Any

from creepkit.composition.mapping import CompositionMap
from creepkit.composition.regression import CompositionRegression
from creepkit.errors import HistoryError, ReportError, restated
from creepkit.forecasts.forecast import Forecast
from creepkit.inverse.identification import Identification
from creepkit.inverse.selection.ranking import Ranking
from creepkit.inverse.uncertainty.importance_sampling import PosteriorSamples
from creepkit.law_search.results import LawSearch
from creepkit.readers.history_csv import HISTORY_CSV, histories_of_tests
from creepkit.readers.questions import Question
from creepkit.readers.table_layouts import tests_in
from creepkit.readers.text_files import table_of_text
from creepkit.records import Histories, History, output_unit
from creepkit.rupture_assessment.assessment import RuptureAssessment

if TYPE_CHECKING:
    from pandas import DataFrame


def to_dataframe(record: object) -> DataFrame:
    """A record as a table: readings, values with intervals, laws with weights, forecast curves, draws, or strengths."""
    try:
        from pandas import DataFrame
    except ImportError:
        raise ReportError("a table needs pandas, which is not installed: pip install 'creepkit[notebook]'") from None
    rows, index = _rows(record)
    frame = DataFrame(rows)
    return frame.set_index(index) if index else frame


def history_from_dataframe(frame: DataFrame, conditions: Mapping[str, Any]) -> History:
    """The history of a table and of what is stated of it; see History.from_dataframe."""
    columns = frame.rename(columns={"strain": "strain_1"}) * 1  # as a History holds strain, and marks as files do
    head, known = "".join(f"# {key}: {value}\n" for key, value in conditions.items()), HISTORY_CSV.vocabulary
    table = table_of_text(Path("DataFrame"), head + columns.to_csv(index=frame.index.name is not None))
    try:
        histories = histories_of_tests(tests_in(table, known), table.path, known)
    except Question as asked:
        raise HistoryError(f"DataFrame: {asked.sentence}, as from_dataframe(frame, {asked.key}=...)") from None
    if len(histories) != 1:
        raise HistoryError(f"DataFrame: it holds {len(histories)} tests; give the rows of one, as by groupby()")
    return histories[0].replace(source="")


def to_arviz(samples: PosteriorSamples) -> Any:
    """Posterior samples as an xarray Dataset of one chain, which `arviz.summary` and `arviz.plot_pair` take.

    ReportError where xarray, which comes with arviz, is not installed.
    """
    with restated(ImportError, ReportError, "samples for arviz need it installed: pip install 'creepkit[notebook]'"):
        from xarray import Dataset
    table, draws = samples.coordinates.law.table, samples.values
    known = {name: {"long_name": p.meaning, "units": p.unit} for name, p in table.items()}
    return Dataset({name: (("chain", "draw"), draws[name][None, :], known[name]) for name in draws})


@singledispatch
def _rows(record: Any) -> tuple[Any, str]:
    """Columns or rows, and which of them is the index, "" for none."""
    raise TypeError(f"{type(record).__name__} has no table")


@_rows.register
def _(history: History) -> tuple[Any, str]:
    outputs = {f"{name}_{output_unit(name)}".rstrip("_"): values for name, values in history.outputs.items()}
    return {"time_s": history.times, **outputs, "used": history.used}, ""


@_rows.register
def _(tests: Histories) -> tuple[Any, str]:
    return [{"test": one.name, **row} for one in tests for row in to_dataframe(one).to_dict("records")], ""


@_rows.register
def _(samples: PosteriorSamples) -> tuple[Any, str]:
    return samples.values, ""


@_rows.register
def _(assessment: RuptureAssessment) -> tuple[Any, str]:
    rows = []
    for one in assessment.strengths:
        bounds = {"mean": one.bounds_of_mean, "heat": one.bounds_of_heat, "test": one.bounds_of_test}
        ends = {f"{end}_of_{of}_MPa": pair[k] for of, pair in bounds.items() for k, end in enumerate(("low", "high"))}
        point = {"hours": one.hours, "temperature_K": one.temperature, "method": one.method}
        rows.append({**point, "strength_MPa": one.value, **ends, "extrapolation": one.extrapolation})
    return rows, ""


@_rows.register
def _(fit: Identification) -> tuple[Any, str]:
    names = ("value", "low", "high", "unit", "verdict")
    return [{"parameter": e.name, **{name: getattr(e, name) for name in names}} for e in fit.estimates], "parameter"


@_rows.register
def _(mapped: CompositionMap) -> tuple[Any, str]:
    rows = []
    for k, alloy in enumerate(mapped.alloys):
        row: dict[str, Any] = {"alloy": alloy}
        row |= {f"{e}_at%": 100 * x for e, x in zip(mapped.elements, mapped.contents[k], strict=True)}
        for name, one in mapped.regressions.items():
            if alloy in one.alloys:
                row |= _of_regression(name, one, one.alloys.index(alloy))
        for name, table in (("", mapped.laws.weights), ("_shared", mapped.laws.shared)):
            row |= {f"{law}{name}": p for law, p in zip(mapped.laws.laws, table[k], strict=True)}
        rows.append(row)
    return rows, "alloy"


def _of_regression(name: str, one: CompositionRegression, k: int) -> dict[str, float]:
    """A property of alloy k by its own tests, with the others, and by the others alone."""
    (shared, shared_sd, share), (others, others_sd) = one.shared, one.left_out
    values = {
        "": one.values, "_sd": one.sd, "_shared": shared, "_shared_sd": shared_sd, "_by_others": others,
        "_by_others_sd": others_sd, "_weight_of_others": share,
    }  # fmt: skip
    return {f"{name}{ending}": float(value[k]) for ending, value in values.items()}


@_rows.register
def _(search: LawSearch) -> tuple[Any, str]:
    front, names = search.front, ("parameters", "complexity", "misfit", "excess", "registered")
    rows = [{"law": one.law.name, **{name: getattr(one, name) for name in names}} for one in search.tried]
    return [{**row, "front": one in front} for row, one in zip(rows, search.tried, strict=True)], ""


@_rows.register
def _(ranking: Ranking) -> tuple[Any, str]:
    rows = [
        {
            "law": one.fit.law.name,
            "weight": one.weight,
            "criterion_less_best": one.excess,
            "chi_square": one.chi_square,
            "parameters": len(one.fit.law.params),
            "verdict": "" if one.fit.adequacy is None else one.fit.adequacy.verdict,
        }
        for one in ranking.laws
    ]
    return rows, "law"


@_rows.register
def _(forecast: Forecast) -> tuple[Any, str]:
    rows = [
        {"test": test.name, "output": name, "time_s": time, "value": value, "low": low, "high": high}
        for test in forecast.tests
        for name, one in test.outputs.items()
        for time, value, low, high in zip(one.times, one.value, one.band.low, one.band.high, strict=True)
    ]
    return rows, ""
