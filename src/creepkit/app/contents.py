"""What an interactive page shows: laws with values, specimens by their records, and measured tests, as plain data.

The page is drawn by scripts, which get all of this as one JSON document. It shows bars, relaxation and the bulge test
of a dimple, which the core in WebAssembly simulates.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from creepkit.errors import CreepkitError, FitError, quoted
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.identification import Identification
from creepkit.inverse.reference_conditions import ISOTHERMAL_RANGE, ReferencePoint
from creepkit.inverse.selection.ranking import Ranking
from creepkit.language import CreepLaw, temperature
from creepkit.records import History, LawWithValues, Specimen, constant_stress, dimensions_of, known_specimens
from creepkit.records.units import celsius_text
from creepkit.registry import resolve_law
from creepkit.specimens.bulge.specimen import Bulge
from creepkit.specimens.relaxation import Relaxation
from creepkit.specimens.uniaxial import Uniaxial

PageSource: TypeAlias = CreepLaw | Identification | Ranking | LawWithValues | str


MOST_LAWS = 12
"""Laws of a ranking on one page, those of largest weight."""


MOST_TESTS = 100
"""Measured tests on one page."""


USUAL_TEMPERATURE = 1073.15
"""K, where nothing says at which temperature a law is wanted."""


USUAL_STRAIN, USUAL_TIME, USUAL_STRESS = 0.02, 36000.0, 100.0
"""Creep strain that a first curve reaches; s and MPa where a law says nothing of time or a specimen of stress."""


USUAL_RATE = 1e-7
"""1/s, of each term of a law without values at USUAL_STRESS, so that creep takes days."""


RATE_STRAIN, RATE_TIME = 0.01, 3600.0
"""Where the creep rate is shown of a law that was not identified; s."""


KINDS: dict[type[object], str] = {Uniaxial: "creep", Relaxation: "relaxation", Bulge: "dimple"}
"""{specimen: the function of the runtime that predicts it}."""


@dataclass(frozen=True)
class PageLaw:
    """A law with the values that its sliders start at; fit : where they come from, weight : in a ranking."""

    law: CreepLaw
    values: Mapping[str, float]
    fit: Identification | None = None
    weight: float | None = None


@dataclass(frozen=True)
class PageContents:
    """Laws, specimens and measured tests of a page; the first law and the first specimen are shown first.

    title : of the page. temperature : K, where the sliders start.
    """

    title: str
    laws: tuple[PageLaw, ...]
    specimens: tuple[Specimen, ...]
    histories: tuple[History, ...]
    temperature: float = USUAL_TEMPERATURE

    def specimen(self, name: str) -> Specimen:
        """The specimen of this name, such as that of a test of the page."""
        return next(one for one in self.specimens if one.name == name)


def page_contents(
    source: PageSource, tests: Sequence[History] = (), *, specimen: str | None = None, title: str = ""
) -> PageContents:
    """Resolve what a page is to show.

    source : a law or its name, a law with values, an identification or a ranking. tests : measured ones that are laid
    over; by default those that an identification holds. specimen : which is shown first; by default that of the tests.
    """
    laws = _page_laws(source)
    law, fit = laws[0].law, laws[0].fit
    known = {name: one for name, one in known_specimens().items() if type(one) in KINDS}
    given = tuple(tests) or (() if fit is None else fit.histories)
    histories = tuple(history for history in given if history.specimen in known)
    if len(histories) > MOST_TESTS:
        raise FitError(f"a page shows at most {MOST_TESTS} tests, found {len(histories)}; give fewer files")
    shown = [history.specimen for history in histories or given[:1]]
    return PageContents(
        title or law.title or law.name,
        laws,
        _specimens(known, [*([specimen] if specimen else []), *shown]),
        histories,
        _first_temperature(histories, fit),
    )


def _page_laws(source: PageSource) -> tuple[PageLaw, ...]:
    """The laws of a source, those of a ranking by falling weight."""
    if isinstance(source, LawWithValues):
        return (PageLaw(source.law, dict(source.values)),)
    if isinstance(source, Ranking):
        return tuple(PageLaw(one.fit.law, one.fit.values, one.fit, one.weight) for one in source.laws[:MOST_LAWS])
    if isinstance(source, Identification):
        return (PageLaw(source.law, source.values, source),)
    law = resolve_law(source)
    return (PageLaw(law, _example_values(law)),)


def _example_values(law: CreepLaw) -> dict[str, float]:
    """The middle of the bounds, but for rate coefficients: with them each term has USUAL_RATE where creep is usual.

    The bounds of coefficients span so many powers of ten that their middle is no material's.
    """
    coordinates = Coordinates(law, ReferencePoint(USUAL_STRESS, RATE_STRAIN, RATE_TIME, USUAL_TEMPERATURE))
    with np.errstate(all="ignore"):
        u = coordinates.u(law.to_internal(law.center())[0])
        u[list(coordinates.coefficients)] = math.log(USUAL_RATE)
        theta = coordinates.theta(u)
    low, high = law.internal_bounds
    inside = np.where(np.isfinite(theta), np.clip(theta, low, high), law.internal_bounds.mean(axis=0))
    return {name: float(np.clip(value, *law.table[name].bounds)) for name, value in law.from_internal(inside).items()}


def _specimens(known: Mapping[str, Specimen], wanted: Sequence[str]) -> tuple[Specimen, ...]:
    """The specimens that a page predicts, those wanted first; FitError for others."""
    for name in wanted:
        if name not in known:
            raise FitError(
                f"specimen '{quoted(name, 60)}' cannot be shown on a page; those that can are {', '.join(known)}"
            )
    others = sorted(known, key=lambda name: _numbers_asked_for(known[name]))
    return tuple(known[name] for name in dict.fromkeys([*wanted, *others]))


def _numbers_asked_for(specimen: Specimen) -> tuple[bool, int]:
    """How much a user has to state before a first curve of a specimen is seen: a modulus, and how many lengths."""
    return "modulus" in specimen.conditions, len(dimensions_of(specimen))


def _first_temperature(histories: Sequence[History], fit: Identification | None) -> float:
    if histories:
        return float(np.median([history.mean_temperature for history in histories]))
    return USUAL_TEMPERATURE if fit is None else float(fit.reference.temperature)


def usual_end(page_law: PageLaw, stress: float, kelvin: float) -> float:
    """s, when a bar has crept by USUAL_STRAIN, or ruptures; what a first curve is to show.

    stress : MPa. kelvin : K.
    """
    times = np.geomspace(1e-6, 1e22, 561)
    plan = History(name="first curve", times=times, outputs={}, loading=constant_stress(stress), temperature=kelvin)
    law = page_law.law
    try:
        prediction = known_specimens()[plan.specimen].predict(law, law.to_internal(dict(page_law.values)), [plan])
    except CreepkitError:
        return USUAL_TIME
    strain = prediction.values[0, 0, :, 0]
    reached = np.flatnonzero(np.isfinite(strain) & (strain > 0.0) & (strain < USUAL_STRAIN))
    if not reached.size:
        return USUAL_TIME
    end = min(float(times[min(reached[-1] + 1, times.size - 1)]), float(prediction.end_times[0, 0]) * 1.02)
    if not (math.isfinite(end) and end > 0.0):
        return USUAL_TIME
    hours = float(f"{end / 3600.0:.2g}")
    return 3600.0 * hours


def temperature_warning(law: CreepLaw, histories: Sequence[History]) -> str:
    """A sentence where a law without temperature is laid over tests at several temperatures; "" where it is not."""
    temperatures = [history.mean_temperature for history in histories]
    if law.uses(temperature) or not temperatures or max(temperatures) - min(temperatures) <= ISOTHERMAL_RANGE:
        return ""
    span = celsius_text(min(temperatures), max(temperatures), digits=0)
    return (
        f"The law does not depend on temperature, and these tests are at {span}: its curves are the same at every "
        "temperature, so that they cannot follow all of them."
    )
