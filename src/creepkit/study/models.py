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
    from creepkit.inverse.search.landscape import Search
    from creepkit.inverse.selection import Ranking
    from creepkit.inverse.settings import Weights
    from creepkit.inverse.sparsity.penalties import Penalty, Subsets
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
    weights: Weights = "noise",
    search: Search | None = None,
    penalty: Penalty | Subsets | None = None,
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
    from creepkit.inverse.identification import Settings
    from creepkit.inverse.identify import identify as run

    histories = histories_given(histories)
    settings = Settings(
        starts=starts, draws=_draws(starts), frames=frames, seed=seed, loss=loss, test_loss=test_loss, weights=weights
    )
    if nuisances is not None:
        settings = replace(settings, nuisances=tuple(nuisances))
    chosen = specimens_of(histories) if using is None else predictors_given(using)
    on_the_way = _through(through, chosen, histories)
    if penalty is not None:
        from creepkit.inverse.sparsity.sparse import sparse

        return sparse(
            law_given(law), histories, chosen, penalty=penalty, search=search, through=on_the_way, settings=settings,
            progress=progress,
        )  # fmt: skip
    return run(
        law_given(law), histories, chosen, settings=settings, search=search, through=on_the_way, progress=progress
    )


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
    from creepkit.inverse.identification import Settings
    from creepkit.inverse.selection.select import select as run

    histories = histories_given(histories)
    settings = Settings(starts=starts, draws=_draws(starts), frames=frames, seed=seed)
    if nuisances is not None:
        settings = replace(settings, nuisances=tuple(nuisances))
    chosen = specimens_of(histories) if using is None else predictors_given(using)
    candidates = [law_given(law) for law in laws]
    return run(
        candidates,
        histories,
        chosen,
        settings=settings,
        through=_through(through, chosen, histories),
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


def _through(
    asked: Predictor | Literal["auto"] | None, using: Predictor | Mapping[str, Predictor], histories: Sequence[History]
) -> Predictor | None:
    """What was asked for; or the shipped surrogate, where it stands for this very specimen and these histories."""
    if not isinstance(asked, str):
        return asked
    if isinstance(using, Mapping) or getattr(using, "name", "") != "bulge":
        return None
    from creepkit.study.networks import surrogate

    model = surrogate("dimple")
    return model if model.stands_for(using, histories) else None


def _draws(starts: int) -> int:
    """Sobol points to screen for so many starts: eight each, a power of two, and at least 64."""
    return max(64, 1 << (8 * max(int(starts), 1) - 1).bit_length())
