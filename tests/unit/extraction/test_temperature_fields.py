"""Temperatures between thermocouples against fields with closed forms, and of infrared images against Planck's law."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from creepkit.errors import HistoryError
from creepkit.extraction.temperature_fields import InfraredCamera, image_of_numbers, temperature_between
from creepkit.records import Channel, InstrumentRecord

PLACES = {"T1": (-50.0, -20.0), "T2": (50.0, -20.0), "T3": (0.0, 40.0), "T4": (0.0, 0.0)}


def recorded(values: dict[str, float]) -> InstrumentRecord:
    """A record of thermocouples that all drift by 1 K."""
    times = np.linspace(0.0, 100.0, 11)
    course = np.linspace(-0.5, 0.5, 11)
    return InstrumentRecord("rig", times, {k: Channel(k, "temperature", v + course) for k, v in values.items()})


def test_at_a_thermocouple_it_is_what_that_says_and_its_course_is_kept() -> None:
    """But for the tolerance of one, which neighbours average."""
    record = recorded({name: 1073.0 + 20.0 * k for k, name in enumerate(PLACES)})
    found = temperature_between(record, list(PLACES), PLACES, PLACES["T3"])
    assert found.values.mean() == pytest.approx(1113.0, abs=3.0)
    assert np.ptp(found.values) == pytest.approx(1.0)
    assert found.sd < 3.5  # the tolerance is 1.9 K at 840 C


def test_between_two_it_is_on_the_straight_line() -> None:
    record = recorded({"T1": 1000.0, "T2": 1100.0})
    found = temperature_between(record, ["T1", "T2"], PLACES, (0.0, -20.0))
    assert found.values.mean() == pytest.approx(1050.0, abs=0.2)
    nearer = temperature_between(record, ["T1", "T2"], PLACES, (25.0, -20.0))
    assert nearer.values.mean() == pytest.approx(1075.0, abs=2.0)


def test_intervals_hold_of_planted_fields() -> None:
    """Gaussian fields with a correlation that falls over 60 mm, and thermocouples off by their tolerance."""
    random, inside, sizes = np.random.default_rng(3), 0, []
    names = [f"T{k}" for k in range(6)]
    for _ in range(200):
        at = random.uniform(-60.0, 60.0, (7, 2))
        apart = np.hypot(*(at[:, None] - at[None]).transpose(2, 0, 1))
        field = 1073.0 + 8.0 * random.multivariate_normal(np.zeros(7), np.exp(-apart / 60.0))
        read = field[:6] + 1.85 * random.standard_normal(6)
        record = recorded(dict(zip(names, read, strict=True)))
        places = {name: (float(x), float(y)) for name, (x, y) in zip(names, at[:6], strict=True)}
        found = temperature_between(record, names, places, (float(at[6, 0]), float(at[6, 1])))
        inside += abs(found.values.mean() - field[6]) < 1.96 * found.sd
        sizes.append(found.sd)
    assert 0.90 <= inside / 200 <= 0.99
    assert np.mean(sizes) < 8.0  # less than the field itself scatters


def test_without_places_it_is_the_mean_with_the_scatter_of_one_more() -> None:
    record = recorded({"T1": 1070.0, "T2": 1074.0, "T3": 1072.0})
    found = temperature_between(record, ["T1", "T2", "T3"], {}, (0.0, 0.0))
    assert found.values.mean() == pytest.approx(1072.0)
    assert found.sd == pytest.approx(2.0 * np.sqrt(4.0 / 3.0))
    with pytest.raises(HistoryError, match="the place of 'T3' is not stated"):
        temperature_between(record, ["T1", "T2", "T3"], {"T1": (0.0, 0.0), "T2": (1.0, 0.0)}, (0.0, 0.0))


def radiance(kelvin: np.ndarray | float, wavelength: float = 1e-5) -> np.ndarray:
    """Planck's law from its constants, SI, but for the factor of the wavelength."""
    h, c, k = 6.62607015e-34, 299792458.0, 1.380649e-23
    return 1.0 / (np.exp(h * c / (wavelength * k * np.asarray(kelvin))) - 1.0)


def seen_by(kelvin: np.ndarray, emissivity: float) -> np.ndarray:
    """C, what a camera that takes the surface for black says, by bisection: it sees reflected radiance too."""
    wanted = emissivity * radiance(kelvin) + (1.0 - emissivity) * radiance(298.15)
    low, high = np.full(kelvin.shape, 200.0), np.full(kelvin.shape, 3000.0)
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = np.where(radiance(middle) < wanted, middle, low), np.where(radiance(middle) < wanted, high, middle)
    return middle - 273.15


@pytest.mark.parametrize("ending", ["csv", "npy", "mat", "txt"])
def test_images_give_the_temperature_under_the_emissivity_that_is_stated(tmp_path: Path, ending: str) -> None:
    rows, columns = np.mgrid[0:40, 0:60]
    true = 1073.15 + 0.2 * (columns - 29.5) - 0.1 * (rows - 19.5)
    image, path = seen_by(true, 0.8), tmp_path / f"ir.{ending}"
    if ending == "npy":
        np.save(path, image)
    elif ending == "mat":
        savemat(path, {"T": image, "note": "plate"}, do_compression=True)
    else:
        text = "\n".join((";" if ending == "csv" else "\t").join(f"{v:.4f}" for v in row) for row in image) + "\n"
        path.write_text(text.replace(".", ",") if ending == "csv" else text)
    np.testing.assert_allclose(image_of_numbers(path), image, atol=1e-3)
    camera = InfraredCamera((10.0, -5.0), 2.0, 0.8, sd=0.01)
    kelvin, sd = camera.read([path]).at((30.0, 5.0), 5.0)  # 10 columns to the right, 5 rows up
    assert kelvin == pytest.approx(1073.15 + 2.0 + 0.5, abs=0.05)
    step = 0.5 * float(seen_by(np.array([1073.15]), 0.81)[0] - seen_by(np.array([1073.15]), 0.79)[0])
    gain = float(seen_by(np.array([1074.15]), 0.8)[0] - seen_by(np.array([1073.15]), 0.8)[0])
    assert sd == pytest.approx(step / gain, rel=0.05)


def test_images_of_the_wrong_place_unit_or_size_are_refused(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.full((4, 5), -400.0))
    np.save(tmp_path / "b.npy", np.full((4, 5), 800.0))
    np.save(tmp_path / "c.npy", np.full((5, 5), 800.0))
    camera = InfraredCamera((0.0, 0.0), 1.0, 0.9)
    with pytest.raises(HistoryError, match="say in which unit they are"):
        camera.read([tmp_path / "a.npy"])
    with pytest.raises(HistoryError, match="4 x 5 and 5 x 5 pixels"):
        camera.read([tmp_path / "b.npy", tmp_path / "c.npy"])
    with pytest.raises(HistoryError, match="a test piece lies at 50, 0 mm"):
        camera.read([tmp_path / "b.npy"]).at((50.0, 0.0), 3.0)
    (tmp_path / "d.csv").write_text("1,2\n3,4,5\n")
    with pytest.raises(HistoryError, match="its rows differ in length"):
        image_of_numbers(tmp_path / "d.csv")
