"""Simulation of single tests, and the quality of measured data."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated

import numpy as np

from creepkit.arrays import ArrayLike
from creepkit.checked_arguments import checked
from creepkit.errors import SolveError
from creepkit.language import symbols
from creepkit.records import History, LawWithValues, Loading, Predictor, Program, Status, call_of_plugin
from creepkit.records.units import ROOM_TEMPERATURE
from creepkit.registry import resolve_law
from creepkit.registry.arguments import resolve_predictor
from creepkit.specimens.run import Run, run_from_outputs, unusual_values, with_explanation

if TYPE_CHECKING:
    from creepkit.language import CreepLaw, Elastic


@checked
def simulate(
    law: CreepLaw | str,
    using: Predictor | str,
    values: Mapping[str, float],
    *,
    loading: Annotated[Loading, "a loading such as constant_stress(50) or PressureJump(P1=8, P2=10, Tj=14400)"],
    times: ArrayLike,
    temperature: float | Program | None = None,
    elastic: Elastic | None = None,
    name: str = "simulated",
) -> Run:
    """Return the history that a law with these values predicts: what a perfect test would have measured.

    using : a specimen, a surrogate or a closed form; values : {parameter or condition: value} in the law's units.
    loading : holds its last value beyond its last breakpoint. times : (frames,) s; temperature : K.
    elastic : E in MPa; a bulge test needs it, and a uniaxial strain then includes the elastic part.

    A test that bursts, meets its limit load or loses convergence is a result too: the history ends there, and says so
    in `status`, `end_time` and `reason`. A specimen may return more, such as the stresses of a BulgeRun.
    """
    valued = LawWithValues(resolve_law(law), values)
    law, values, using = valued.law, valued.values, resolve_predictor(using)
    if temperature is None and law.uses(symbols.temperature):
        raise SolveError(f"law '{law.name}' depends on temperature: give temperature= in K")
    if lacking := ", ".join(f"{one.name} in {one.unit}" for one in law.conditions):
        raise SolveError(f"law '{law.name}' needs a value for {lacking} as well")
    planned_test = History(
        name=name,
        times=np.atleast_1d(np.asarray(times, float)),
        outputs={},
        loading=loading,
        temperature=ROOM_TEMPERATURE if temperature is None else temperature,
        specimen=using.specimen.name or "uniaxial",
        elastic=elastic,
        includes_elastic=elastic is not None and loading.quantity == "stress",
        source=f"simulation of law '{law.name}'",
    )
    explanation = unusual_values(law, values, elastic)
    try:
        return with_explanation(_simulated(law, using, values, planned_test), explanation)
    except SolveError as error:
        if not explanation:
            raise
        raise SolveError(f"{error}{explanation}") from error


def _simulated(law: CreepLaw, using: Predictor, values: Mapping[str, float], planned_test: History) -> Run:
    run: Run | None = call_of_plugin(
        lambda: using.run(law, values, planned_test), using, f"specimen '{using.label}': run()", SolveError
    )
    if run is not None:
        return run
    prediction = using.predict(law, law.to_internal(values), [planned_test])
    status, end = Status(int(prediction.status[0, 0])), float(prediction.end_times[0, 0])
    return run_from_outputs(Run, planned_test, prediction.outputs, prediction.of(0), status, end, prediction.reason)
