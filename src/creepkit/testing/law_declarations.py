"""Checks of what an author states about a law: name, texts, units, examples, signs and temperature."""

from __future__ import annotations

import pickle
import re

import mpmath
import numpy as np

from creepkit.kernels.lowering import lower
from creepkit.kernels.multiprecision import MultiprecisionLaw
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import POINT_VARIABLES, temperature
from creepkit.registry import default_registry
from creepkit.testing.law_dimensions import check_dimensions
from creepkit.testing.reports import finding
from creepkit.testing.sample_points import LawSamples, constraints_hold, log_rate, point_text

NAME_OF_LAW = re.compile(r"[a-z0-9]+([-_][a-z0-9]+)*([+*(\[@].*)?")
"""Words in small letters joined by hyphens; what sums and temperature add may follow."""


FEWEST_SAMPLES = 8
"""At which the constraints must hold for a verdict to mean something."""


EXAMPLE_TOLERANCE = 1e-6


@finding("constraints")
def check_constraints(_: CreepLaw, samples: LawSamples) -> str:
    """The constraints hold at enough points of the bounds."""
    assert len(samples) >= FEWEST_SAMPLES, (
        f"the constraints hold at {len(samples)} of the samples; widen them or narrow the bounds"
    )
    return f"{len(samples)} points"


@finding("no term is negative")
def check_signs(law: CreepLaw, samples: LawSamples) -> str:
    """Each term is evaluated as the author wrote it."""
    exact = MultiprecisionLaw(law)
    for point, theta in zip(samples.points, samples.theta, strict=True):
        for label, value in zip(law.terms, exact.terms(point, theta), strict=True):
            assert mpmath.im(value) == 0 and value >= 0, (
                f"term '{label}' is {mpmath.nstr(value, 4)} 1/s at {point_text(law, point)}; say in constraints where "
                "the law holds, constraints=(stress > s0,), or use Max(stress - s0, 0)"
            )
    return f"{len(samples)} points"


@finding("name")
def check_name(law: CreepLaw, _: LawSamples) -> str:
    """The name has the stated pattern, and no other plugin has it."""
    assert NAME_OF_LAW.fullmatch(law.name), (
        f"'{law.name}' is not in small letters and digits joined by hyphens, such as my-law; rename it"
    )
    for plugin in default_registry().plugins():
        other = plugin.contributions.get("law", {}).get(law.name)
        taken = other is not None and other != law
        assert not taken, f"'{law.name}' is taken, by {plugin.provenance}; give the law another name"
    return law.name


@finding("title, references, units")
def check_texts(law: CreepLaw, _: LawSamples) -> str:
    """Title, references and units are there, and each reference says who and when."""
    assert law.title.strip(), "missing title, such as title='Norton power law'"
    example = "references=('Norton (1929), The Creep of Steel at High Temperatures',)"
    assert law.references, f"missing references, such as {example}"
    short = [reference for reference in law.references if len(reference.strip()) < 2]
    assert not short, f"{short[0]!r} is no reference; write a tuple of texts, {example}"
    missing = [name for name, param in law.table.items() if not param.unit]
    assert not missing, f"missing unit of {', '.join(missing)}"
    return "present"


@finding("dimensions")
def check_units(law: CreepLaw, _: LawSamples) -> str:
    """The units of parameters make rates in 1/s and arguments of functions without a unit."""
    check_dimensions(law)
    return "rates in 1/s"


@finding("LaTeX, source and copies")
def check_printing(law: CreepLaw, _: LawSamples) -> str:
    """LaTeX and source print, and the law survives pickling."""
    text, source, copy = law.latex(), lower(law, "numpy").source, pickle.loads(pickle.dumps(law))
    assert text.count("{") == text.count("}") and text.count(r"\left") == text.count(r"\right"), text
    assert "def rate" in source, source
    assert copy == law and copy.fingerprint == law.fingerprint, "a copy in another process is another law"
    return f"{len(text)} and {len(source)} characters"


@finding("rate grows with temperature")
def check_temperature(law: CreepLaw, samples: LawSamples) -> str | None:
    """The rate grows with temperature at most points, or the law declares that it falls."""
    if not law.uses(temperature):
        return None
    warmer = samples.scaled([POINT_VARIABLES.index(temperature)], 1.01)
    before, after = (log_rate(lower(law, "numpy"), one) for one in (samples, warmer))
    counted = np.isfinite(before) & np.isfinite(after) & constraints_hold(law, warmer.points, warmer.theta)
    falling, rising = int((after < before)[counted].sum()), int((after > before)[counted].sum())
    assert falling <= rising or law.falls_with_temperature, (
        f"a higher temperature lowers it at {falling} of {int(counted.sum())} points; check the sign of the activation "
        "energy, exp(-Q/(R T)), or declare falls_with_temperature=True"
    )
    return f"at {rising} of {int(counted.sum())} points"


@finding("example {}", each=lambda law, _: range(1, len(law.examples) + 1))
def check_example(law: CreepLaw, _: LawSamples, number: int) -> str:
    """An example of the author has the rate that he states."""
    variables, given = (*POINT_VARIABLES, *law.states), dict(law.examples[number - 1])
    stated = float(given.pop("rate"))
    missing = [key for key in law.names if key not in given]
    missing += [s.name for s in variables if law.uses(s) and s.name not in given]
    remedy = "give every parameter and what the rates use of the point"
    assert not missing, f"it has no {missing[0]}; {remedy}"
    unknown = given.keys() - {s.name for s in variables} - {*law.names}
    assert not unknown, f"it has {min(unknown)}, which the law does not know; {remedy}"
    theta = law.to_internal(law.values({key: given[key] for key in law.names}))[0]
    point = np.array([float(given.get(s.name, 0.0)) for s in variables])
    found = float(sum(MultiprecisionLaw(law).terms(point, theta)))
    assert abs(found - stated) <= EXAMPLE_TOLERANCE * abs(stated), (
        f"{found:.7g} 1/s, and the example states {stated:.7g}; correct one of them"
    )
    return f"{found:.7g} 1/s"
