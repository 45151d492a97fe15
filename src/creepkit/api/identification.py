"""Identification, ranking, temperature dependence, screening, confirmation and export of laws."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from creepkit import registry
from creepkit.api.simulation import (
    check_histories,
    resolve_law,
    resolve_predictor,
    resolve_predictors,
    specimens_of_histories,
)
from creepkit.errors import ExportError, FitError
from creepkit.records import History, LawWithValues, Nuisance, Predictor, Units

if TYPE_CHECKING:
    from creepkit.discovery.elastic_moduli import ModulusEstimates
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.search.global_search import GlobalSearch
    from creepkit.inverse.selection import Ranking
    from creepkit.inverse.settings import OutputWeights
    from creepkit.inverse.sparsity.penalties import ContributionPenalty, Subsets
    from creepkit.language import CreepLaw, Elastic


if TYPE_CHECKING:
    from creepkit.inverse.confirmation import Confirmation
    from creepkit.inverse.identification import Identification
    from creepkit.language import CreepLaw
    from creepkit.screening.results import Plate


if TYPE_CHECKING:
    from creepkit.discovery.temperature_law import TemperatureLaw
    from creepkit.inverse.identification import Identification
    from creepkit.language import CreepLaw, Elastic


if TYPE_CHECKING:
    from creepkit.discovery.discover import TemperatureStudy
    from creepkit.discovery.temperature_law import TemperatureLaw
    from creepkit.inverse.identification import Identification
    from creepkit.language import CreepLaw


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
        starts=starts,
        sobol_points=_sobol_draws(starts),
        frames=frames,
        seed=seed,
        loss=loss,
        test_loss=test_loss,
        weights=weights,
    )
    if nuisances is not None:
        settings = replace(settings, nuisances=tuple(nuisances))
    predictor = specimens_of_histories(histories) if using is None else resolve_predictors(using)
    surrogate_predictor = _resolve_surrogate(through, predictor, histories)
    if penalty is not None:
        from creepkit.inverse.sparsity.term_selection import identify_sparse

        return identify_sparse(
            resolve_law(law), histories, predictor, penalty=penalty, search=search, through=surrogate_predictor, settings=settings,
            progress=progress,
        )  # fmt: skip
    return run(
        resolve_law(law),
        histories,
        predictor,
        settings=settings,
        search=search,
        through=surrogate_predictor,
        progress=progress,
    )


def moduli(
    law: CreepLaw | str, histories: Sequence[History], using: Predictor | str | None = None, *, frames: int = 15
) -> ModulusEstimates:
    """Identify each bulge test's Young's modulus from its first frames, and Wachtman's form through them.

    law : what creeps meanwhile, with its temperature; frames : used frames looked at, the paper's 15 by default.
    `[h.replace(elastic=found.elastic) for h in histories]` then fixes the moduli.
    """
    from creepkit.discovery.elastic_moduli import identify_moduli as run

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
    requested: Predictor | Literal["auto"] | None,
    predictor: Predictor | Mapping[str, Predictor],
    histories: Sequence[History],
) -> Predictor | None:
    """What was asked for; or the shipped surrogate, where it stands for this very specimen and these histories."""
    if not isinstance(requested, str):
        return requested
    if isinstance(predictor, Mapping) or getattr(predictor, "name", "") != "bulge":
        return None
    from creepkit.api.simulation import surrogate

    model = surrogate("dimple")
    return model if model.applies_to(predictor, histories) else None


def _sobol_draws(starts: int) -> int:
    """Sobol points to screen for so many starts: eight each, a power of two, and at least 64."""
    return max(64, 1 << (8 * max(int(starts), 1) - 1).bit_length())


def screen(
    histories: Sequence[History] | str | Path,
    laws: Sequence[CreepLaw | str] | None = None,
    using: Predictor | str | Mapping[str, Predictor] | None = None,
    *,
    progress: Callable[[str, int, int, str], None] | None = None,
    **options: Any,
) -> Plate:
    """Identify the law of every alloy from its tests, and set the alloys side by side.

    histories : of all alloys, or a folder of their files; laws : candidates, by default those of Table 1.
    options : compositions, to (the folder from which an interrupted call goes on), nuisances, through, penalty,
        confirm, workers and more: see creepkit.screening.screen.screen.
    """
    from creepkit.screening.screen import screen as run

    return run(histories, laws, using, progress=progress, **options)


def confirm(
    fit: Identification, tests: Sequence[History] | None = None, using: Predictor | str | None = None
) -> Confirmation:
    """Simulate an identified law for each test by the specimen itself, and compare: finite elements for a bulge test.

    tests : by default those that were fitted; using : by default the specimen that they name.
    """
    from creepkit.inverse.confirmation import confirm as run

    histories = check_histories(list(fit.histories if tests is None else tests))
    return run(fit, histories, specimens_of_histories(histories) if using is None else resolve_predictors(using))


def export(
    source: CreepLaw | Identification | TemperatureLaw | LawWithValues | str,
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

    source : a law, which needs `values` {parameter: value}, or an identification or a law of temperature that was
        discovered, whose intervals and range of validity become comments, or a ValuedLaw, such as an exported JSON
        read back.
    target : one of `exporters()`. units : of stress and time in the text, Units("Pa", "h") or {"stress": "Pa"}.
    temperature : K, puts a number in the place of the temperature, for targets that know none.
    elastic : E in MPa, and nu, for targets that state them. name : what the target calls the law.
    to, force : the file to write, and whether one that exists may be replaced.

    ExportError, with the reason, when the target cannot express the law.
    """
    from creepkit.exporters.law_files import write_export

    exporter = registry.default_registry().exporter(target)
    if temperature is not None:
        notes = [*notes, f"taken at a temperature of {temperature:g} K"]
    valued = _resolve_valued_law(source, values, notes)
    valued = valued.replace(
        units=valued.units if units is None else _resolve_units(units),
        elastic=elastic or valued.elastic,
        name=name or valued.name,
    )
    if temperature is not None:
        valued = valued.at(temperature)
    if to is not None:
        write_export(valued, exporter, to, force=force)
    return exporter.text(valued)


