"""Meshes read from files: the paper's own mesh, decks of CalculiX, small files written here, and what is refused."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from creepkit.errors import SolveError
from creepkit.fem.finite_element_model import finite_element_model
from creepkit.fem.mesh import Mesh, discretize, half_bandwidth, renumbered
from creepkit.fem.mesh_files import read_mesh
from creepkit.specimens.bulge.geometry import DimpleGeometry
from helpers.decks import mesh_of_deck
from helpers.fem_cases import mesh_quality
from helpers.paths import SHARED, needs_shared_data

DATA = SHARED

NODES = """id,r_mm,z_mm
1,0,0
2,1,0
3,2,0
4,0,1
5,1,1
6,2,1
"""
QUADS = "id,n1,n2,n3,n4\n1,1,2,5,4\n2,2,5,6,3\n"
"""Two squares side by side; the second goes round clockwise, so that its side at z = 0 is the fourth."""

SETS = {"top": [4, 5, 6], "encastre": [3, 6], "pressure_face_S1": [1], "pressure_face_S4": [2]}


def write(folder: Path, nodes: str = NODES, quads: str = QUADS, **sets: list) -> Mesh:
    (folder / "nodes.csv").write_text(nodes)
    (folder / "quads.csv").write_text(quads)
    (folder / "sets.json").write_text(json.dumps(SETS | sets))
    return read_mesh(folder / "nodes.csv", folder / "quads.csv", folder / "sets.json")


def push(mesh: Mesh) -> np.ndarray:
    """Resultant of a unit pressure on the pressed sides over 2 pi: in r of the section, and in z."""
    first, last = mesh.nodes[mesh.pressed[:, 0]], mesh.nodes[mesh.pressed[:, 2]]
    return np.array([(first - last)[:, 1].sum(), 0.5 * (last**2 - first**2)[:, 0].sum()])


@needs_shared_data
def test_the_mesh_of_the_paper():
    folder = DATA / "dabi"
    mesh = read_mesh(*(folder / f"paper_mesh_{name}" for name in ("nodes.csv", "quads.csv", "sets.json")))
    assert len(mesh.elements) == 2117
    corners = np.unique(mesh.elements[:, :4])
    assert corners.size == 2268
    assert len(mesh.nodes) == 2268 + 2268 + 2117 - 1  # Euler: as many sides as corners and elements, less one
    at, ours = discretize(mesh), discretize(DimpleGeometry().mesh(2))
    for exact, found in (
        (ours.weights / ours.points[..., 0], at.weights / at.points[..., 0]),
        (ours.weights, at.weights),
    ):
        assert found.sum() == pytest.approx(exact.sum(), rel=1e-4)  # its sides are straight on the ellipse
    np.testing.assert_allclose(push(mesh), [2.0 + 1.5, 7.5**2 / 2], rtol=1e-12)
    top = mesh.nodes[mesh.top]
    assert (top[[0, -1]] == [[0, 4], [7.5, 4]]).all()
    assert (np.diff(top[:, 0]) > 0).all()
    r, z = mesh.nodes.T
    np.testing.assert_array_equal(mesh.held[:, 1], (r == 10) | ((z == 0) & (r >= 7.5)))
    assert half_bandwidth(mesh.elements) < 400


@needs_shared_data
@pytest.mark.parametrize("name", ["dabi_timehardening.inp", "dabi_norton_in625_800C_steady.inp"])
def test_decks_of_calculix(name, tmp_path):
    mesh = mesh_of_deck(DATA / "benchmarks" / "dabi_ccx" / name, tmp_path)
    assert (len(mesh.elements), len(mesh.nodes), len(mesh.pressed), len(mesh.top)) == (174, 613, 35, 61)
    area = (discretize(mesh).weights / discretize(mesh).points[..., 0]).sum()
    assert area == pytest.approx(10 * 4 - 7.5 * 2 - np.pi / 4 * 7.5 * 1.5, rel=1e-5)
    np.testing.assert_allclose(push(mesh), [2.0 + 1.5, 7.5**2 / 2], rtol=1e-12)
    np.testing.assert_allclose(mesh.nodes[mesh.top], np.stack([np.arange(61) / 8, np.full(61, 4.0)], axis=1))
    r, z = mesh.nodes.T
    np.testing.assert_array_equal(mesh.held[:, 1], (r == 10) | ((z == 0) & (r >= 7.5)))


def test_tables_become_a_mesh_of_eight_node_elements(tmp_path):
    """Two squares, pressed from below, held at r = 2."""
    mesh = write(tmp_path)
    assert (len(mesh.elements), len(mesh.nodes)) == (2, 13)
    np.testing.assert_allclose(mesh_quality(mesh).sine, 1.0)
    np.testing.assert_allclose(push(mesh), [0.0, 2.0], atol=1e-15)
    np.testing.assert_allclose(mesh.nodes[mesh.top], [[r, 1] for r in (0, 0.5, 1, 1.5, 2)])
    np.testing.assert_array_equal(mesh.held[:, 1], mesh.nodes[:, 0] == 2)
    np.testing.assert_array_equal(mesh.held[:, 0], np.isin(mesh.nodes[:, 0], [0, 2]))


def test_eight_node_elements_keep_their_middle_nodes(tmp_path):
    nodes = "id,r_mm,z_mm\n1,0,0\n2,1,0\n3,1,1\n4,0,1\n5,.5,-.1\n6,1,.5\n7,.5,1\n8,1e-17,.5\n"
    sets = dict(top=[4, 7, 3], encastre=[2, 6, 3], pressure_face_S1=[1], pressure_face_S4=[])
    mesh = write(tmp_path, nodes, "id,n1,n2,n3,n4,n5,n6,n7,n8\n1,1,2,3,4,5,6,7,8\n", **sets)
    area = (discretize(mesh).weights / discretize(mesh).points[..., 0]).sum()
    assert area == pytest.approx(1 + 2 / 3 * 0.1)  # Archimedes' parabola
    assert mesh.held[:, 0].sum() == 6


def test_renumbering_keeps_the_mesh_and_never_widens_its_bandwidth():
    mesh = DimpleGeometry().mesh()
    order = np.random.default_rng(1).permutation(len(mesh.nodes))
    new = np.argsort(order)
    shuffled = Mesh(mesh.nodes[order], new[mesh.elements], mesh.held[order], new[mesh.pressed], new[mesh.top])
    again = renumbered(shuffled)
    assert half_bandwidth(shuffled.elements) > 300
    assert half_bandwidth(again.elements) < 100
    assert half_bandwidth(renumbered(mesh).elements) <= half_bandwidth(mesh.elements) == 39
    for one, other in ((mesh.elements, again.elements), (mesh.pressed, again.pressed), (mesh.top, again.top)):
        np.testing.assert_array_equal(mesh.nodes[one], again.nodes[other])
        np.testing.assert_array_equal(mesh.held[one], again.held[other])


WRONG = [
    ("nodes.csv", "6,2,1", "5,2,1", "7: '5, 2, 1' is no row; write a whole number from 1 on that no other row has"),
    ("nodes.csv", "6,2,1", "6,2", "7: '6, 2' is no row; write a whole number"),
    ("nodes.csv", "r_mm", "r", "1: missing column 'r_mm'; found: id, r, z_mm"),
    ("quads.csv", "2,5,4", "2,5,9", " element 1 names node 9, which is not among the nodes"),
    ("quads.csv", "2,2,5,6,3", "2,2,6,5,3", "element 1 of the mesh, near r = 1.5 mm, z = 0.5 mm, is inverted"),
    ("sets.json", "[4, 5, 6]", "[4, 6]", " the nodes of the top are not one line of element sides from the axis"),
    ("sets.json", "[4, 5, 6]", "4", " set 'top' is not a list of node numbers; write one such as [1, 6, 147]"),
    ("sets.json", "encastre", "encaster", " there is no set 'encastre'; did you mean 'encaster'?"),
    ("sets.json", "[3, 6]", "[3, 60]", " set 'encastre' names node 60, which is not among the nodes"),
    ("sets.json", "_face_", "_side_", " the mesh has no pressed side; say by a set which are"),
]


def test_what_is_wrong_in_tables(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for file, old, new, message in WRONG:
        write(tmp_path)
        Path(file).write_text(Path(file).read_text().replace(old, new))
        with pytest.raises(SolveError, match=re.escape(message)):
            finite_element_model(read_mesh("nodes.csv", "quads.csv", "sets.json"))
