"""The paper's own experiment from its folder: dimples of several alloys in two views, one edited table, laws."""

from __future__ import annotations

import csv
import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from helpers.command_line import creepkit
from helpers.plates import PlannedDimple, write_lab, write_runs
from helpers.virtual_camera import Dimple, VirtualCamera

WEST = (
    PlannedDimple("A1", "norton", {"A": 1e-15, "n": 5.2}, thickness=0.50),
    PlannedDimple("A2", "norton", {"A": 2e-13, "n": 4.0}, thickness=0.47, modulus=170e3),
)
EAST = (PlannedDimple("A3", "norton", {"A": 5e-16, "n": 5.2}, thickness=0.52),)


@pytest.fixture(scope="module")
def lab(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("lab")
    write_lab(folder, WEST, EAST, columns=2)
    return folder


def run(*words) -> str:
    result = creepkit(*words)
    assert result.exit_code == 0, result.output
    return result.output


def fill_in(path: Path, planned: dict[tuple[str, str], PlannedDimple]) -> None:
    """What a person does: alloys, thicknesses and moduli into the empty cells of the table."""
    with path.open() as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        one = planned[row["camera"], row["dimple"]]
        row |= {"alloy": one.alloy, "thickness [mm]": f"{one.thickness}", "thickness tolerance [%]": "2"}
        row["modulus [GPa]"] = f"{one.modulus / 1e3:g}"
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)


def test_init_one_edit_and_run_give_a_law_of_every_alloy(lab: Path) -> None:
    said = run("init", lab)
    assert "question" not in said
    study = lab / "study.toml"
    text = study.read_text().replace("subset_mm = 0 ", "subset_mm = 1 ")
    text = re.sub(r"laws = \[.*?\]", 'laws = ["norton"]\nstarts = 1\nframes = 12', text).replace("[selection]", "")
    study.write_text(text)
    empty = creepkit("run", study, "--only", "identification")
    assert empty.exit_code == 1
    assert "Young's modulus of east D1 is not stated; write modulus [GPa] of the table of alloys" in empty.stderr
    fill_in(lab / "alloys.csv", {("west", "D1"): WEST[0], ("west", "D2"): WEST[1], ("east", "D1"): EAST[0]})
    run("run", study)
    result = ck.Study.load(study).run()  # kept
    assert {one.state for one in result.stages} == {"kept"}
    assert [(h.name, h.alloy, h.elastic.E) for h in result.histories] == [
        ("east D1", "A3", 150e3),
        ("west D1", "A1", 150e3),
        ("west D2", "A2", 170e3),
    ]
    for one in (*WEST, *EAST):
        found = {e.name: e for e in result.rankings[one.alloy].best.estimates}
        for name, value in one.values.items():  # six intervals at once: those of 99 %, in which all lie 94 times of 100
            scale = math.log if name == "A" else float
            low, high, middle = (scale(getattr(found[name], end)) for end in ("low", "high", "value"))
            assert abs(scale(value) - middle) < 2.576 / 1.96 * (high - low) / 2
        assert result.rankings[one.alloy].best.numerical_error.confirms
    west, east = (result.imposed[f"{view} D1"].alignment for view in ("west", "east"))
    assert result.imposed["west D2"].alignment.lag == west.lag  # one clock a camera
    assert west.lag_interval[0] < 623.4 < west.lag_interval[1]
    assert east.lag_interval[0] < 512.4 < east.lag_interval[1]
    page = result.report.read_text()
    assert all(one.alloy in page for one in (*WEST, *EAST))


WEST_ALONE = """
[[record]]
name = "logger"
file = "logger.csv"

[[camera]]
frames = "west"
times = "west_times.csv"
subset_mm = 1
modulus_GPa = 150
"""


