"""The text of a CalculiX deck and the reading of what CalculiX prints, without CalculiX."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import numpy as np
import pytest

from creepkit.fem.mesh import Mesh
from creepkit.records import PressureJump, Program

sys.path.append(str(Path(__file__).parent))
calculix = importlib.import_module("calculix_deck")

NODES = np.array([[0, 0], [2, 0], [2, 1], [0, 1], [1, 0], [2, 0.5], [1, 1], [0, 0.5]], dtype=float)
HELD = np.zeros((8, 2), dtype=bool)
HELD[[1, 2, 5]] = True
BLOCK = Mesh(NODES, np.arange(8)[None], HELD, np.array([[0, 4, 1]]), np.array([3, 6, 2]))
LAW = calculix.Norton(3e-11, 3.2, -0.4)


def deck(**changes):
    given = {
        "mesh": BLOCK,
        "E": 150e3,
        "nu": 0.3,
        "creep": LAW,
        "pressure": PressureJump(8.0, 10.0, 100.0).program(),
        "times": [50.0, 200.0],
        "nodes": [3, 6],
        **changes,
    }
    return calculix.Deck(**given)


def after(text: str, keyword: str) -> list[str]:
    """The data lines that follow the last card beginning with a keyword."""
    lines = text.splitlines()
    start = max(k for k, line in enumerate(lines) if line.startswith(keyword)) + 1
    count = next(k for k, line in enumerate([*lines[start:], "*"]) if line.startswith("*"))
    return lines[start : start + count]


def test_the_text_of_a_deck() -> None:
    assert deck().text().splitlines() == [
        "*NODE, NSET=NALL",
        "1, 0.0000000000, 0.0000000000, 0.",
        "2, 2.0000000000, 0.0000000000, 0.",
        "3, 2.0000000000, 1.0000000000, 0.",
        "4, 0.0000000000, 1.0000000000, 0.",
        "5, 1.0000000000, 0.0000000000, 0.",
        "6, 2.0000000000, 0.5000000000, 0.",
        "7, 1.0000000000, 1.0000000000, 0.",
        "8, 0.0000000000, 0.5000000000, 0.",
        "*ELEMENT, TYPE=CAX8R, ELSET=EALL",
        "1, 1, 2, 3, 4, 5, 6, 7, 8",
        "*NSET, NSET=PRINTED",
        "4, 7,",
        "*NSET, NSET=RADIAL",
        "1, 2, 3, 4, 6, 8,",
        "*NSET, NSET=AXIAL",
        "2, 3, 6,",
        "*BOUNDARY",
        "RADIAL, 1, 1",
        "AXIAL, 2, 2",
        "*MATERIAL, NAME=ALLOY",
        "*ELASTIC",
        "150000, 0.3",
        "*CREEP, LAW=NORTON",
        "3e-11, 3.2, -0.4",
        "*SOLID SECTION, ELSET=EALL, MATERIAL=ALLOY",
        "*AMPLITUDE, NAME=PRESSURE, TIME=TOTAL TIME",
        "0, 0",
        "5, 8",
        "100, 8",
        "105, 10",
        "*TIME POINTS, NAME=PRINTING, TIME=TOTAL TIME",
        "5,",
        "50,",
        "100,",
        "105,",
        "200,",
        "*STEP, INC=1000000, NLGEOM",
        "*VISCO, CETOL=0.0001",
        "0.01, 200, 1e-09, 600",
        "*DLOAD, AMPLITUDE=PRESSURE",
        "1, P1, 1.",
        "*NODE PRINT, NSET=PRINTED, TIME POINTS=PRINTING",
        "U",
        "*END STEP",
    ]


@pytest.mark.parametrize(("edge", "side"), [((0, 4, 1), 1), ((1, 5, 2), 2), ((2, 6, 3), 3), ((3, 7, 0), 4)])
def test_sides_are_counted_as_calculix_does(edge: tuple[int, ...], side: int) -> None:
    assert calculix.pressed_sides(Mesh(NODES, np.arange(8)[None], HELD, np.array([edge]), BLOCK.top)) == [(1, side)]


def test_a_rate_coefficient_that_would_be_raised_is_written_in_a_larger_unit_of_stress() -> None:
    """CalculiX takes no A below 1e-20; with stress in s MPa, A is A s^n and E and pressure are divided by s."""
    rescaled = deck(creep=calculix.Norton(5e-21, 7.0))
    unit = rescaled.stress_unit
    A, n, m = (float(cell) for cell in after(rescaled.text(), "*CREEP")[0].split(","))
    assert A > 1e6 * calculix.SMALLEST_A
    assert (A, n, m) == (pytest.approx(5e-21 * unit**7), 7.0, 0.0)
    assert float(after(rescaled.text(), "*ELASTIC")[0].split(",")[0]) == pytest.approx(150e3 / unit)
    assert float(after(rescaled.text(), "*AMPLITUDE")[1].split(",")[1]) == pytest.approx(8 / unit)
    assert deck().stress_unit == 1.0


def test_a_jump_is_a_static_step_of_a_millisecond() -> None:
    text = deck(pressure=Program.steps([(0.0, 8.0), (100.0, 10.0)])).text()
    lines = text.splitlines()
    steps = [lines[k + 1 : k + 3] for k, line in enumerate(lines) if line.startswith("*STEP")]
    jump, visco = ["*STATIC", "0.001, 0.001, 1e-09, 600"], "*VISCO, CETOL=0.0001"
    assert steps == [jump, [visco, "0.01, 99.999, 1e-09, 600"], jump, [visco, "0.01, 99.999, 1e-09, 600"]]
    assert after(text, "*AMPLITUDE") == ["0, 0", "0.001, 8", "100, 8", "100.001, 10"]
    assert after(text, "*TIME POINTS") == ["0.001,", "50,", "100,", "100.001,", "200,"]


def test_an_elastic_deck_is_static() -> None:
    text = deck(creep=None, large=False).text()
    assert "*CREEP" not in text
    assert "*VISCO" not in text
    assert "NLGEOM" not in text


DAT = """
 displacements (vx,vy,vz) for set PRINTED and time  0.5000000E+01

         4  0.000000E+00  1.000000E-02  0.000000E+00
         7  1.000000E-03  2.000000E-02  0.000000E+00

 displacements (vx,vy,vz) for set PRINTED and time  0.5000000E+02

         4  0.000000E+00  3.000000E-02  0.000000E+00
         7  2.000000E-03  4.000000E-02  0.000000E+00

 stresses (elem, integ.pnt.,sxx,syy,szz,sxy,sxz,syz) for set EALL and time  0.5000000E+02

         1   1 -1.362684E+02 -8.205476E+00 -1.363831E+02  1.506193E-01 -1.792553E-03 -1.515459E-03
         1   2 -1.347213E+02 -8.150756E+00 -1.356823E+02  4.053210E-01 -1.117806E-02 -4.071517E-03
