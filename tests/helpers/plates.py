"""Folders as a laboratory with dimples and cameras keeps them: frames of a plate, times beside them, and records.

Dimples are simulated on finer elements than identifications use, watched by a virtual camera and written as DICe and
VIC-3D export them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import creepkit as ck
from creepkit.records import CameraFrame, Frames, Program
from helpers.virtual_camera import Dimple, VirtualCamera

PITCH = 24.0
"""mm between the centres of a plate."""


BAR = 10.0
"""bar/MPa."""


@dataclass(frozen=True)
class PlannedDimple:
    """One dimple: its alloy, its law with values, apex thickness, mm, modulus, MPa, and temperature, K."""

    alloy: str
    law: str
    values: dict[str, float]
    thickness: float = 0.5
    modulus: float = 150e3
    temperature: float = 1073.15


@dataclass(frozen=True)
class Schedule:
    """When frames are taken and what is imposed; s and MPa, on the clock of the camera from its first frame on."""

    frames: int = 46
    interval: float = 40.0
    rest: int = 9
    pressures: tuple[float, float] = (8.0, 10.0)
    jump: float = 760.0

    @property
    def times(self) -> np.ndarray:
        return self.interval * np.arange(self.frames)

    @property
    def start(self) -> float:
        """Of the load, between two frames."""
        return (self.rest - 0.6) * self.interval

    @property
    def program(self) -> Program:
        return ck.PressureJump(P1=self.pressures[0], P2=self.pressures[1], Tj=self.jump).program()

    def pressure(self, times: np.ndarray) -> np.ndarray:
        return np.where(times < self.start, 0.0, self.program.at(np.maximum(times - self.start, 0.0)))


def simulated(planned: PlannedDimple, schedule: Schedule) -> Dimple:
    """The top of a dimple at every frame."""
    loaded = schedule.times[schedule.times > schedule.start] - schedule.start
    loading = ck.PressureJump(P1=schedule.pressures[0], P2=schedule.pressures[1], Tj=schedule.jump)
    run = ck.simulate(
        planned.law, ck.specimen("bulge").replace(refinement=2.0, apex_thickness=planned.thickness), planned.values,
        loading=loading, times=loaded, temperature=planned.temperature, elastic=ck.Elastic(E=planned.modulus),
    )  # fmt: skip
    top = run.test.model.top
    rise, widening = (run._at(np.asarray(run.simulation.displacements[:, top, k]), loaded) for k in (1, 0))
    still = np.zeros((schedule.frames - loaded.size, rise.shape[1]))
    return Dimple(schedule.times, run.test.piece.top_radii, np.vstack([still, rise]), np.vstack([still, widening]))


def grid(count: int, columns: int) -> list[tuple[float, float]]:
    """Centres in the plate, row by row from the top, each from left to right, as creepkit numbers them."""
    rows = -(-count // columns)
    return [
        (PITCH * (k % columns - 0.5 * (columns - 1)) + 0.3, PITCH * (0.5 * (rows - 1) - k // columns) - 0.2)
        for k in range(count)
    ]


def watched(
    dimples: Sequence[Dimple], columns: int = 3, *, spacing: float = 0.9, seed: int = 1, noise: float = 1.5e-3
) -> Frames:
    """What one camera sees of dimples that lie in rows on one plate."""
    centers = grid(len(dimples), columns)
    reach = 2.0 * max(max(abs(x), abs(y)) for x, y in centers) + 34.0
    camera = VirtualCamera(
        points=int((reach / spacing) ** 2), spacing=spacing, centers=tuple(centers), seed=seed, noise=noise, subset=1.0
    )
    return camera.frames(*dimples)


def dice_table(frame: CameraFrame) -> str:
    """As DICe writes one frame: words above, pixels beside, z first, lost subsets with sigma -1."""
    names = "SUBSET_ID,COORDINATE_X,COORDINATE_Y,DISPLACEMENT_X,DISPLACEMENT_Y,SIGMA"
    names += "".join(f",MODEL_{kind}_{axis}" for kind in ("COORDINATES", "DISPLACEMENT") for axis in "ZYX")
    head = f"***\n*** Digital Image Correlation Engine (DICe)\n*** Reference image: plate_0000.tif\n***\n{names}\n"
    pixels = 500.0 + 20.0 * frame.points[:, :2]
    cells = np.c_[
        np.arange(len(pixels)), pixels, 20.0 * frame.displacements[:, :2], _sigma(frame), frame.points[:, ::-1],
        frame.displacements[:, ::-1],
    ]  # fmt: skip
    return head + _lines(cells, "%d," + ",".join(["%.3f"] * 4 + ["%.3g"] + ["%.6f"] * 6))


def vic_table(frame: CameraFrame) -> str:
    """As VIC-3D writes one frame in a country of decimal commas."""
    head = '"X [mm]";"Y [mm]";"Z [mm]";"U [mm]";"V [mm]";"W [mm]";"sigma [pixel]"\n'
    cells = np.c_[frame.points, frame.displacements, _sigma(frame)]
    return head + _lines(cells, ";".join(["%.6f"] * 6 + ["%.3g"])).replace(".", ",")


SYSTEMS = {"dice": (dice_table, "DICe_solution_{:03d}.txt"), "vic-3d": (vic_table, "plate-{:04d}_0.csv")}


def _sigma(frame: CameraFrame) -> np.ndarray:
    return np.where(frame.valid, 0.02, -1.0)


def _lines(cells: np.ndarray, form: str) -> str:
    return (f"{form}\n" * len(cells)) % tuple(cells.ravel().tolist())


def write_frames(folder: Path, frames: Frames, system: str = "dice") -> None:
    """One file a frame."""
    folder.mkdir(parents=True)
    table, name = SYSTEMS[system]
    for k in range(len(frames)):
        (folder / name.format(k)).write_text(table(frames[k]), encoding="cp1252")


def write_times(path: Path, times: np.ndarray) -> None:
    """A row a frame: its number and its time."""
    path.write_text("frame,time [s]\n" + "".join(f"{k},{t:.3f}\n" for k, t in enumerate(times)))


def write_record(path: Path, schedule: Schedule, lag: float, channels: dict[str, float], seed: int = 5) -> None:
    """A logger whose clock is ahead by `lag`, s: one pressure, and thermocouples {head: mean in C}."""
    random = np.random.default_rng(seed)
    clock = np.arange(-600.0, schedule.times[-1] + 600.0, 2.0)
    pressure = BAR * schedule.pressure(clock) + random.normal(0.0, 0.05, clock.size)
    warm = [mean + random.normal(0.0, 0.3, clock.size) for mean in channels.values()]
    cells = np.c_[clock + 600.0 + lag, pressure, *warm]
    head = ",".join(["time [s]", "P [barg]", *channels])
    path.write_text(f"{head}\n" + _lines(cells, ",".join(["%.1f", "%.3f", *["%.2f"] * len(warm)])))


def write_runs(
    folder: Path, temperatures: Sequence[float], values: dict[str, float], law: str = "norton", lag: float = 7.0
) -> Schedule:
    """`run1/` ... of one dimple each at temperatures, C, with `run1_times.csv` and `run1_log.csv` beside each.

    values : of `law`, whose Q is about T_ref of 1043.15 K, kJ/mol being no unit here: J/mol.
    """
    schedule = Schedule()
    for k, celsius in enumerate(temperatures, 1):
        kelvin = celsius + 273.15
        factor = np.exp(-values["Q"] / 8.314462618 * (1.0 / kelvin - 1.0 / 1043.15))
        planned = PlannedDimple("X", law, {"A": values["A"] * factor, "n": values["n"]}, temperature=kelvin)
        write_frames(folder / f"run{k}", watched([simulated(planned, schedule)], 1, seed=10 + k))
        write_times(folder / f"run{k}_times.csv", schedule.times)
        write_record(folder / f"run{k}_log.csv", schedule, lag + k, {"T1 [C]": celsius}, seed=20 + k)
    return schedule


def write_lab(
    folder: Path, west: Sequence[PlannedDimple], east: Sequence[PlannedDimple], lag: float = 23.4, *,
    columns: int = 3, spacing: float = 0.9, schedule: Schedule | None = None,
    thermocouples: dict[str, float] | None = None,
) -> Schedule:  # fmt: skip
    """`west/` (DICe) and `east/` (VIC-3D), `west_times.csv`, `east_times.csv` of another start, and `logger.csv`."""
    schedule = schedule or Schedule()
    for name, planned, system, shift in (("west", west, "dice", 0.0), ("east", east, "vic-3d", 111.0)):
        own = replace(schedule, frames=schedule.frames - (name == "east"))
        dimples = [simulated(one, own) for one in planned]
        write_frames(folder / name, watched(dimples, columns, spacing=spacing, seed=len(name) + len(planned)), system)
        write_times(folder / f"{name}_times.csv", own.times + shift)
    heads = thermocouples or {"TC1 [C]": 800.0, "TC2 [C]": 801.0, "TC3 [C]": 799.0}
    write_record(folder / "logger.csv", schedule, lag, heads)
    return schedule
