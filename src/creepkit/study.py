"""The verbs of a study, as typed in a notebook; each finds its nouns in the registry and hands over the work."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creepkit import registry
from creepkit.errors import FitError, SolveError
from creepkit.language import symbols
from creepkit.records import EVERY_FRAME, History, Loading, Nuisance, Predictor, Program, Specimen, Status

if TYPE_CHECKING:
    from creepkit.arrays import ArrayLike
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.selection import Ranking
    from creepkit.language import CreepLaw, Elastic

ROOM_TEMPERATURE = 293.15
"""K; stands where a law does not ask for a temperature."""


# ---- nouns by name -------------------------------------------------------------------------------------------------


def law(name: str) -> CreepLaw:
    """Return the law called `name`: one of `laws()`."""
    return registry.default().law(name)


def laws() -> dict[str, CreepLaw]:
    """Return every law that is known: {name: law}."""
    return {name: found.value for name, found in registry.default().laws().items()}


def specimen(name: str) -> Specimen:
    """Return the specimen called `name`: one of `specimens()`."""
    return registry.default().specimen(name)


def specimens() -> dict[str, Specimen]:
    """Return every specimen that is known: {name: specimen}."""
    return {name: found.value for name, found in registry.default().specimens().items()}


# ---- measured files ------------------------------------------------------------------------------------------------


def read_histories(paths: str | Path | Iterable[str | Path], reader: str | None = None) -> list[History]:
    """Read measured histories from a file, a folder, a pattern such as "in625/*.csv", or several of these.

    reader : name of the reader; by default the one that accepts the file.
    """
    from creepkit.readers.reading import read_histories as run

    readers = [found.value for found in registry.default().readers().values()]
    return run(paths, readers, reader)


# ---- models --------------------------------------------------------------------------------------------------------


def simulate(
    law: CreepLaw,
    using: Predictor,
    values: Mapping[str, float],
    *,
    loading: Loading,
    times: ArrayLike,
    temperature: float | Program | None = None,
    elastic: Elastic | None = None,
    name: str = "simulated",
) -> History:
    """Return the history that a law with these values predicts: what a perfect test would have measured.

    using : a specimen, a surrogate or a closed form; values : {parameter: value} in the law's units.
    times : (frames,) s; temperature : K; `elastic` in MPa. The history of a specimen that bursts ends there.
    """
    if temperature is None and law.uses(symbols.temperature):
        raise SolveError(f"law '{law.name}' depends on temperature: give temperature= in K")
    plan = History(
        name=name,
        times=np.asarray(times, float),
        outputs={},
        loading=loading,
        temperature=ROOM_TEMPERATURE if temperature is None else temperature,
        specimen=getattr(using, "name", "uniaxial"),
        elastic=elastic,
        source=f"simulation of law '{law.name}'",
    )
    prediction = using.predict(law, law.values(values), [plan])
    status, end = Status(int(prediction.status[0, 0])), float(prediction.end_times[0, 0])
    if status not in (Status.COMPLETE, Status.BURST):
        told = status.name.lower().replace("_", " ")
        raise SolveError(f"the simulation of law '{law.name}' stopped at {end:g} s: {told}; check values and loading")
    rows = prediction.of(0)
    alive = np.isfinite(rows).all(axis=1)
    if not alive.any():
        raise SolveError(f"the simulation of law '{law.name}' burst at {end:g} s, before the first time asked for")
    outputs = dict(zip(prediction.outputs, rows[alive].T, strict=True))
    return plan.replace(times=plan.times[alive], outputs=outputs, used=EVERY_FRAME)


def identify(
    law: CreepLaw,
    histories: Sequence[History],
    using: Predictor | None = None,
    *,
    nuisances: Sequence[Nuisance] | None = None,
    starts: int = 8,
    frames: int = 40,
    seed: int = 0,
    loss: str = "linear",
    progress: Callable[[str, int, int], None] | None = None,
) -> Identification:
    """Identify the parameters of a law from all histories at once, with 95 % intervals.

    using : a specimen or any predictor; by default the specimen that the histories name.
    nuisances : what differs between tests; by default an offset of each curve and test-to-test scatter of the rate.
    starts, seed : of the search, which includes the centre of the bounds; frames : looked at in each history.
    loss : "linear", or a robust loss of scipy's least_squares such as "soft_l1".
    """
    from creepkit.inverse.identification import Settings
    from creepkit.inverse.identify import NUISANCES
    from creepkit.inverse.identify import identify as run

    settings = Settings(starts=starts, draws=max(64, 8 * starts), frames=frames, seed=seed, loss=loss)
    chosen = using or _specimen_of(histories)
    given = NUISANCES if nuisances is None else nuisances
    return run(law, histories, chosen, nuisances=given, settings=settings, progress=progress)


def rank(fits: Sequence[Identification]) -> Ranking:
    """Rank identifications of the same histories by BIC, with weights and a verdict."""
    from creepkit.inverse.selection import rank as run

    return run(fits)


def load(path: str | Path) -> Identification:
    """Return the identification saved in a JSON file; attach its histories again with `.on(histories, using)`."""
    from creepkit.inverse.files import load as run

    return run(path)


def _specimen_of(histories: Sequence[History]) -> Specimen:
    names = sorted({h.specimen for h in histories})
    if len(names) != 1:
        raise FitError(f"the histories name {len(names)} specimens ({', '.join(names) or 'none'}): say using=")
    return specimen(names[0])


# ---- text ----------------------------------------------------------------------------------------------------------


def export(
    source: CreepLaw | Identification,
    language: str,
    values: Mapping[str, float] | None = None,
    *,
    notes: Sequence[str] = (),
    to: str | Path | None = None,
) -> str:
    """Return a law with its values as text in `language` (latex, python, json ...), and write it to a file if asked.

    source : a law, which needs `values` {parameter: value}, or an identification, whose intervals and range of
        validity become comments.
    """
    from creepkit.export.writing import export_text, write_text
    from creepkit.inverse.identification import Identification

    exporter = registry.default().exporter(language)
    if isinstance(source, Identification):
        from creepkit.inverse.printing import notes_of

        law, values, notes = source.law, source.values if values is None else values, [*notes_of(source), *notes]
    else:
        law, values = source, values or {}
    if to is not None:
        write_text(law, values, exporter, to, notes)
    return export_text(law, values, exporter, notes)

