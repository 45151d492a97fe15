"""The contents of a page as one JSON document, which its scripts read: laws, specimens and tests in plain numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.app.contents import (
    KINDS,
    RATE_STRAIN,
    RATE_TIME,
    USUAL_STRESS,
    PageContents,
    PageLaw,
    temperature_warning,
    usual_end,
)
from creepkit.app.models import model_of
from creepkit.errors import CreepkitError
from creepkit.exporters.documents import expression_mathml, latex_unit, law_equations
from creepkit.exporters.javascript import law_expression
from creepkit.inverse.identification import Identification
from creepkit.inverse.minimum_rates import measured_minimum_rate
from creepkit.inverse.reference_conditions import ISOTHERMAL_RANGE
from creepkit.language.law import CreepLaw
from creepkit.language.printing import LatexLawPrinter, latex_equations
from creepkit.language.symbols import POINT_VARIABLES
from creepkit.records import (
    History,
    LawWithValues,
    Load,
    Output,
    Program,
    Specimen,
    is_logarithmic,
    loads_of,
    outputs_of,
    typical_history,
)
from creepkit.records.loading import held_of

if TYPE_CHECKING:
    from creepkit.arrays import Floats


MOST_FRAMES = 300
"""Frames of a test that a page draws and compares; of a longer one, as many evenly spread over its frames."""


MOST_BREAKPOINTS = 400
"""Rows of a recorded load or temperature that a page has."""


def contents_document(contents: PageContents, models: Collection[str] = ()) -> dict[str, Any]:
    """All that the scripts of a page read. models : names of the models that the page brings along."""

    def with_model(document: dict[str, Any], found: Mapping[str, str]) -> dict[str, Any]:
        return document | {"model": next((name for name in found if name in models), None)}

    specimens = [with_model(specimen_document(one), model_of(one) if models else {}) for one in contents.specimens]
    tests = [
        with_model(test_document(one, contents), model_of(contents.specimen(one.specimen), one) if models else {})
        for one in contents.histories
    ]
    stress = specimens[0]["loads"][0]["stress"]
    laws = [
        law_document(one, usual_end(one, stress, contents.temperature))
        | {"warning": temperature_warning(one.law, contents.histories)}
        for one in contents.laws
    ]
    return {
        "title": contents.title,
        "laws": laws,
        "specimens": specimens,
        "tests": tests,
        "temperature": contents.temperature,
        "same_temperature": ISOTHERMAL_RANGE,
    }


# ---- laws ----------------------------------------------------------------------------------------------------------


def law_document(page_law: PageLaw, end: float) -> dict[str, Any]:
    """A law: equation, parameters, where its sliders start, and what is known of its values.

    end : s, of a first curve.
    """
    law, fit = page_law.law, page_law.fit
    known = law_data(LawWithValues(law, page_law.values) if fit is None else fit)
    return {
        **{name: value for name, value in known.items() if name != "source"},
        # the page's style aligns their columns
        "equations": [re.sub(r' style="[^"]*"', "", equation) for equation in known["equations"]],
        "code": law.fingerprint,  # under which scripts find its JavaScript
        "latex": [f"{left} = {' '.join(right)}" for left, right in latex_equations(law, LatexLawPrinter(law))],
        "weight": page_law.weight,
        "end": end,
        "rate_point": rate_point(fit),
        "covariance": None if fit is None else _covariance(fit),
        "undetermined": [] if fit is None else list(_undetermined(fit)),
        "judged": "" if fit is None else judged_text(fit),
    }


def law_data(source: CreepLaw | Identification | LawWithValues) -> dict[str, Any]:
    """Return a law as a page needs it, in plain JSON values; those of a law alone are the middles of its bounds.

    `source` is a JavaScript expression (see `exporters.javascript.law_expression`). `interval` is that of 95 %,
    `verdict` says whether the tests determine a parameter; both are null without an identification.
    """
    fit = source if isinstance(source, Identification) else None
    law, values = (source, source.center()) if isinstance(source, CreepLaw) else (source.law, dict(source.values))
    return {
        "name": law.name,
        "title": law.title or law.name,
        "equations": [*law_equations(law)],
        "variables": [symbol.name for symbol in POINT_VARIABLES if law.uses(symbol)],
        "parameters": _parameters(law, values, fit),
        "source": law_expression(LawWithValues(law, values)),
    }


def _parameters(law: CreepLaw, values: Mapping[str, float], fit: Identification | None) -> list[dict[str, Any]]:
    estimates = {} if fit is None else {estimate.name: estimate for estimate in fit.estimates}
    rows, latex = [], LatexLawPrinter(law)
    for symbol, param in law.params.items():
        found, unit = estimates.get(symbol.name), "" if param.unit == "1" else param.unit
        rows.append({
            "name": symbol.name,
            "symbol": expression_mathml(symbol),
            "latex": latex.doprint(symbol),
            "latex_unit": latex_unit(unit).strip("$"),
            "title": param.meaning,
            "unit": unit,
            "scale": param.scale,
            "low": param.bounds[0],
            "high": param.bounds[1],
            "off": param.off,
            "value": float(values[symbol.name]),
            "interval": None if found is None else [finite(found.low), finite(found.high)],
            "verdict": None if found is None else found.verdict,
        })  # fmt: skip
    return rows


def judged_text(fit: Identification) -> str:
    """What the identification found of the misfit, which it takes otherwise than the page does; "" for nothing."""
    sentences = []
    if fit.adequacy is not None and fit.adequacy.outputs:
        chi_square, rate = fit.adequacy.chi_square, fit.noise_model.rate
        scatter = f"; these scatter by {100.0 * rate:.2g} %" if rate > 0.0 else ""
        sentences.append(
            f"At its optimum the identification found {np.sqrt(chi_square):.2g} times the noise (reduced chi-square "
            f"{chi_square:.3g}): it counts a rate and an offset of each test's own as scatter between tests{scatter}."
        )
    if fit.numerical_error is not None:
        sentences.append(
            "The identification was corrected for the numerical error of its predictor, up to "
            f"{fit.numerical_error.noises:.2g} times the noise; the curves and misfits here are not."
        )
    return " ".join(sentences)


def rate_point(fit: Identification | None) -> dict[str, Any]:
    """At which strain and time (s) the creep rate is shown, and over which stresses, MPa."""
    if fit is None:
        return {"strain": RATE_STRAIN, "time": RATE_TIME, "stress": [0.1 * USUAL_STRESS, 5.0 * USUAL_STRESS]}
    low, high = fit.ranges["stress"]
    return {"strain": fit.reference.strain, "time": fit.reference.time, "stress": [low / 1.25, high * 1.25]}


def _covariance(fit: Identification) -> list[list[float]] | None:
    """Of the internal values, from which follows what the others are likely to be when one is moved."""
    to_theta = fit.coordinates.jacobian(fit.u)
    covariance = np.asarray(to_theta @ fit.covariance @ to_theta.T)
    return covariance.tolist() if np.isfinite(covariance).all() else None


def _undetermined(fit: Identification) -> Sequence[str]:
    try:
        if fit.adequacy is not None and fit.adequacy.rejects:
            return (f"this law does not fit the tests: it {fit.adequacy}",)
        return fit.undetermined()
    except (CreepkitError, np.linalg.LinAlgError, ValueError):
        return ()


# ---- specimens -----------------------------------------------------------------------------------------------------


def specimen_document(specimen: Specimen) -> dict[str, Any]:
    """A specimen by its record: outputs, loads, whether it needs a modulus, and what predicts it."""
    conditions: Mapping[str, tuple[float, float]] = specimen.conditions
    low, high = conditions.get("modulus", (50e3, 300e3))
    modulus = float(f"{getattr(typical_history(specimen).elastic, 'E', 150e3):.2g}")
    return {
        "name": specimen.name,
        "title": specimen.title,
        "outputs": [
            {"name": str(output), "title": output.long_name, **_shown_unit(output)}
            for output in outputs_of(specimen)
            if output in specimen.outputs
        ],
        "loads": [_load_document(specimen, load, conditions) for load in loads_of(specimen)],
        "modulus": {"needed": "modulus" in conditions, "low": low, "high": high, "value": modulus},
        "runtime": KINDS.get(type(specimen)),
    }


def _shown_unit(output: Output) -> dict[str, Any]:
    """The unit of an output on a page, and how many of it one of creepkit's is."""
    return {"unit": "%", "factor": 100.0} if is_logarithmic(output) else {"unit": output.unit, "factor": 1.0}


