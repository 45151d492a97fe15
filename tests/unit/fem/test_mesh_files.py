"""Meshes read from files: the paper's own mesh, decks of CalculiX, small files written here, and what is refused."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from creepkit.errors import SolveError
from creepkit.fem.mesh import Mesh, discretize, half_bandwidth
from creepkit.fem.mesh_builder import renumbered
from creepkit.fem.mesh_files import read_input_deck, read_mesh
from creepkit.specimens.bulge.geometry import DimpleGeometry
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

DECK = """** two squares, one of them in capitals
*Node, nset=ALL
 1, 0., 0.
 2, 1., 0., 0.
 3, 2., 0.
*NODE
 4, 0., 1.0d0
 5, 1., 1.
 6, 2., 1.
*Element, type=CAX4R, elset=Squares
 1, 1, 2, 5, 4
 2, 2, 5,
 6, 3
*Nset, nset=TOP, generate
 4, 6, 1
*Nset, nset=Wall
 3, 6
*Elset, elset=_Low_S1, internal
 1
*Elset, elset=_Low_S4, internal
 2
*Surface, type=ELEMENT,
  name=Low
 _Low_S1, S1
 _Low_S4, S4
*Boundary
 Part-1.Wall, ENCASTRE
 1, 1
*Material, name=M
*Elastic
 150000., 0.3
*Step, nlgeom
*Visco, cetol=1e-4
 1., 100.
*Dsload
 Low, P, 8.
*End step
"""


def write(folder: Path, nodes: str = NODES, quads: str = QUADS, **sets: list) -> Mesh:
    (folder / "nodes.csv").write_text(nodes)
    (folder / "quads.csv").write_text(quads)
    (folder / "sets.json").write_text(json.dumps(SETS | sets))
    return read_mesh(folder / "nodes.csv", folder / "quads.csv", folder / "sets.json")


def deck(folder: Path, text: str, **options) -> Mesh:
    (folder / "mesh.inp").write_text(text)
    return read_input_deck(folder / "mesh.inp", **options)


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
def test_decks_of_calculix(name):
    mesh = read_input_deck(DATA / "benchmarks" / "dabi_ccx" / name)
    assert (len(mesh.elements), len(mesh.nodes), len(mesh.pressed), len(mesh.top)) == (174, 613, 35, 61)
    area = (discretize(mesh).weights / discretize(mesh).points[..., 0]).sum()
    assert area == pytest.approx(10 * 4 - 7.5 * 2 - np.pi / 4 * 7.5 * 1.5, rel=1e-5)
    np.testing.assert_allclose(push(mesh), [2.0 + 1.5, 7.5**2 / 2], rtol=1e-12)
    np.testing.assert_allclose(mesh.nodes[mesh.top], np.stack([np.arange(61) / 8, np.full(61, 4.0)], axis=1))
    r, z = mesh.nodes.T
    np.testing.assert_array_equal(mesh.held[:, 1], (r == 10) | ((z == 0) & (r >= 7.5)))


def test_tables_become_a_mesh_of_eight_node_elements(tmp_path):
    check(write(tmp_path))


@pytest.mark.parametrize("pressed", [None, "low"])
def test_a_deck_becomes_the_same_mesh(tmp_path, pressed):
    check(deck(tmp_path, DECK, pressed=pressed))


def test_a_deck_may_press_elements_one_by_one(tmp_path):
    check(deck(tmp_path, DECK.replace("*Dsload\n Low, P, 8.", "*DLOAD\n1, P1, 1.\n_Low_S4, P4, 1.")))


def check(mesh: Mesh) -> None:
    """Two squares, pressed from below, held at r = 2."""
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
    ("CAX4R", "CPE4", "10: element type CPE4 is not supported; allowed are CAX4, CAX4R, CAX8, CAX8R"),
    (" 2, 2, 5,\n 6, 3", " 2, 2, 5, 6", "12: an element CAX4R has a number and 4 nodes, found 4 cells"),
    (" 1, 1, 2, 5, 4", " 1, 1, 2, 5, 9", "11: element 1 names node 9, which is not among the nodes"),
    (" 1, 1, 2,", " 2, 1, 2,", "13: element 2 was already given in mesh.inp:11; keep one of them"),
    ("nset=TOP", "nset=TIP", " there is no node set 'top'; did you mean 'TIP'? (known: ALL, TIP, WALL)"),
    ("_Low_S1, S1", "_Low_S1, S5", "24: 'S5' is no side of a quadrilateral; allowed are S1 to S4"),
    ("l, ENCASTRE", "l, 1, 2, 0.5", "27: a motion of 0.5 mm is prescribed; only nodes at rest are read, with 0"),
    (" 3, 6\n", " 3, 60\n", "17: there is no node 60; name one of the 6 nodes given before"),
    (" Low, P", " Lower, P", "36: there is no surface 'Lower'; did you mean 'LOW'? (known: LOW)"),
    ("*Dsload", "*Load", " the mesh has no pressed side; say which sides of which elements are pressed"),
    (
        "*Node, nset",
        "*Include, input=a.inp\n*Node, nset",
        "2: *INCLUDE is not followed; put the included lines into mesh.inp",
    ),
    ("** two", "1, 2\n** two", "1: data before any keyword; an input deck begins with a line such as *NODE"),
    ("*Nset, nset=Wall", "*Nset", "16: *NSET has no NSET; write *NSET, NSET=..."),
]


def test_what_is_wrong_in_decks(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for old, new, message in WRONG:
        assert old in DECK
        Path("mesh.inp").write_text(DECK.replace(old, new))
        with pytest.raises(SolveError, match=f"^{re.escape('mesh.inp:' + message)}$"):
            read_input_deck("mesh.inp")
