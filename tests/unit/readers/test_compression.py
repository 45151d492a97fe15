"""Compression tests, whose area grows: told by a word or by signs, and read with their true stress."""

import numpy as np
import pytest

import creepkit as ck

LOAD, RATE, N = 80.0, 2e-8, 4.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("title", ["# label test: Compression creep, Gleeble", "# label Versuch: Druckkriechversuch"])
def test_a_compressed_piece_has_logarithmic_strains_and_its_true_stress(tmp_path, title, sign):
    """A power law in closed form: d(strain)/dt = r exp(-n strain) under a load, so strain = ln(1 + n r t) / n."""
    times = np.linspace(0.0, 2000.0, 41)[1:]
    strain = np.log1p(N * RATE * 3600.0 * times) / N
    rows = "\n".join(f"{t:.1f},{sign * 100.0 * -np.expm1(-e):.6f}" for t, e in zip(times, strain, strict=True))
    text = f"{title}\n# stress_MPa: {LOAD}\n# temperature_C: 950\ntime_h,strain_%\n{rows}\n"
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    (one,) = ck.read_histories(tmp_path / "a.csv")
    np.testing.assert_allclose(one.outputs["strain"], strain, atol=2e-8)
    assert one.strain_measure == "logarithmic"
    np.testing.assert_allclose(one.loading.program().at(one.times), LOAD * np.exp(-strain), rtol=1e-6)
    assert one.labels["assumed"].startswith("compression")


@pytest.mark.parametrize("height", ["Specimen height;12;mm", "Probenhöhe (mm);12", "Hauteur initiale;12;mm"])
def test_the_height_of_a_compressed_piece_is_its_gauge_length(tmp_path, height):
    head = f"Compression creep;P1\n{height}\nDiameter;8;mm\nTemperature;950;°C\nTime (h);Load (N);"
    (tmp_path / "a.csv").write_text(head + "Height change (µm)\n0;4000;0\n10;4000;-60\n20;4000;-120\n", "utf-8")
    (one,) = ck.read_histories(tmp_path / "a.csv")
    np.testing.assert_allclose(one.outputs["strain"], -np.log1p([0.0, -0.005, -0.01]), atol=1e-12)
    assert one.geometry == {"gauge_length": 12.0, "diameter": 8.0}


@pytest.mark.parametrize("label", ["part: compressor disc", "rig: tension-compression", "Maschine: Zug-Druck"])
def test_a_bar_of_a_compressor_or_of_a_rig_for_both_is_in_tension(tmp_path, label):
    (tmp_path / "a.csv").write_text(
        f"# label {label}\n# stress_MPa: 80\n# temperature_C: 950\ntime_h,strain_%\n1,1\n2,2\n"
    )
    (one,) = ck.read_histories(tmp_path / "a.csv")
    assert one.strain_measure == "engineering"
    np.testing.assert_allclose(one.loading.program().at(one.times), 80.0)
