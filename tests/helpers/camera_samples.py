"""Small frames as camera systems export them: one dome, written in the words of each system by code of its own."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

LOST = (3, 17)
"""Points that the correlation lost."""


@dataclass(frozen=True)
class Dome:
    """A flat grid that bulges: points (n, 3) mm, displacements (n, 3) mm, sigma (n,) pixels; z to the cameras."""

    points: np.ndarray
    displacements: np.ndarray
    sigma: np.ndarray


def dome(amplitude: float = 0.4, count: int = 7) -> Dome:
    axis = np.linspace(-6.0, 6.0, count)
    x, y = (grid.ravel() for grid in np.meshgrid(axis, axis))
    u_z = amplitude * np.exp(-(((x**2 + y**2) / 9.0) ** 1.2))
    points = np.stack([x, y, 0.01 * x - 0.02 * y], axis=1)
    moved = np.stack([0.02 + 0.001 * y, -0.01 + 0.002 * x, u_z], axis=1)
    return Dome(points, moved, 0.012 + 1e-4 * np.arange(x.size))


def _table(delimiter: str, heads: list[str], columns: list[np.ndarray], form: str = "%.9g") -> str:
    rows = [delimiter.join(form % value for value in row) for row in zip(*columns, strict=True)]
    return "\n".join([delimiter.join(heads), *rows]) + "\n"


def _sigma(frame: Dome) -> np.ndarray:
    sigma = frame.sigma.copy()
    sigma[list(LOST)] = -1.0
    return sigma


def vic_3d(frame: Dome | None = None) -> bytes:
    """A title line, heads in quotes with units."""
    frame = frame or dome()
    names = ["X [mm]", "Y [mm]", "Z [mm]", "U [mm]", "V [mm]", "W [mm]", "sigma [pixel]", "exx [1] - Lagrange"]
    columns = [*frame.points.T, *frame.displacements.T, _sigma(frame), 1e-3 * frame.sigma]
    return ("plate-0012_0\n" + _table(",", [f'"{name}"' for name in names], columns)).encode()


def vic_3d_decimal_commas(frame: Dome | None = None) -> bytes:
    """Semicolons and decimal commas, in the order of another export, in Latin-1."""
    frame = frame or dome()
    names = ["sigma [pixel]", "W [mm]", "U [mm]", "V [mm]", "Z [mm]", "X [mm]", "Y [mm]"]
    x, y, z, u, v, w = (*frame.points.T, *frame.displacements.T)
    text = _table(";", [f'"{name}"' for name in names], [_sigma(frame), w, u, v, z, x, y]).replace(".", ",")
    return ("Prüfung 3\n" + text).replace("\n", "\r\n").encode("cp1252")


def vic_3d_images(amplitudes: tuple[float, ...] = (0.0, 0.2, 0.4)) -> bytes:
    """Several images in one file, each with its title line and head."""
    return b"".join(vic_3d(dome(amplitude)) for amplitude in amplitudes)


def vic_3d_mat(frame: Dome | None = None) -> bytes:
    """Grids of a MATLAB file, written by SciPy."""
    from scipy.io import savemat

    frame = frame or dome()
    side = round(len(frame.points) ** 0.5)
    arrays = dict(zip("XYZUVW", (*frame.points.T, *frame.displacements.T), strict=True), sigma=_sigma(frame))
    file = io.BytesIO()
    grids = {name: values.reshape(side, side) for name, values in arrays.items()}
    savemat(file, {"note": "plate", **grids}, do_compression=True)
    return file.getvalue()


def dice(frame: Dome | None = None) -> bytes:
    """The head of *** lines, commas; a lost subset has sigma, gamma and beta of -1."""
    frame = frame or dome()
    head = ["***", "*** Digital Image Correlation Engine (DICe)", "*** Reference image: plate_0000.tif", "***"]
    return ("\n".join(head) + "\n" + _dice_table(frame, ",")).encode()


def dice_blanks(frame: Dome | None = None) -> bytes:
    """Without a head, with blanks between cells."""
    return _dice_table(frame or dome(), " ").encode()


def _dice_table(frame: Dome, delimiter: str) -> str:
    names = ["SUBSET_ID", "COORDINATE_X", "COORDINATE_Y", "DISPLACEMENT_X", "DISPLACEMENT_Y", "SIGMA", "GAMMA", "BETA"]
    names += [f"MODEL_{kind}_{axis}" for kind in ("DISPLACEMENT", "COORDINATES") for axis in "ZYX"]
    sigma = _sigma(frame)
    other = np.where(sigma < 0, -1.0, 1e-6)
    pixels = 500.0 + 40.0 * frame.points
    columns = [np.arange(len(sigma)), pixels[:, 0], pixels[:, 1], 40 * frame.displacements[:, 0]]
    columns += [40 * frame.displacements[:, 1], sigma, other, other]
    columns += [*frame.displacements.T[::-1], *frame.points.T[::-1]]
    return _table(delimiter, names, columns, "%.10E")


def _y_down(frame: Dome) -> list[np.ndarray]:
    down = np.array([1.0, -1.0, 1.0])
    points, moved = frame.points * down, frame.displacements * down
    moved[list(LOST)] = np.nan
    return [*points.T, *moved.T]


def matchid_2024(frame: Dome | None = None) -> bytes:
    """Names of release 2024.1; y points down; lost points are NaN."""
    frame = frame or dome()
    names = ["Coordinates.Image X [Pixel]", "coor.X [mm]", "coor.Y [mm]", "coor.Z [mm]"]
    names += ["disp.Horizontal Displacement U [mm]", "disp.Vertical Displacement V [mm]", "disp.Out-Of-Plane: W [mm]"]
    return _table(",", names, [np.arange(len(frame.sigma)), *_y_down(frame)]).replace("nan", "NaN").encode()


def matchid_2023(frame: Dome | None = None) -> bytes:
    """Names of release 2023, without units."""
    frame = frame or dome()
    pixels = np.arange(len(frame.sigma))
    return _table(",", ["x_pic", "y_pic", *"xyzuvw"], [pixels, pixels, *_y_down(frame)]).encode()


def zeiss(frame: Dome | None = None) -> bytes:
    """nodemap.txt: a head of # lines of which the last names the columns, semicolons, padded cells, strain in %."""
    frame = frame or dome()
    moved = frame.displacements.copy()
    moved[list(LOST)] = np.nan
    names = ["ID", "x_undef [mm]", "y_undef [mm]", "z_undef [mm]", "u [mm]", "v [mm]", "w [mm]", "epsx [%]"]
    columns = [np.arange(len(frame.sigma)), *frame.points.T, *moved.T, frame.sigma]
    lines = ["# Process data:", "# specimen : plate 3, left", "#" * 60, "# force : value_element : 14985.6", "#" * 60]
    return ("\n".join(lines) + "\n#" + _table("; ", [f"{n:>20}" for n in names], columns, "%20.12f")).encode()


