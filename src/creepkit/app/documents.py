"""The contents of a page as one JSON document, which its scripts read: laws, specimens and tests in plain numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.app.contents import (
    RATE_STRAIN,
    RATE_TIME,
    SAME_TEMPERATURE,
    USUAL_STRESS,
    PageContents,
    PageLaw,
    specimen_name,
    temperature_warning,
    usual_end,
)
from creepkit.app.model_data import law_data
from creepkit.app.page_models import model_of, network_of
from creepkit.errors import CreepkitError
from creepkit.exporters.latex import latex_unit
from creepkit.inverse.measured_minimum_rates import measured_minimum_rate
from creepkit.language.printing import LatexLawPrinter, latex_equations
from creepkit.records import (
    History,
    LawWithValues,
    Load,
    Program,
    Specimen,
    dimensions_of,
    loads_of,
    outputs_of,
    outputs_of_test,
    typical_history,
)
from creepkit.records.interfaces import SupportsReducedOrderModel
from creepkit.specimens.bulge.specimen import Bulge
from creepkit.specimens.relaxation import Relaxation
from creepkit.specimens.run import Runnable
from creepkit.specimens.uniaxial import Uniaxial

if TYPE_CHECKING:
    from creepkit.arrays import Floats
    from creepkit.inverse.identification import Identification


MOST_FRAMES = 300
"""Frames of a test that a page draws and compares; of a longer one, as many evenly spread over its frames."""


MOST_BREAKPOINTS = 400
"""Rows of a recorded load or temperature that a page has."""


def contents_document(contents: PageContents, models: Collection[str] = ()) -> dict[str, Any]:
    """All that the scripts of a page read, but for what answers them.

    models : names of the reduced-order models that the page brings along, of one that no server answers.
    """

    def with_model(document: dict[str, Any], specimen: Specimen, history: History | None = None) -> dict[str, Any]:
        own = [name for name in (model_of(specimen, history) if models else ()) if name in models]
        return {**document, "model": own[0] if own else None}

    networks = [name for name in network_of(contents) if name in models]
    specimens = [
        with_model(specimen_document(one), one)
        | {"network": networks[0] if networks and specimen_name(contents.surrogate) == one.name else None}
        for one in contents.specimens
    ]
    stress = specimens[0]["loads"][0]["stress"]
    return {
        "title": contents.title,
        "laws": [
            law_document(one, usual_end(one, stress, contents.temperature))
            | {"warning": temperature_warning(one.law, contents.histories)}
            for one in contents.laws
        ],
        "specimens": specimens,
        "tests": [
            with_model(test_document(one, contents), contents.specimen(one.specimen), one) for one in contents.histories
        ],
        "temperature": contents.temperature,
        "same_temperature": SAME_TEMPERATURE,
    }


# ---- laws ----------------------------------------------------------------------------------------------------------


def law_document(page_law: PageLaw, end: float) -> dict[str, Any]:
    """A law: equation, parameters, where its sliders start, and what is known of its values.

    end : s, of a first curve.
    """
    law, latex = page_law.law, LatexLawPrinter(page_law.law)
    known = law_data(LawWithValues(law, page_law.values) if page_law.fit is None else page_law.fit)
    for symbol, row in zip(law.params, known["parameters"], strict=True):
        row |= {"latex": latex.doprint(symbol), "latex_unit": latex_unit(row["unit"]).strip("$")}
    return {
        **{name: value for name, value in known.items() if name != "source"},
        # the page's style aligns their columns, for the policy of the server allows no other
        "equations": [re.sub(r' style="[^"]*"', "", equation) for equation in known["equations"]],
        "code": law_code_name(page_law),
        "latex": [f"{left} = {' '.join(right)}" for left, right in latex_equations(law, latex)],
        "weight": page_law.weight,
        "end": end,
        "rate_point": rate_point(page_law.fit),
        "covariance": None if page_law.fit is None else _covariance(page_law.fit),
        "undetermined": [] if page_law.fit is None else list(_undetermined(page_law.fit)),
        "judged": "" if page_law.fit is None else judged_text(page_law.fit),
    }


def judged_text(fit: Identification) -> str:
    """What the identification found of the misfit, which it takes otherwise than the page does; "" for nothing."""
    return " ".join(filter(None, (_misfit_at_optimum(fit), _numerical_error(fit))))


def _numerical_error(fit: Identification) -> str:
    """That curves of the page have an error of which the identification took account; "" where it found none."""
    error = fit.numerical_error
    if error is None:
        return ""
    return (
        f"The identification was corrected for the numerical error of its predictor, up to {error.noises:.2g} times "
        "the noise; the curves and misfits here are not."
    )


def _misfit_at_optimum(fit: Identification) -> str:
    scatter = f"; these scatter by {100.0 * fit.noise_model.rate:.2g} %" if fit.noise_model.rate > 0.0 else ""
    if fit.adequacy is None or not fit.adequacy.outputs:
        return ""
    chi_square = fit.adequacy.chi_square
    return (
        f"At its optimum the identification found {np.sqrt(chi_square):.2g} times the noise (reduced chi-square "
        f"{chi_square:.3g}): it counts a rate and an offset of each test's own as scatter between tests{scatter}."
    )


def law_code_name(page_law: PageLaw) -> str:
    """The name under which the scripts of a page find the law as JavaScript."""
    return page_law.law.fingerprint


def rate_point(fit: Identification | None) -> dict[str, Any]:
    """At which strain and time (s) the creep rate is shown, and over which stresses, MPa."""
    if fit is None:
        return {"strain": RATE_STRAIN, "time": RATE_TIME, "stress": [0.1 * USUAL_STRESS, 5.0 * USUAL_STRESS]}
    low, high = fit.ranges["stress"]
    reference = fit.reference
    return {"strain": reference.strain, "time": reference.time, "stress": [low / 2.0, high * 2.0]}


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
    """A specimen by its record: outputs, loads, lengths, and whether it needs a modulus or has a section to draw."""
    conditions: Mapping[str, tuple[float, float]] = getattr(specimen, "conditions", None) or {}
    elastic = typical_history(specimen).elastic
    low, high = conditions.get("modulus", (50e3, 300e3))
    return {
        "name": specimen.name,
        "title": specimen.title,
        "outputs": [
            {
                "name": str(output),
                "title": output.long_name,
                "unit": output.unit,
                "logarithmic": output.logarithmic,
                "grows": output.grows,
                "noise": output.noise,
            }
            for output in outputs_of(specimen)
            if output in specimen.outputs
        ],
        "loads": [_load_document(specimen, load, conditions) for load in loads_of(specimen)],
        "dimensions": [
            {"name": d.name, "title": d.long_name, "value": d.default, "low": d.bounds[0], "high": d.bounds[1]}
            for d in dimensions_of(specimen)
            if d.of_piece
        ],
        "modulus": {
            "needed": "modulus" in conditions,
            "low": low,
            "high": high,
            "value": float(f"{getattr(elastic, 'E', 150e3):.2g}"),
        },
        "runtime": runtime_of(specimen),
        "reduced": isinstance(specimen, SupportsReducedOrderModel),
        "runs": isinstance(specimen, Runnable),
    }


def runtime_of(specimen: Specimen) -> str | None:
    """Which function of the runtime predicts a specimen in a page that stands alone; None where none does."""
    kinds: dict[type[object], str] = {Uniaxial: "creep", Relaxation: "relaxation", Bulge: "dimple"}
    return kinds.get(type(specimen))


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


def _reference_stress(specimen: Any, plan: History) -> float:
    """MPa, that stands for a plan."""
    try:
        stress = float(np.max(specimen.reference_stress(plan)))
    except (CreepkitError, AttributeError, ValueError):
        return USUAL_STRESS
    return stress if 0.0 < stress < math.inf else USUAL_STRESS


# ---- measured tests ------------------------------------------------------------------------------------------------


def compared_frames(history: History) -> Any:
    """(frames,) indices of the used frames that a page shows."""
    used = np.flatnonzero(history.used)
    if used.size > MOST_FRAMES:
        used = used[np.unique(np.linspace(0, used.size - 1, MOST_FRAMES).round().astype(int))]
    return used


def test_document(history: History, contents: PageContents) -> dict[str, Any]:
    """A measured test: its frames, the noise of each output, and how it was made."""
    frames = compared_frames(history)
    program, temperature = history.loading.program(), history.temperature_program()
    specimen: Any = contents.specimen(history.specimen)
    stated = set(outputs_of_test(specimen, history)) if history.outputs else set()
    return {
        "name": history.name,
        "condition": history.condition,
        "specimen": history.specimen,
        "times": numbers(history.times[frames]),
        "outputs": {str(n): numbers(v[frames]) for n, v in history.outputs.items() if n in stated},
        "noise": {n: v for n in history.outputs if (v := _noise(history, n, contents)) is not None},
        "offset": _offsets(history, contents),
        "load": history.loading.quantity,
        "control": getattr(history.loading, "control", "load"),
        "program": _thinned(program),
        "temperature": float(np.mean(temperature.values)),
        "temperature_program": _thinned(temperature),
        "modulus": None if history.elastic is None else finite(history.elastic.at(history.mean_temperature).E),
        "lengths": {name: float(value) for name, value in history.geometry.items()},
        "nuisances": _has_nuisances(history, contents),
        "minimum_rate": _minimum_rate(history),
        "note": "; ".join(_test_notes(history, contents)),
        "rupture_time": history.rupture_time,
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


def _thinned(program: Program) -> list[list[float | None]]:
    """Times and values of a program; of a recorded one of many rows, as many evenly spread over them."""
    kept = np.arange(program.times.size)
    if kept.size > MOST_BREAKPOINTS:
        kept = np.unique(np.linspace(0, kept.size - 1, MOST_BREAKPOINTS).round().astype(int))
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
    for one in _test_fits(history, contents):
        for fitted in one.outputs:
            if fitted.output == output and 0.0 < fitted.noise < math.inf:
                return float(fitted.noise)
    for known in outputs_of(contents.specimen(history.specimen)):
        if known == output:
            return known.noise
    return None


def _offsets(history: History, contents: PageContents) -> dict[str, float]:
    """{output: what was added to it before creep began, as loading strain is}, of the first law's identification."""
    return {o.output: float(o.offset) for one in _test_fits(history, contents) for o in one.outputs if o.offset}


