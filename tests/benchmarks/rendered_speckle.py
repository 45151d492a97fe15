"""Amplitudes of a dome from rendered pairs of speckle images, correlated by pyvale.

    python tests/benchmarks/rendered_speckle.py [--python PYTHON_WITH_PYVALE] [--points-step 10] [--write]

A plate with a dome of known shape moves as a rigid body (by 0.3 mm in all, and 0.2 degrees); the dome grows after ten
frames at rest. Two pinhole cameras see it at 0.03 mm a pixel, with eight bits and noise of 1 grey value. pyvale
correlates the pairs with subsets of 31 pixels; `ck.read_frames` reads what it writes, and `ck.extract` fits Eq. (7)
within 7.5 mm, and rings. Errors are against `Observation` of the true dome, in frames in which it is 50 um high or
more; "stated" is the standard deviation that the history carries.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from measured import Page, arguments
from scipy.ndimage import gaussian_filter, map_coordinates, spline_filter

import creepkit as ck
from creepkit.records import Frames
from creepkit.specimens.bulge.observation import Observation

PIXELS = 900
DISTANCE = 300.0
"""mm, of both cameras."""

FOCAL = DISTANCE / 0.03
"""Pixels."""

ANGLE = np.deg2rad(20.0)
RADIUS = 6.5
CELL = 0.01
"""mm, of the texture."""

APEXES = (*[0.0] * 10, 0.05, *np.linspace(0.1, 0.8, 15).round(3).tolist())
NOISE = 1.0
"""Grey values."""

CORRELATE = """
import sys
from pathlib import Path
import numpy as np
from pyvale import calib, dic

