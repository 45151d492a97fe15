"""What laboratories leave unsaid: what was imposed, when a step began, what loading left in a strain record."""

from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import HistoryError
from creepkit.readers.history_csv import HISTORY_CSV, write_history
from creepkit.records import History, RecordedLoading, StrainSteps, StressSteps
from creepkit.reports.histories import kind_of_test

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
    assert "strain imposed (its column is held)" in assumed(history)
    named = read(HOT + "# modulus_GPa: 150\n# specimen: relaxation\n" + body)
    assert named.loading == history.loading


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


def test_a_step_between_readings_of_a_schedule_is_amid_them_unless_the_strain_tells_where(read):
    """Norton, read every 2 h from 1 h on: a temperature raised at 60.1, 59.1, 60.9 h; with a noise that hides it, 60 h.

    Of thermal expansion the lines meet elsewhere: they tell nothing.
    """
    times = np.arange(1.0, 121.0, 2.0)
    for raised, noise, grown in (
        (60.1, 0.0, 0.0),
        (59.1, 0.0, 0.0),
        (60.9, 0.0, 0.0),
        (60.9, 4e-4, 0.0),
        (59, 0, 3e-3),
    ):
        strain = 1e-4 * (np.minimum(times, raised) + 3.0 * np.maximum(times - raised, 0.0)) + grown * (times > 60)
        strain = strain + noise * np.random.default_rng(0).standard_normal(times.size)
        text = "# stress_MPa: 60\ntime_h,temperature_C,strain_1\n" + rows(times, np.where(times < 60, 700, 720), strain)
        expected = pytest.approx(60.0, abs=0.5) if noise or grown else pytest.approx(raised)
        assert read(text).temperature.times[1] / 3600.0 == expected


def test_a_step_between_distant_frames_may_be_stated(read):
    kept = STEP_TIMES != 50.5 * 3600
    body = "time_s,strain_pct,stress_MPa\n" + rows(STEP_TIMES[kept], STRAIN[kept], LEVELS[kept])
    stated = read(HOT + "# stress_steps: 0 s 100 MPa; 52 h 120 MPa\n" + body)
    assert (stated.loading, dict(stated.stated)) == (StressSteps(((0.0, 100.0), (52 * 3600.0, 120.0))), {})


def test_two_readings_at_the_time_of_a_step_state_it(read):
    """The mean of both, 110 MPa, was never imposed."""
    times, levels = np.array([0.0, 10, 20, 20, 30, 40]) * 3600, [100, 100, 100, 120, 120, 120]
    history = read(HOT + "time_s,strain_pct,stress_MPa\n" + rows(times, [0, 1, 2, 2.1, 3, 4], levels))
    assert history.loading == StressSteps(((0.0, 100.0), (20 * 3600.0, 120.0)))
    np.testing.assert_allclose(history.outputs["strain"], [0, 0.01, 0.021, 0.03, 0.04])


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
    with pytest.raises(HistoryError, match="x.csv:4: stress_measure is true and control is load, but an engine"):
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
    with pytest.raises(HistoryError, match="which leaves no elastic strain; leave out includes_elastic: yes"):
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


# ---- plain bars ------------------------------------------------------------------------------------------------------

# Load and extension of bars, relaxation with its loading ramp, and which of stress and strain was imposed.


E, N, A = 160e3, 5.0, 2e-18
"""MPa, 1, and 1/s at 1 MPa of the planted Norton law."""


BAR_TIMES = np.array([*np.arange(0.0, 8.0, 1.0), 8.0, 10, 14, 20, 40, 100, 300, 1e3, 3e3, 1e4, 3e4, 86400.0])
"""s; loaded in the first eight."""


def relaxing_stress(times: np.ndarray, strain: float) -> np.ndarray:
    """MPa, by the closed form s^(1 - n) = s0^(1 - n) + (n - 1) E A t of a hold behind an elastic ramp."""
    held = np.maximum(times - 8.0, 0.0)
    relaxed = ((E * strain) ** (1 - N) + (N - 1) * E * A * held) ** (1 / (1 - N))
    return np.where(times <= 8.0, E * strain * times / 8.0, relaxed)


def read_bar(path: Path, text: str, name: str = "x.csv") -> History:
    (path / name).write_text(text, encoding="utf-8")
    (test,) = ck.read_histories(path / name)
    return test