def _has_nuisances(history: History, contents: PageContents) -> bool:
    """Whether a law on the page was identified with nuisances that change the simulation of a test."""
    fits = [one.fit for one in contents.laws if one.fit is not None]
    return any(np.any(values != 0.0) for fit in fits for values in fit.nuisance_values([history]).values())


def _test_fits(history: History, contents: PageContents) -> list[Any]:
    fit = contents.laws[0].fit
    return [] if fit is None else [one for one in fit.tests if one.name == history.name]


# ---- numbers -------------------------------------------------------------------------------------------------------


def numbers(values: Floats) -> list[float | None]:
    """Numbers to six digits, which is finer than a screen; None in the place of those that are not finite.

    values : (...,), returned one after another.
    """
    given = np.asarray(values, float).ravel()
    with np.errstate(all="ignore"):
        scale = 10.0 ** (5.0 - np.floor(np.log10(np.abs(given))))
        rounded = np.round(given * scale) / scale
    rounded = np.where(np.isfinite(rounded), rounded, given)
    if np.isfinite(rounded).all():
        return list(rounded.tolist())
    return [value if math.isfinite(value) else None for value in rounded.tolist()]


def finite(value: Any) -> float | None:
    """The number, or None where it is none or not finite."""
    return float(value) if isinstance(value, int | float | np.floating) and math.isfinite(value) else None
