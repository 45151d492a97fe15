"""What laboratories leave unsaid: what was imposed, when a step began, what loading left in a strain record."""

from pathlib import Path

import numpy as np
import pytest

from creepkit.errors import HistoryError
from creepkit.readers.history_csv import HISTORY_CSV, write_history
from creepkit.records import History, RecordedLoading, StrainSteps, StressSteps

HOT = "# temperature_C: 850\n"
SAID = "# control: load\n# strain_measure: engineering\n"


@pytest.fixture
def read(tmp_path: Path):
    def one(text: str) -> History:
        path = tmp_path / "x.csv"
        path.write_text(text, encoding="utf-8")
        (history,) = HISTORY_CSV.read(path)
        (back,) = HISTORY_CSV.read(write_history(history, tmp_path / "y.csv"))
        for name, values in history.outputs.items():
            np.testing.assert_array_equal(values, back.outputs[name])
        assert (back.loading, back.includes_elastic) == (history.loading, history.includes_elastic)
        np.testing.assert_array_equal(back.used, history.used)
        return history

    return one


def rows(*columns) -> str:
    return "\n".join(",".join(f"{x:.10g}" for x in row) for row in zip(*columns, strict=True)) + "\n"


def assumed(history: History) -> str:
    return history.labels.get("assumed", "")


# Relaxation: stress over time at a held strain.

TIMES = np.array([0.0, 100.0, 400.0, 900.0, 1600.0, 2500.0])
RELAXING = 300.0 / (1.0 + TIMES / 500.0)


def test_held_strain_in_the_head(read):
    history = read(HOT + "# modulus_GPa: 150\n# strain_pct: 0.2\ntime_s,stress_MPa\n" + rows(TIMES, RELAXING))
    assert (history.specimen, history.loading) == ("relaxation", StrainSteps(((0.0, 0.002),)))
    np.testing.assert_allclose(history.outputs["stress"], RELAXING)


def test_held_strain_without_a_unit(read):
    body = "time_s,stress_MPa\n" + rows(TIMES, RELAXING)
    history = read(HOT + "# modulus_GPa: 150\n# strain: 0.002\n" + body)
    assert history.loading == StrainSteps(((0.0, 0.002),))
    assert "strain 0.002 as a fraction" in assumed(history)
    with pytest.raises(HistoryError, match="x.csv:3: 'strain' is 0.2 without a unit; write strain_pct"):
        read(HOT + "# modulus_GPa: 150\n# strain: 0.2\n" + body)


def test_a_held_column_of_strain_beside_a_falling_stress_is_a_relaxation(read):
    """Until now it was read as creep under a stress that fell."""
    body = "time_s,strain_pct,stress_MPa\n" + rows(TIMES, np.full(6, 0.2), RELAXING)
    history = read(HOT + "# modulus_GPa: 150\n" + body)
    assert (history.specimen, list(history.outputs)) == ("relaxation", ["stress"])
    assert history.loading.program().values.tolist() == [0.002]
    assert "strain imposed, for its column is held" in assumed(history)
    named = read(HOT + "# modulus_GPa: 150\n# specimen: relaxation\n" + body)
    assert named.loading == history.loading


def test_a_held_column_of_stress_beside_a_growing_strain_is_creep(read):
    history = read(HOT + "time_s,strain_pct,stress_MPa\n" + rows(TIMES, TIMES / 1e4, np.full(6, 120.0)))
    assert (history.specimen, history.loading) == ("uniaxial", StressSteps(((0.0, 120.0),)))


# Steps of load and temperature.

STEP_TIMES = np.array([0.0, 10, 20, 30, 40, 50, 50.5, 60, 70, 80, 90, 100]) * 3600
LEVELS = np.where(STEP_TIMES > 50 * 3600, 120.0, 100.0)
STRAIN = STEP_TIMES / 1e8


def test_nominal_levels_of_a_column_are_steps_and_no_ramp(read):
    history = read(HOT + "time_s,strain_pct,stress_MPa\n" + rows(STEP_TIMES, STRAIN, LEVELS))
    assert history.loading == StressSteps(((0.0, 100.0), (50.5 * 3600, 120.0)))
    assert "steps of stress from the first frame of each level on" in assumed(history)


