"""From a folder of a camera's exports and an instrument's record, on other clocks, to a fitted law: commands only.

The camera watches a simulated dimple (Norton's law, finer elements than those that identify). Its files are tables with
column names of no known system, z away from it, and hold no times; one cannot be read.
"""

import json
import re

import numpy as np
import pytest

import creepkit as ck
from helpers.command_line import creepkit
from helpers.virtual_camera import Dimple, VirtualCamera

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
    run = ck.simulate(
        "norton", ck.specimen("bulge").replace(refinement=1.25), LAW, loading=loading, times=seen,
        temperature=TEMPERATURE + 273.15, elastic=ck.Elastic(E=1.5e5, nu=0.3),
    )  # fmt: skip
    top = run.test.model.top
    rise, widening = (run._at(np.asarray(run.simulation.displacements[:, top, k]), seen) for k in (1, 0))
    still = np.zeros((REST, rise.shape[1]))
    times = INTERVAL * np.arange(REST + LOADED)
    dimple = Dimple(times, run.test.radii, np.vstack([still, rise]), np.vstack([still, widening]))
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


def run(*words):
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
    text = run(*extract)
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
    assert "D1" in run("read", folder / "out" / "D1.csv")
    words = ["--law", "norton", "--fix", "n=5", "--starts", "1", "--frames", "5", "--json"]
    answer = json.loads(run("identify", folder / "out" / "D1.csv", *words))
    found = answer["laws"][0]["parameters"]["A"]
    assert found["low"] < LAW["A"] < found["high"]
    assert found["value"] == pytest.approx(LAW["A"], rel=0.15)


STUDY = """
[[record]]
name = "rig"
file = "record.csv"
time_zone = "America/Chicago"

[[camera]]
name = "plate 3"
frames = "frames"
columns = { x = "PX [mm]", y = "PY [mm]", z = "PZ [mm]", u = "DX [mm]", v = "DY [mm]", w = "DZ [mm]" }
times = "times.csv"
subset_mm = 1.2
record = "rig"
modulus_GPa = 150
alloy = "X"

[identification]
laws = ["norton"]
fix = { n = 5 }
starts = 1
frames = 5

[report]
attach_MB = 50
"""
TEST = "plate 3 D1"


def states(result):
    return {one.name: one.state for one in result.stages}


@pytest.mark.nightly
def test_a_study_goes_from_frames_and_a_record_to_a_law_and_to_its_report(laboratory, tmp_path):
    for name in ("frames", "times.csv", "record.csv"):
        (tmp_path / name).symlink_to(laboratory / name)
    file = tmp_path / "study.toml"
    file.write_text(STUDY)
    said = []
    result = ck.Study.load(file).run(progress=lambda task, done, total, note: said.append((task, note)))
    assert result.failures == ()
    assert set(states(result).values()) == {"made"}
    assert any(task == "extraction of plate 3" and "frames" in note for task, note in said)
    low, high = result.imposed[TEST].alignment.lag_interval
    assert low < -LAG < high
    (history,) = result.histories
    assert (history.name, history.alloy, history.elastic.E) == (TEST, "X", 1.5e5)
    found = next(one for one in result.rankings[""].best.estimates if one.name == "A")
    assert found.low < LAW["A"] < found.high
    (left_out,) = (one for one in result.exclusions if one.frames == (30,))
    assert left_out.reason.startswith("unreadable, frames as the camera counts them: f_030.csv:2:")

    page = result.report.read_text()
    assert len(page) < 8_000_000
    for text in ('id="extraction"', 'id="imposed"', "95 % interval", "f_030.csv:2:", "frames/f_000.csv"):
        assert text in page
    lock = json.loads((tmp_path / "study.lock").read_text())
    assert {"record.csv", "times.csv", "frames/f_030.csv"} <= set(lock["inputs"])
    assert lock["stages"]["record of plate 3"]["numbers"]["lag_s"] == pytest.approx(-LAG, abs=10)

    again = ck.Study.load(file).run()
    assert set(states(again).values()) == {"kept"}
    assert again.changes == ()
    assert np.array_equal(again.histories[0].times, history.times)
    assert again.extractions[TEST].noise.correlation == result.extractions[TEST].noise.correlation

    file.write_text(STUDY.replace('time_zone = "America/Chicago"', 'time_zone = "America/New_York"'))
    moved = ck.Study.load(file).run(only="extraction")
    assert states(moved)["extraction of plate 3"] == "kept"  # the frames are not read again for it
    assert states(moved)["record of plate 3"] in ("made", "failed")

    file.write_text(STUDY.replace("modulus_GPa", 'channels = ["D1: Press.", "D1: Tmp."]\nmodulus_GPa'))
    failed = ck.Study.load(file).run()
    assert states(failed) == {"extraction of plate 3": "kept", "record of plate 3": "failed", "report": "made"}
    assert "there is no channel 'D1: Tmp.'; did you mean 'D1: Temp.'?" in failed.failures[0].sentence
    assert "This report is not complete" in failed.report.read_text()
