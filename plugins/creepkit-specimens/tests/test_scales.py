"""Reference stress and growth per strain against simulations: they say how fast a test piece creeps, to a third."""

from __future__ import annotations

import numpy as np
import pytest
from creepkit_specimens.notched_bar import NotchedBar, NotchedRelaxation
from creepkit_specimens.plate_bulge import DomeBulge, PlateBulge
from creepkit_specimens.tube import OpenTube, Tube

import creepkit as ck

PIECES = {
    "tube": (Tube(), "pressure", 20.0),
    "thick tube": (Tube(thickness=5.0), "pressure", 60.0),
    "open tube": (OpenTube(), "pressure", 20.0),
    "plate-bulge": (PlateBulge(), "pressure", 0.5),
    "larger plate": (PlateBulge(radius=30.0), "pressure", 0.1),
    "dome-bulge": (DomeBulge(), "pressure", 4.0),
    "notched bar": (NotchedBar(), "force", 6000.0),
    "blunt notch": (NotchedBar(notch_radius=8.0, gauge_length=40.0), "force", 6000.0),
}


def plan_of(specimen: ck.Axisymmetric, load: str, value: float, modulus: float) -> ck.History:
    outputs = {name: np.zeros(1) for name in specimen.outputs}
    return ck.History(
        "plan", [1.0], outputs, ck.constant_load(load, value), 1000.0, specimen=specimen.name,
        elastic=ck.Elastic(E=modulus),
    )  # fmt: skip


@pytest.mark.parametrize("piece", PIECES)
def test_a_piece_grows_as_it_says(piece: str) -> None:
    """Steady creep with n = 5, from 1.5e-4 to 3e-4 of creep at the reference stress."""
    specimen, load, value = PIECES[piece]
    plan = plan_of(specimen, load, value, 9e7)
    stress, growth = specimen.reference_stress(plan), specimen.growth_per_strain(plan)
    run = ck.simulate(
        "norton", specimen.replace(resolution=1e-5), {"A": 1e-9 / stress[-1] ** 5, "n": 5.0}, loading=plan.loading,
        elastic=plan.elastic, temperature=1000.0, times=[1.5e5, 3e5],
    )  # fmt: skip
    grown = np.diff(run.outputs[specimen.outputs[0]])[0]
    assert grown / (1.5e-4 * growth) == pytest.approx(1.0, abs=0.35)


def test_a_held_bar_knows_its_elastic_force() -> None:
    """Sections in a row are softer than a notch that they cannot follow, by some percent."""
    bar = NotchedRelaxation()
    plan = plan_of(bar, "displacement", 0.02, 150e3)
    run = ck.simulate(
        "norton", bar, {"A": 1e-40, "n": 1.0}, loading=plan.loading, elastic=plan.elastic, temperature=1000.0,
        times=[1.0],
    )  # fmt: skip
    stress = run.outputs["force"][0] / (16.0 * np.pi * bar.constraint)
    assert bar.reference_stress(plan)[0] == pytest.approx(stress, rel=0.1)