def relaxation(names: str, units: tuple[float, float], head: str, decimal: str = ".", seed: int = 1) -> str:
    """A record of load and extension in some units, with the noise of a machine."""
    rng, strain = np.random.default_rng(seed), 1.5e-3
    stress = relaxing_stress(BAR_TIMES, strain) + rng.normal(0.0, 0.1, BAR_TIMES.size)
    held = np.minimum(BAR_TIMES / 8.0, 1.0) * strain + rng.normal(0.0, 2e-6, BAR_TIMES.size)
    rows = zip(BAR_TIMES, units[0] * stress, units[1] * held, strict=True)
    body = "".join(f"{t:.1f};{load:.5f};{extension:.7f}\n" for t, load, extension in rows)
    return f"{head}{names}\n{body.replace('.', decimal)}"


AREA = 0.25 * np.pi * 36.0
RELAXATIONS = {
    "load and extension": (
        relaxation(
            "Time;Load;Extension\ns;N;mm",
            (AREA, 25.0),
            "Machine;Z100\nSpecimen diameter;6.00;mm\nGauge length;25.0;mm\nTest temperature;600;°C\n"
            "Control;strain hold 0.15 %\n\n",
        )
    ),
    "German": relaxation(
        "Zeit [s];Prüfkraft [kN];Verlängerung [mm]",
        (1e-3 * AREA, 50.0),
        "Probendurchmesser (mm);6,0\nAnfangsmesslänge (mm);50,0\nPrüftemperatur (°C);600\n",
        ",",
    ),
    "French, rectangle": relaxation(
        "Temps (s);Force (N);Allongement (mm)",
        (20.0, 30.0),
        "Largeur (mm);10\nÉpaisseur (mm);2\nLongueur de base (mm);30\nTempérature (°C);600\n",
    ),
    "US": relaxation(
        "Time (s);Load (lbf);Strain (µε)",
        (0.19 * 645.16 / 4.4482216152605, 1e6),
        "Area (in2);0.19\nTemperature (F);1112\n",
    ),
    "stress and strain": relaxation("time_s;stress_MPa;strain_mm/m", (1.0, 1e3), "# temperature_C: 600\n"),
    "symbols in a title": relaxation("t (s);σ (MPa);ΔL (mm)", (1.0, 40.0), "T = 600 °C; L0 = 40 mm\n"),
}


@pytest.mark.parametrize("kind", RELAXATIONS)
def test_relaxation_with_its_ramp(tmp_path: Path, kind: str) -> None:
    """The strain is imposed as a ramp and a hold; the modulus is that of the ramp, within 1 %."""
    test = read_bar(tmp_path, RELAXATIONS[kind].replace("\n\n", "\n"))
    assert (test.specimen, test.loading.quantity) == ("relaxation", "strain")
    assert test.temperature == pytest.approx(873.15, abs=0.01)
    program = test.loading.program()
    np.testing.assert_allclose(program.at(np.array([4.0, 8.0, 9e3])), [7.5e-4, 1.5e-3, 1.5e-3], rtol=4e-3)
    assert test.elastic is not None
    assert float(test.elastic.E) == pytest.approx(E, rel=0.01)
    assert "GPa of 8 frames of the loading ramp (95 %: " in test.labels["assumed"]
    np.testing.assert_allclose(test.outputs["stress"], relaxing_stress(BAR_TIMES, 1.5e-3), atol=0.5)


def test_a_ramp_that_is_read_after_its_start_begins_unloaded(tmp_path: Path) -> None:
    times = [20.0, 40, 60, 80, 100, 120, *np.geomspace(180, 36000, 20)]
    rows = [(t, min(t / 120, 1.0) * 1.5e-3, min(t / 120, 1.0) * 240 * (max(t, 120) / 120) ** -0.05) for t in times]
    test = read_bar(tmp_path, creep("time_s,strain_1,stress_MPa", rows, "# modulus_GPa: 160\n"))
    program = test.loading.program().at(np.array([0.0, 10, 60, 3e4]))
    np.testing.assert_allclose(program, [0, 1.25e-4, 7.5e-4, 1.5e-3], atol=1e-15)


def test_a_tension_test_that_bends_shows_its_modulus_at_its_beginning(tmp_path: Path) -> None:
    """100 GPa where it begins; pulled on at 1e-5 1/s to 40 times the strain at which it has bent away."""
    rows = [(e / 1e-5, e, 120.0 * np.tanh(1e5 * e / 120.0)) for e in np.geomspace(1e-5, 0.05, 80)]
    test = read_bar(tmp_path, creep("time_s,strain_1,stress_MPa", rows))
    assert float(test.elastic.E) == pytest.approx(1e5, rel=0.06)
    assert kind_of_test(test) == "tension at a constant strain rate"


def creep(names: str, rows: list[tuple[float, ...]], head: str = "") -> str:
    body = "".join(",".join(f"{value:.8g}" for value in row) + "\n" for row in rows)
    return f"# temperature_C: 600\n{head}{names}\n{body}"


