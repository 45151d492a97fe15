"""The exported C compiles without a warning and agrees with 50 digits: rates, derivatives, internal variables."""

import ctypes
import math

import numpy as np
import pytest

from creepkit.exporters.c import CExporter
from creepkit.language import stress
from creepkit.language.symbols import POINT_VARIABLES
from creepkit.laws.combined import COMBINED
from creepkit.laws.norton import NORTON
from creepkit.laws.time_hardening import TIME_HARDENING
from creepkit.records import LawWithValues, Units
from helpers.compilers import shared_library
from helpers.export_cases import LAWS, disagreements, labelled_values

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic")


def compile_c(gcc, folder, sources):
    """The exported sources as one library, all in one call of the compiler without a warning."""
    for k, source in enumerate(sources):
        (folder / f"law{k}.c").write_text(CExporter().text(source), encoding="utf-8")
    files = sorted(folder.glob("law*.c"))
    return shared_library([gcc, *STRICT, "-O1", *files, "-lm"], folder / "laws.so")[0]


class Compiled:
    """One law in a library."""

    def __init__(self, library, name, law):
        self.used = [k for k, s in enumerate(POINT_VARIABLES) if s == stress or law.uses(s)]
        self.used += [len(POINT_VARIABLES) + k for k in range(len(law.states))]
        self.states, self.size = len(law.states), len(POINT_VARIABLES) + len(law.states)
        self.entries = {end: getattr(library, f"{name}_{end}", None) for end in ("rate", "log_rate", "state_rates")}
        self.entries["rate"].restype = self.entries["log_rate"].restype = ctypes.c_double

    def arguments(self, point):
        return [ctypes.c_double(point[k]) for k in self.used]

    def rate(self, point):
        return self.entries["rate"](*self.arguments(point))

    def log_rate(self, point):
        """ln rate, and its derivatives to the variables used."""
        slopes = (ctypes.c_double * len(self.used))()
        return self.entries["log_rate"](*self.arguments(point), slopes), list(slopes)

    def state_rates(self, point):
        """Rates, and rows of derivatives."""
        rates, slopes = (ctypes.c_double * self.states)(), (ctypes.c_double * (self.states * len(self.used)))()
        self.entries["state_rates"](*self.arguments(point), rates, slopes)
        return list(rates), np.array(slopes).reshape(self.states, -1)

    def rows(self, point):
        """Value and derivatives of the rate and of each state's rate, and ln rate."""
        rows = np.zeros((1 + self.states, 1 + self.size))
        log, slopes = self.log_rate(point)
        rows[0, 0] = self.rate(point)
        with np.errstate(over="ignore", invalid="ignore"):  # a rate that no double holds is judged by its logarithm
            rows[0, [1 + k for k in self.used]] = rows[0, 0] * np.array(slopes)
        if self.states:
            rates, slopes = self.state_rates(point)
            rows[1:, 0] = rates
            rows[1:, [1 + k for k in self.used]] = slopes
        return rows, log


def test_every_law_agrees_with_50_digits(tmp_path, gcc):
    library = compile_c(gcc, tmp_path, labelled_values().values())

    def evaluate(_, judged):
        pairs = zip(judged.labels, judged.drawn.points, strict=True)
        found = [Compiled(library, label, judged.law).rows(point) for label, point in pairs]
        return np.array([rows for rows, _ in found]), np.array([log for _, log in found])

    assert disagreements(evaluate) == []


# ---- what the text holds -------------------------------------------------------------------------------------------


def test_a_file_has_the_authors_numbers_and_says_how_to_call_it():
    text = CExporter().text(LawWithValues(NORTON, {"A": 1.2e-16, "n": 5.2}, ["n = 5.2 +- 0.1 (95 %)"]))
    for line in (
        " * Stress in MPa, time in s, rates in 1/s. stress is a ratio to 1 MPa, time to 1 s, rates are per s.",
        " * Note: n = 5.2 +- 0.1 (95 %)",
        " *   double norton_rate(double stress);",
        " *   double norton_log_rate(double stress, double slopes[1]);",
        "static const double A = 1.2e-16; /* 1/s, rate coefficient */",
        "static const double n = 5.2; /* stress exponent */",
        "double norton_rate(double stress)",
    ):
        assert line in text.splitlines()
    assert [line for line in text.splitlines() if line.startswith("#")] == ["#include <math.h>"]


# ---- what the compiled file does -----------------------------------------------------------------------------------


def test_units_are_converted_on_entry_and_on_exit(tmp_path, gcc):
    """With stress in Pa and time in h, rates are per hour and slopes per Pa and per hour."""
    law = LAWS["foreign Kachanov-Rabotnov"] + TIME_HARDENING
    values = law.center()
    units = Units("Pa", "h")
    sources = [LawWithValues(law, values, name="native"), LawWithValues(law, values, name="converted", units=units)]
    library = compile_c(gcc, tmp_path, sources)
    plain, other = (Compiled(library, name, law) for name in ("native", "converted"))
    point = np.array([120.0, 0.01, 7.2e4, 1000.0, 90.0, 40.0, 0.3])
    scales = np.array([1e6, 1.0, 1 / 3600, 1.0, 1e6, 1e6, 1.0])
    rows, log = plain.rows(point)
    found, found_log = other.rows(point * scales)
    np.testing.assert_allclose(found[:, 0], 3600 * rows[:, 0], rtol=1e-13)
    np.testing.assert_allclose(found[:, 1:], 3600 * rows[:, 1:] / scales, rtol=1e-13)
    assert found_log == pytest.approx(log + math.log(3600), rel=1e-14)


def test_internal_variables_start_and_end_as_the_law_says(tmp_path, gcc):
    law = LAWS["foreign Kachanov-Rabotnov"]
    library = compile_c(gcc, tmp_path, [LawWithValues(law, law.center(), name="damage")])
    assert ctypes.c_double.in_dll(library, "damage_initial").value == 0.0
    assert ctypes.c_double.in_dll(library, "damage_limit").value == 0.99


def test_virgin_and_unloaded_material_has_finite_numbers(tmp_path, gcc):
    library = compile_c(gcc, tmp_path, [LawWithValues(COMBINED, COMBINED.center())])
    law = Compiled(library, "combined", COMBINED)
    for point in ([100.0, 0.0, 0.0], [0.0, 0.01, 1.0], [0.0, 0.0, 0.0]):
        rows, log = law.rows(point + [0.0] * 3)
        assert np.isfinite(rows).all()
        assert math.isfinite(log)


def test_beyond_doubles_the_rate_is_infinite_and_its_logarithm_is_not(tmp_path, gcc):
    """ln A sinh(x)^n = ln A + n (x - ln 2) for large x."""
    law = LAWS["registered hyperbolic-sine"]
    library = compile_c(gcc, tmp_path, [LawWithValues(law, {"A": 1e-5, "n": 8.0, "B": 1.0})])
    found = Compiled(library, "hyperbolic_sine", law)
    assert found.rate([2000.0]) == math.inf
    log, slopes = found.log_rate([2000.0])
    assert log == pytest.approx(math.log(1e-5) + 8 * (2000 - math.log(2)), rel=1e-14)
    assert slopes == [pytest.approx(8.0)]
