"""Exported Fortran: every law's own subroutine against 50 digits, and what the files hold."""

import ctypes
import re
import subprocess

import mpmath
import numpy as np
import pytest

from creepkit.errors import ExportError
from creepkit.exporters.creep_subroutine import ABAQUS_CREEP, CALCULIX_CREEP
from creepkit.exporters.fortran import FORTRAN_RESERVED, fortran_statements, law_subroutine, stable_function_definitions
from creepkit.exporters.law_code import Identifiers, LawCode
from creepkit.language import CreepLaw, Param, mean_stress, parameters, principal_stress, stress
from creepkit.language.symbols import POINT_VARIABLES
from creepkit.laws.norton import NORTON
from creepkit.laws.time_hardening import TIME_HARDENING
from creepkit.records import LawWithValues
from helpers.compiled_fortran import PARAMETERS, compile_fortran, pointer
from helpers.export_cases import LAWS, disagreements, labelled_values

A, n, a = parameters("A n a")
RATE = Param("rate coefficient", bounds=(1e-40, 1e-5), unit="1/s", scale="log", off=0.0)
POWER = Param("exponent", bounds=(1, 8))
NORTON_VALUES = {"A": 1e-16, "n": 5.0}


def law(term, params, name="foreign", **more):
    return CreepLaw(name=name, title="A foreign law", terms={"term": term}, params=params, references=("x",), **more)


def routine_of(values, name):
    return law_subroutine(LawCode(values, Identifiers(FORTRAN_RESERVED, ignore_case=True)), name)


# ---- the law -------------------------------------------------------------------------------------------------------


def test_every_law_agrees_with_50_digits(tmp_path, gfortran):
    lines = [line for label, source in labelled_values().items() for line in routine_of(source, label)]
    library = compile_fortran(gfortran, "\n".join(lines) + "\n", tmp_path, "laws")[0]

    def evaluate(_, judged):
        pairs = zip(judged.labels, judged.drawn.points, strict=True)
        found = [rows_of(library, label, point, judged.law) for label, point in pairs]
        return np.array([rows for rows, _ in found]), np.array([log for _, log in found])

    assert disagreements(evaluate) == []


def rows_of(library, name, point, judged):
    """Value and derivatives of the rate and of each state's rate, and ln rate, at one point."""
    rows, width = 1 + len(judged.states), len(POINT_VARIABLES) + len(judged.states)
    given, out = np.array(point), np.empty(rows * (1 + width))
    getattr(library, f"{name}_")(pointer(given), pointer(out))
    values, slopes = out[:rows].copy(), out[rows:].reshape(rows, width).copy()
    with np.errstate(over="ignore", invalid="ignore"):  # a rate that no double holds is judged by its logarithm
        values[0] = np.exp(values[0])
        slopes[0] *= values[0]
    return np.column_stack([values, slopes]), out[0]


def test_functions_that_fortran_lacks_keep_their_digits_near_zero(tmp_path, gfortran):
    lines = [
        "subroutine probe(a, out)",
        "implicit none",
        "double precision, intent(in) :: a",
        "double precision, intent(out) :: out(6)",
        *(f"out({k}) = {name}(a)" for k, name in enumerate(PROBED, 1)),
    ]
    text = fortran_statements([*lines, "contains", *stable_function_definitions(PROBED), "end subroutine probe"])
    library = compile_fortran(gfortran, "\n".join(text) + "\n", tmp_path, "probe")[0]
    for a in (1e-12, 3e-5, 0.02, 0.4, 0.6, 0.9, 1.1, 5.0, 40.0, 600.0):
        out = np.empty(6)
        library.probe_(ctypes.byref(ctypes.c_double(a)), pointer(out))
        with mpmath.workdps(40):
            exact = [f(mpmath.mpf(a)) for f in PROBED.values()]
        assert out == pytest.approx([float(e) for e in exact], rel=1e-14)


PROBED = {
    "log1p": lambda x: mpmath.log(1 + x),
    "expm1": lambda x: mpmath.exp(x) - 1,
    "log_sinh": lambda x: mpmath.log(mpmath.sinh(x)),
    "log_cosh": lambda x: mpmath.log(mpmath.cosh(x)),
    "log_rise": lambda x: mpmath.log(1 - mpmath.exp(-x)),
    "coth": mpmath.coth,
}


# ---- the text ------------------------------------------------------------------------------------------------------


def test_every_file_is_fixed_form():
    for law in LAWS.values():
        given = LawWithValues(law, law.center(), notes=["a note " * 30])
        if law.uses(principal_stress):
            with pytest.raises(ExportError, match="largest principal stress"):
                ABAQUS_CREEP.text(given)
            continue
        text = ABAQUS_CREEP.text(given)
        assert text.isascii() or not law.title.isascii(), law.name
        for line in text.splitlines():
            assert len(line) <= 72, (law.name, line)
            assert line.startswith(("!", "      ", "     &")), (law.name, line)