HOURS = np.linspace(0.0, 100.0, 21)
BARS = {
    "extension": ("Time (h),Elongation (mm)", (30.0,), "# stress_MPa: 160\n# gauge_length_mm: 30\n"),
    "extension, load as a number": (
        "Time (h),Extension (mm)",
        (30.0,),
        f"# load_kN: {0.16 * AREA}\n# gauge_length_mm: 30\n# diameter_mm: 6\n",
    ),
    "load in a column": ("Time (h),Strain (%),Load (N)", (100.0, 160.0 * 50), "# area_mm2: 50\n"),
    "elongation in per cent": ("Time (h),Elongation (%)", (100.0,), "# stress_MPa: 160\n"),
    "extension in micrometres": ("t (h),ΔL (µm)", (1e3 * 25.4,), "# stress_MPa: 160\n# gauge_length_in: 1\n"),
    "thousands of hours": ("Time (10^3 h),Strain (1e-6)", (1e6,), "# stress_kg/mm2: 16.3154594\n"),
    "a load beside the stress": ("Time (h),Strain (%),Load (N)", (100.0, 4524.0), "# stress_MPa: 160\n"),
}


@pytest.mark.parametrize("kind", BARS)
def test_creep_of_a_plain_bar(tmp_path: Path, kind: str) -> None:
    names, factors, head = BARS[kind]
    strain = 1e-4 * HOURS
    hours = HOURS * (1e-3 if "10^3" in names else 1.0)
    rows = [(t, factors[0] * e, *factors[1:]) for t, e in zip(hours, strain, strict=True)]
    test = read_bar(tmp_path, creep(names, rows, head))
    assert (test.specimen, test.loading.quantity) == ("uniaxial", "stress")
    assert test.loading.program().at(np.array([10.0]))[0] == pytest.approx(160.0, rel=1e-6)
    np.testing.assert_allclose(test.outputs["strain"], strain, rtol=1e-6, atol=1e-12)
    if "mm" in names or "Load" in names:
        assert test.labels["assumed"].startswith("a plain bar: ")


def test_lengths_that_nobody_stated_are_asked_for(tmp_path: Path) -> None:
    rows = [(t, 1e-3 * t, 4500.0) for t in HOURS]
    for head, asked in (("", "gauge_length_mm"), ("# gauge_length_mm: 30\n", "diameter_mm, or width_mm and thickness")):
        with pytest.raises(HistoryError, match=asked) as caught:
            read_bar(tmp_path, creep("Time (h),Extension (mm),Load (N)", rows, head))
        assert "ignore" not in str(caught.value)


def test_a_notched_bar_is_one_where_its_notch_is_stated(tmp_path: Path) -> None:
    head = (
        "# specimen: notched-bar\n# force_N: 9000\n# diameter_mm: 10\n# notch_diameter_mm: 7\n# gauge_length_mm: 30\n"
    )
    test = read_bar(tmp_path, creep("Time (h),Elongation (mm)", [(t, 1e-3 * t) for t in HOURS], head))
    assert (test.specimen, test.loading.quantity) == ("notched-bar", "force")


def test_what_was_imposed(tmp_path: Path) -> None:
    """Held stress behind a ramp, a constant rate of strain, and what cannot be told."""
    times = np.array([0.0, 30, 60, 600, *np.linspace(3600, 360000, 20)])
    ramped, strain = np.minimum(times / 60, 1.0) * 120.0, 1e-9 * times
    names, head = "time_s,strain_1,stress_MPa", "# modulus_GPa: 160\n"
    test = read_bar(tmp_path, creep(names, list(zip(times, strain, ramped, strict=True)), head))
    assert "stress imposed (its column is held)" in test.labels["assumed"]
    rate = 1e-7 * times
    stress = 200.0 * (1.0 - np.exp(-rate / 2e-3))
    test = read_bar(tmp_path, creep(names, list(zip(times, rate, stress, strict=True)), head))
    assert (test.specimen, "strain imposed (its rate is constant)" in test.labels["assumed"]) == ("relaxation", True)
    for first in (14.0, 18.0, 25.0):  # MPa of the first of 80 frames behind the elastic part, of a tensile test
        rate = np.linspace(5e-4, 4e-2, 80)
        stress = first + (34.0 - first) * (1.0 - np.exp(-(rate - 5e-4) / 6e-3)) + 0.25 * np.sin(np.arange(80))
        test = read_bar(tmp_path, creep(names, list(zip(rate / 1e-4, rate, stress, strict=True)), head))
        assert (test.specimen, "strain imposed (its" in test.labels["assumed"]) == ("relaxation", True), first
        np.testing.assert_allclose(test.loading.program().at(np.array([0.0, 2.0, 200.0])), [0, 2e-4, 2e-2], atol=1e-9)
    swinging = 100.0 * (1.05 + np.sin(np.arange(times.size)))
    with pytest.raises(HistoryError, match="stress and strain both change.*specimen: uniaxial.*specimen: relaxation"):
        read_bar(tmp_path, creep(names, list(zip(times, 1e-3 * times**0.3, swinging, strict=True)), head))


