"""How a law's parameters depend on temperature."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from creepkit.records import History, Predictor
from creepkit.study.nouns import check_histories, resolve_law, resolve_predictor

if TYPE_CHECKING:
    from creepkit.discovery.temperature_study import TemperatureStudy
    from creepkit.discovery.trend import TemperatureLaw
    from creepkit.inverse.identification import Identification
    from creepkit.language import CreepLaw


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

    options : moduli, within, forms, prior, settings: see creepkit.discovery.temperature_study.
    """
    from creepkit.discovery.temperature_study import temperature_study as run

    return run(resolve_law(law), check_histories(tests), resolve_predictor(using), progress=progress, **options)