def _resolve_valued_law(
    source: CreepLaw | Identification | TemperatureLaw | LawWithValues | str, values: Mapping[str, float] | None,
    notes: Sequence[str],
) -> LawWithValues:  # fmt: skip
    """The source with its own values, or those given in their place, which its notes then tell."""
    from creepkit.inverse.identification import Identification

    resolved: Any = getattr(source, "valued", source)  # a law of temperature has one
    if isinstance(resolved, Identification):
        from creepkit.report.identification_text import identification_comments

        resolved = LawWithValues(
            resolved.law, resolved.values, tuple(identification_comments(resolved)), ranges=resolved.ranges
        )
    if not isinstance(resolved, LawWithValues):
        return LawWithValues(resolve_law(resolved), values or {}, tuple(notes))
    source_values, valued_law = resolved.values, resolved if values is None else resolved.replace(values=values)
    change_notes = [
        f"{k} = {v:.8g} was set by hand, in place of {source_values[k]:.8g}"
        for k, v in valued_law.values.items()
        if v != source_values[k]
    ]
    return valued_law.replace(notes=(*resolved.notes, *change_notes, *notes))


def _resolve_units(units: Units | Mapping[str, str]) -> Units:
    if isinstance(units, Units):
        return units
    unknown = sorted({*units} - {"stress", "time"})
    if unknown:
        raise ExportError(f"units have no '{unknown[0]}'; write units={{'stress': 'Pa', 'time': 'h'}}")
    return Units(**units)


def discover(
    fits: Sequence[Identification],
    *,
    forms: Sequence[str] | Mapping[str, Sequence[str]] | None = None,
    histories: Sequence[History] | None = None,
    using: Predictor | str | None = None,
    progress: Callable[[str, int, int], None] | None = None,
    **options: Any,
) -> TemperatureLaw:
    """Find closed forms of the parameters against temperature; with histories, judged by how they fit those.

    fits : identifications of one law, each at one temperature, three temperatures or more. forms : names of registered
    temperature forms, or {parameter: names}. options : prior, parameters, settings: see creepkit.discovery.discover.
    """
    from creepkit.discovery.discover import discover as run

    predictor = None if using is None else resolve_predictor(using)
    tests = None if histories is None else check_histories(histories)
    return run(fits, forms=forms, histories=tests, using=predictor, progress=progress, **options)


def temperature_study(
    law: CreepLaw | str, tests: Sequence[History], using: Predictor | str, *,
    progress: Callable[[str, int, int], None] | None = None, **options: Any,
) -> TemperatureStudy:  # fmt: skip
    """Moduli, the law times Arrhenius jointly, each temperature alone, and forms of temperature, in one call.

    options : moduli, within, forms, prior, settings: see creepkit.discovery.discover.
    """
    from creepkit.discovery.discover import temperature_study as run

    return run(resolve_law(law), check_histories(tests), resolve_predictor(using), progress=progress, **options)
