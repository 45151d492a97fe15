"""Tubes under internal pressure: steady creep, finite strain, and figures of other programs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from creepkit_specimens.notched_bar import NotchedBar, NotchedRelaxation
from creepkit_specimens.plate_bulge import DEFLECTION, LIMIT_LOAD, DomeBulge, PlateBulge
from creepkit_specimens.tube import OpenTube, Tube
from scipy.integrate import solve_ivp

import creepkit as ck
from creepkit.records import Program, Status
from creepkit.specimens.axisymmetric import prepared_section

STIFF = ck.Elastic(E=9e7)
"""Elastic strains of 1e-6 and less beside creep strains of 1e-4: what is left is creep."""


@dataclass(frozen=True)
class PlaneStrainTube(Tube):
    """A tube whose length is held."""

    name = "plane-strain-tube"

    def section(self, load: str) -> ck.Section:
        outer = 0.5 * self.outer_diameter
        wall = ck.Section.rectangle((self.bore, 0.0), (outer, self.thickness / 3.0), self.elements(10), 1)
        return wall.hold("bottom", z=True).hold("top", z=True).press("left")


def simulated(tube: Tube, values: dict[str, float], pressure: float, times, elastic=STIFF):
    """A run, complete, at one pressure from time zero."""
    run = ck.simulate(
        "norton", tube, values, loading=ck.constant_load("pressure", pressure), elastic=elastic, temperature=1000.0,
        times=times,
    )  # fmt: skip
    assert run.status is Status.COMPLETE
    return run


def last_rate(run) -> float:
    """Growth of the outer diameter per second in the last accepted step."""
    quantities = run.test.piece.observed(run.test.load, run.simulation)
    return 2.0 * float(np.diff(quantities[-2:, 0])[0] / np.diff(run.simulation.times[-2:])[0])


def steady_velocity(inner: float, outer: float, pressure: float, A: float, n: float) -> float:
    """Radial velocity times the radius in steady creep with no axial strain, mm^2/s.

    R. W. Bailey 1935, Proc. Inst. Mech. Engrs 131, 131; a closed tube has no axial strain either.
    """
    driving = 2.0 * pressure / n / ((outer / inner) ** (2.0 / n) - 1.0)
    return (np.sqrt(3.0) / 2.0) ** (n + 1) * A * driving**n * outer**2


@pytest.mark.parametrize("ratio", [1.25, 2.0])
@pytest.mark.parametrize("n", [1.0, 4.0, 8.0])
def test_steady_creep_of_a_closed_tube(n: float, ratio: float) -> None:
    """The end force alone keeps the length: the face is free to move and must not. Creep strains are 2e-5."""
    tube = Tube(20.0, 10.0 - 10.0 / ratio, tolerance=1e-4, resolution=1e-5)
    A = 1e-9 / 60.0**n
    velocity = steady_velocity(10.0 / ratio, 10.0, 20.0, A, n) / 10.0
    run = simulated(tube, {"A": A, "n": n}, 20.0, [2e-4 / velocity])
    assert last_rate(run) == pytest.approx(2.0 * velocity, rel=1e-3)
    face = run.displacements()[-1, run.model.nodes[:, 1] > 0, 1]
    assert np.abs(face).max() < 1e-3 * abs(run.outputs["diameter_growth"][-1])


def test_steady_creep_of_an_open_tube() -> None:
    """At the outer surface only the hoop stress is left: 2 p a^2/(b^2 - a^2) for n = 1 (Lame)."""
    run = simulated(OpenTube(20.0, 2.0, tolerance=1e-4, resolution=1e-5), {"A": 1e-11, "n": 1.0}, 20.0, [1e5])
    assert last_rate(run) / 20.0 == pytest.approx(1e-11 * 2.0 * 20.0 * 64.0 / 36.0, rel=1e-3)


@pytest.mark.parametrize("n", [2.0, 6.0])
def test_large_strain_with_no_axial_strain(n: float) -> None:
    """Up to a hoop strain of a third at the bore: r v is one number, in which the radii of the time stand."""
    inner, outer, A = 8.0, 10.0, 1e-9 / 60.0**n

    def grow(_, squares):
        return [2.0 * steady_velocity(*np.sqrt(squares), 20.0, A, n)] * 2

    def by_a_third(_, squares):
        return squares[0] - (4.0 / 3.0 * inner) ** 2

    by_a_third.terminal = True
    known = solve_ivp(
        grow, (0.0, 1e9), [inner**2, outer**2], events=by_a_third, dense_output=True, rtol=1e-10, atol=1e-12
    )
    assert known.status == 1
    times = np.linspace(0.1, 1.0, 10) * known.t[-1]
    run = simulated(PlaneStrainTube(20.0, 2.0, tolerance=1e-4), {"A": A, "n": n}, 20.0, times)
    np.testing.assert_allclose(run.outputs["diameter_growth"], 2.0 * (np.sqrt(known.sol(times)[1]) - outer), rtol=1e-3)


# ---- plate bulge -----------------------------------------------------------------------------------------------------

# Plates and domes under gas pressure: elastic with large deflection, steady creep, and the sphere behind a dome.


NORTON_PLATE = {1: 0.14062500, 2: 0.04257705, 3: 0.01274967, 4: 0.0038365, 5: 0.00116165, 7: 0.000108187}
"""{n: c}: a thin clamped plate creeps by c A p^n a^(2n+2)/h^(2n+1) in its middle; by Hermite elements."""


def plate_of(specimen: ck.Axisymmetric, values: dict[str, float], pressure, times, modulus: float):
    """A complete run; pressure : MPa, or a program of it."""
    loading = pressure if isinstance(pressure, ck.RecordedLoading) else ck.constant_load("pressure", pressure)
    run = ck.simulate(
        "norton", specimen, values, loading=loading, elastic=ck.Elastic(E=modulus), temperature=1000.0, times=times
    )
    assert run.status is Status.COMPLETE
    return run


def plate_rate(run) -> float:
    """Of the observed displacement in the last accepted step, mm/s."""
    quantities = run.test.piece.observed(run.test.load, run.simulation)
    return float(np.diff(quantities[-2:, 0])[0] / np.diff(run.simulation.times[-2:])[0])


def test_the_stated_scales_are_those_of_a_thin_plate() -> None:
    assert NORTON_PLATE[4] / LIMIT_LOAD**4 == pytest.approx(DEFLECTION, rel=0.05)
    plate = PlateBulge()
    plan = ck.History(
        "plan", specimen="plate-bulge", loading=ck.constant_load("pressure", 0.5), temperature=1000.0, times=[1.0, 2.0],
        outputs={"deflection": [0.0, 0.0]}, elastic=ck.Elastic(E=1e5),
    )  # fmt: skip
    assert plate.reference_stress(plan) == pytest.approx([0.32 * 400.0 * 0.5] * 2, rel=1e-3)


@pytest.mark.parametrize(("A", "n"), [(1.2e-17, 5.5), (4e-15, 4.0)])
def test_a_thin_plate_creeps_as_by_a_mesh_of_three_times_as_many_elements_a_side(A: float, n: float) -> None:
    plates = PlateBulge(8.0, 0.5), PlateBulge(8.0, 0.5, refinement=3.0, tolerance=5e-4)
    times = [1.0, 60.0, 600.0, 14400.0]
    heights = [plate_of(one, {"A": A, "n": n}, 4.0, times, 140e3).outputs["deflection"] for one in plates]
    creep, fine = (one[1:] - one[0] for one in heights)
    assert creep == pytest.approx(fine, rel=6e-3)


def test_a_plate_states_the_stresses_that_creep_follows_while_it_bulges() -> None:
    """At last those of a spherical cap, P R/(2 h) of the wall that its area thins, and no longer those of bending."""
    values, p = {"A": 5e-6 / 60.0**5, "n": 5.0}, 0.3
    run = plate_of(PlateBulge(10.0, 0.2), values, p, [100.0, 1e3, 3e3, 1e4], 1e5)
    w = run.outputs["deflection"][-1]
    cap = p * (100.0 + w**2) / (4.0 * w) / (0.2 * 100.0 / (100.0 + w**2))
    (low, high), seen = run.creep_stress_range, PlateBulge(10.0, 0.2).reference_stress(run)
    assert low == pytest.approx(cap, rel=0.1)
    assert seen.min() == pytest.approx(low, rel=0.1)
    assert 1.4 * cap < high < 0.32 * 2500.0 * p
    fit = ck.identify("norton", [run], starts=1)
    assert fit.ranges["stress"] == pytest.approx((low, high), rel=0.08)
    assert low < fit.tested_point.stress < high


@pytest.mark.parametrize("n", [1.0, 4.0])
def test_the_top_of_a_hemisphere_creeps_as_a_sphere(n: float) -> None:
    """Steady creep of a thick sphere, 0.5 A ((1.5 p/n)/((b/a)^(3/n) - 1))^n b^3/r^2, for a wall without thickness.

    At the clamp the wall cannot widen and stretches more along the meridian, over lengths of sqrt(R t): what that adds
    is halved from t/R = 0.02 to 0.005 and extrapolated.
    """
    p, A = 0.02, 1e-9 / 0.5**n
    found = []
    for t in (0.2, 0.05):
        known = 0.5 * A * (1.5 * p / n / ((1.0 + 0.1 * t) ** (3.0 / n) - 1.0)) ** n * (10.0 + t)
        run = plate_of(
            DomeBulge(10.0, t, 10.0, refinement=3.0, resolution=1e-6), {"A": A, "n": n}, p, [1e-4 / known], 9e7
        )
        found.append(plate_rate(run) / known)
    assert 2.0 * found[1] - found[0] == pytest.approx(1.0, abs=0.015)


# ---- notched bar -----------------------------------------------------------------------------------------------------

# Notched bars: a notch of no depth, relaxation, bounds of steady creep, and creep as viscous elasticity.


SMOOTH = {"diameter": 10.0, "notch_diameter": 9.9998, "notch_radius": 0.5, "gauge_length": 20.0}
"""A bar with a notch of a tenth of a micrometre."""
AREA = 25.0 * np.pi


def notched(bar: NotchedBar, values: dict[str, float], loading, times, elastic=STIFF):
    """A complete run."""
    run = ck.simulate("norton", bar, values, loading=loading, elastic=elastic, temperature=1000.0, times=times)
    assert run.status is Status.COMPLETE
    return run


def last_rates(bar: NotchedBar, values: dict[str, float], force: float, time: float) -> np.ndarray:
    """Rates (2,) of elongation and contraction in the last accepted step, mm/s."""
    run = notched(bar, values, ck.constant_load("force", force), [time])
    quantities = run.test.piece.observed(run.test.load, run.simulation)
    change = np.diff(quantities[-2:], axis=0)[0] / np.diff(run.simulation.times[-2:])[0]
    radial = [number % 2 for number in prepared_section(run.test.piece, run.test.load).order].index(0)
    return np.array([2.0 * change[1 - radial], -2.0 * change[radial]])


@pytest.mark.parametrize("n", [2.0, 6.0])
def test_without_a_notch_it_is_a_bar_under_a_dead_load(n: float) -> None:
    """Logarithmic strain e with exp(-n e) = 1 - n A s^n t, up to 20 %, and the area that goes with it."""
    stress, A = 60.0, 1e-9 / 60.0**n
    end = (1.0 - np.exp(-0.2 * n)) / (n * 1e-9)
    times = np.linspace(0.1, 1.0, 8) * end
    run = notched(
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
    run = notched(bar, {"A": A, "n": n}, ck.constant_load("displacement", 0.02), times, ck.Elastic(E=E))
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
    pulled = notched(NotchedBar(tolerance=2e-4), values, ramp, times[1:], elastic)
    course = Program(times, np.append(0.0, pulled.outputs["elongation"]))
    held = notched(
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
        run = notched(bar, still, ck.constant_load("force", 1e-3 * force), [1.0], ck.Elastic(E=1e5, nu=nu))
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
