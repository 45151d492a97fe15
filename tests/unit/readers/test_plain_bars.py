"""Load and extension of bars, relaxation with its loading ramp, and which of stress and strain was imposed."""

from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import HistoryError
from creepkit.records import History

E, N, A = 160e3, 5.0, 2e-18
"""MPa, 1, and 1/s at 1 MPa of the planted Norton law."""


TIMES = np.array([*np.arange(0.0, 8.0, 1.0), 8.0, 10, 14, 20, 40, 100, 300, 1e3, 3e3, 1e4, 3e4, 86400.0])
"""s; loaded in the first eight."""


def relaxing_stress(times: np.ndarray, strain: float) -> np.ndarray:
    """MPa, by the closed form s^(1 - n) = s0^(1 - n) + (n - 1) E A t of a hold behind an elastic ramp."""
    held = np.maximum(times - 8.0, 0.0)
    relaxed = ((E * strain) ** (1 - N) + (N - 1) * E * A * held) ** (1 / (1 - N))
    return np.where(times <= 8.0, E * strain * times / 8.0, relaxed)


def read(path: Path, text: str, name: str = "x.csv") -> History:
    (path / name).write_text(text, encoding="utf-8")
    (test,) = ck.read_histories(path / name)
    return test


def relaxation(names: str, units: tuple[float, float], head: str, decimal: str = ".", seed: int = 1) -> str:
    """A record of load and extension in some units, with the noise of a machine."""
    rng, strain = np.random.default_rng(seed), 1.5e-3
    stress = relaxing_stress(TIMES, strain) + rng.normal(0.0, 0.1, TIMES.size)
    held = np.minimum(TIMES / 8.0, 1.0) * strain + rng.normal(0.0, 2e-6, TIMES.size)
    rows = zip(TIMES, units[0] * stress, units[1] * held, strict=True)
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
    test = read(tmp_path, RELAXATIONS[kind].replace("\n\n", "\n"))
    assert (test.specimen, test.loading.quantity) == ("relaxation", "strain")
    assert test.temperature == pytest.approx(873.15, abs=0.01)
    program = test.loading.program()
    np.testing.assert_allclose(program.at(np.array([4.0, 8.0, 9e3])), [7.5e-4, 1.5e-3, 1.5e-3], rtol=4e-3)
    assert test.elastic is not None
    assert float(test.elastic.E) == pytest.approx(E, rel=0.01)
    assert "GPa of 8 frames of the loading ramp (95 %: " in test.labels["assumed"]
    np.testing.assert_allclose(test.outputs["stress"], relaxing_stress(TIMES, 1.5e-3), atol=0.5)


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
    test = read(tmp_path, creep(names, rows, head))
    assert (test.specimen, test.loading.quantity) == ("uniaxial", "stress")
    assert test.loading.program().at(np.array([10.0]))[0] == pytest.approx(160.0, rel=1e-6)
    np.testing.assert_allclose(test.outputs["strain"], strain, rtol=1e-6, atol=1e-12)
    if "mm" in names or "Load" in names:
        assert test.labels["assumed"].startswith("a plain bar: ")


def test_lengths_that_nobody_stated_are_asked_for(tmp_path: Path) -> None:
    rows = [(t, 1e-3 * t, 4500.0) for t in HOURS]
    for head, asked in (("", "gauge_length_mm"), ("# gauge_length_mm: 30\n", "diameter_mm, or width_mm and thickness")):
        with pytest.raises(HistoryError, match=asked) as caught:
            read(tmp_path, creep("Time (h),Extension (mm),Load (N)", rows, head))
        assert "ignore" not in str(caught.value)


def test_a_notched_bar_is_one_where_its_notch_is_stated(tmp_path: Path) -> None:
    head = (
        "# specimen: notched-bar\n# force_N: 9000\n# diameter_mm: 10\n# notch_diameter_mm: 7\n# gauge_length_mm: 30\n"
    )
    test = read(tmp_path, creep("Time (h),Elongation (mm)", [(t, 1e-3 * t) for t in HOURS], head))
    assert (test.specimen, test.loading.quantity) == ("notched-bar", "force")


def test_what_was_imposed(tmp_path: Path) -> None:
    """Held stress behind a ramp, a constant rate of strain, and what cannot be told."""
    times = np.array([0.0, 30, 60, 600, *np.linspace(3600, 360000, 20)])
    ramped, strain = np.minimum(times / 60, 1.0) * 120.0, 1e-9 * times
    names, head = "time_s,strain_1,stress_MPa", "# modulus_GPa: 160\n"
    test = read(tmp_path, creep(names, list(zip(times, strain, ramped, strict=True)), head))
    assert "stress imposed, for its column is held" in test.labels["assumed"]
    rate = 1e-7 * times
    stress = 200.0 * (1.0 - np.exp(-rate / 2e-3))
    test = read(tmp_path, creep(names, list(zip(times, rate, stress, strict=True)), head))
    assert (test.specimen, "strain imposed, for its rate is constant" in test.labels["assumed"]) == ("relaxation", True)
    swinging = 100.0 * (1.05 + np.sin(np.arange(times.size)))
    with pytest.raises(HistoryError, match="stress and strain both change.*specimen: uniaxial.*specimen: relaxation"):
        read(tmp_path, creep(names, list(zip(times, 1e-3 * times**0.3, swinging, strict=True)), head))


def test_readings_within_the_noise_of_zero_may_be_negative(tmp_path: Path) -> None:
    rows = [(0.0, 0.0, -0.4), (1.0, 1e-3, 100.0), (2.0, 2e-3, 100.0), (3.0, 3e-3, 100.1)]
    test = read(tmp_path, creep("time_h,strain_1,stress_MPa", rows))
    assert test.loading.program().at(np.array([0.0]))[0] == 0.0
    with pytest.raises(HistoryError, match="is -5; a stress must lie"):
        read(tmp_path, creep("time_h,strain_1,stress_MPa", [(0.0, 0.0, -5.0), *rows[1:]]))