def test_readings_within_the_noise_of_zero_may_be_negative(tmp_path: Path) -> None:
    rows = [(0.0, 0.0, -0.4), (1.0, 1e-3, 100.0), (2.0, 2e-3, 100.0), (3.0, 3e-3, 100.1)]
    test = read_bar(tmp_path, creep("time_h,strain_1,stress_MPa", rows))
    assert test.loading.program().at(np.array([0.0]))[0] == 0.0
    pressed = read_bar(tmp_path, creep("time_h,strain_1,stress_MPa", [(0.0, 0.0, -5.0), *rows[1:]]))
    assert pressed.loading.program().at(np.array([0.0]))[0] == -5.0, "which is more than noise"


def test_a_file_of_a_testing_machine_with_an_interruption(tmp_path: Path) -> None:
    """Force and extension with a loading ramp, a pause without load and a remark: as the machine wrote it.

    Planted: Norton's rate of strain, 150 GPa, a furnace that failed between 40 and 80 h, rupture at 140 h.
    """
    area, length, stress, modulus, rng = 0.25 * np.pi * 8.0**2, 40.0, 160.0, 150e3, np.random.default_rng(5)
    clock = np.r_[
        np.linspace(0.0, 0.01, 7), np.geomspace(0.02, 39.9, 40), np.linspace(40.1, 79, 8), np.linspace(80, 140, 40)
    ]
    loaded = np.where(clock < 40.0, clock, np.maximum(clock - 40.0, 40.0))
    load = np.where((clock > 40.0) & (clock < 79.5), 25.0 / area, stress * np.minimum(clock / 0.01, 1.0))
    strain = 1e-4 * loaded + load / modulus + 1e-6 * rng.standard_normal(clock.size)
    force = area * load + 4.0 * rng.standard_normal(clock.size)
    head = "Prüfmaschine;Zwick\nProbe;P2\nProbendurchmesser d0;8,00;mm\nMesslänge L0;40,00;mm\nPrüftemperatur;600;°C\n"
    head += "Bemerkung;Bruch in Messlänge\n\nZeit;Kraft;Verlängerung;Temperatur\nh;N;mm;°C\n"
    rows = [
        f"{t:.4f};{f:.1f};{length * e:.5f};600.{k % 3}"
        for k, (t, f, e) in enumerate(zip(clock, force, strain, strict=True))
    ]
    (tmp_path / "P2.csv").write_text(head + "\n".join(rows).replace(".", ",") + "\n", "cp1252")
    (test,) = ck.read_histories(tmp_path / "P2.csv")
    assert (test.specimen, test.loading.quantity, test.includes_elastic) == ("uniaxial", "stress", True)
    assert test.elastic is not None
    assert test.elastic.at(873.15).E == pytest.approx(modulus, rel=0.05)
    assert (test.rupture_time, test.labels["Bemerkung"]) == (pytest.approx(3600.0 * 140.0), "Bruch in Messlänge")
    np.testing.assert_allclose(
        test.loading.program().at(3600.0 * np.array([20.0, 60.0, 100.0])), [160, 0.5, 160], atol=0.1
    )
    assert test.used.tolist() == (clock > 0.009).tolist()
    fit = ck.identify(ck.law("norton").fix(n=1.0), [test], nuisances=())
    assert float(fit.rate(160.0, 873.15)[0]) == pytest.approx(1e-4 / 3600.0, rel=0.02)


def test_a_day_beside_a_time_of_day_is_one_time_and_an_answer_may_name_the_unit_of_another_row(tmp_path: Path) -> None:
    """Read once a day at about nine: without its day a test of three days lasts minutes."""
    rows = [f"0{day}.03.2023;09:{7 * day:02d}:00;{0.01 * day:.3f};600;0.1" for day in (1, 2, 3, 4)]
    (tmp_path / "a.csv").write_text("Datum;Uhrzeit;Dehnung;Temperatur;Weg 2\n;;%;°C;mm\n" + "\n".join(rows) + "\n")
    answers = '["a.csv"]\nstress_MPa = 120\ncolumns = {"Weg 2 (mm)" = "unused"}\n'
    (tmp_path / "tests.toml").write_text(answers)
    (test,) = ck.read_histories(tmp_path)
    np.testing.assert_allclose(test.times / 3600.0, [0.0, 24 + 7 / 60, 48 + 14 / 60, 72 + 21 / 60])
