"""Displacement at any radius, between the nodes of the top."""

import numpy as np

from creepkit.fem.surface_interpolation import surface_interpolation


def test_interpolation_is_exact_for_parabolas_and_nodal():
    nodes = np.concatenate([[0.0], np.cumsum(np.repeat(np.random.default_rng(1).uniform(0.2, 0.9, 8), 2))])
    wanted = np.linspace(0.0, nodes[-1], 57)
    parabola = np.polynomial.Polynomial([0.3, -0.2, 0.07])
    np.testing.assert_allclose(surface_interpolation(nodes, wanted) @ parabola(nodes), parabola(wanted), atol=1e-13)
    np.testing.assert_allclose(surface_interpolation(nodes, nodes), np.eye(nodes.size), atol=1e-13)


def test_interpolation_follows_the_element_where_its_middle_node_is_off():
    first, middle, last = nodes = np.array([1.0, 1.4, 2.0])
    for c in (-0.9, -0.3, 0.2, 0.7):
        shapes = np.array([c * (c - 1) / 2, 1 - c * c, c * (c + 1) / 2])
        np.testing.assert_allclose(surface_interpolation(nodes, [shapes @ nodes])[0], shapes, atol=1e-13)
    assert first < middle < last
