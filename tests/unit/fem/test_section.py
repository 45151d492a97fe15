"""Sections: meshes with named sides and points, joined, held and loaded; forces, planes and moved sides in the core."""

from __future__ import annotations

import numpy as np
import pytest

from creepkit.fem.section import Section
from creepkit.fem.simulation import LoadHistory, Simulation, simulate
from creepkit.fem.solver import SolverSettings
from creepkit.laws.norton import NORTON
from creepkit.records import Program, Status
from helpers.fem_cases import lowered

E, NU = 1e5, 0.3
STILL = {"A": 1e-40, "n": 1.0}
BAR = Section.rectangle((0.0, 0.0), (2.0, 3.0), 3, 2)


def simulated(section: Section, observed, *, load: float = 0.0, motion: float = 0.0, values=STILL, end=1.0, poisson=NU):
    """A complete simulation under a constant load or motion from time zero."""
    kernel, theta = lowered(NORTON), NORTON.to_internal(values)[0]
    constant = Program.constant
    history = LoadHistory(constant(load), constant(1000.0), constant(E), end, poisson, constant(motion))
    settings = SolverSettings(tolerance=1e-4, newton=1e-9, deflection_limit=np.inf, least=1e-6)
    made = simulate(kernel, theta, section.model(np.asarray(observed)), history, settings=settings)
    assert made.status is Status.COMPLETE
    return made


def top_of(section: Section, made: Simulation) -> np.ndarray:
    """u_z of the nodes of the top in the end, mm."""
    return made.displacements[-1, np.unique(section.sides["top"]), 1]


def test_a_rectangle_has_its_sides_and_corners() -> None:
    for name, (axis, value) in {"bottom": (1, 0.0), "top": (1, 3.0), "left": (0, 0.0), "right": (0, 2.0)}.items():
        assert (BAR.nodes[np.unique(BAR.sides[name]), axis] == value).all()
    assert [len(BAR.sides[name]) for name in ("bottom", "top", "left", "right")] == [3, 3, 2, 2]
    np.testing.assert_array_equal(BAR.nodes[BAR.points["top_right"]], (2.0, 3.0))
    np.testing.assert_array_equal(BAR.nodes[BAR.points["bottom_left"]], (0.0, 0.0))


def test_a_dead_force_stretches_a_bar_as_hooke_says() -> None:
    """The force is Kirchhoff stress times area over stretch, whether the face is a plane or not."""
    force = 1e-3 * E * 4.0 * np.pi
    for face in (lambda s: s, lambda s: s.plane("top")):
        bar = face(BAR.hold("bottom", z=True)).pull("top", force)
        strain = np.log1p(top_of(bar, simulated(bar, [], load=1.0)) / 3.0)
        np.testing.assert_allclose(strain * np.exp(-strain), 1e-3, rtol=1e-6)


def test_a_force_is_shared_as_the_area_is() -> None:
    """A unit force has the sum 1/(2 pi) over the radian, and pulls evenly: no shear, the same strain everywhere."""
    bar = BAR.hold("bottom", z=True).pull("top", 5.0)
    assert bar.forces[:, 1].sum() * 2 * np.pi == pytest.approx(5.0, rel=1e-12)
    made = simulated(bar, [], load=100.0)
    heights, axial = bar.nodes[:, 1], made.displacements[-1, :, 1]
    np.testing.assert_allclose(axial, heights / 3.0 * axial.max(), atol=1e-12)


def test_a_plane_has_one_displacement() -> None:
    """A force on the outer half of a face alone; the free face bends, the plane does not."""
    section = BAR.hold("bottom", z=True).with_side("rim", lambda r, z: (z > 2.999) & (r > 1.3))
    free, plane = section.pull("rim", 1e4), section.plane("top").pull("rim", 1e4)
    assert np.ptp(top_of(free, simulated(free, [], load=1.0))) > 1e-3
    found = top_of(plane, simulated(plane, [], load=1.0))
    assert np.ptp(found) == 0.0
    # the force does the same work on the mean of the face whatever its place: as an even one
    even = section.plane("top").pull("top", 1e4)
    np.testing.assert_allclose(found, top_of(even, simulated(even, [], load=1.0)), rtol=1e-9)


def test_a_moved_side_needs_the_force_that_moves_it() -> None:
    """Hooke's law for a bar in logarithmic strain, and the same force moves it as far."""
    bar = BAR.hold("bottom", z=True)
    made = simulated(bar.move("top"), [], motion=0.01)
    strain = np.log1p(0.01 / 3.0)
    assert 2 * np.pi * made.reactions[-1] == pytest.approx(E * strain * 4.0 * np.pi * np.exp(-strain), rel=1e-7)
    back = bar.plane("top").pull("top")
    again = simulated(back, [], load=2 * np.pi * float(made.reactions[-1]))
    np.testing.assert_allclose(top_of(back, again), 0.01, rtol=1e-6)


def test_observed_displacements_do_not_change_a_simulation() -> None:
    """Which are observed decides what errors are measured by, so the steps, but no equation."""
    bar, values = BAR.hold("bottom", z=True).pull("top"), {"A": 1e-12, "n": 3.0}
    ends = [
        simulated(bar, observed, load=500.0, values=values, end=1e4).displacements[-1]
        for observed in ([], [2 * BAR.points["top_left"] + 1], [2 * BAR.points["bottom_right"]])
    ]
    for end in ends[1:]:
        np.testing.assert_allclose(end, ends[0], rtol=1e-4, atol=1e-9)


def test_joined_sections_are_one_body() -> None:
    """A bar of two blocks strains as one of one block, and the inner side is no side any more."""
    lower = Section.rectangle((0.0, 0.0), (2.0, 1.0), 3, 1)
    upper = Section.rectangle((0.0, 1.0), (2.0, 3.0), 3, 2)
    both = lower.joined(upper)
    assert len(both.nodes) == len(lower.nodes) + len(upper.nodes) - 7
    assert set(both.sides) == {"bottom", "left", "right", "top"}
    assert len(both.sides["right"]) == 3
    for each in (both, BAR):
        bar = each.hold("bottom", z=True).pull("top", 1e3)
        strain = np.log1p(top_of(bar, simulated(bar, [], load=1.0)) / 3.0)
        np.testing.assert_allclose(strain * np.exp(-strain), 1e3 / (E * 4.0 * np.pi), rtol=1e-7)
