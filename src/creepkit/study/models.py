"""Simulation and identification."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from creepkit.errors import FitError, SolveError
from creepkit.language import symbols
from creepkit.records import History, Loading, Nuisance, Predictor, Program, Status
from creepkit.specimens.run import Run, Runnable, run_from_outputs
from creepkit.study.nouns import check_histories, resolve_law, resolve_predictor, resolve_predictors, specimens_of_histories

if TYPE_CHECKING:
    from creepkit.arrays import ArrayLike
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.moduli import ModulusEstimates
    from creepkit.inverse.search.landscape import GlobalSearch
    from creepkit.inverse.selection import Ranking
    from creepkit.inverse.settings import OutputWeights
    from creepkit.inverse.sparsity.penalties import ContributionPenalty, Subsets
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
    law, using = resolve_law(law), resolve_predictor(using)
    if not hasattr(loading, "program"):
        raise SolveError(f"loading is {loading!r}; write constant_stress(50) or PressureJump(P1=8, P2=10, Tj=14400)")
    if temperature is None and law.uses(symbols.temperature):
        raise SolveError(f"law '{law.name}' depends on temperature: give temperature= in K")
    planned_test = History(
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
        return using.run(law, values, planned_test)
    prediction = using.predict(law, values, [planned_test])
    status, end = Status(int(prediction.status[0, 0])), float(prediction.end_times[0, 0])
    return run_from_outputs(Run, planned_test, prediction.outputs, prediction.of(0), status, end)


def identify(
    law: CreepLaw | str,
    histories: Sequence[History],
    using: Predictor | str | Mapping[str, Predictor | str] | None = None,
    *,
    nuisances: Sequence[Nuisance] | None = None,
    weights: OutputWeights = "noise",
    search: GlobalSearch | None = None,
    penalty: ContributionPenalty | Subsets | None = None,
    through: Predictor | Literal["auto"] | None = "auto",
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
    weights : what is minimised. "noise": least squares of frames, intervals from all the scatter found; "likelihood":
        noise and autocorrelation of every output in values, intervals and ranking alike; "equal": Eq. (4) of the
        paper; "paper": its Eq. (S3), .99 on D_amp; or {output: weight} of relative squared errors.
    search : how to begin: by default least squares from screened starts; ParticleSwarm() as in the paper, CmaEs().
    penalty : on the contributions of a sum's terms, such as L2(), GroupL2(), Sqrt() or Subsets(): those that are left
        out stand in the answer's `sparsity`, and the law of the answer is what remains.
    through : a surrogate in which the search's minima are refined before `using` (finite elements) has its last word;
        "auto" takes the one that comes with creepkit where it is of this specimen.
    starts, seed : of the search, which includes the centre of the bounds; frames : looked at in each history.
    loss : of frames: "linear", or a robust loss of scipy's least_squares such as "soft_l1" (for the values; intervals
        stay Gaussian); test_loss : of whole tests: "gaussian", or "student", with which a test far from the others
        loses its pull.
    """
    from creepkit.inverse.identification import IdentificationSettings
    from creepkit.inverse.identify import identify as run

    histories = check_histories(histories)
    settings = IdentificationSettings(
        starts=starts, sobol_points=_sobol_draws(starts), frames=frames, seed=seed, loss=loss, test_loss=test_loss, weights=weights
    )
    if nuisances is not None:
        settings = replace(settings, nuisances=tuple(nuisances))
    predictor = specimens_of_histories(histories) if using is None else resolve_predictors(using)
    surrogate_predictor = _resolve_surrogate(through, predictor, histories)
    if penalty is not None:
        from creepkit.inverse.sparsity.sparse import identify_sparse

        return identify_sparse(
            resolve_law(law), histories, predictor, penalty=penalty, search=search, through=surrogate_predictor, settings=settings,
            progress=progress,
        )  # fmt: skip
    return run(
        resolve_law(law), histories, predictor, settings=settings, search=search, through=surrogate_predictor, progress=progress
    )


def moduli(
    law: CreepLaw | str, histories: Sequence[History], using: Predictor | str | None = None, *, frames: int = 15
) -> ModulusEstimates:
    """Identify each bulge test's Young's modulus from its first frames, and Wachtman's form through them.

    law : what creeps meanwhile, with its temperature; frames : used frames looked at, the paper's 15 by default.
    `[h.replace(elastic=found.elastic) for h in histories]` then fixes the moduli.
    """
    from creepkit.inverse.moduli import identify_moduli as run

    histories = check_histories(histories)
    predictor = resolve_predictors(using) if using is not None else specimens_of_histories(histories)
    if isinstance(predictor, Mapping):
        raise FitError("moduli are identified from tests of one specimen; give those alone, and using= that one")
    return run(resolve_law(law), histories, predictor, frames=frames)


def select(
    laws: Sequence[CreepLaw | str],
    histories: Sequence[History],
    using: Predictor | str | Mapping[str, Predictor | str] | None = None,
    *,
    nuisances: Sequence[Nuisance] | None = None,
    through: Predictor | Literal["auto"] | None = "auto",
    sums: bool | None = False,
    by: Literal["bic", "aicc", "hold-out"] = "bic",
    starts: int = 8,
    frames: int = 60,
    seed: int = 0,
    progress: Callable[[str, int, int], None] | None = None,
) -> Ranking:
    """Identify several laws from the same histories by likelihood, and say which of them the histories speak for.

    laws : candidates; sums : also sums of two of them (None: where no single law goes down to the noise).
    by : the criterion; the answer is a set of laws with weights, "decisive" only above .95.
    nuisances, through, starts, frames, seed : as for identify().
    """
    from creepkit.inverse.identification import IdentificationSettings
    from creepkit.inverse.selection.select import select as run

    histories = check_histories(histories)
    settings = IdentificationSettings(starts=starts, sobol_points=_sobol_draws(starts), frames=frames, seed=seed)
    if nuisances is not None:
        settings = replace(settings, nuisances=tuple(nuisances))
    predictor = specimens_of_histories(histories) if using is None else resolve_predictors(using)
    candidates = [resolve_law(law) for law in laws]
    return run(
        candidates,
        histories,
        predictor,
        settings=settings,
        through=_resolve_surrogate(through, predictor, histories),
        sums=sums,
        by=by,
        progress=progress,
    )


def rank(fits: Sequence[Identification]) -> Ranking:
    """Rank identifications of the same histories by BIC, with weights and a verdict."""
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.selection import rank as run

    if isinstance(fits, Identification):
        raise FitError("rank() takes a list of identifications, found a single one")
    return run(list(fits))


def _resolve_surrogate(
    requested: Predictor | Literal["auto"] | None, predictor: Predictor | Mapping[str, Predictor], histories: Sequence[History]
) -> Predictor | None:
    """What was asked for; or the shipped surrogate, where it stands for this very specimen and these histories."""
    if not isinstance(requested, str):
        return requested
    if isinstance(predictor, Mapping) or getattr(predictor, "name", "") != "bulge":
        return None
    from creepkit.study.networks import surrogate

    model = surrogate("dimple")
    return model if model.applies_to(predictor, histories) else None


def _sobol_draws(starts: int) -> int:
    """Sobol points to screen for so many starts: eight each, a power of two, and at least 64."""
    return max(64, 1 << (8 * max(int(starts), 1) - 1).bit_length())
