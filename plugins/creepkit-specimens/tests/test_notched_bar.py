"""Notched bars: a notch of no depth, relaxation, bounds of steady creep, and creep as viscous elasticity."""

from __future__ import annotations

import numpy as np
import pytest
from creepkit_specimens.notched_bar import NotchedBar, NotchedRelaxation

import creepkit as ck
from creepkit.records import Program, Status

SMOOTH = {"diameter": 10.0, "notch_diameter": 9.9998, "notch_radius": 0.5, "gauge_length": 20.0}
"""A bar with a notch of a tenth of a micrometre."""
AREA = 25.0 * np.pi
STIFF = ck.Elastic(E=9e7)


def simulated(bar: NotchedBar, values: dict[str, float], loading, times, elastic=STIFF):
    """A complete run."""
    run = ck.simulate("norton", bar, values, loading=loading, elastic=elastic, temperature=1000.0, times=times)
    assert run.status is Status.COMPLETE
    return run


def last_rates(bar: NotchedBar, values: dict[str, float], force: float, time: float) -> np.ndarray:
    """Rates (2,) of elongation and contraction in the last accepted step, mm/s."""
    run = simulated(bar, values, ck.constant_load("force", force), [time])
    quantities = run.test.quantities(run.simulation)
    change = np.diff(quantities[-2:], axis=0)[0] / np.diff(run.simulation.times[-2:])[0]
    radial = [number % 2 for number in run.test.body.order].index(0)
    return np.array([2.0 * change[1 - radial], -2.0 * change[radial]])


@pytest.mark.parametrize("n", [2.0, 6.0])
def test_without_a_notch_it_is_a_bar_under_a_dead_load(n: float) -> None:
    """Logarithmic strain e with exp(-n e) = 1 - n A s^n t, up to 20 %, and the area that goes with it."""
    stress, A = 60.0, 1e-9 / 60.0**n
    end = (1.0 - np.exp(-0.2 * n)) / (n * 1e-9)
    times = np.linspace(0.1, 1.0, 8) * end
    run = simulated(
        NotchedBar(**SMOOTH, tolerance=1e-3), {"A": A, "n": n}, ck.constant_load("force", stress * AREA), times
    )
    strain = -np.log1p(-n * 1e-9 * times) / n
    np.testing.assert_allclose(run.outputs["elongation"], 20.0 * np.expm1(strain), rtol=2e-3)
    np.testing.assert_allclose(run.outputs["contraction"], -10.0 * np.expm1(-0.5 * strain), rtol=2e-3)


def test_without_a_notch_it_relaxes_as_a_bar() -> None:
    """s = (s0^(1-n) + (n - 1) E A t)^(-1/(n-1)) from an elongation of 0.1 % on, to a quarter of the stress."""
    n, A, E = 5.0, 1e-16, 150e3
    bar = NotchedRelaxation(**SMOOTH, tolerance=1e-3)
    times = np.geomspace(10.0, 1e6, 12)
    run = simulated(bar, {"A": A, "n": n}, ck.constant_load("displacement", 0.02), times, ck.Elastic(E=E))
    first = E * np.log(1.001)
    known = (first ** (1 - n) + (n - 1) * E * A * times) ** (-1.0 / (n - 1))
    assert known[-1] < 0.3 * first
    # nominal stress: the true one on an area that strain has made smaller, with Poisson's ratio on its way to 0.5
    np.testing.assert_allclose(run.outputs["force"] / AREA, known, rtol=2e-3)


def test_an_imposed_elongation_needs_the_force_that_causes_it() -> None:
    """The elongation of a test under 5 kN, imposed as a program, needs 5 kN and contracts the root as much."""
    values, elastic = {"A": 1e-16, "n": 5.0}, ck.Elastic(E=150e3)
    times = np.linspace(0.0, 2e5, 101)
    ramp = ck.RecordedLoading(Program(np.array([0.0, 2e4, 2e5]), np.array([0.0, 5e3, 5e3])), "force")
    pulled = simulated(NotchedBar(tolerance=2e-4), values, ramp, times[1:], elastic)
    course = Program(times, np.append(0.0, pulled.outputs["elongation"]))
    held = simulated(
        NotchedRelaxation(tolerance=1e-3, max_steps=5000),
        values,
        ck.RecordedLoading(course, "displacement"),
        times[1:],
        elastic,
    )
    after = times[1:] > 2e4  # before, straight lines between points of a curved program are another test
    np.testing.assert_allclose(held.outputs["force"][after], 5e3, rtol=5e-3)
    contraction = (each.outputs["contraction"][after] for each in (held, pulled))
    np.testing.assert_allclose(*contraction, rtol=8e-3)


def test_linear_creep_is_incompressible_elasticity() -> None:
    """With n = 1 rates are the displacements of an elastic bar with E = 1/A and Poisson's ratio 0.5 (Hoff 1954)."""
    bar, force, A = NotchedBar(resolution=1e-6, tolerance=1e-3, refinement=2.0), 6000.0, 1e-12
    rates = last_rates(bar, {"A": A, "n": 1.0}, force, 1e6)
    still = {"A": 1e-40, "n": 1.0}
    ends = []
    for nu in (0.49, 0.499):
        run = simulated(bar, still, ck.constant_load("force", 1e-3 * force), [1.0], ck.Elastic(E=1e5, nu=nu))
        ends.append([1e3 * 1e5 * run.outputs[name][-1] for name in bar.outputs])
    elastic = (10.0 * np.array(ends[1]) - ends[0]) / 9.0  # to 0.5, at which no elastic body can be simulated
    np.testing.assert_allclose(rates / A, elastic, rtol=1e-3)


@pytest.mark.parametrize("n", [1.0, 3.0, 6.0])
def test_steady_creep_is_faster_than_any_plane_sections_allow(n: float) -> None:
    """Elongation rate >= F^n d^(n+1)/D^n with D the integral of A^(-1/n) e^(1+1/n) of an admissible velocity field.

    This follows from the minimum of the potential of rates (Hill 1956, J. Mech. Phys. Solids 5, 66). Sections that stay
    plane have u_z' = g(z), u_r = -g r/2 and the shear strain -g' r/2; g = (a/r)^m is tried for several m. The other
    bound is that of a bar as thick as the root throughout.
    """
    bar, force, strength = NotchedBar(resolution=1e-6, tolerance=1e-3), 6000.0, 120.0
    A = 1e-9 / strength**n
    surface, _ = bar.profile(2000, 2000)
    outer, z = surface.T
    shares = (np.arange(400) + 0.5) / 400.0
    bounds = []
    for m in np.linspace(1.0, 2.5 * n + 2.0, 25):
        g = (4.0 / outer) ** m
        slope = np.gradient(g, z)
        r = shares[:, None] * outer
        rate = np.sqrt(g**2 + (slope * r) ** 2 / 12.0)  # equivalent: e_r = e_hoop = -g/2, gamma = g' r/2
        across = (rate ** (1.0 + 1.0 / n) * 2.0 * np.pi * r).mean(axis=0) * outer
        dissipation = 2.0 * np.trapezoid(across, z) * A ** (-1.0 / n)
        stretch = 2.0 * np.trapezoid(g, z)
        bounds.append(force**n * stretch ** (n + 1.0) / dissipation**n)
    least, most = max(bounds), A * (force / (16.0 * np.pi)) ** n * 30.0
    rate = last_rates(bar, {"A": A, "n": n}, force, 1e-5 * 1e9)[0]
    assert least < rate < most