def test_temperatures_of_dimples_between_thermocouples_and_in_the_infrared(lab: Path) -> None:
    """Two dimples 24 mm apart on a plate that is 0.5 K/mm hotter to the right."""
    study = lab / "temperatures.toml"
    study.write_text(WEST_ALONE + 'channels = ["P", "TC1"]\n')
    one = ck.Study.load(study).run(only="extraction")
    centers = {name: e.center for name, e in one.extractions.items()}
    assert {i.temperature_sd for i in one.imposed.values()} == {0.0}
    x, y = next(iter(centers.values()))
    where = f'centers_mm = [[{x}, {y}], [{x - 60}, {y}]]\nnames = ["good", "outside"]\n'
    study.write_text(WEST_ALONE + 'channels = ["P", "TC1"]\n' + where)
    partly = ck.Study.load(study).run(only="extraction")
    assert [h.name for h in partly.histories] == ["west good"]
    ((left_out, reason),) = [(e.test, e.reason) for e in partly.exclusions if not e.frames]
    assert left_out == "west outside"
    assert "points of the clamped plate" in reason
    middle = np.mean([center[0] for center in centers.values()])
    places = f"TC1 = [{middle}, {y}], TC2 = [{middle + 2}, {y}], TC3 = [{middle - 2}, {y}]"  # 800, 801 and 799 C
    study.write_text(WEST_ALONE + f'channels = ["P", "TC1", "TC2", "TC3"]\nthermocouples_mm = {{ {places} }}\n')
    between = ck.Study.load(study).run(only="extraction")
    left, right = (between.imposed[f"west D{k}"] for k in (1, 2))
    assert left.temperature.values.mean() < 1073.15 < right.temperature.values.mean()
    assert left.temperature_sd > 1.0
    columns = middle + 0.5 * (np.arange(161) - 80)
    (lab / "ir").mkdir(exist_ok=True)
    np.save(lab / "ir" / "image_1.npy", np.tile(800.0 + 0.5 * (columns - middle), (81, 1)))
    infrared = 'infrared = {{ images = "ir", center_mm = [{}, {}], mm_per_pixel = 0.5, emissivity = 1.0, {} }}\n'
    infrared = infrared.format(middle, y, "emissivity_sd = 0.01")
    study.write_text(WEST_ALONE + 'channels = ["P"]\n' + infrared)
    seen = ck.Study.load(study).run(only="extraction").imposed
    for name, center in centers.items():
        planted = 1073.15 + 0.5 * (center[0] - middle)
        assert seen[name].temperature.values.mean() == pytest.approx(planted, abs=0.1)
        # d(ln S)/dT of Planck's law at 10 um and 1073 K: 1 % of radiance is 5.8 K
        assert seen[name].temperature_sd == pytest.approx(5.8, rel=0.1)
    text = WEST_ALONE.partition("[[camera]]")[2] + "load = { pressure_MPa = 8 }\n" + infrared
    study.write_text("[[camera]]" + text)
    stated = ck.Study.load(study).run(only="extraction")
    assert [h.temperature for h in stated.histories] == pytest.approx(
        [1073.15 + 0.5 * (center[0] - middle) for center in centers.values()], abs=0.1
    )
    assert all(float(h.labels["temperature_sd_K"]) > 1.0 for h in stated.histories)


def test_what_succeeded_is_written_whatever_failed(lab: Path, tmp_path: Path) -> None:
    """A centre beside the dimples, whose ring lies outside of the field of view."""
    frames = ck.read_frames(lab / "west", None, lab / "west_times.csv")
    first = ck.extract(frames, subset=1.0)[0].center
    words = ["extract", lab / "west", "--times", lab / "west_times.csv", "--record", lab / "logger.csv", "--channels"]
    words += ["P,TC1", "--center", f"{first[0]},{first[1]}", "--center", f"{first[0] - 60},{first[1]}"]
    words += ["--names", "good,outside", "--modulus-gpa", "150", "--to", tmp_path / "out", "--search", "400,800"]
    result = creepkit(*words)
    assert result.exit_code == 1
    assert "outside: " in result.stderr
    (history,) = ck.read_histories(tmp_path / "out")
    assert history.labels["place"] == "good"
    known = creepkit(*words[:-4], "--lag", "623.4", "--to", tmp_path / "known")
    assert "623.4 s (stated)" in known.output


def test_one_alloy_at_four_temperatures_gives_its_temperature_form(tmp_path: Path) -> None:
    """From cameras alone: each run is under its own record."""
    values = {"A": 1e-16, "n": 5.2, "Q": 400e3}
    write_runs(tmp_path, (730, 757, 784, 811), values)
    run("init", tmp_path)
    planned = {(f"run{k}", "D1"): PlannedDimple("X", "norton", {}) for k in range(1, 5)}
    fill_in(tmp_path / "alloys.csv", planned)
    study = tmp_path / "study.toml"
    text = study.read_text().replace("subset_mm = 0 ", "subset_mm = 1 ")
    text = re.sub(r"laws = \[.*?\]", 'laws = ["norton"]\nstarts = 1\nframes = 12', text).replace("[selection]", "")
    study.write_text(text.partition("[report]")[0])
    result = ck.Study.load(study).run()
    assert [round(h.mean_temperature - 273.15) for h in result.histories] == [730, 757, 784, 811]
    assert result.failures == ()
    found = next(iter(result.temperature.values())).temperature_law
    activation = next(value for name, value in found.values.items() if name.startswith("Q"))
    assert activation == pytest.approx(400e3, rel=0.05)
    assert np.isfinite(list(found.values.values())).all()


# ---- cameras to law --------------------------------------------------------------------------------------------------

# From a folder of a camera's exports and an instrument's record, on other clocks, to a fitted law: commands only. The
# camera watches a simulated dimple (Norton's law, finer elements than those that identify). Its files are tables with
# column names of no known system, z away from it, and hold no times; one cannot be read.


