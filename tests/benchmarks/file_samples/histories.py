"""Samples of the readers of histories: one file a test, folders with an index, relaxation, steps, a dimple."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from file_samples.samples import ReaderSample

import creepkit as ck
from creepkit.records import History
from creepkit.testing.reader_checks import history_difference

CREEP = """# name: bar 12
# alloy: Alloy 9
# specimen: uniaxial
# temperature_C: 850
# stress_MPa: 61.5
# modulus_GPa: 150.5
# control: load
# strain_measure: engineering
# includes_elastic: no
# heat: X7
# ended: stopped
time_h,strain_pct,strain_sd_pct,temperature_C
0.0,0.0,0.0021,850.1
0.5,0.0214,0.0021,850.2
1.5,0.0341,0.0022,849.9
2.5,0.0523,0.0021,850.3
3.5,0.0611,0.0023,850.1
4.5,0.0785,0.0021,849.8
5.5,0.0912,0.0021,850.2
6.5,0.1077,0.0022,850.0
"""
DIMPLE = """# specimen: bulge
# temperature_K: 1053.15
# pressure_1_MPa: 8.25
# pressure_2_MPa: 10.5
# jump_time_h: 2.5
# ramp_s: 5.5
# apex_thickness_mm: 0.502
time_h,amplitude_mm,width_mm,shape,amplitude_sd_mm
1.25,0.0521,3.711,2.041,0.0021
2.25,0.0563,3.702,2.038,0.0021
3.25,0.0814,3.691,2.032,0.0022
4.25,0.0932,3.683,2.027,0.0021
5.25,0.1043,3.672,2.021,0.0021
"""
RELAXATION = """# specimen: relaxation
# temperature_C: 600
# modulus_GPa: 165.5
# strain_pct: 0.21
# strain_measure: engineering
time_s,stress_MPa
0.5,312.5
60.5,281.25
600.5,240.125
3600.5,201.5
36000.5,160.75
"""
STEPS = """# temperature_C: 750
# stress_steps: 0 s 100.5 MPa; 2.25 h 120.5 MPa
# control: load
# strain_measure: logarithmic
# includes_elastic: no
time_h,strain_pct,used
1.25,0.0512,1
2.125,0.0641,1
3.125,0.0913,1
4.125,0.1214,0
"""
INDEX = """key,temperature_C,stress_MPa,youngs_MPa,state,heat
a/1,900.5,25.5,149000.5,Ruptured,X7
a/2,950.5,20.5,144000.5,Discontinued,X8
"""
CURVES = """key,time_s,strain_pct
a/1,0.5,0.0012
a/1,100.5,0.0114
a/1,900.5,0.0316
a/2,0.5,0.0011
a/2,90.5,0.0217
"""
LIST = "test,temperature_C,stress_MPa,rupture_h\nA,980.5,230.5,78.75\n"
FRAMES = """time_h,creep_extension_pct,T_top_C,T_mid_C,T_bot_C
0.5,0.0012,980.5,981.5,982.5
20.5,0.5123,980.25,981.25,988.5
70.5,3.1235,980.75,981.75,982.25
"""


READERS = {
    "csv": "csv",
    "index of a table": "indexed-table",
    "table with": "indexed-table",
    "index of files": "indexed-files",
    "files with": "indexed-files",
}
"""{beginning of a sample's name: its reader}."""


def read(path: Path) -> list[History]:
    """The histories in a file, or in the folder of an index."""
    return ck.read_histories(path)


def difference(first: Sequence[History], second: Sequence[History]) -> str:
    """What distinguishes what was read of a mutated file; labels and names, one of them the folder's, may differ."""
    if len(first) != len(second):
        return f"{len(first)} and {len(second)} tests"
    plain = ([one.replace(name="", alloy="", labels={}, source="") for one in each] for each in (first, second))
    return next((gap for one, other in zip(*plain, strict=True) if (gap := history_difference(one, other))), "")


def decided(histories: Sequence[History]) -> str:
    """What was assumed of the tests, and how many frames of one time were made one."""
    said = ("assumed", "merged_frames")
    return "; ".join(history.labels.get(label, "") for history in histories for label in said)


def table(name: str, files: dict[str, str], mutated: str, misspelt: str, without_unit: str) -> ReaderSample:
    """A sample of text; misspelt : keys or columns, each of which is written with a letter missing."""
    return ReaderSample(
        name,
        {file: text.encode() for file, text in files.items()},
        mutated,
        read,
        difference,
        decided,
        delimiter=",",
        misspelt=tuple((key, key[:2] + key[3:]) for key in misspelt.split()),
        without_unit=tuple((key, key.rpartition("_")[0]) for key in without_unit.split()),
        reader=next((one for beginning, one in READERS.items() if name.startswith(beginning)), ""),
    )


def samples() -> Iterator[ReaderSample]:
    """The samples of the registered readers of histories."""
    keys = "alloy specimen temperature_C stress_MPa modulus_GPa control strain_measure includes_elastic heat ended"
    yield table("csv creep", {"x.csv": CREEP}, "x.csv", keys, "temperature_C stress_MPa modulus_GPa time_h strain_pct")
    keys = "specimen temperature_K pressure_1_MPa pressure_2_MPa jump_time_h ramp_s apex_thickness_mm amplitude_sd_mm"
    yield table(
        "csv dimple", {"x.csv": DIMPLE}, "x.csv", keys, "pressure_1_MPa jump_time_h ramp_s amplitude_mm width_mm"
    )
    keys = "specimen modulus_GPa strain_pct strain_measure stress_MPa"
    yield table("csv relaxation", {"x.csv": RELAXATION}, "x.csv", keys, "strain_pct stress_MPa time_s modulus_GPa")
    yield table("csv steps", {"x.csv": STEPS}, "x.csv", "stress_steps control strain_measure used", "strain_pct time_h")
    folder = {"index.csv": INDEX, "curves.csv": CURVES}
    columns = "temperature_C stress_MPa youngs_MPa heat"
    yield table("index of a table", folder, "index.csv", columns, "temperature_C stress_MPa")
    yield table("table with an index", folder, "curves.csv", "strain_pct time_s key", "time_s")
    files = {"index.csv": LIST, "A_creep.csv": FRAMES}
    yield table("index of files", files, "index.csv", "temperature_C stress_MPa rupture_h", "stress_MPa rupture_h")
    yield table("files with an index", files, "A_creep.csv", "creep_extension_pct time_h T_mid_C", "time_h")
