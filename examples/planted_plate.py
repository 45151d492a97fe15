"""A planted plate: alloys mixed from four base alloys, with known laws, tested by finite element simulation.

The base alloys are those that Chen et al. mixed, in nominal compositions (the paper's own are in a table that we have
not seen); laws and values are drawn around the three of their Fig. 7a, noise and thickness are as measured on real
dimples. Which law an alloy obeys depends on its class, as in Fig. 7c: hyperbolic sine in iron-rich alloys, the two
power laws in cobalt-rich alloys, any of the three elsewhere.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from creepkit import kernels, limits, registry
from creepkit.arrays import Floats
from creepkit.checked_arguments import checked
from creepkit.errors import SolveError
from creepkit.files.writing import write_text
from creepkit.language import Elastic
from creepkit.readers.history_csv import write_history
from creepkit.records import History, PressureJump, Status, output_named
from creepkit.screening.alloys import Compositions, atomic_percent

BASE_ALLOYS = {
    # Eiselstein and Tillack (1991), The invention and definition of alloy 625, table I, typical; nickel is the balance
    "IN625": {"Ni": 63.05, "Cr": 21.5, "Mo": 9.0, "Nb": 3.6, "Fe": 2.0, "Mn": 0.2, "Si": 0.2, "Al": 0.2, "Ti": 0.2,
              "C": 0.05},
    # UNS R30605 (ASTM F90): the middle of each range, two thirds of the iron allowed; cobalt is the balance
    "Haynes 25": {"Co": 51.4, "Cr": 20.0, "W": 15.0, "Ni": 10.0, "Fe": 2.0, "Mn": 1.5, "C": 0.1},
    # UNS S31603 (ASTM A240): the middle of each range, usual manganese, silicon and carbon; iron is the balance
    "316L": {"Fe": 66.48, "Cr": 17.0, "Ni": 12.0, "Mo": 2.5, "Mn": 1.5, "Si": 0.5, "C": 0.02},
    # the usual NiCoCrAlY for thermal spraying, Ni-23Co-17Cr-12Al-0.5Y
    "MCrAlY": {"Ni": 47.5, "Co": 23.0, "Cr": 17.0, "Al": 12.0, "Y": 0.5},
}  # fmt: skip
"""{base alloy: {element: wt.%}}."""


MIXTURE_CONCENTRATION = 0.6
"""Concentration of the Dirichlet distribution of mixtures: below one, most have one or two bases in the main."""


FIGURE_7A = {
    "hyperbolic-sine": {"A": 3.16e-7, "n": 4.15, "B": 87.16},
    "strain-hardening": {"A": 5.5e-14, "n": 3.28, "m": -0.32},
    "norton": {"A": 1.2e-16, "n": 5.2},
}
"""{law: values}, 1/s, MPa: Fe-rich, Ni-rich and Co-rich in the caption of Fig. 7."""


PARAMETER_SD = {"n": 0.3, "m": 0.05, "B": 8.0}
"""Standard deviations about these."""


RATE_FACTOR_RANGE = (0.16, 1.0)
"""Factor on the rate at 100 MPa and a strain of 0.01, drawn on a logarithmic scale."""


LAW_PROBABILITIES = {"Fe-rich": (0.8, 0.1, 0.1), "Co-rich": (0.0, 0.5, 0.5)}
"""{class: share of each law of FIGURE_7A}; in other classes all are alike."""


THICKNESS_MEAN_SD, MIN_THICKNESS = (0.4935, 0.027), 0.44
"""mm: mean and standard deviation of the apex of 25 measured dimples; thinner than the last burst in such a test."""


LOADING, TIMES = PressureJump(P1=8, P2=10, Tj=7200), np.arange(60.0, 4 * 3600 + 1, 60.0)


TEMPERATURE, ELASTIC = 1073.15, Elastic(E=150e3)


MAX_DRAWS = 20
"""How often values are drawn for an alloy whose dimple would burst."""


@dataclass(frozen=True, eq=False)
class AlloyTruth:
    """True values of a planted alloy: its law, parameters, apex thickness (mm), and fractions of the base alloys."""

    law: str
    values: Mapping[str, float]
    thickness: float
    base_fractions: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class PlantedPlate:
    """A plate of virtual tests, and the truth about each alloy."""

    histories: tuple[History, ...]
    compositions: Compositions
    truth: Mapping[str, AlloyTruth]

    def write(self, folder: Path) -> tuple[Path, Path]:
        """Write tests/*.csv, compositions.csv and truth.csv; the folder of the tests and the compositions."""
        tests = folder / "tests"
        tests.mkdir(parents=True, exist_ok=True)
        for history in self.histories:
            write_history(history, tests / f"{history.name}.csv")
        composition_file = folder / "compositions.csv"
        contents = [{"alloy": a, **{e: f"{x:.4f}" for e, x in c.items()}} for a, c in self.compositions.atomic.items()]
        write_text("# unit: at.%\n" + _csv_text(contents), composition_file, SolveError)
        rows = [
            {"alloy": a, "law": t.law, **t.values, "thickness_mm": t.thickness, **t.base_fractions}
            for a, t in self.truth.items()
        ]
        write_text(_csv_text(rows), folder / "truth.csv", SolveError)
        return tests, composition_file


@checked
def planted_plate(
    alloys: Annotated[int, limits.Limits(1, 10_000)] = 47,
    seed: Annotated[int, limits.SEED] = 7,
    *,
    thickness_known: bool = True,
) -> PlantedPlate:
    """Simulate the tests of so many alloys, one dimple each; the first alloys are the same however many there are.

    thickness_known : whether each test states the apex thickness of its dimple, to a micrometre.
    """
    histories, atomic, truth = [], {}, {}
    for number in range(1, alloys + 1):
        name, rng = f"A{number:02d}", np.random.default_rng([seed, number])
        base_fractions = dict(zip(BASE_ALLOYS, rng.dirichlet([MIXTURE_CONCENTRATION] * len(BASE_ALLOYS)), strict=True))
        atomic[name] = mix_base_alloys(base_fractions)
        law = _draw_law(Compositions({name: atomic[name]}).class_of(name), rng)
        truth[name], history = _simulate_test(name, law, base_fractions, rng)
        histories.append(history if thickness_known else history.replace(geometry={}))
    return PlantedPlate(tuple(histories), Compositions(atomic), truth)


def mix_base_alloys(base_fractions: Mapping[str, float]) -> dict[str, float]:
    """{element: at.%} of base alloys mixed by weight."""
    weights: dict[str, float] = {}
    for base_alloy, fraction in base_fractions.items():
        for element, weight in BASE_ALLOYS[base_alloy].items():
            weights[element] = weights.get(element, 0.0) + fraction * weight
    return atomic_percent(weights)


def _draw_law(alloy_class: str, rng: np.random.Generator) -> str:
    return str(rng.choice(list(FIGURE_7A), p=LAW_PROBABILITIES.get(alloy_class, (1 / 3, 1 / 3, 1 / 3))))


def _simulate_test(
    name: str, law: str, base_fractions: Mapping[str, float], rng: np.random.Generator
) -> tuple[AlloyTruth, History]:
    """One dimple of an alloy that lasts to the end of the test, simulated on a finer mesh than identifications use."""
    coarse_specimen: Any = registry.default_registry().specimen("bulge")
    for _ in range(MAX_DRAWS):
        thickness = round(max(rng.normal(*THICKNESS_MEAN_SD), MIN_THICKNESS), 3)
        values = _draw_values(law, rng)
        planned_test = History(
            name, TIMES, {}, LOADING, TEMPERATURE, "bulge", ELASTIC, alloy=name, geometry={"apex_thickness": thickness}
        )
        specimen = coarse_specimen.replace(refinement=2.0, tolerance=1e-3)
        creep_law = registry.default_registry().law(law)
        prediction = specimen.predict(creep_law, creep_law.to_internal(values), [planned_test])
        if prediction.status[0, 0] == Status.COMPLETE:
            return AlloyTruth(law, values, thickness, base_fractions), _with_noise(
                planned_test, prediction.outputs, prediction.of(0), rng
            )
    raise SolveError(f"alloy '{name}': its dimple burst in all of {MAX_DRAWS} draws; choose another seed")


def _draw_values(law: str, rng: np.random.Generator) -> dict[str, float]:
    """Values about those of Fig. 7a, with the rate at 100 MPa at most theirs."""
    mean_values = FIGURE_7A[law]
    values = {
        name: v + PARAMETER_SD[name] * rng.normal() if name in PARAMETER_SD else v for name, v in mean_values.items()
    }
    rate_factor = math.exp(rng.uniform(*np.log(RATE_FACTOR_RANGE)))
    mean_rate, drawn_rate = (_rate_at_100_MPa(law, v) for v in (mean_values, values))
    return {
        name: float(f"{v * (rate_factor * mean_rate / drawn_rate if name == 'A' else 1.0):.6g}")
        for name, v in values.items()
    }


def _rate_at_100_MPa(law: str, values: Mapping[str, float]) -> float:
    """Creep rate in 1/s at 100 MPa and a strain of 0.01."""
    kernel = kernels.lower(registry.default_registry().law(law), "numpy")
    return float(kernel.rate(values, stress=100.0, strain=0.01, time=3600.0, temperature=TEMPERATURE))


def _with_noise(
    planned_test: History, names: Sequence[str], exact_outputs: Floats, rng: np.random.Generator
) -> History:
    """The plan with noisy outputs."""
    outputs = {
        name: exact_outputs[:, k]
        + rng.normal(0.0, output_named(name, planned_test.specimen).noise or 0.0, len(exact_outputs))
        for k, name in enumerate(names)
    }
    return replace(planned_test, outputs={name: np.round(row, 6) for name, row in outputs.items()})


def _csv_text(rows: Sequence[Mapping[str, Any]]) -> str:
    text = io.StringIO()
    columns = list(dict.fromkeys(name for row in rows for name in row))
    writer = csv.DictWriter(text, columns, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()