_PYVALE_NAMES = """subset_x subset_y disp_u disp_v disp_mag converged cost_zncc ftol xtol num_iter stereo_disp_u_px
stereo_disp_v_px stereo_disp_mag_px stereo_disp_u_mm stereo_disp_v_mm stereo_disp_w_mm stereo_x_mm stereo_y_mm
stereo_z_mm stereo_converged stereo_cost_zncc stereo_ftol stereo_xtol stereo_num_iter epi_dist_px"""


PYVALE_COLUMNS = tuple(_PYVALE_NAMES.split())


INTEGERS = {"subset_x": "<i4", "subset_y": "<i4", "num_iter": "<i4", "stereo_num_iter": "<i4"} | {
    "converged": "u1",
    "stereo_converged": "u1",
}


def _pyvale_rows(frame: Dome) -> np.ndarray:
    """Where points are now, in axes of camera 0, which stands 300 mm off: y down, z away from it."""
    rows = np.zeros(len(frame.sigma), dtype=[(name, INTEGERS.get(name, "<f8")) for name in PYVALE_COLUMNS])
    points = frame.points * [1, -1, -1] + [0, 0, 300.0]
    moved = frame.displacements * [1, -1, -1]
    for k, axis in enumerate("xyz"):
        rows[f"stereo_{axis}_mm"] = points[:, k] + moved[:, k]
        rows[f"stereo_disp_{'uvw'[k]}_mm"] = moved[:, k]
    rows["converged"] = rows["stereo_converged"] = 1
    rows["stereo_cost_zncc"] = 0.998
    rows["stereo_converged"][LOST[0]] = 0
    rows["stereo_disp_w_mm"][LOST[1]] = np.nan
    return rows


def pyvale(frame: Dome | None = None) -> bytes:
    """CSV; of a lost point the C library of Windows writes -nan(ind)."""
    rows = _pyvale_rows(frame or dome())
    columns = [rows[name] for name in PYVALE_COLUMNS]
    return _table(",", [f'"{name}"' for name in PYVALE_COLUMNS], columns).replace("nan", "-nan(ind)").encode()


SAMPLES: dict[str, tuple[Callable[[], bytes], str, str]] = {
    "vic_3d": (vic_3d, "plate-0012_0.csv", "vic-3d"),
    "vic_3d_decimal_commas": (vic_3d_decimal_commas, "plate-0012_0.csv", "vic-3d"),
    "vic_3d_mat": (vic_3d_mat, "plate-0012_0.mat", "vic-3d-mat"),
    "dice": (dice, "DICe_solution_012.txt", "dice"),
    "dice_blanks": (dice_blanks, "DICe_solution_012.txt", "dice"),
    "matchid_2024": (matchid_2024, "plate_0012.csv", "matchid"),
    "matchid_2023": (matchid_2023, "plate_0012.csv", "matchid"),
    "zeiss": (zeiss, "plate_12_nodemap.txt", "zeiss"),
    "pyvale": (pyvale, "dic_results_0012.csv", "pyvale"),
}
"""{sample: (content, name of a file, name of the format)}, each one frame of the same dome."""
