"""The verbs of a study, as typed in a notebook; each finds its nouns in the registry and hands over the work."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from creepkit import registry
from creepkit.errors import ExportError, FitError, LawError, SolveError
from creepkit.language import symbols
from creepkit.records import (
    Exporter,
    History,
    Loading,
    Nuisance,
    Predictor,
    Program,
    Specimen,
    Status,
    Units,
    ValuedLaw,
)
from creepkit.specimens.run import Run, Runnable, run_of

if TYPE_CHECKING:
    from creepkit.arrays import ArrayLike
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.moduli import Moduli
    from creepkit.inverse.selection import Ranking
    from creepkit.language import CreepLaw, Elastic
    from creepkit.readers.suspects import Suspect

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


def suspects(histories: Sequence[History], specimen: Predictor | str | None = None) -> tuple[Suspect, ...]:
    """Return what looks wrong in histories: unloading, falling amplitudes, outliers, tests far from others.

    specimen : what the first frames are compared with, which should show its elastic deflection; None believes them.
    """
    from creepkit.readers.suspects import suspects as run

    return run(_histories(histories), None if specimen is None else _predictor(specimen))


def with_suspects_marked(histories: Sequence[History], kinds: Collection[str] | None = None) -> list[History]:
    """Return the histories with suspect frames unused and a label that says which; whole tests stay.

    kinds : of "unloading", "falling" and "outlier"; all of them by default.
    """
    from creepkit.readers.suspects import OF_FRAMES
    from creepkit.readers.suspects import with_suspects_marked as run

    return run(_histories(histories), OF_FRAMES if kinds is None else kinds)


# ---- models --------------------------------------------------------------------------------------------------------


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
    law, using = _law(law), _predictor(using)
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
        specimen=getattr(using, "name", "uniaxial"),
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

    histories = _histories(histories)
    settings = Settings(
        starts=starts, draws=_draws(starts), frames=frames, seed=seed, loss=loss, test_loss=test_loss, weights=weights
    )
    if nuisances is not None:
        settings = replace(settings, nuisances=tuple(nuisances))
    chosen = _specimens_of(histories) if using is None else _predictors(using)
    return run(_law(law), histories, chosen, settings=settings, progress=progress)


def moduli(
    law: CreepLaw | str, histories: Sequence[History], using: Predictor | str | None = None, *, frames: int = 15
) -> Moduli:
    """Identify each bulge test's Young's modulus from its first frames, and Wachtman's form through them.

    law : what creeps meanwhile, with its temperature; frames : used frames looked at, the paper's 15 by default.
    `[h.replace(elastic=found.elastic) for h in histories]` then fixes the moduli.
    """
    from creepkit.inverse.moduli import identify_moduli as run

    histories = _histories(histories)
    chosen = _predictors(using) if using is not None else _specimens_of(histories)
    if isinstance(chosen, Mapping):
        raise FitError("moduli are identified from tests of one specimen; give those alone, and using= that one")
    return run(_law(law), histories, chosen, frames=frames)


def rank(fits: Sequence[Identification]) -> Ranking:
    """Rank identifications of the same histories by BIC, with weights and a verdict."""
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.selection import rank as run

    if isinstance(fits, Identification):
        raise FitError("rank() takes a list of identifications, found a single one")
    return run(list(fits))


def load(path: str | Path) -> Identification:
    """Return the identification saved in a JSON file; attach its histories again with `.on(histories, using)`."""
    from creepkit.inverse.files import load as run

    return run(path)


def _draws(starts: int) -> int:
    """Sobol points to screen for so many starts: eight each, a power of two, and at least 64."""
    return max(64, 1 << (8 * max(int(starts), 1) - 1).bit_length())


def _law(given: CreepLaw | str) -> CreepLaw:
    """The law itself, or the one of that name."""
    if isinstance(given, str):
        return law(given)
    if not hasattr(given, "terms"):
        raise LawError(f"a creep law or its name is needed, found {type(given).__name__}")
    return given


def _predictor(given: Predictor | str) -> Predictor:
    """The predictor itself, or the specimen of that name."""
    if isinstance(given, str):
        return specimen(given)
    if not hasattr(given, "predict"):
        raise SolveError(f"a specimen, its name or another predictor is needed, found {type(given).__name__}")
    return given


def _histories(given: Sequence[History]) -> list[History]:
    if isinstance(given, (str, Path, History)):
        raise FitError("histories must be a list of them: read_histories(path) returns one, [history] makes one")
    histories = list(given)
    strangers = [type(h).__name__ for h in histories if not isinstance(h, History)]
    if strangers:
        raise FitError(f"histories must be a list of them, found {strangers[0]} in it; use read_histories(path)")
    return histories


def _predictors(given: Predictor | str | Mapping[str, Predictor | str]) -> Predictor | dict[str, Predictor]:
    """One predictor, or one for each specimen."""
    if isinstance(given, Mapping):
        return {name: _predictor(one) for name, one in given.items()}
    return _predictor(given)


def _specimens_of(histories: Sequence[History]) -> Predictor | dict[str, Predictor]:
    """The specimen that the histories name, or all of them by name."""
    names = sorted({h.specimen for h in histories})
    if not names:
        raise FitError("there are no histories to identify a law from")
    return specimen(names[0]) if len(names) == 1 else {name: specimen(name) for name in names}


# ---- text ----------------------------------------------------------------------------------------------------------


def export(
    source: CreepLaw | Identification | ValuedLaw | str,
    target: str,
    values: Mapping[str, float] | None = None,
    *,
    units: Units | Mapping[str, str] | None = None,
    temperature: float | None = None,
    elastic: Elastic | None = None,
    name: str = "",
    notes: Sequence[str] = (),
    to: str | Path | None = None,
    force: bool = False,
) -> str:
    """Return a law with its values as text for a target (latex, python, abaqus ...), and write it to a file if asked.

    source : a law, which needs `values` {parameter: value}, or an identification, whose intervals and range of
        validity become comments, or a ValuedLaw, such as an exported JSON read back.
    target : one of `exporters()`. units : of stress and time in the text, Units("Pa", "h") or {"stress": "Pa"}.
    temperature : K, puts a number in the place of the temperature, for targets that know none.
    elastic : E in MPa, and nu, for targets that state them. name : what the target calls the law.
    to, force : the file to write, and whether one that exists may be replaced.

    ExportError, with the reason, when the target cannot express the law.
    """
    from creepkit.export.writing import write_text
    from creepkit.inverse.identification import Identification

    exporter = registry.default().exporter(target)
    if isinstance(source, Identification):
        from creepkit.inverse.printing import notes_of

        law, values, notes = source.law, source.values if values is None else values, [*notes_of(source), *notes]
    elif isinstance(source, ValuedLaw):
        law, values, notes = source.law, source.values if values is None else values, [*source.notes, *notes]
    else:
        law, values = _law(source), values or {}
    if temperature is not None:
        notes = [*notes, f"taken at a temperature of {temperature:g} K"]
    valued = ValuedLaw(law, values, tuple(notes), _units(units), elastic, name)
    if temperature is not None:
        valued = valued.at(temperature)
    if to is not None:
        write_text(valued, exporter, to, force=force)
    return exporter.text(valued)


def exporters() -> dict[str, Exporter]:
    """Return every target that laws can be exported to: {name: exporter}."""
    return {name: found.value for name, found in registry.default().exporters().items()}


def _units(given: Units | Mapping[str, str] | None) -> Units:
    if given is None or isinstance(given, Units):
        return given or Units()
    odd = sorted({*given} - {"stress", "time"})
    if odd:
        raise ExportError(f"units have no '{odd[0]}'; write units={{'stress': 'Pa', 'time': 'h'}}")
    return Units(**given)