"""


def test_displacements_at_the_times_asked_for() -> None:
    """Points of time that only the amplitude needed are left out; a time that was never reached is NaN."""
    result = calculix.displacements(DAT.splitlines(), deck(nodes=[6, 3]))
    np.testing.assert_array_equal(result[0], [[2e-3, 0.04], [0.0, 0.03]])
    assert np.isnan(result[1]).all()


def test_stresses_in_mpa() -> None:
    rescaled = deck(creep=calculix.Norton(5e-21, 7.0))
    result = calculix.stresses(DAT.splitlines(), rescaled)
    assert result.shape == (2, 1, 2, 4)
    expected = np.array([-136.2684, -8.205476, -136.3831, 0.1506193]) * rescaled.stress_unit
    np.testing.assert_allclose(result[0, 0, 0], expected)
    assert np.isnan(result[1]).all()


def test_increments_and_iterations_of_a_status_file() -> None:
    text = """SUMMARY OF JOB INFORMATION
  STEP      INC     ATT  ITRS     TOT TIME     STEP TIME      INC TIME
     1          1     1     2  0.500000E-01  0.500000E-01  0.500000E-01
     1          2     1     3  0.100000E+00  0.100000E+00  0.500000E-01
"""
    assert calculix.increments(text.splitlines()) == (2, 5)


def test_extrapolation_removes_an_error_that_falls_as_the_number_of_increments_grows() -> None:
    limit, slope = np.array([0.3, 0.7]), np.array([-0.2, -1.1])
    result = calculix.extrapolated(limit + slope / 110, limit + slope / 289, (110, 289))
    np.testing.assert_allclose(result, limit, rtol=1e-13)