def _load_document(specimen: Specimen, load: Load, conditions: Mapping[str, tuple[float, float]]) -> dict[str, Any]:
    plan = typical_history(specimen, load.name)
    value = float(f"{np.max(plan.loading.program().values):.2g}")
    low, high = conditions.get(load.name, (0.1 * value, 10.0 * value))
    return {
        "name": load.name,
        "title": load.long_name,
        "unit": load.unit,
        "low": low,
        "high": high,
        "value": value,
        "ramp": load.ramp,
        "control": load.name == "stress",
        "stress": _reference_stress(specimen, plan),
    }


def _reference_stress(specimen: Specimen, plan: History) -> float:
    """MPa, that stands for a plan."""
    if not specimen.states("reference_stress"):
        return USUAL_STRESS
    try:
        stress = float(np.max(specimen.reference_stress(plan)))
    except (CreepkitError, ValueError):
        return USUAL_STRESS
    return stress if 0.0 < stress < math.inf else USUAL_STRESS


# ---- measured tests ------------------------------------------------------------------------------------------------


def _thinned(rows: Any, most: int) -> Any:
    """Of many rows, as many as are allowed, evenly spread over them; rows : (rows,) indices."""
    if rows.size <= most:
        return rows
    return rows[np.unique(np.linspace(0, rows.size - 1, most).round().astype(int))]


