"""Plates and domes under gas pressure: elastic with large deflection, steady creep, and the sphere behind a dome."""

from __future__ import annotations

import numpy as np
import pytest
from creepkit_specimens.plate_bulge import DEFLECTION, LIMIT_LOAD, DomeBulge, PlateBulge

import creepkit as ck
from creepkit.records import Program, Status

NORTON_PLATE = {1: 0.14062500, 2: 0.04257705, 3: 0.01274967, 4: 0.0038365, 5: 0.00116165, 7: 0.000108187}
"""{n: c}: a thin clamped plate creeps by c A p^n a^(2n+2)/h^(2n+1) in its middle; by Hermite elements."""


def simulated(specimen: ck.Axisymmetric, values: dict[str, float], pressure, times, modulus: float):
    """A complete run; pressure : MPa, or a program of it."""
    loading = pressure if isinstance(pressure, ck.RecordedLoading) else ck.constant_load("pressure", pressure)
    run = ck.simulate(
        "norton", specimen, values, loading=loading, elastic=ck.Elastic(E=modulus), temperature=1000.0, times=times
    )
    assert run.status is Status.COMPLETE
    return run


def last_rate(run) -> float:
    """Of the observed displacement in the last accepted step, mm/s."""
    quantities = run.test.quantities(run.simulation)
    return float(np.diff(quantities[-2:, 0])[0] / np.diff(run.simulation.times[-2:])[0])


def test_large_elastic_deflection() -> None:
    """CalculiX 2.20 on a mesh of 40 x 4, radius 100 mm, 1 mm thick, E = 2e5 MPa: up to 2.8 thicknesses.

    It takes Green's strain where we take logarithmic strain, which differ by a share of (w/a)^2 = 8e-4 at the end.
    """
    unit = 3 * 100.0**4 * (1 - 0.3**2) / (16 * 2e5)  # deflection of the linear thin plate for 1 MPa
    known = {0.8088: 0.6539485, 1.6176: 1.020393, 4.044: 1.612409, 8.088: 2.151861, 16.176: 2.799732}
    times = np.arange(1.0, len(known) + 1.0)
    ramp = Program(np.append(0.0, times), np.append(0.0, np.array(list(known)) / unit))
    plate = PlateBulge(100.0, 1.0, refinement=2.0)
    run = simulated(plate, {"A": 1e-40, "n": 1.0}, ck.RecordedLoading(ramp, "pressure"), times, 2e5)
    np.testing.assert_allclose(run.outputs["deflection"], list(known.values()), rtol=2e-3)


@pytest.mark.parametrize("n", [1, 3, 5])
def test_steady_creep_of_a_thin_plate(n: int) -> None:
    """Thicknesses of 0.02 and 0.01 of the radius, extrapolated to none; the deflection is 1e-3 of the thickness."""
    found = []
    for h in (2.0, 1.0):
        A, p = 1e-9 / 0.6**n, 0.6 * (h / 100.0) ** 2
        thin = NORTON_PLATE[n] * A * p**n * 100.0 ** (2 * n + 2) / h ** (2 * n + 1)
        plate = PlateBulge(100.0, h, refinement=2.0, resolution=1e-6, tolerance=1e-3)
        found.append(last_rate(simulated(plate, {"A": A, "n": float(n)}, p, [1e-3 * h / thin], 9e7)) / thin)
    assert 0.95 < found[0] < found[1] < 1.0
    assert 2.0 * found[1] - found[0] == pytest.approx(1.0, abs=4e-3)


def test_the_stated_scales_are_those_of_a_thin_plate() -> None:
    assert NORTON_PLATE[4] / LIMIT_LOAD**4 == pytest.approx(DEFLECTION, rel=0.05)
    plate = PlateBulge()
    plan = ck.History(
        "plan", specimen="plate-bulge", loading=ck.constant_load("pressure", 0.5), temperature=1000.0, times=[1.0, 2.0],
        outputs={"deflection": [0.0, 0.0]}, elastic=ck.Elastic(E=1e5),
    )  # fmt: skip
    assert plate.reference_stress(plan) == pytest.approx([0.32 * 400.0 * 0.5], rel=1e-3)


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
        run = simulated(
            DomeBulge(10.0, t, 10.0, refinement=3.0, resolution=1e-6), {"A": A, "n": n}, p, [1e-4 / known], 9e7
        )
        found.append(last_rate(run) / known)
    assert 2.0 * found[1] - found[0] == pytest.approx(1.0, abs=0.015)
