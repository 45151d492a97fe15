"""Simulation and identification."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from creepkit.errors import FitError, SolveError
from creepkit.language import symbols
from creepkit.records import History, Loading, Nuisance, Predictor, Program, Status
from creepkit.specimens.run import Run, Runnable, run_of
from creepkit.study.nouns import histories_given, law_given, predictor_given, predictors_given, specimens_of

if TYPE_CHECKING:
    from creepkit.arrays import ArrayLike
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.moduli import Moduli
    from creepkit.inverse.selection import Ranking
    from creepkit.language import CreepLaw, Elastic

ROOM_TEMPERATURE = 293.15
"""K; stands where a law does not ask for a temperature."""


def simulate(
    law: CreepLaw | str,
    using: Predictor | str,
    values: Mapping[str, float],
    *,
    loading: Loading,
    times: ArrayLike,
    temperature: float | Program | None = None,
    elastic: Elastic | None = None,
    name: str = "simulated",
) -> Run:
    """Return the history that a law with these values predicts: what a perfect test would have measured.

    using : a specimen, a surrogate or a closed form; values : {parameter: value} in the law's units.
    loading : holds its last value beyond its last breakpoint. times : (frames,) s; temperature : K.
    elastic : E in MPa; a bulge test needs it, and a uniaxial strain then includes the elastic part.

    A test that bursts, meets its limit load or loses convergence is an answer too: the history ends there, and says so
    in `status`, `end_time` and `reason`. A specimen may return more, such as the stresses of a BulgeRun.
    """
    law, using = law_given(law), predictor_given(using)
    if not hasattr(loading, "program"):
        raise SolveError(f"loading is {loading!r}; write constant_stress(50) or PressureJump(P1=8, P2=10, Tj=14400)")
    if temperature is None and law.uses(symbols.temperature):
        raise SolveError(f"law '{law.name}' depends on temperature: give temperature= in K")
    plan = History(
        name=name,
        times=np.atleast_1d(np.asarray(times, float)),
        outputs={},
        loading=loading,
        temperature=ROOM_TEMPERATURE if temperature is None else temperature,
        specimen=getattr(getattr(using, "specimen", using), "name", "uniaxial"),
        elastic=elastic,
        includes_elastic=elastic is not None and loading.quantity == "stress",
        source=f"simulation of law '{law.name}'",
    )
    values = law.values(values)
    if isinstance(using, Runnable):
        return using.run(law, values, plan)
    found = using.predict(law, values, [plan])
    status, end = Status(int(found.status[0, 0])), float(found.end_times[0, 0])
    return run_of(Run, plan, found.outputs, found.of(0), status, end)


def identify(
    law: CreepLaw | str,
    histories: Sequence[History],
    using: Predictor | str | Mapping[str, Predictor | str] | None = None,
    *,
    nuisances: Sequence[Nuisance] | None = None,
    weights: Literal["noise"] | Mapping[str, float] = "noise",
    starts: int = 8,
    frames: int = 40,
    seed: int = 0,
    loss: str = "linear",
    test_loss: str = "gaussian",
    progress: Callable[[str, int, int], None] | None = None,
) -> Identification:
    """Identify the parameters of a law from all histories at once, with 95 % intervals.

    law : a law or its name; using : a specimen (or its name) or any predictor, or {specimen: predictor}; by default
        what the histories name.
    nuisances : what differs between tests; by default an offset of each output and test-to-test scatter of the rate.
    weights : "noise", or {output: weight} of relative squared errors, such as {"amplitude": 0.99, "width": 0.005,
        "shape": 0.005} of the paper's loss.
    starts, seed : of the search, which includes the centre of the bounds; frames : looked at in each history.
    loss : of frames: "linear", or a robust loss of scipy's least_squares such as "soft_l1" (for the values; intervals
        stay Gaussian); test_loss : of whole tests: "gaussian", or "student", with which a test far from the others
        loses its pull.
    """
    from creepkit.inverse.identification import Settings
    from creepkit.inverse.identify import identify as run

    histories = histories_given(histories)
    settings = Settings(
        starts=starts, draws=_draws(starts), frames=frames, seed=seed, loss=loss, test_loss=test_loss, weights=weights
    )
    if nuisances is not None:
        settings = replace(settings, nuisances=tuple(nuisances))
    chosen = specimens_of(histories) if using is None else predictors_given(using)
    return run(law_given(law), histories, chosen, settings=settings, progress=progress)


def moduli(
    law: CreepLaw | str, histories: Sequence[History], using: Predictor | str | None = None, *, frames: int = 15
) -> Moduli:
    """Identify each bulge test's Young's modulus from its first frames, and Wachtman's form through them.

    law : what creeps meanwhile, with its temperature; frames : used frames looked at, the paper's 15 by default.
    `[h.replace(elastic=found.elastic) for h in histories]` then fixes the moduli.
    """
    from creepkit.inverse.moduli import identify_moduli as run

    histories = histories_given(histories)
    chosen = predictors_given(using) if using is not None else specimens_of(histories)
    if isinstance(chosen, Mapping):
        raise FitError("moduli are identified from tests of one specimen; give those alone, and using= that one")
    return run(law_given(law), histories, chosen, frames=frames)


def rank(fits: Sequence[Identification]) -> Ranking:
    """Rank identifications of the same histories by BIC, with weights and a verdict."""
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.selection import rank as run

    if isinstance(fits, Identification):
        raise FitError("rank() takes a list of identifications, found a single one")
    return run(list(fits))


def _draws(starts: int) -> int:
    """Sobol points to screen for so many starts: eight each, a power of two, and at least 64."""
    return max(64, 1 << (8 * max(int(starts), 1) - 1).bit_length())