def test_files_compile_without_a_warning(tmp_path, gfortran):
    sources = []
    for k, name in enumerate(["combined with temperature", "registered drifting-exponent", "foreign names of Python"]):
        for exporter in (ABAQUS_CREEP, CALCULIX_CREEP):
            sources.append(tmp_path / f"{exporter.name}{k}.f")
            sources[-1].write_text(exporter.text(LawWithValues(LAWS[name], LAWS[name].center())))
    (tmp_path / "ABA_PARAM.INC").write_text("      implicit real*8(a-h,o-z)\n")
    flags = ["-fsyntax-only", "-Wall", "-Wno-zerotrip", "-Wno-unused-dummy-argument"]
    run = subprocess.run([gfortran, *flags, *sources], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (run.returncode, run.stderr) == (0, "")


def test_the_head_says_law_units_values_notes_and_what_the_input_file_needs():
    text = ABAQUS_CREEP.text(
        LawWithValues(TIME_HARDENING, {"A": 1.5e-12, "n": 4.0, "m": -0.3}, ["n = 4, 95 % interval 3.8 to 4.2"])
    )
    words = " ".join(re.sub(r"^! *", "", line) for line in text.splitlines() if line.startswith("!"))
    for said in (
        "rate = A*stress**n*time**m",
        "Stress in MPa, time in s, rates in 1/s.",
        "A = 1.5e-12 1/s, rate coefficient",
        "Note: n = 4, 95 % interval 3.8 to 4.2",
        "*CREEP, LAW=USER",
        "Time is the total time, TIME(2), less t_first",
    ):
        assert said in words


def test_names_that_clash_without_case_are_renamed_openly():
    text = ABAQUS_CREEP.text(
        LawWithValues(law(A * stress**n * a, {A: RATE, n: POWER, a: POWER}), NORTON_VALUES | {"a": 2})
    )
    assert "! 'a' is called a_2 here" in text
    assert "parameter :: a_2 = 2.0d0" in text


def test_a_name_is_made_an_identifier_and_short_enough():
    text = ABAQUS_CREEP.text(LawWithValues(NORTON, NORTON_VALUES, name="2nd law of Würzburg, " + 9 * "long "))
    assert re.search(r"subroutine x_2nd_law_of_wurzbur\w*_law\(x, out\)", text)
    assert max(len(name) for name in re.findall(r"subroutine (\w+)", text)) <= 31


@pytest.mark.parametrize("exporter", [ABAQUS_CREEP, CALCULIX_CREEP])
def test_nothing_in_a_note_or_a_title_becomes_code(exporter, tmp_path, gfortran):
    """Abaqus has files preprocessed, and to a preprocessor C comments are comments."""
    notes = (
        "x\n      call abort()",
        "x & \n     & call abort()",
        "x\r      call abort()",
        "#include 'x'\n#include 'x'",
    )
    source = LawWithValues(NORTON.rename("norton", "open /* for ever"), {"A": 1e-16, "n": 5}, notes)
    (tmp_path / "ABA_PARAM.INC").write_text(PARAMETERS)
    (tmp_path / "law.f").write_text(exporter.text(source))
    plain = exporter.text(LawWithValues(NORTON, {"A": 1e-16, "n": 5}))
    kept = [[line for line in text.splitlines() if line[:1] != "!"] for text in (exporter.text(source), plain)]
    assert kept[0] == kept[1]
    command = [gfortran, "-c", "-cpp", "law.f", "-o", "law.o"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert b"creep_" in (tmp_path / "law.o").read_bytes()


def test_a_saturating_rate_raises_no_floating_point_exception_at_long_times(tmp_path, gfortran):
    text = ABAQUS_CREEP.text(LawWithValues(LAWS["foreign saturating"], {"A": 1e-20, "r": 1e-3, "n": 4.0}))
    driver = """
      program trapped
        double precision x(6), out(7)
        x = (/ 60d0, 0d0, 1d7, 1d3, 60d0, 20d0 /)
        call foreign_law(x, out)
        if (abs(out(1) - log(1d-20) - 4*log(60d0)) > 1d-9) stop 2
      end program"""
    (tmp_path / "ABA_PARAM.INC").write_text(PARAMETERS)
    (tmp_path / "law.f").write_text(text + driver + "\n")
    trap = [gfortran, "-w", "-ffpe-trap=invalid,zero,overflow", "-finit-real=snan", "-o", "law", "law.f"]
    subprocess.run(trap, cwd=tmp_path, check=True)
    assert subprocess.run([tmp_path / "law"], check=False).returncode == 0


def test_what_creep_is_not_told_is_refused():
    first = law(A * principal_stress**n, {A: RATE, n: POWER})
    with pytest.raises(ExportError, match="largest principal stress, which Abaqus does not pass to CREEP"):
        ABAQUS_CREEP.text(LawWithValues(first, NORTON_VALUES))
    mean = law(A * (stress + mean_stress) ** n, {A: RATE, n: POWER})
    assert "given(2) = -p" in ABAQUS_CREEP.text(LawWithValues(mean, NORTON_VALUES))
    with pytest.raises(ExportError, match="mean stress, which CalculiX does not pass.*export it as 'calculix-umat'"):
        CALCULIX_CREEP.text(LawWithValues(mean, NORTON_VALUES))
    shared = law(A * (a * principal_stress + (1 - a) * stress) ** n, {A: RATE, n: POWER, a: Param("share", (0, 1))})
    text = ABAQUS_CREEP.text(LawWithValues(shared, {**NORTON_VALUES, "a": 0.0}))
    assert "switched off and left out: a = 0" in text, "a share that is zero by value leaves the von Mises stress"
    calculix = CALCULIX_CREEP.text(LawWithValues(NORTON, NORTON_VALUES))
    head = " ".join(re.sub(r"^! *", "", calculix, flags=re.MULTILINE).split())
    assert "ignores a preloaded CREEP" in head
    assert "insists on CETOL" in head