def test_the_strain_tells_when_a_load_was_raised_between_distant_frames(read):
    """Strain hardening; read each 20 h, the load was raised at 80.1 h, at 99.9 h, or amid two readings."""
    times, fine = np.array([0.0, 5, 10, 20, *range(40, 201, 20)]), np.linspace(0.0, 200.0, 4001)
    for raised, modulus, expected in (
        (80.1, None, 80.0),
        (99.9, None, 100.0),
        (99.9, 150e3, 100.0),
        (90.0, None, None),
    ):
        rate = 1e-4 * np.where(fine < raised, 1.0, 1.3**5) * 1e3**-0.5  # of the strain e: de/dt = rate / e^0.5
        creep = (1.5 * np.append(0.0, np.cumsum(rate[:-1] * np.diff(fine)))) ** (2 / 3)
        stress = np.where(times < 99.0, 100.0, 130.0) + (
            0.0 if modulus is None else 0.1 * (-1.0) ** np.arange(times.size)
        )
        strain = np.interp(times, fine, creep) + (
            0.0 if modulus is None else np.where(times < raised, 100, 130) / modulus
        )
        text = HOT + "time_h,stress_MPa,strain_1\n" + rows(times, stress, strain)
        if expected is None:
            with pytest.raises(HistoryError, match=r"between 288000 s and 360000 s; state when; .*\] stress_steps = "):
                read(text)
        else:
            program = read(text).loading.program()
            assert program.times[np.argmax(program.values > 120.0)] == pytest.approx(3600.0 * expected)


def test_a_step_between_distant_frames_may_be_stated(read):
    kept = STEP_TIMES != 50.5 * 3600
    body = "time_s,strain_pct,stress_MPa\n" + rows(STEP_TIMES[kept], STRAIN[kept], LEVELS[kept])
    stated = read(HOT + "# stress_steps: 0 s 100 MPa; 52 h 120 MPa\n" + body)
    assert stated.loading == StressSteps(((0.0, 100.0), (52 * 3600.0, 120.0)))
    assert dict(stated.stated) == {}


def test_two_readings_at_the_time_of_a_step_state_it(read):
    """The mean of both, 110 MPa, was never imposed."""
    times, levels = np.array([0.0, 10, 20, 20, 30, 40]) * 3600, [100, 100, 100, 120, 120, 120]
    history = read(HOT + "time_s,strain_pct,stress_MPa\n" + rows(times, [0, 1, 2, 2.1, 3, 4], levels))
    assert history.loading == StressSteps(((0.0, 100.0), (20 * 3600.0, 120.0)))
    np.testing.assert_allclose(history.outputs["strain"], [0, 0.01, 0.021, 0.03, 0.04])


def test_numbered_steps(read):
    head = HOT + "# stress_1_MPa: 100\n# stress_2_MPa: 110\n# stress_3_MPa: 120\n"
    times, steps = np.array([0.0, 10, 20, 20.1, 30, 40, 40.1, 50]) * 3600, [1, 1, 1, 2, 2, 2, 3, 3]
    body = "time_s,step,strain_pct\n" + rows(times, steps, times / 1e6)
    expected = StressSteps(((0.0, 100.0), (20.1 * 3600, 110.0), (40.1 * 3600, 120.0)))
    assert read(head + body).loading == expected
    with pytest.raises(HistoryError, match="x.csv:11: step 3 has no level; write stress_3 with its unit"):
        read(head.replace("# stress_3_MPa: 120\n", "") + body)
    with pytest.raises(HistoryError, match="'stress_3_MPa' has no meaning beside the other conditions"):
        read(head + "# jump_time_h: 20\ntime_s,strain_pct\n0,0\n10,1\n")


def test_a_record_with_ramps_and_noise_stays_a_program(read):
    stress = 100.0 + np.array([0, 0.01, 0, 8, 16, 20, 20.01, 20, 20, 20.01, 20, 20])
    history = read(HOT + "time_s,strain_pct,stress_MPa\n" + rows(STEP_TIMES, STRAIN, stress))
    assert isinstance(history.loading, RecordedLoading)


# Engineering and true stress.


def test_the_measure_of_the_stress_says_what_is_held(read):
    body = "time_s,strain_pct\n0,0\n10,1\n"
    assert read(HOT + "# stress_MPa: 60\n# stress_measure: true\n" + body).loading.control == "stress"
    engineering = read(HOT + "# stress_MPa: 60\n# stress_measure: engineering\n" + body)
    assert engineering.loading.control == "load"
    assert "control load, for the stress is the engineering one" in assumed(engineering)
    steps = HOT + "# stress_steps: 0 s 60 MPa; 5 s 70 MPa\n# control: load\n# stress_measure: true\n"
    with pytest.raises(HistoryError, match="x.csv:4: stress_measure is true and control is load, but steps and rec"):
        read(steps + body)


# Loading strain: stress over modulus is 120 / 150e3 = 8e-4.

LOADED = HOT + SAID + "# stress_MPa: 120\n# modulus_GPa: 150\n"
AFTER = np.array([30.0, 60, 90, 150, 600, 3600, 7200, 36000])
CREEP = 1e-8 * AFTER


def total(*, elastic: float = 8e-4) -> str:
    """Frames at rest, half way up, and after loading."""
    times, strain = np.append([0.0, 20.0], AFTER), np.append([0.0, 0.2 * elastic], elastic + CREEP)
    return "time_s,strain_pct\n" + rows(times, 100 * strain)


def test_the_end_of_loading_is_found(read):
    history = read(LOADED + total())
    assert (history.includes_elastic, history.used.tolist()) == (True, [False, False, *[True] * 8])
    assert "includes_elastic yes and frames before 30 s not used (the strain then stays at 1.00" in assumed(history)


