"""Labels of tests say the load program and the temperature over the frames that were used."""

import numpy as np
import pytest

from creepkit.inverse.held_levels import holds
from creepkit.records import History, PointLoading, PressureJump, Program, RecordedLoading, StrainSteps, constant_stress
from creepkit.records.loading import StressSteps
from creepkit.reports.load_programs import kind_of_test, label_of, program_text

HOUR = 3600.0


def history(loading, temperature=1066.15, end=8.0, **changes):
    times = np.linspace(0.1, end, 20) * HOUR
    return History("a", times, {"strain": 1e-3 * times}, loading, temperature, **changes)


CASES = [
    (PressureJump(8.0, 10.0, 4 * HOUR), "8 → 10 MPa at 4 h, 793 °C"),
    (PressureJump(8.0, 8.0, 4 * HOUR), "8 MPa, 793 °C"),
    (PressureJump(8.0, 10.0, 20 * HOUR), "8 MPa, 793 °C"),  # the jump comes after the last frame
    (constant_stress(43.0), "43 MPa, 793 °C"),
    (StressSteps(((0, 60), (HOUR, 80), (2 * HOUR, 60))), "60 → 80 MPa at 1 h → 60 MPa at 2 h, 793 °C"),
    (StressSteps(tuple((k * HOUR, 50 + 10 * k) for k in range(5))), "50 → … → 90 MPa, 5 steps, 793 °C"),
    (StrainSteps(((0, 0.002), (HOUR, 0.003)), ramp=60.0), "strain 0.002 → 0.003 at 1 h, 793 °C"),
    (PointLoading({"11": 80.0, "12": [(0, 0), (HOUR, 40)]}), "stress 11 80 MPa, stress 12 0 → 40 MPa at 1 h, 793 °C"),
    (RecordedLoading(Program(np.array([0.0, 9 * HOUR]), np.array([0.0, 10.0])), "stress"), "ramps MPa, 793 °C"),
]


@pytest.mark.parametrize(("loading", "text"), CASES)
def test_the_program_is_written_as_people_say_it(loading, text):
    assert program_text(history(loading)) == text
    assert label_of(history(loading)) == f"a: {text}"


def test_a_recorded_load_that_wavers_by_less_than_two_per_cent_is_held():
    times = np.linspace(0, 8 * HOUR, 200)
    wavering = Program(times, 100.0 + 0.5 * np.sin(times))
    assert program_text(history(RecordedLoading(wavering, "stress"))) == "100 MPa, 793 °C"


def test_temperatures_are_held_or_change():
    assert program_text(history(constant_stress(50.0), Program.steps([(0, 1000.0), (2 * HOUR, 1040.0)]))).endswith(
        "50 MPa, 727 → 767 °C at 2 h"
    )
    assert program_text(history(constant_stress(50.0), Program.steps([(0, 1000.0), (2 * HOUR, 1001.0)]))).endswith(
        "50 MPa, 727 °C"
    )


def test_holds_leave_out_ramps_and_end_with_the_test():
    program = PressureJump(8.0, 10.0, 100.0, ramp=5.0).program()
    assert holds(program, 300.0, 0.1) == [(5.0, 100.0, 8.0), (105.0, 300.0, 10.0)]
    assert holds(program, 90.0, 0.1) == [(5.0, 100.0, 8.0)]


@pytest.mark.parametrize(
    ("loading", "kind"),
    [
        (constant_stress(50.0), "creep under constant load"),
        (constant_stress(50.0, "stress"), "creep under constant true stress"),
        (StressSteps(((0.0, 50.0), (4 * HOUR, 60.0))), "creep under stepwise load"),
        (StressSteps(((0.0, 50.0), (40 * HOUR, 60.0))), "creep under constant load"),  # the step comes after the end
        (PressureJump(8.0, 8.0, 4 * HOUR), "creep under constant pressure"),
        (StrainSteps(((0.0, 0.002),)), "constant strain, at which the stress relaxes"),
        (RecordedLoading(Program([0.0, 9 * HOUR], [0.0, 0.01]), "strain"), "changing strain"),
        (PointLoading({"11": Program.constant(50.0)}, {"12": Program.constant(0.0)}),
         "prescribed components of stress and strain"),
    ],
)  # fmt: skip
def test_what_is_held_is_said_in_the_words_of_the_field(loading, kind):
    assert kind_of_test(history(loading)) == kind
