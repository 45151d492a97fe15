"""Extraction from frames of a virtual camera that watched a simulated dimple, whose outputs are known."""

from dataclasses import replace

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import HistoryError
from creepkit.fem.surface_interpolation import surface_interpolation
from creepkit.records import CameraFrame, Frames
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
    fields = ("points", "displacements", "valid", "confidence", "time", "source")
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
    assert (extraction.motion.standard_errors[:3] < 5e-4).all()


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


def test_points_in_another_order_are_the_same_points(extraction, frames):
    def shuffled(frame):
        order = np.random.default_rng(3).permutation(np.flatnonzero(frame.valid))
        parts = (frame.points, frame.displacements, frame.valid, frame.confidence)
        return CameraFrame(*(part[order] for part in parts), frame.time, frame.source)

    (found,) = ck.extract(changed(frames, dict.fromkeys(range(1, len(frames)), shuffled)), subset=CAMERA.subset)
    np.testing.assert_allclose(found.outputs["amplitude"], extraction.outputs["amplitude"], atol=1e-7)


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
