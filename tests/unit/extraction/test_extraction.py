"""Extraction from frames of a virtual camera that watched a simulated dimple, whose outputs are known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation

import creepkit as ck
from creepkit.errors import HistoryError
from creepkit.extraction.frame_checks import frames_at_rest
from creepkit.extraction.noise import autocorrelation, patch_covariance, patch_numbers, rigid_gains, time_correlation
from creepkit.extraction.plate import rigid_motions
from creepkit.extraction.temperature_fields import InfraredCamera, image_of_numbers, temperature_between
from creepkit.fem.surface_interpolation import surface_interpolation
from creepkit.records import CameraFrame, Channel, Frames, InstrumentRecord
from helpers.virtual_camera import Dimple, VirtualCamera, simulated_dimple

REST = 14
CAMERA = VirtualCamera(seed=4, points=1700)


@pytest.fixture(scope="module")
def dimple():
    return simulated_dimple(frames=REST + 34, rest=REST, A=3e-17, n=5.0)


@pytest.fixture(scope="module")
def frames(dimple):
    return held(CAMERA.frames(dimple))


@pytest.fixture(scope="module")
def extraction(frames):
    (found,) = ck.extract(frames, subset=CAMERA.subset, loading=8.0, temperature=1050.0)
    return found


def held(frames):
    """The same frames, made once."""
    kept = [frames[k] for k in range(len(frames))]
    return Frames(frames.name, frames.times, kept.__getitem__)


def changed(frames, changes):
    """The same frames but for those that functions make anew."""
    return replace(frames, read_frame=lambda k: changes.get(k, lambda frame: frame)(frames.read_frame(k)))


def rebuilt(frame, **changes):
    fields = ("points", "displacements", "valid", "time", "source")
    return CameraFrame(**{name: changes.get(name, getattr(frame, name)) for name in fields})


def test_the_outputs_are_those_of_the_simulated_surface(dimple, extraction):
    truth = dimple.truth()
    assert extraction.used.all()
    assert extraction.flags == ()
    assert set(extraction.rest) <= set(range(1, REST))  # the reference image shows no noise of its own
    errors = {name: (extraction.outputs[name] - truth[:, k])[REST:] for k, name in enumerate(extraction.outputs)}
    assert abs(errors["amplitude"].mean()) < 1.4e-3  # zero level and 34 frames know it to 0.45 um
    for name, error in errors.items():
        scores = error / extraction.standard_deviation[name][REST:]
        assert 0.6 < np.sqrt((scores**2).mean()) < 1.8  # the error of the zero level is common to all of them
    np.testing.assert_allclose(extraction.center, [12.4, -7.7], atol=0.02)
    assert (extraction.center_sd < 0.01).all()


def test_the_rigid_motion_is_that_of_the_plate(extraction):
    turn = np.degrees(np.linalg.norm(extraction.motion.rotations[-1]))
    assert turn == pytest.approx(CAMERA.turn, rel=0.06)  # the walk ends within 3 % of it, with some jitter
    assert extraction.motion.points >= 400


def test_means_on_rings(dimple, frames):
    (found,) = ck.extract(frames, operator="rings 0, 2, 4 mm", subset=CAMERA.subset)
    truth = dimple.rise @ surface_interpolation(dimple.radii, [0.0, 2.0, 4.0]).T
    assert found.operator == "rings 0, 2, 4 mm"
    for k, name in enumerate(("displacement_1", "displacement_2", "displacement_3")):
        error = (found.outputs[name] - truth[:, k])[REST:]
        assert abs(error.mean()) < 1.2e-3
        assert 0.5 < np.sqrt(((error / found.standard_deviation[name][REST:]) ** 2).mean()) < 1.8


def test_the_history_says_what_is_known(extraction, tmp_path):
    history = extraction.history
    assert history.operator == "field 0-7.5 mm"
    assert history.times[0] == 150.0  # the load began within the interval before the first frame that shows it
    assert set(history.noise_correlation) == {("amplitude", "width"), ("amplitude", "shape"), ("width", "shape")}
    assert history.labels["frames_before_time_zero"] == str(REST - 1)
    (again,) = ck.read_histories(ck.write_history(history, tmp_path / "D1.csv"))
    np.testing.assert_allclose(again.outputs["shape"], history.outputs["shape"])
    np.testing.assert_allclose(again.standard_deviation["width"], history.standard_deviation["width"])
    with pytest.raises(HistoryError, match="no frame after time zero, 100000 s after the first, has outputs"):
        extraction.history_under(8.0, 1050.0, time_zero=1e5)


def test_bad_frames_are_flagged_and_change_no_other(extraction, frames):
    random = np.random.default_rng(0)

    def unreadable(frame):
        raise HistoryError("frame_20.csv: line 3: 'abc' is no number")

    def noisy(frame):
        return rebuilt(frame, displacements=frame.displacements + 0.01 * random.normal(size=frame.displacements.shape))

    def thin(frame):
        return rebuilt(frame, valid=frame.valid & (random.random(frame.valid.size) < 0.2))

    def bumped(frame):
        return rebuilt(frame, displacements=frame.displacements + np.array([0.0, 0.2, 0.0]))

    bad = changed(frames, {20: unreadable, 25: noisy, 30: thin, 35: bumped})
    (found,) = ck.extract(bad, subset=CAMERA.subset)
    assert {f.frames[0]: f.kind for f in found.flags} == {
        20: "unreadable",
        25: "residual",
        30: "few points",
        35: "motion",
    }
    assert "frame_20.csv: line 3" in found.flags[0].reason
    assert np.flatnonzero(~found.used).tolist() == [20, 25, 30, 35]
    good = found.used & extraction.used
    np.testing.assert_allclose(found.outputs["amplitude"][good], extraction.outputs["amplitude"][good], atol=5e-4)
    assert np.isfinite(found.outputs["amplitude"][35])  # a bump is taken off: the frame is there for who wants it


@pytest.mark.parametrize("given", [False, True])
def test_axes_that_point_away_from_the_cameras_are_turned(extraction, frames, given, tmp_path):
    """As DICe exports them: x to the right, y down, z away; a dome then falls."""
    half = np.array([1.0, -1.0, -1.0])

    def away(frame):
        return rebuilt(frame, points=frame.points * half, displacements=frame.displacements * half)

    centers = {"D1": tuple(extraction.center * half[:2])} if given else None
    turned = changed(frames, dict.fromkeys(range(len(frames)), away))
    (found,) = ck.extract(turned, subset=CAMERA.subset, centers=centers, loading=8.0, temperature=1050.0)
    assert found.turned
    assert not extraction.turned
    for name, values in extraction.outputs.items():
        np.testing.assert_allclose(found.outputs[name][REST + 5 :], values[REST + 5 :], rtol=1e-3, atol=1e-4)
    np.testing.assert_allclose(found.center, extraction.center * half[:2], atol=1e-4)
    assert "  assumed: z of the frames points away from the cameras" in str(found)
    (again,) = ck.read_histories(ck.write_history(found.history, tmp_path / "D1.csv"))
    assert again.labels["assumed"].startswith("z of the frames points away from the cameras")


def test_a_dimple_of_15_mm_loses_no_height_to_the_plate():
    """Beside a rigid motion and a tilt; as one of 7.5 mm it is refused, for the plate about that would be the dome."""
    lengths = dict(cavity_radius=15.0, roof_radial=15.0, roof_axial=3.0, outer_radius=20.0, plate_thickness=8.0)
    wide = ck.specimen("bulge").replace(apex_thickness=1.0, **lengths)
    large = simulated_dimple(frames=26, rest=12, specimen=wide)
    frames = held(VirtualCamera(points=3600, spacing=1.0, seed=3).frames(large))
    (found,) = ck.extract(frames, wide, subset=1.2)
    errors = (found.outputs["amplitude"] - large.truth("field 0-15 mm")[:, 0])[12:]
    assert found.outputs["amplitude"][-1] > 0.5
    assert abs(errors.mean()) < 1e-3
    with pytest.raises(HistoryError, match=r"D1: the plate between 10 and 15 mm .* larger than a radius of 7.5 mm"):
        ck.extract(frames, subset=1.2)


def test_several_dimples_are_named_by_rows(dimple):
    few = [0, 1, 2, 3, 4, 5, 6, 7, *range(REST, REST + 34, 6)]
    short = Dimple(150.0 * np.arange(len(few)), dimple.radii, dimple.rise[few], dimple.widening[few])
    camera = VirtualCamera(seed=2, points=62 * 62, spacing=0.9, centers=((-13.0, 11.0), (12.0, 13.0), (0.0, -12.0)))
    frames = held(camera.frames(short, short, short))
    found = ck.extract(frames, subset=camera.subset)
    assert [one.name for one in found] == ["D1", "D2", "D3"]
    places = np.array([one.center for one in found]) - [12.0, -7.0]
    np.testing.assert_allclose(places, camera.centers, atol=0.05)
    (given,) = ck.extract(frames, subset=camera.subset, centers={"E5": tuple(found[1].center)})
    assert given.name == "E5"
    assert given.center_given
    np.testing.assert_allclose(given.outputs["amplitude"][8:], short.truth()[8:, 0], atol=4e-3)


# ---- plate and noise -------------------------------------------------------------------------------------------------

# Rigid motion and noise against planted ones.


def flat_points(seed=0, count=400):
    xy = np.random.default_rng(seed).uniform(-15, 15, (count, 2))
    return np.c_[xy, np.zeros(count)]


@pytest.mark.parametrize("degrees", [1e-7, 0.2, 25.0])
def test_a_planted_rigid_motion_is_found_beside_wild_points(degrees):
    places = flat_points()
    vector = np.radians(degrees) * np.array([0.6, -0.64, 0.48])
    shift = np.array([0.3, -0.2, 0.1])
    moved = (places @ Rotation.from_rotvec(vector).as_matrix().T + shift - places)[None]
    valid = np.ones(moved.shape[:2], bool)
    moved[0, :80] += np.random.default_rng(1).uniform(-3, 3, (80, 3))  # a fifth of them
    valid[0, 80:90] = False
    moved[0, 80:90] = np.nan
    motion = rigid_motions(places, np.nan_to_num(moved), valid)
    np.testing.assert_allclose(motion.rotation_vectors()[0], vector, rtol=1e-6, atol=1e-13)
    np.testing.assert_allclose(motion.translations()[0], shift, atol=1e-9)
    np.testing.assert_allclose(motion.taken_off(places, np.nan_to_num(moved))[0, 90:], 0.0, atol=1e-9)


def test_patches_give_the_scatter_of_a_fit_to_correlated_errors():
    """The linear fit of a plane and a bell to noise that neighbours share; patches see its residuals alone."""
    random = np.random.default_rng(5)
    side = np.arange(-7.5, 7.51, 0.5)
    places = np.stack([g.ravel() for g in np.meshgrid(side, side)], axis=1)
    white = random.normal(size=(600, side.size, side.size))
    errors = gaussian_filter(white, (0, 1.0, 1.0)).reshape(600, -1)
    columns = np.c_[np.exp(-(places**2).sum(axis=1) / 14.0), np.ones(len(places)), places]
    gains = np.linalg.pinv(columns)
    truth = (errors @ gains.T).std(axis=0)
    residuals = errors - errors @ gains.T @ columns.T
    rho = autocorrelation(residuals, places, 0.5)
    numbers = patch_numbers(places, 3.0)
    stated = np.sqrt(np.diag(patch_covariance(gains[None], residuals, numbers)[0]))
    assert stated[0] < 0.8 * truth[0]  # what the fit took
    np.testing.assert_allclose(
        stated / np.sqrt(rho.kept_by_residuals(gains, places, numbers, columns, gains).within), truth, rtol=0.12
    )


def test_gains_of_the_clamped_plate_are_shift_and_small_rotations():
    places = flat_points(3)[:, :2]
    heights = 0.1 + 2e-3 * places[:, 1] - (-3e-3) * places[:, 0]
    np.testing.assert_allclose(rigid_gains(places) @ heights, [0.1, 2e-3, -3e-3], atol=1e-12)


def test_correlation_in_time_of_a_moving_average():
    white = np.random.default_rng(0).normal(size=20_000)
    lag_one, integral = time_correlation(white[1:] + white[:-1])
    assert lag_one == pytest.approx(0.5, abs=0.03)
    assert integral == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize(("loaded_from", "expected"), [(20, range(1, 20)), (1, [0])])
def test_frames_at_rest(loaded_from, expected):
    random = np.random.default_rng(1)
    signal = 1e-3 * random.normal(size=80)
    signal[0] = 0.0
    signal[loaded_from:] += 0.03 + 0.002 * np.arange(80 - loaded_from)
    rest = frames_at_rest(signal, np.ones(80, bool), True, None)
    assert set(rest) <= set(expected)
    assert len(rest) >= 0.8 * len(expected)
    load = np.where(np.arange(80) < loaded_from, 0.0, 8.0)
    assert frames_at_rest(signal, np.ones(80, bool), True, load).tolist() == list(expected)


# ---- temperature fields ----------------------------------------------------------------------------------------------

# Temperatures between thermocouples against fields with closed forms, and of infrared images against Planck's law.


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
