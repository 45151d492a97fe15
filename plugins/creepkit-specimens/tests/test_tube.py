"""Tubes under internal pressure: steady creep, finite strain, and figures of other programs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from creepkit_specimens.tube import OpenTube, Tube
from scipy.integrate import solve_ivp

import creepkit as ck
from creepkit.records import Status

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
    quantities = run.test.quantities(run.simulation)
    return 2.0 * float(np.diff(quantities[-2:, 0])[0] / np.diff(run.simulation.times[-2:])[0])


def steady_velocity(inner: float, outer: float, pressure: float, A: float, n: float) -> float:
    """Radial velocity times the radius in steady creep with no axial strain, mm^2/s.

    R. W. Bailey 1935, Proc. Inst. Mech. Engrs 131, 131; a closed tube has no axial strain either.
    """
    return (
        (np.sqrt(3.0) / 2.0) ** (n + 1)
        * A
        * (2.0 * pressure / n / ((outer / inner) ** (2.0 / n) - 1.0)) ** n
        * outer**2
    )


@pytest.mark.parametrize("ratio", [1.25, 2.0])
@pytest.mark.parametrize("n", [1.0, 3.0, 5.0, 8.0])
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


def test_a_thin_open_tube_creeps_as_a_hoop() -> None:
    """By the hoop stress p r/t at mid-wall, for t/r = 0.01, but for shares of t/r."""
    run = simulated(OpenTube(20.1, 0.1, tolerance=1e-4, resolution=1e-5), {"A": 1e-19, "n": 5.0}, 1.0, [1e5])
    assert last_rate(run) / 20.1 == pytest.approx(1e-19 * 100.0**5, rel=0.02)


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


def test_a_viscoelastic_tube_as_code_aster() -> None:
    """Its case ssna104a: tube of radii 1 and 2, E = 1, nu = 0.3, rate = stress, p = 1e-3 (here all 1e5 times that).

    Its strains of 2e-3 are infinitesimal, so a hundredth of its pressure acts here. It documents 2.14498e-3 for u_r at
    the outer surface at t = 0.9; the formula behind it is that of a Maxwell tube.
    """
    p, nu, t = 1e-3, 0.3, np.array([1e-3, 0.1, 0.5, 0.9])
    tube = PlaneStrainTube(4.0, 1.0, tolerance=1e-4, resolution=1e-6)
    run = simulated(tube, {"A": 1e-5, "n": 1.0}, 1.0, t, ck.Elastic(E=1e5, nu=nu))
    shares = (1 + nu) * 4 / 2 + 1.5 * (1 - 2 * nu) * 2 - (1 - 2 * nu) ** 2 * 2 * np.exp(-t) / 2 + 1.5 * 4 * t / 2
    known = p / 3.0 * shares
    assert known[-1] == pytest.approx(2.14498e-3, rel=1e-5)
    np.testing.assert_allclose(100.0 * run.outputs["diameter_growth"] / 2.0, known, rtol=2e-4)


def test_stresses_as_calculix() -> None:
    """CalculiX 2.20, radii 100 and 200 mm, 200 MPa, n = 5 (NAFEMS R0049, case CR4): stresses along r, z, hoop."""
    calculix = {
        102.5: (-191.894, -28.349, 135.195),
        122.5: (-135.599, 16.688, 168.976),
        152.5: (-71.700, 67.810, 207.319),
        177.5: (-30.593, 100.697, 231.987),
        197.5: (-3.141, 122.659, 248.459),
    }
    tube = Tube(400.0, 100.0, refinement=3.0, tolerance=1e-3, resolution=1e-5)
    run = simulated(tube, {"A": 3.125e-14, "n": 5.0}, 200.0, [1e-3])
    places, stress = run.field("stress", 1e-3)
    order = np.argsort(places[:, 0])
    found = np.interp(list(calculix), places[order, 0], stress[order])
    known = [np.sqrt(0.5 * ((r - z) ** 2 + (z - h) ** 2 + (h - r) ** 2)) for r, z, h in calculix.values()]
    np.testing.assert_allclose(found, known, rtol=4e-3)
