"""Simulation of single tests and of data sets, training of surrogates, and the quality of measured data."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.arrays import ArrayLike
from creepkit.checked_arguments import checked, checked_with_own_words
from creepkit.errors import DatasetError, SolveError, SurrogateError
from creepkit.jobs.shard_progress import ProgressCallback
from creepkit.language import symbols
from creepkit.records import History, Loading, Predictor, Program, Specimen, Status, call_of_plugin, predict_with
from creepkit.registry import resolve_law
from creepkit.registry.arguments import check_histories, resolve_predictor
from creepkit.sampling.domains import SamplingDesign
from creepkit.specimens.run import Run, Runnable, run_from_outputs, unusual_values, with_explanation
from creepkit.surrogates.surrogate import Recipe

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset
    from creepkit.jobs.worker_pools import ParallelExecution
    from creepkit.language import CreepLaw, Elastic
    from creepkit.quality import DataQuality
    from creepkit.surrogates.recipe import Training
    from creepkit.surrogates.surrogate import Surrogate


ROOM_TEMPERATURE = 293.15
"""K; stands where a law does not ask for a temperature."""


@checked_with_own_words("values", "loading")
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

    A test that bursts, meets its limit load or loses convergence is a result too: the history ends there, and says so
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
    explanation = unusual_values(law, values, elastic)
    try:
        return with_explanation(_simulated(law, using, values, planned_test), explanation)
    except SolveError as error:
        if not explanation:
            raise
        raise SolveError(f"{error}{explanation}") from error


def _simulated(law: CreepLaw, using: Predictor, values: Mapping[str, float], planned_test: History) -> Run:
    if isinstance(using, Runnable):
        runnable = using
        return call_of_plugin(
            lambda: runnable.run(law, values, planned_test),
            using,
            f"specimen '{getattr(using, 'name', type(using).__name__)}': run()",
            SolveError,
        )
    theta = law.to_internal(values)
    prediction = predict_with(using, law, theta, [planned_test])
    status, end = Status(int(prediction.status[0, 0])), float(prediction.end_times[0, 0])
    return run_from_outputs(Run, planned_test, prediction.outputs, prediction.of(0), status, end, prediction.reason)


@checked
def check_data_quality(
    histories: Sequence[History], specimen: Predictor | str | None = None, *, activation_energy: float | None = None
) -> DataQuality:
    """Return what looks wrong: frames, tests far from others, and what happened in several tests at one time.

    specimen : what the first frames are compared with, which should show its elastic deflection; without it, none.
    activation_energy : J/mol, with which a factor on the creep rate is put as a step of temperature; 400e3 by default.
    """
    from creepkit.quality import ACTIVATION_ENERGY
    from creepkit.quality import check_data_quality as run

    predictor = None if specimen is None else resolve_predictor(specimen)
    energy = ACTIVATION_ENERGY if activation_energy is None else activation_energy
    return run(check_histories(histories), predictor, activation_energy=energy)


@checked
def exclude_suspect_frames(histories: Sequence[History], kinds: Collection[str] | None = None) -> list[History]:
    """Return the histories with suspect frames unused and a label that says which; whole tests stay.

    kinds : of "unloading", "falling" and "outlier"; all of them by default.
    """
    from creepkit.quality import FRAME_FLAG_KINDS
    from creepkit.quality import exclude_suspect_frames as run

    return run(check_histories(histories), FRAME_FLAG_KINDS if kinds is None else kinds)


@checked
def generate(
    source: SamplingDesign | CreepLaw | str,
    using: Specimen | str,
    samples: int | None = None,
    *,
    seed: int,
    to: str | Path,
    draws: int | None = None,
    execution: ParallelExecution | None = None,
    progress: ProgressCallback | None = None,
    **design: Any,
) -> Dataset:
    """Simulate samples until so many are accepted, write them to an HDF5 file, and return them.

    source : a law or its name, or a design. Samples of a law are drawn from a sampling domain,
        domain="conditioned" (the default, where most creep visibly) or "paper"; `design` says this and what else is
        to differ from it: ranges of conditions in MPa, s, mm and K, as in P1=(5, 20), and the s between frames, as in
        every=900.
    samples : accepted ones wanted; whole shards are made, of 256 draws or as many as are wanted where these are fewer,
        so that there may be some more. Or draws : how many are simulated or rejected, whatever becomes of them.
    to : the file; its shards lie in a folder beside it. A call that was interrupted is made again to go on.
    execution : processes or a cluster, and the part of the shards to do; by default one process for each core.
    progress : called as progress(task, done, total, note).
    """
    from creepkit.dataset.generation import generate as run

    specimen: Any = resolve_predictor(using)
    chosen = resolve_design(source, specimen, **design)
    return run(chosen, specimen, samples=samples, draws=draws, seed=seed, to=to, execution=execution, progress=progress)


def resolve_design(source: SamplingDesign | CreepLaw | str, specimen: Specimen, **changes: Any) -> SamplingDesign:
    """The design itself, or the one for a law in a sampling domain.

    changes : `domain`, `every`, `grid` and ranges of conditions, as sampling.domains.sampling_design takes them.
    """
    from creepkit.sampling.domains import SamplingDesign, sampling_design

    if not isinstance(source, SamplingDesign):
        return sampling_design(resolve_law(source), specimen, **changes)
    if changes:
        argument = next(iter(changes))
        raise DatasetError(f"{argument}= belongs to a law; a design such as {source.name} has its own, change it there")
    return source


@checked_with_own_words("recipe", "data")
def train(
    data: Dataset | str | Path,
    recipe: Recipe,
    *,
    to: str | Path | None = None,
    seed: int = 0,
    training: Training | None = None,
    device: str = "auto",
    progress: ProgressCallback | None = None,
) -> Surrogate:
    """Train a network on a data set, or its file, and return it as a predictor: identify(..., using=it).

    recipe : ParameterGru(), the recurrent network of the law of the data, with its settings.
    to : file to write. Interrupted, the same call goes on where it was; done, it returns what the file holds.
    seed : of the split into training and validation rows, the first weights and the order of rows.
    training : epochs, rate and so on in the place of the recipe's. device : "auto" (a GPU where there is one), "cpu".
    progress : called with (task, epochs done, epochs in all, note); the note says Eq. (4) of the validation rows.
    """
    from creepkit.surrogates.training import train as run

    if isinstance(data, (str, Path)):
        from creepkit.dataset.storage import read_dataset

        data = read_dataset(data)
    if not hasattr(data, "accepted"):
        raise DatasetError(f"train() takes a data set or its file, found {type(data).__name__}; generate() makes one")
    if isinstance(recipe, type) or not hasattr(recipe, "sample_arrays"):
        found_type = recipe.__name__ if isinstance(recipe, type) else type(recipe).__name__
        raise SurrogateError(f"train() takes a recipe such as ParameterGru(hidden=128, layers=3), found {found_type}")
    return run(data, recipe, to=to, seed=seed, training=training, device=device, progress=progress)