folder = Path(sys.argv[1])
images = np.load(folder / "images.npy")
settings = calib.loadtxt(folder / "calibration.csv")
mask = np.zeros(images.shape[2:], dtype=bool)
mask[40:-40, 40:-40] = True
dic.calculate_3d(
    reference=[images[0, 0], images[1, 0]], deformed=[images[0, 1:], images[1, 1:]], calibration=settings,
    roi_mask=mask, seed=[images.shape[3] // 2, images.shape[2] // 2], subset_size=31, subset_step=int(sys.argv[2]),
    max_displacement=128, output_basepath=folder / sys.argv[3], print_level=0, shape_function=sys.argv[3],
)
"""


def height(x: np.ndarray, y: np.ndarray, apex: float) -> np.ndarray:
    return apex * np.clip(1.0 - (x**2 + y**2) / RADIUS**2, 0.0, None) ** 3


def rigid_motion(share: float) -> tuple[np.ndarray, np.ndarray]:
    """Rotation (3, 3) about the centre of the plate, and translation (3,) mm."""
    axis, angle = np.array([0.6, 0.64, 0.48]), share * np.deg2rad(0.2)
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    rotation = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return rotation, share * np.array([0.2, -0.1, 0.2])


def texture() -> np.ndarray:
    """Coefficients of a cubic spline through grey values of blots some four pixels wide."""
    size = round(1.35 * PIXELS * 0.03 / CELL)
    noise = gaussian_filter(np.random.default_rng(5).normal(size=(size, size)), 0.05 / CELL)
    return spline_filter(127.0 + 90.0 * np.tanh(1.6 * noise / noise.std()), order=3)


def cameras() -> list[tuple[np.ndarray, np.ndarray]]:
    """Rotation and translation from the axes of camera 0 (x right, y down, z away) to those of each."""
    c, s = np.cos(ANGLE), np.sin(ANGLE)
    turned = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    return [(np.eye(3), np.zeros(3)), (turned, DISTANCE * np.array([-s, 0.0, 1.0 - c]))]


def render(speckle: np.ndarray, camera: int, frame: int) -> np.ndarray:
    """Eight-bit image (PIXELS, PIXELS) of the plate in a frame."""
    turn, shift = cameras()[camera]
    rotation, translation = rigid_motion(frame / (len(APEXES) - 1))
    target = np.array([0.0, 0.0, DISTANCE])
    centre = rotation.T @ (-turn.T @ shift - target - translation)  # of the camera, from the plate's own axes
    total = np.zeros((PIXELS, PIXELS))
    for dx in (-0.25, 0.25):
        for dy in (-0.25, 0.25):
            i, j = np.meshgrid(np.arange(PIXELS) + dx, np.arange(PIXELS) + dy)
            middle = 0.5 * (PIXELS - 1)
            rays = np.stack([(i - middle) / FOCAL, (j - middle) / FOCAL, np.ones_like(i)]).reshape(3, -1)
            rays = rotation.T @ turn.T @ rays
            along = -centre[2] / rays[2]
            for _ in range(12):  # towards the cameras is -z
                rise = height(centre[0] + along * rays[0], centre[1] + along * rays[1], APEXES[frame])
                along = (-rise - centre[2]) / rays[2]
            places = np.stack([centre[1] + along * rays[1], centre[0] + along * rays[0]]) / CELL
            grey = map_coordinates(speckle, places + 0.5 * (len(speckle) - 1), order=3, prefilter=False, mode="nearest")
            total += 0.25 * grey.reshape(total.shape)
    noise = np.random.default_rng([camera, frame]).normal(scale=NOISE, size=total.shape)
    return np.clip(np.rint(total + noise), 0, 255).astype(np.uint8)


def write_calibration(path: Path) -> None:
    _, shift = cameras()[1]
    rows = []
    for name in ("cam0", "cam1"):
        rows += [f"{name}_fx_px,{FOCAL}", f"{name}_fy_px,{FOCAL}", f"{name}_fs_px,0"]
        rows += [f"{name}_cx_px,{0.5 * (PIXELS - 1)}", f"{name}_cy_px,{0.5 * (PIXELS - 1)}"]
        rows += [f"{name}_{term},0" for term in ("k1", "k2", "p1", "p2", "k3")]
    rows += [f"t{axis}_mm,{value!r}" for axis, value in zip("xyz", shift.tolist(), strict=True)]
    rows += ["theta_deg,0", f"phi_deg,{float(np.rad2deg(ANGLE))!r}", "psi_deg,0"]
    path.write_text("\n".join(rows) + "\n")


SUBSET = 31 * 0.03
"""Side of the mean that `ck.extract` takes out, mm."""


def add_rows(page: Page, frames: Frames, subset: float) -> None:
    radii = np.linspace(0.0, 10.0, 801)
    rise = np.array([height(radii, 0.0 * radii, apex) for apex in APEXES])
    shown = np.array(APEXES) >= 0.05
    for operator in ("field 0-7.5 mm", "rings 0, 2, 4 mm"):
        (found,) = ck.extract(frames, operator=operator, subset=subset)
        truth = Observation.from_text(operator).observe(radii, rise[shown])
        for k, (name, values) in enumerate(found.outputs.items()):
            error, sd = values[shown] - truth[:, k], found.standard_deviation[name][shown]
            unit, factor = ("", 1.0) if name == "shape" else (" um", 1e3)
            inside = f"{np.count_nonzero(np.abs(error) < 1.96 * sd)} of {error.size}"
            numbers = (np.mean(error), np.std(error), np.sqrt(np.mean(sd**2)), error[-1])
            page.row(operator, name, *(f"{factor * number:.3g}{unit}" for number in numbers), inside)


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--python", default=sys.executable, help="a Python that has pyvale, by default this one")
    parser.add_argument("--points-step", type=int, default=10, help="pixels from one subset to the next")
    options = parser.parse_args()
    page = Page("rendered_speckle", __doc__)
    speckle = texture()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        images = [[render(speckle, camera, frame) for frame in range(len(APEXES))] for camera in (0, 1)]
        np.save(folder / "images.npy", np.array(images))
        write_calibration(folder / "calibration.csv")
        command = [options.python, "-c", CORRELATE, str(folder), str(options.points_step), "AFFINE"]
        (folder / "AFFINE").mkdir()
        subprocess.run(command, check=True, stdout=sys.stderr, cwd=folder)  # pyvale leaves a log there
        page.table("operator", "output", "mean error", "scatter", "stated sd", "error in the last frame", "within 95 %")
        times = 60.0 * np.arange(len(APEXES))
        add_rows(page, ck.read_frames(folder / "AFFINE", times=times), SUBSET)
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
