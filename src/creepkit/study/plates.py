"""Many alloys at once, and the word of the full simulation."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from creepkit.records import History, Predictor
from creepkit.study.nouns import check_histories, resolve_predictors, specimens_of_histories

if TYPE_CHECKING:
    from creepkit.inverse.confirm import Confirmation
    from creepkit.inverse.identification import Identification
    from creepkit.language import CreepLaw
    from creepkit.plates.plate import Plate


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
        confirm, workers and more: see creepkit.plates.screening.screen.
    """
    from creepkit.plates.screening import screen as run

    return run(histories, laws, using, progress=progress, **options)


def confirm(
    fit: Identification, tests: Sequence[History] | None = None, using: Predictor | str | None = None
) -> Confirmation:
    """Simulate an identified law for each test by the specimen itself, and compare: finite elements for a bulge test.

    tests : by default those that were fitted; using : by default the specimen that they name.
    """
    from creepkit.inverse.confirm import confirm as run

    histories = check_histories(list(fit.histories if tests is None else tests))
    return run(fit, histories, specimens_of_histories(histories) if using is None else resolve_predictors(using))
