"""The dimple's mesh against closed forms of its section, over the whole family."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from creepkit.fem.mesh import discretize, half_bandwidth, outline, refuse_inverted, strip_nodes
from creepkit.specimens.bulge.geometry import DimpleGeometry, column_lines, mesh_layout
from helpers.fem_cases import mesh_quality

TAPERED = DimpleGeometry()
FILLET = DimpleGeometry(1.0, 5.0, 1.0, 1.5, 4.0, 7.5, ("rim",))
THIN = DimpleGeometry(0.2, 5.0, 1.0, 0.3, 4.0, 7.5)
NO_WALL = DimpleGeometry(roof_axial=3.5)
SHORT_WALL = DimpleGeometry(roof_axial=3.45)
SHORT_FLOOR = DimpleGeometry(roof_radial=7.2)
THICK = DimpleGeometry(3.0, 7.5, 7.5, 0.9, 4.0, 10.0)
FAMILY = [TAPERED, FILLET, THIN, NO_WALL, SHORT_WALL, SHORT_FLOOR, THICK]


def area(g: DimpleGeometry) -> float:
    """Section of the disc less that of the cavity: floor, quarter ellipse and what lies below it."""
    R, a, b, h, H = g.cavity_radius, g.roof_radial, g.roof_axial, g.apex_thickness, g.plate_thickness
    return g.outer_radius * H - (R - a) * (H - h) - a * (H - h - b) - np.pi / 4 * a * b


def volume(g: DimpleGeometry) -> float:
    """Volume over 2 pi, from the first moment of a quarter ellipse about r = R - a: a^2 b / 3."""
    R, a, b, h, H = g.cavity_radius, g.roof_radial, g.roof_axial, g.apex_thickness, g.plate_thickness
    below = (R - a) ** 2 / 2 * (H - h) + (R**2 - (R - a) ** 2) / 2 * (H - h - b)
    return g.outer_radius**2 / 2 * H - below - (R - a) * np.pi / 4 * a * b - a**2 * b / 3


def errors(g: DimpleGeometry, refinement: float) -> np.ndarray:
    at = discretize(g.mesh(refinement))
    found = np.array([(at.weights / at.points[:, :, 0]).sum(), at.weights.sum()])
    return np.abs(found / [area(g), volume(g)] - 1)


def test_the_production_meshes():
    tapered, fillet = TAPERED.mesh(), FILLET.mesh()
    assert [len(m.elements) for m in (tapered, fillet)] == [50, 75]
    assert [half_bandwidth(m.elements) for m in (tapered, fillet)] == [39, 39]
    assert tapered.nodes.size == 362
    layers = np.array([0, 0.16, 0.38, 0.57, 0.68, 1])
    np.testing.assert_allclose(tapered.nodes[:11:2, 1], 3.5 + 0.5 * layers, rtol=1e-14)
    np.testing.assert_allclose(fillet.nodes[:11:2, 1], [3, 3.17, 3.4, 3.6, 3.83, 4], rtol=1e-14)
    np.testing.assert_allclose(fillet.nodes[fillet.pressed[:8, 2], 0], 0.5 * np.arange(1, 9), rtol=1e-13)
    assert mesh_quality(tapered).sine.min() > 0.6
    assert mesh_quality(fillet).sine.min() > 0.7


@pytest.mark.parametrize("g", FAMILY, ids=range(len(FAMILY)))
def test_area_and_volume_converge_with_the_fourth_order(g):
    coarse, fine = errors(g, 2), errors(g, 4)
    assert coarse.max() < 1e-4
    assert g is SHORT_WALL or (np.log2(coarse / fine) > 3.5)[fine > 1e-12].all()  # its wall has no column before 5.5


def test_a_short_wall_gets_a_column_when_columns_are_short_enough():
    coarse, fine = errors(SHORT_WALL, 6), errors(SHORT_WALL, 12)
    assert (np.log2(coarse / fine) > 3.5).all()


@pytest.mark.parametrize("g", FAMILY, ids=range(len(FAMILY)))
@pytest.mark.parametrize("refinement", [0.5, 1, 1.7])
def test_sides_are_where_they_belong(g, refinement):
    mesh = g.mesh(refinement)
    r, z = mesh.nodes[mesh.pressed.ravel()].T
    R, a, b = g.cavity_radius, g.roof_radial, g.roof_axial
    roof = g.plate_thickness - g.apex_thickness - b
    on_roof = z > roof
    np.testing.assert_allclose(((np.maximum(r - R + a, 0) / a) ** 2 + ((z - roof) / b) ** 2)[on_roof], 1, rtol=1e-12)
    np.testing.assert_allclose(r[~on_roof], R, rtol=1e-13)
    first, last = mesh.nodes[mesh.pressed[:, 0]], mesh.nodes[mesh.pressed[:, 2]]
    np.testing.assert_array_equal(first[1:], last[:-1])
    np.testing.assert_allclose([first[0], last[-1]], [[0, g.plate_thickness - g.apex_thickness], [R, 0]], rtol=1e-14)
    top = mesh.nodes[mesh.top]
    assert (np.diff(top[:, 0]) > 0).all()
    assert len(top) % 2 == 1
    assert (top[[0, -1], 0] == [0, g.outer_radius]).all()
    assert (top[:, 1] == g.plate_thickness).all()
    assert {len(np.unique(side)) for side in mesh.pressed} == {3}


@pytest.mark.parametrize("g", FAMILY, ids=range(len(FAMILY)))
@pytest.mark.parametrize("clamped", [("bottom",), ("rim",), ("bottom", "rim")])
def test_what_is_clamped_is_held_and_nothing_else(g, clamped):
    g = g.replace(clamped=clamped)
    mesh = g.mesh()
    r, z = mesh.nodes.T
    where = np.zeros(len(r), bool)
    if "bottom" in clamped:
        where |= z == 0
    if "rim" in clamped:
        where |= r == g.outer_radius
    np.testing.assert_array_equal(mesh.held[:, 1], where)
    np.testing.assert_array_equal(mesh.held[:, 0], where | (r == 0))
    assert (r == 0).sum() == 11


@st.composite
def dimples(draw) -> DimpleGeometry:
    share = st.floats(0, 1)
    R = 10 ** draw(st.floats(0, 1.5))
    a = R * (0.1 + 0.9 * min(1.0, 1.3 * draw(share)))
    H = R * 10 ** (-0.8 + draw(share))
    h = H * (0.05 + 0.65 * draw(share))
    b = (H - h) * (0.1 + 0.9 * min(1.0, 1.2 * draw(share)))
    return DimpleGeometry(h, R, a, b, H, R * (1 + 10 ** -draw(share)))


@settings(max_examples=150, deadline=None)
@given(dimples(), st.sampled_from([0.5, 0.75, 1.0, 1.3, 2.0]))
def test_every_dimple_of_a_wide_family_has_a_sound_mesh(g, refinement):
    mesh = g.mesh(refinement)
    refuse_inverted(mesh)
    worst = mesh_quality(mesh)
    assert worst.sine.min() > 0.04
    assert worst.evenness.min() > 0.01


@pytest.mark.parametrize("g", FAMILY, ids=range(len(FAMILY)))
@pytest.mark.parametrize("field", DimpleGeometry.lengths)
def test_velocities_of_the_nodes_are_the_differences_of_the_mesh(g, field):
    """The mesh as the dimple of that length has it, unless its columns are more or fewer there."""
    value = getattr(g, field)
    step = 1e-6 * value
    sizes = [g._dimensions()._replace(**{field: value + s * step}) for s in (1, -1)]
    layouts = [mesh_layout(size, 1.0) for size in sizes]
    if layouts[0].counts != layouts[1].counts:
        layouts = [g._layout(1.0)] * 2
    one, other = (
        strip_nodes(*column_lines(size, layout), layout.breaks) for size, layout in zip(sizes, layouts, strict=True)
    )
    central = (one - other) / (2 * step)
    velocity = g.mesh_velocity(field)
    # at the ends of the allowed range, as roof_radial = cavity_radius, the curve goes on with another curvature
    np.testing.assert_allclose(velocity, central, atol=5e-6)


def test_the_outline_is_the_cavity_the_top_the_rim_the_ground_and_the_axis():
    for g in FAMILY:
        mesh = g.mesh()
        columns, layers = len(mesh.pressed), 5
        assert len(outline(mesh.elements)) == 2 * (columns + layers)
