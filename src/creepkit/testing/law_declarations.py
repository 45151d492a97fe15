"""Checks of what an author states about a law: names, units, references, examples and temperature."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from creepkit.kernels.lowering import lower
from creepkit.kernels.multiprecision import MultiprecisionLaw
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import POINT_VARIABLES, temperature
from creepkit.registry import default_registry
from creepkit.testing.law_checks import log_rate
from creepkit.testing.law_dimensions import DimensionError, check_dimensions
from creepkit.testing.reports import ConformanceCheck
from creepkit.testing.sample_points import LawSamples, constraints_hold

NAME_OF_LAW = re.compile(r"[a-z0-9]+([-_][a-z0-9]+)*([+*(\[@].*)?")
"""Words in small letters joined by hyphens; what sums and temperature add may follow."""


EXAMPLE_TOLERANCE = 1e-6


def check_name(law: CreepLaw, _: LawSamples) -> Iterator[ConformanceCheck]:
    """The name has the stated pattern, and no other plugin has it."""
    if not NAME_OF_LAW.fullmatch(law.name):
        detail = f"'{law.name}' is not in small letters and digits joined by hyphens, such as my-law; rename it"
        yield ConformanceCheck("name", False, detail)
        return
    registered = default_registry().laws().get(law.name)  # a file stands in for an installed plugin
    plugins = () if registered is not None and registered.value == law else default_registry().plugins()
    for plugin in plugins:
        other = plugin.contributions.get("law", {}).get(law.name)
        if other is not None and other != law:
            yield ConformanceCheck(
                "name", False, f"'{law.name}' is taken, by {plugin.provenance}; give the law another name"
            )
            return
    yield ConformanceCheck("name", True, law.name)


def check_references(law: CreepLaw, _: LawSamples) -> Iterator[ConformanceCheck]:
    """Each reference says who and when; one of a letter each is a text in the place of a tuple."""
    short = [reference for reference in law.references if len(reference.strip()) < 2]
    detail = f"{len(law.references)} given"
    if short:
        detail = f"{short[0]!r} is none; write a tuple of texts, references=('Norton (1929), The Creep of Steel',)"
    yield ConformanceCheck("references", not short, detail)


def check_units(law: CreepLaw, _: LawSamples) -> Iterator[ConformanceCheck]:
    """The units of parameters make rates in 1/s and arguments of functions without a unit."""
    try:
        check_dimensions(law)
    except DimensionError as error:
        yield ConformanceCheck("dimensions", False, str(error))
        return
    yield ConformanceCheck("dimensions", True, "rates in 1/s")


def check_temperature(law: CreepLaw, samples: LawSamples) -> Iterator[ConformanceCheck]:
    """The rate grows with temperature at most points, or the law declares that it falls."""
    if not law.uses(temperature):
        return
    points = samples.points.copy()
    points[:, POINT_VARIABLES.index(temperature)] *= 1.01
    kernel, warmer = lower(law, "numpy"), LawSamples(points, samples.theta)
    before, after = log_rate(kernel, samples), log_rate(kernel, warmer)
    counted = np.isfinite(before) & np.isfinite(after) & constraints_hold(law, points, samples.theta)
    falling, rising = int((after < before)[counted].sum()), int((after > before)[counted].sum())
    if falling > rising and not law.falls_with_temperature:
        detail = (
            f"a higher temperature lowers it at {falling} of {int(counted.sum())} points; check the sign of the "
            "activation energy, exp(-Q/(R T)), or declare falls_with_temperature=True"
        )
        yield ConformanceCheck("rate grows with temperature", False, detail)
        return
    yield ConformanceCheck("rate grows with temperature", True, f"at {rising} of {int(counted.sum())} points")


def check_examples(law: CreepLaw, _: LawSamples) -> Iterator[ConformanceCheck]:
    """Each example of the author has the rate that he states."""
    known = {s.name for s in (*POINT_VARIABLES, *law.states)}
    for position, example in enumerate(law.examples, 1):
        name, given = f"example {position}", dict(example)
        stated = float(given.pop("rate"))
        unknown = [key for key in given if key not in known and key not in law.names]
        missing = [key for key in law.names if key not in given]
        missing += [s.name for s in (*POINT_VARIABLES, *law.states) if law.uses(s) and s.name not in given]
        if unknown or missing:
            detail = f"it has no {missing[0]}" if missing else f"it has {unknown[0]}, which the law does not know"
            yield ConformanceCheck(name, False, f"{detail}; give every parameter and what the rates use of the point")
            continue
        theta = law.to_internal(law.values({key: given[key] for key in law.names}))[0]
        point = np.array([float(given.get(s.name, 0.0)) for s in (*POINT_VARIABLES, *law.states)])
        found = float(sum(MultiprecisionLaw(law).terms(point, theta)))
        passed = abs(found - stated) <= EXAMPLE_TOLERANCE * abs(stated)
        detail = f"{found:.7g} 1/s" + ("" if passed else f", and the example states {stated:.7g}; correct one of them")
        yield ConformanceCheck(name, passed, detail)