def test_a_file_that_says_what_its_strain_is_is_believed(read):
    for said in ("yes", "no"):
        history = read(LOADED + f"# includes_elastic: {said}\n" + total())
        assert (history.includes_elastic, history.used.all(), assumed(history)) == (said == "yes", True, "")


@pytest.mark.parametrize("exponent", [1 / 3, 0.5, 1.0])
def test_primary_creep_is_no_loading(read, exponent):
    """A strain that passes the elastic one on its way, as the cube root of time or faster."""
    times = np.append(0.0, np.geomspace(10, 1e5, 60))
    strain = 8e-4 * (times / 100.0) ** exponent
    history = read(LOADED + "time_s,strain_pct\n" + rows(times, 100 * strain))
    assert (history.includes_elastic, history.used.all()) == (False, True)


def test_strain_at_time_zero(read):
    times = np.append(0.0, AFTER)
    elastic = read(LOADED + "time_s,strain_pct\n" + rows(times, 100 * (8.2e-4 + 1e-8 * times)))
    assert elastic.includes_elastic
    assert "the strain at time 0 is 1.03 of stress over modulus" in assumed(elastic)
    plastic = read(LOADED + "time_s,strain_pct\n" + rows(times, 100 * (3e-3 + 1e-8 * times)))
    assert not plastic.includes_elastic
    np.testing.assert_allclose(plastic.outputs["strain"], 1e-8 * times, atol=1e-12)
    assert "loading strain 0.003 at time 0 subtracted" in assumed(plastic)
    # elastic and plastic: 1.57 of stress over modulus
    partly = read(LOADED + "time_s,strain_pct\n" + rows(times, 100 * (1.256e-3 + 1e-8 * times)))
    assert not partly.includes_elastic
    np.testing.assert_allclose(partly.outputs["strain"], 1e-8 * times, atol=1e-12)


def test_stated_loading_strain(read):
    body = "time_s,strain_pct\n" + rows(AFTER, 100 * (3e-3 + CREEP))
    told = read(LOADED + "# loading_strain_pct: 0.3\n# includes_loading: yes\n" + body)
    np.testing.assert_allclose(told.outputs["strain"], CREEP, atol=1e-12)
    assert told.labels["loading_strain"] == "0.003"
    found = read(LOADED + "# loading_strain_pct: 0.3\n" + body)
    np.testing.assert_allclose(found.outputs["strain"], CREEP, atol=1e-12)
    assert "loading strain contained" in assumed(found)
    beside = read(LOADED + "# loading_strain_pct: 0.3\ntime_s,strain_pct\n" + rows(AFTER, 100 * CREEP))
    np.testing.assert_allclose(beside.outputs["strain"], CREEP, atol=1e-12)
    assert "loading strain not contained" in assumed(beside)


def test_stated_end_of_loading(read):
    history = read(LOADED + "# loading_time_s: 30\n# includes_loading: yes\n" + total(elastic=3e-3))
    assert history.used.tolist() == [False, False, *[True] * 8]
    np.testing.assert_allclose(history.outputs["strain"][2:], CREEP - CREEP[0], atol=1e-12)
    with pytest.raises(HistoryError, match="x.csv:6: every frame lies before 'loading_time_h'"):
        read(LOADED + "# loading_time_h: 100\n" + total())
    with pytest.raises(HistoryError, match="includes_loading is yes, but not by how much; state loading_strain_pct"):
        read(LOADED + "# includes_loading: yes\ntime_s,strain_pct\n" + rows(AFTER, 100 * (3e-3 + CREEP)))
    with pytest.raises(HistoryError, match="no elastic strain is left; leave out includes_elastic: yes"):
        read(LOADED + "# includes_loading: yes\n# includes_elastic: yes\n# loading_strain_pct: 0.3\n" + total())


def test_steps_of_temperature(read):
    text = HOT.replace("temperature_C: 850", "stress_MPa: 100") + "time_s,strain_pct,temperature_C\n"
    temperatures = np.where(LEVELS > 110, 870.0, 850.0)
    program = read(text + rows(STEP_TIMES, STRAIN, temperatures)).temperature_program()
    np.testing.assert_allclose(program.at([0, 50.4 * 3600, 50.5 * 3600]) - 273.15, [850, 850, 870])


@pytest.mark.parametrize("unit", ["°C", "deg C", "C", "celsius"])
def test_units_of_programs_are_spelled_as_those_of_columns(read, unit):
    program = f"# stress_MPa: 120\n# temperature_program: 0 h 630 {unit}; 200 hours 630 {unit}; 201 h 670 {unit}\n"
    history = read(program + "time_h,strain_pct\n" + rows([0, 1, 300], [0.0, 0.1, 0.2]))
    assert history.temperature.values.tolist() == pytest.approx([903.15, 903.15, 943.15])
    assert history.temperature.times.tolist() == pytest.approx([0, 200 * 3600, 201 * 3600])
