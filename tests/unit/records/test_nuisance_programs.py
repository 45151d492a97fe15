"""What the rig did, as programs of a history: values at chosen times, jumps that stay jumps, keys, refusals."""

import numpy as np
import pytest

from creepkit.errors import SolveError
from creepkit.records import (
    History,
    Nuisance,
    Program,
    RecordedLoading,
    StressSteps,
    constant_strain,
    constant_stress,
    kind_and_start,
    with_program_nuisances,
)

TIMES = np.array([10.0, 500.0, 1000.0])


def history(loading=None, temperature=1000.0, **fields):
    return History("one", TIMES, {}, loading or constant_stress(50.0), temperature, **fields)


def test_a_step_of_temperature_is_a_ramp_of_five_seconds():
    program = with_program_nuisances(history(), {"temperature step@400": -12.0}).temperature_program()
    np.testing.assert_allclose(program.at([0, 400, 402.5, 405, 900]), [1000, 1000, 994, 988, 988])


def test_a_drift_reaches_its_value_at_the_last_used_frame():
    cut = history(used=np.array([True, True, False]))
    program = with_program_nuisances(cut, {"temperature drift": 5.0}).temperature_program()
    np.testing.assert_allclose(program.at([0, 250, 500, 1000]), [1000, 1002.5, 1005, 1005])


def test_steps_add_to_one_another_and_to_what_was_recorded():
    """A recorded jump at 300 s stays one: 1000 K before it, 1010 K at it."""
    recorded = history(temperature=Program(np.array([0.0, 300.0, 300.0]), np.array([1000.0, 1000.0, 1010.0])))
    values = {"temperature step@200": 2.0, "temperature step@600": -3.0}
    program = with_program_nuisances(recorded, values).temperature_program()
    np.testing.assert_allclose(program.at([100, 250, 299.999, 300, 700]), [1000, 1002, 1002, 1012, 1009])


def test_a_load_step_scales_a_stress_and_keeps_its_control():
    loaded = with_program_nuisances(
        history(StressSteps(((0.0, 40.0), (700.0, 60.0)), "stress")), {"load step@400": 0.1}
    ).loading
    assert isinstance(loaded, RecordedLoading)
    assert (loaded.quantity, loaded.control) == ("stress", "stress")
    np.testing.assert_allclose(loaded.program().at([100, 402.5, 500, 700]), [40, 42, 44, 66])


def test_what_changes_no_program_leaves_the_history_as_it_is():
    plain = history()
    assert with_program_nuisances(plain, {"rate drift": 0.3, "thickness": 0.5}) is plain
    stepped = with_program_nuisances(plain, {"rate step@400": 0.3}).temperature_program()
    np.testing.assert_array_equal(stepped.times, [0, 400, 405])
    np.testing.assert_array_equal(stepped.values, 1000.0)


def test_a_strain_has_no_load_step():
    with pytest.raises(SolveError, match="a load step changes a stress or a pressure, and strain is prescribed here"):
        with_program_nuisances(history(constant_strain(0.002)), {"load step@400": 0.1})


@pytest.mark.parametrize("start", [8250.0, 0.1, 1e7 / 3])
def test_keys_name_kind_and_start(start):
    kind, found = kind_and_start(Nuisance("rate step", start=start).key)
    assert kind == "rate step"
    assert found == pytest.approx(start, rel=1e-14)
    assert Nuisance("thickness").key == "thickness"


def test_what_is_no_nuisance_is_refused_in_one_sentence():
    with pytest.raises(SolveError, match="nuisance 'temprature step' is not known; did you mean 'temperature step'"):
        Nuisance("temprature step", start=10.0)
    with pytest.raises(SolveError, match="start is 0 s; say when it begins, such as start=3600"):
        Nuisance("rate step")
    with pytest.raises(SolveError, match="nuisance 'thickness' has no start; only temperature step, rate step, load"):
        Nuisance("thickness", start=5.0)
    with pytest.raises(SolveError, match="scope 'tests' is not known; did you mean 'test'"):
        Nuisance("rate step", "tests", start=5.0)
