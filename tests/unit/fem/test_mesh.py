"""The eight-node element, strips of it, and what is said of meshes, against polynomials and closed forms."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from creepkit.errors import SolveError
from creepkit.fem.finite_element_model import finite_element_model
from creepkit.fem.mesh import CORNERS, Mesh, discretize, shape_functions, shape_gradients, strip_mesh
from creepkit.fem.section import Section
from creepkit.fem.simulation import LoadHistory, Simulation, simulate
from creepkit.fem.solver import SolverSettings
from creepkit.laws.norton import NORTON
from creepkit.records import Program, Status
from helpers.fem_cases import lowered, mesh_quality

MIDDLES = 0.5 * (CORNERS + np.roll(CORNERS, -1, axis=0))
NODES = np.vstack([CORNERS, MIDDLES])
CENTRE = np.array([3.0, 0.0])
PLACES = np.random.default_rng(1).uniform(-1, 1, (40, 2))


def ring(columns: int, layers: int, bend: float = 0.4) -> Mesh:
    """A quarter of a ring around (3, 0), from radius 1 to 2; its nodes lie on rays, at uneven places by `bend`."""
    angle = np.linspace(np.pi / 2, 0, 2 * columns + 1)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    breaks = np.linspace(0, 1, layers + 1) ** (1 + bend)
    body = strip_mesh(CENTRE + circle, CENTRE + 2 * circle, breaks)
    held = np.zeros(body.nodes.shape, bool)
    held[body.last] = True
    return Mesh(body.nodes, body.elements, held, body.inner, [])


def test_shape_functions_are_one_at_their_node_and_zero_at_the_others():
    np.testing.assert_allclose(shape_functions(NODES), np.eye(8), atol=1e-15)


def test_shape_functions_reproduce_every_serendipity_monomial():
    powers = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (2, 1), (1, 2)]
    for i, j in powers:
        at_nodes, there = NODES[:, 0] ** i * NODES[:, 1] ** j, PLACES[:, 0] ** i * PLACES[:, 1] ** j
        np.testing.assert_allclose(shape_functions(PLACES) @ at_nodes, there, atol=1e-14)


def test_shape_gradients_are_the_differences_of_the_values():
    step = 1e-6
    for k in range(2):
        move = step * np.eye(2)[k]
        slope = (shape_functions(PLACES + move) - shape_functions(PLACES - move)) / (2 * step)
        np.testing.assert_allclose(shape_gradients(PLACES)[:, :, k], slope, atol=1e-9)


def test_a_linear_field_has_its_gradient_at_every_point_of_a_curved_mesh():
    mesh = ring(5, 3)
    at = discretize(mesh)
    values = (2.0 + 3.0 * mesh.nodes[:, 0] - 5.0 * mesh.nodes[:, 1])[mesh.elements][:, None]
    np.testing.assert_allclose((at.by_radius * values).sum(axis=2), 3.0, atol=1e-12)
    np.testing.assert_allclose((at.by_height * values).sum(axis=2), -5.0, atol=1e-12)
    there = 2.0 + 3.0 * at.points[:, :, 0] - 5.0 * at.points[:, :, 1]
    np.testing.assert_allclose((at.over_radius * values).sum(axis=2), there / at.points[:, :, 0], atol=1e-12)


def test_geometry_change_is_the_derivative_of_what_the_mesh_becomes():
    mesh = ring(3, 2)
    velocity = np.random.default_rng(2).normal(size=mesh.nodes.shape)
    held = replace(mesh, held=np.ones(mesh.nodes.shape, dtype=bool))
    change, step = finite_element_model(held).geometry_derivative(velocity), 1e-6
    ahead, behind = (discretize(mesh.moved(mesh.nodes + s * velocity)) for s in (step, -step))
    at = discretize(mesh)
    growth = np.log(ahead.weights / behind.weights) / (2 * step)
    np.testing.assert_allclose(np.trace(change.gradient, axis1=2, axis2=3) + change.hoop, growth, atol=1e-8)
    slopes = np.stack([at.by_radius, at.by_height], axis=3)
    moved = (np.stack([ahead.by_radius, ahead.by_height], 3) - np.stack([behind.by_radius, behind.by_height], 3)) / 2e-6
    np.testing.assert_allclose(-np.einsum("epaj,epji->epai", slopes, change.gradient), moved, atol=1e-6)


def test_sides_of_a_strip_lie_on_its_lines_with_the_solid_to_their_left():
    angle = np.linspace(np.pi / 2, 0, 9)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    body = strip_mesh(CENTRE + circle, CENTRE + 2 * circle, np.array([0, 0.2, 1.0]))
    for sides, radius, sense in ((body.inner, 1, -1), (body.outer, 2, 1)):
        ends = body.nodes[sides] - CENTRE
        np.testing.assert_allclose(np.hypot(*ends.reshape(-1, 2).T), radius, rtol=1e-14)
        first, last = ends[:, 0], ends[:, 2]
        assert (sense * (first[:, 0] * last[:, 1] - first[:, 1] * last[:, 0]) > 0).all()
    np.testing.assert_array_equal(body.inner_line[::2], np.append(body.inner[:, 0], body.inner[-1, 2]))
    np.testing.assert_array_equal(body.outer_line[::2], np.append(body.outer[:, 2], body.outer[-1, 0]))
    np.testing.assert_allclose(body.nodes[body.first][:, 0], 3.0, atol=1e-15)
    np.testing.assert_allclose(body.nodes[body.last][:, 1], 0.0, atol=1e-15)
    np.testing.assert_allclose(body.nodes[body.last][:, 0], [4, 4.1, 4.2, 4.6, 5.0], rtol=1e-14)


def test_quality_is_one_of_a_rectangle_and_the_sine_of_a_parallelogram():
    for lean, sine in ((0.0, 1.0), (1.0, np.sqrt(0.5))):
        nodes = NODES @ [[2.0, 0.0], [lean, 1.0]] + [5.0, 0.0]
        worst = mesh_quality(Mesh(nodes, [np.arange(8)], np.zeros((8, 2), bool), [], []))
        assert worst.sine == pytest.approx(sine)
        assert worst.evenness == pytest.approx(1.0)


def test_an_inverted_element_is_refused():
    mesh = ring(3, 2)
    inverted = mesh.elements.copy()
    inverted[4] = inverted[4][[0, 3, 2, 1, 7, 6, 5, 4]]
    message = (
        "element 4 of the mesh, near r = 4.11 mm, z = 0.2974 mm, is inverted (1 of 6 elements are); number its "
        "corners anticlockwise and keep its middle nodes near the middle of its sides, or change the refinement of a "
        "mesh that was made here"
    )
    with pytest.raises(SolveError, match=f"^{re.escape(message)}$"):
        discretize(Mesh(mesh.nodes, inverted, mesh.held, mesh.pressed, mesh.top))


def test_a_middle_node_beyond_a_quarter_of_its_side_is_refused():
    nodes = NODES + CENTRE
    nodes[4] = [2.4, -1.0]
    with pytest.raises(SolveError, match="element 0 of the mesh, near r = 3 mm, z = 0 mm, is inverted"):
        discretize(Mesh(nodes, [np.arange(8)], np.zeros((8, 2), bool), [], []))


# ---- section ---------------------------------------------------------------------------------------------------------

# Sections: meshes with named sides and points, held and loaded; forces, planes and moved sides in the core.


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