LAG, START, INTERVAL, REST, LOADED = 37.0, 1755561113.25, 20.0, 10, 30
"""The record's clock is behind by so many s; unix time of the first frame; s between frames; frames at rest, loaded."""
LAW = {"A": 1e-15, "n": 5.0}
TEMPERATURE = 777.0
PSI = 145.0377377


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory):
    folder = tmp_path_factory.mktemp("laboratory")
    loading = ck.PressureJump(P1=5.0, P2=7.0, Tj=300.0)
    start_of_load = (REST - 0.5) * INTERVAL
    seen = INTERVAL * np.arange(REST, REST + LOADED) - start_of_load
    run_cameras = ck.simulate(
        "norton", ck.specimen("bulge").replace(refinement=1.25), LAW, loading=loading, times=seen,
        temperature=TEMPERATURE + 273.15, elastic=ck.Elastic(E=1.5e5, nu=0.3),
    )  # fmt: skip
    top = run_cameras.test.model.top
    rise, widening = (
        run_cameras._at(np.asarray(run_cameras.simulation.displacements[:, top, k]), seen) for k in (1, 0)
    )
    still = np.zeros((REST, rise.shape[1]))
    times = INTERVAL * np.arange(REST + LOADED)
    dimple = Dimple(times, run_cameras.test.piece.top_radii, np.vstack([still, rise]), np.vstack([still, widening]))
    write_frames(folder / "frames", VirtualCamera(seed=21, points=1700).frames(dimple))
    stamps = "".join(f"{k},{1e3 * (START + t):.0f}\n" for k, t in enumerate(times))
    (folder / "times.csv").write_text("index,time\n" + stamps)
    write_record(folder / "record.csv", loading.program(), start_of_load, times[-1])
    return folder


def write_frames(folder, frames):
    folder.mkdir()
    half = np.array([1.0, -1.0, -1.0])
    for k in range(len(frames)):
        frame = frames[k]
        rows = np.c_[frame.points * half, frame.displacements * half][frame.valid]
        np.savetxt(folder / f"f_{k:03d}.csv", rows, "%.6f", ";", header="PX;PY;PZ;DX;DY;DZ", comments="")
    (folder / "f_030.csv").write_text("PX;PY;PZ;DX;DY;DZ\n1;2;3;0;0;abc\n")


def write_record(path, program, start_of_load, end):
    """A row a second of D1 and a dimple that is not loaded, in the record's own time of day."""
    clock = np.arange(-120.0, end + 120.0, 1.0)  # of the camera, s since its first frame
    pressure = PSI * np.where(clock < start_of_load, 0.0, program.at(np.maximum(clock - start_of_load, 0.0)))
    pressure = pressure + np.random.default_rng(0).normal(0.0, 0.5, pressure.size)
    lines = ["Default User,Sample 1", "time,A1: Press.(PSIG),D1: Press.(PSIG),A1: Temp.(C),D1: Temp.(C)"]
    origin = np.datetime64("2025-08-18T18:51:53.250") - np.timedelta64(round(1e3 * LAG), "ms")
    for t, p in zip(clock, pressure, strict=True):
        stamp = str(origin + np.timedelta64(round(1e3 * t), "ms"))
        day, time = stamp.split("T")
        year, month, day = day.split("-")
        lines.append(f"{int(month)}/{int(day)}/{year}  {time}000,10.0,{p:.2f},757.2,{TEMPERATURE:.1f}")
    path.write_text("\n".join(lines) + "\n")


def run_cameras(*words):
    result = creepkit(*words)
    assert result.exit_code == 0, result.output
    return result.stdout


def test_from_frames_and_a_record_to_a_law(laboratory, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)  # results of identify
    folder = laboratory
    extract = (
        "extract", folder / "frames", "--columns", "x=PX [mm],y=PY [mm],z=PZ [mm],u=DX [mm],v=DY [mm],w=DZ [mm]",
        "--times", folder / "times.csv", "--record", folder / "record.csv", "--time-zone", "America/Chicago",
        "--subset", 1.2, "--modulus-gpa", 150, "--to", folder / "out",
    )  # fmt: skip
    text = run_cameras(*extract)
    assert "assumed: z of the frames points away from the cameras" in text
    assert "D1: unreadable: frame 30: " in text
    low, high = map(float, re.search(r"record ahead by \S+ s \((\S+) to (\S+) s, 95 %\)", text).groups())
    assert low < -LAG < high
    (history,) = ck.read_histories(folder / "out" / "D1.csv")
    assert history.mean_temperature == pytest.approx(TEMPERATURE + 273.15, abs=0.5)
    written = (folder / "out" / "D1.csv").read_bytes()
    (folder / "out" / "D1.csv").write_text("edited")
    again = creepkit(*extract)
    assert again.exit_code == 1
    assert "D1.csv: cannot be written: it is there, and creepkit did not write it as it is now" in again.stderr
    (folder / "out" / "D1.csv").write_bytes(written)
    assert "D1" in run_cameras("read", folder / "out" / "D1.csv")
    words = ["--law", "norton", "--fix", "n=5", "--starts", "1", "--frames", "5", "--json"]
    answer = json.loads(run_cameras("identify", folder / "out" / "D1.csv", *words))
    found = answer["laws"][0]["parameters"]["A"]
    assert found["low"] < LAW["A"] < found["high"]
    assert found["value"] == pytest.approx(LAW["A"], rel=0.15)
