"""Laws, specimens, histories, simulation, data sets and surrogates by name; and how a verb resolves its arguments."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit import registry
from creepkit.errors import DatasetError, FitError, LawError, PluginError, SolveError, SurrogateError
from creepkit.language import symbols
from creepkit.records import History, Loading, Predictor, Program, Specimen, Status
from creepkit.specimens.run import Run, Runnable, run_from_outputs

if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset
    from creepkit.surrogates.recipe import ProgressCallback, Training
    from creepkit.surrogates.surrogate import Recipe, Surrogate


if TYPE_CHECKING:
    from creepkit.language import CreepLaw


if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.quality import QualityFlag


if TYPE_CHECKING:
    from creepkit.dataset.dataset import Dataset
    from creepkit.jobs.shard_progress import ProgressCallback
    from creepkit.language import CreepLaw
    from creepkit.records import Specimen
    from creepkit.sampling.domains import SamplingDesign


if TYPE_CHECKING:
    from creepkit.arrays import ArrayLike
    from creepkit.inverse.identification import Identification
    from creepkit.language import CreepLaw, Elastic


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

    recipe : ParameterGru() for the law of the data, RateNet() for any law.
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
    if isinstance(recipe, type) or not hasattr(recipe, "samples"):
        found_type = recipe.__name__ if isinstance(recipe, type) else type(recipe).__name__
        raise SurrogateError(f"train() takes a recipe such as ParameterGru(hidden=128, layers=3), found {found_type}")
    return run(data, recipe, to=to, seed=seed, training=training, device=device, progress=progress)


def surrogate(name_or_path: str | Path) -> Surrogate:
    """Return the surrogate of this name that comes with creepkit, such as "dimple", or the one in a file."""
    from creepkit.surrogates.loading import surrogate_by_name as run

    return run(name_or_path)


def law(name: str) -> CreepLaw:
    """Return the law called `name`: one of `available("laws")`."""
    return registry.default_registry().law(name)


def specimen(name: str) -> Specimen:
    """Return the specimen called `name`: one of `available("specimens")`."""
    return registry.default_registry().specimen(name)


def available(kind: str) -> dict[str, Any]:
    """Return all that is registered of a kind, {name: value}: "laws", "specimens", "exporters" or "readers"."""
    kinds = ("laws", "specimens", "exporters", "readers")
    if kind not in kinds:
        raise PluginError(f"'{kind}' is no kind of plugin; choose one of {', '.join(kinds)}")
    return {name: entry.value for name, entry in getattr(registry.default_registry(), kind)().items()}


# ---- what is given -------------------------------------------------------------------------------------------------


def resolve_law(law_or_name: CreepLaw | str) -> CreepLaw:
    """The law itself, or the one of that name."""
    if isinstance(law_or_name, str):
        return law(law_or_name)
    if not hasattr(law_or_name, "terms"):
        raise LawError(f"a creep law or its name is needed, found {type(law_or_name).__name__}")
    return law_or_name


def resolve_predictor(predictor_or_name: Predictor | str) -> Predictor:
    """The predictor itself, or the specimen of that name."""
    if isinstance(predictor_or_name, str):
        return specimen(predictor_or_name)
    if not hasattr(predictor_or_name, "predict"):
        raise SolveError(
            f"a specimen, its name or another predictor is needed, found {type(predictor_or_name).__name__}"
        )
    return predictor_or_name


def check_histories(values: Sequence[History]) -> list[History]:
    """The histories as a list; FitError for what is none."""
    if isinstance(values, (str, Path, History)):
        raise FitError("histories must be a list of them: read_histories(path) returns one, [history] makes one")
    histories = list(values)
    wrong_types = [type(h).__name__ for h in histories if not isinstance(h, History)]
    if wrong_types:
        raise FitError(f"histories must be a list of them, found {wrong_types[0]} in it; use read_histories(path)")
    return histories


def resolve_predictors(predictors: Predictor | str | Mapping[str, Predictor | str]) -> Predictor | dict[str, Predictor]:
    """One predictor, or one for each specimen."""
    if isinstance(predictors, Mapping):
        return {name: resolve_predictor(predictor) for name, predictor in predictors.items()}
    return resolve_predictor(predictors)


def specimens_of_histories(histories: Sequence[History]) -> Predictor | dict[str, Predictor]:
    """The specimen that the histories name, or all of them by name."""
    names = sorted({h.specimen for h in histories})
    if not names:
        raise FitError("there are no histories to identify a law from")
    return specimen(names[0]) if len(names) == 1 else {name: specimen(name) for name in names}


def read_histories(paths: str | Path | Iterable[str | Path], reader: str | None = None) -> list[History]:
    """Read measured histories from a file, a folder, a pattern such as "in625/*.csv", or several of these.

    reader : name of the reader; by default the one that accepts the file.
    """
    from creepkit.readers.reading import read_histories as run

    readers = [entry.value for entry in registry.default_registry().readers().values()]
    return run(paths, readers, reader)


def check_data_quality(
    histories: Sequence[History], specimen: Predictor | str | None = None
) -> tuple[QualityFlag, ...]:
    """Return what looks wrong in histories: unloading, falling amplitudes, outliers, tests far from others.

    specimen : what the first frames are compared with, which should show its elastic deflection; None believes them.
    """
    from creepkit.quality import check_data_quality as run

    return run(check_histories(histories), None if specimen is None else resolve_predictor(specimen))


def exclude_suspect_frames(histories: Sequence[History], kinds: Collection[str] | None = None) -> list[History]:
    """Return the histories with suspect frames unused and a label that says which; whole tests stay.

    kinds : of "unloading", "falling" and "outlier"; all of them by default.
    """
    from creepkit.quality import FRAME_FLAG_KINDS
    from creepkit.quality import exclude_suspect_frames as run

    return run(check_histories(histories), FRAME_FLAG_KINDS if kinds is None else kinds)


def load(path: str | Path) -> Identification:
    """Return the identification saved in a JSON file; attach its histories again with `.on(histories, using)`."""
    from creepkit.inverse.identification_document import read_identification as run

    return run(path)


def generate(
    source: SamplingDesign | CreepLaw | str,
    using: Specimen | str,
    samples: int | None = None,
    *,
    seed: int,
    to: str | Path,
    domain: str | None = None,
    draws: int | None = None,
    workers: int | None = None,
    cluster: str | None = None,
    part: tuple[int, int] | None = None,
    progress: ProgressCallback | None = None,
    **changes: Any,
) -> Dataset:
    """Simulate samples until so many are accepted, write them to an HDF5 file, and return them.

    source : a law or its name, whose samples are drawn from a `box` ("conditioned", where most creep visibly, or
        "paper"; `changes` of it as in P1=(5, 20), every=900), or a design such as rate_family().
    samples : accepted ones wanted; whole shards of 256 draws are made, so that there are some more. Or draws : how many
        are simulated or rejected, whatever becomes of them.
    to : the file; its shards lie in a folder beside it. A call that was interrupted is made again to go on.
    workers : processes, by default one for each core. cluster : address of a dask scheduler, tcp://host:port.
    part : (k, n) simulates every n-th shard only, from the k-th on, for arrays of jobs; a call without it merges.
    progress : called as progress(task, done, total, note).
    """
    from creepkit.dataset.generation import generate as run

    specimen_record = specimen(using) if isinstance(using, str) else using
    design = resolve_design(source, specimen_record, domain, changes)
    return run(
        design, specimen_record, samples=samples, seed=seed, to=to, workers=workers, cluster=cluster, draws=draws, part=part,
        progress=progress,
    )  # fmt: skip


def resolve_design(
    source: SamplingDesign | CreepLaw | str,
    specimen: Specimen,
    domain: str | None = None,
    changes: dict[str, Any] | None = None,
) -> SamplingDesign:
    """The design itself, or the one for a law in a box."""
    from creepkit.sampling.domains import SamplingDesign, sampling_design

    if not isinstance(source, SamplingDesign):
        return sampling_design(resolve_law(source), specimen, domain or "conditioned", **changes or {})
    if domain is not None or changes:
        argument = "domain" if domain is not None else next(iter(changes or {}))
        raise DatasetError(f"{argument}= belongs to a law; a design such as {source.name} has its own, change it there")
    return source


def rate_family(using: Specimen | str | None = None, **changes: Any) -> SamplingDesign:
    """Return the design of diverse rate functions, not of one law, from which a surrogate learns to serve any law.

    using : the specimen, by default the paper's dimple. changes : ranges of conditions, P1=(5, 20); grid=TimeGrid(...).
    """
    from creepkit.sampling.rate_family import rate_family as run

    return run(specimen(using) if isinstance(using, str) else using, **changes)


def read_dataset(path: str | Path, *, accepted_only: bool = False) -> Dataset:
    """Return the data set of an HDF5 file that `generate` wrote.

    accepted_only : leave rejected and failed samples in the file, which spares their memory.
    """
    from creepkit.dataset.storage import read_dataset

    return read_dataset(path, accepted_only=accepted_only)


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
    prediction = using.predict(law, law.to_internal(values), [planned_test])
    status, end = Status(int(prediction.status[0, 0])), float(prediction.end_times[0, 0])
    return run_from_outputs(Run, planned_test, prediction.outputs, prediction.of(0), status, end)