def test_document(history: History, contents: PageContents) -> dict[str, Any]:
    """A measured test: its frames, the noise of each output, and how it was made."""
    frames, temperature = _thinned(np.flatnonzero(history.used), MOST_FRAMES), history.temperature_program()
    specimen: Any = contents.specimen(history.specimen)
    stated = set(specimen.outputs_of_test(history)) if history.outputs else set()
    fits = _test_fits(history, contents)
    return {
        "name": history.name,
        "condition": history.condition,
        "specimen": history.specimen,
        "times": numbers(history.times[frames]),
        "outputs": {str(n): numbers(v[frames]) for n, v in history.outputs.items() if n in stated},
        "noise": {n: v for n in history.outputs if (v := _noise(history, n, contents)) is not None},
        # what was added before creep began, as loading strain is, of the first law's identification
        "offset": {o.output: float(o.offset) for one in fits for o in one.outputs if o.offset},
        "load": history.loading.quantity,
        "control": held_of(history.loading),
        "program": _program_rows(history.loading.program()),
        "temperature": float(np.mean(temperature.values)),
        "temperature_program": _program_rows(temperature),
        "modulus": None if history.elastic is None else finite(history.elastic.at(history.mean_temperature).E),
        "minimum_rate": _minimum_rate(history),
        "note": "; ".join(_test_notes(history, contents)),
        "includes_elastic": history.includes_elastic,
        "measure": history.strain_measure,
    }


def _minimum_rate(history: History) -> float | None:
    """1/s, that a test states or its strain shows; None where neither does."""
    if history.minimum_rate is not None:
        return history.minimum_rate
    return finite(measured_minimum_rate(history)) if history.used.any() else None


def _test_notes(history: History, contents: PageContents) -> list[str]:
    """Why a test has no misfit, and that the first law was identified without it."""
    without = contents.laws[0].fit is not None and not _test_fits(history, contents)
    notes = ["no misfit: all of its frames are excluded"] if history.outputs and not history.used.any() else []
    return [*notes, *(["the law was identified without this test"] if without else [])]


def _program_rows(program: Program) -> list[list[float | None]]:
    """Times and values of a program."""
    kept = _thinned(np.arange(program.times.size), MOST_BREAKPOINTS)
    return [numbers(program.times[kept]), numbers(program.values[kept])]


def _noise(history: History, output: str, contents: PageContents) -> float | None:
    """Standard deviation of a frame in the unit of the output: stated, else estimated by the fit, else the record's.

    None where the fit says that its noise is not known well enough to judge a law by it.
    """
    stated = history.standard_deviation.get(output)
    if stated is not None and np.isfinite(stated).any() and float(np.nanmedian(stated)) > 0.0:
        return float(np.nanmedian(stated))
    fit = contents.laws[0].fit
    if fit is not None and fit.adequacy is not None and not fit.adequacy.judges(output):
        return None
    fitted = [o.noise for one in _test_fits(history, contents) for o in one.outputs if o.output == output]
    estimated = next((float(noise) for noise in fitted if 0.0 < noise < math.inf), None)
    usual = next((known.noise for known in outputs_of(contents.specimen(history.specimen)) if known == output), None)
    return usual if estimated is None else estimated


def _test_fits(history: History, contents: PageContents) -> list[Any]:
    fit = contents.laws[0].fit
    return [] if fit is None else [one for one in fit.tests if one.name == history.name]


# ---- numbers -------------------------------------------------------------------------------------------------------


def numbers(values: Floats) -> list[float | None]:
    """Numbers to six digits, which is finer than a screen; None in the place of those that are not finite.

    values : (...,), returned one after another.
    """
    return [float(f"{value:.6g}") if math.isfinite(value) else None for value in np.ravel(values).tolist()]


def finite(value: Any) -> float | None:
    """The number, or None where it is none or not finite."""
    return float(value) if isinstance(value, int | float | np.floating) and math.isfinite(value) else None
