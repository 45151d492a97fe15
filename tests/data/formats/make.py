"""Write small files of every format as it is today: `python tests/data/formats/make.py`.

They go into the folder of this version. A folder that is there stays as it is: what an earlier version wrote has to be
read by all later ones (tests/unit/files/test_formats.py). Raise the version of creepkit, then run this program,
whenever a format gets a new version.
"""

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

import creepkit as ck

HOURS = [0.0, 1.0, 2.0, 5.0, 10.0, 20.0]
"""h"""


TEMPERATURES = (1023.15, 1073.15, 1123.15)
"""K"""


STUDY = """\
[study]
title = "one law"
[data]
files = ["1073K_*.csv"]
[identification]
laws = ["norton"]
temperature = "none"
starts = 1
"""


def main() -> None:
    folder = Path(__file__).parent / ck.__version__
    if folder.is_dir() and any(folder.iterdir()):
        raise SystemExit(f"{folder}: is there already, and stays as it is")
    make(folder)


def make(folder: Path) -> None:
    """Write a file of each format into a folder."""
    folder.mkdir(exist_ok=True)
    groups = creep_tests(folder)
    identified(groups, folder)
    planned(folder)
    ck.rupture(rupture_tests(), "larson-miller").save(folder / "rupture_assessment.json")


def creep_tests(folder: Path) -> dict[float, list[ck.History]]:
    """{temperature in K: tests}, written as CSV: Norton's law at two stresses."""
    groups: dict[float, list[ck.History]] = {}
    for temperature in TEMPERATURES:
        for stress in (60.0, 90.0):
            values = {"A": 1e-18 * (temperature / 1073.15) ** 30, "n": 5.0}
            test = {"loading": ck.constant_stress(stress), "elastic": ck.Elastic(E=150e3), "temperature": temperature}
            history = ck.simulate("norton", "uniaxial", values, times=[3600 * h for h in HOURS], **test)
            history = replace(history, name=f"{temperature:.0f}K_{stress:.0f}MPa")
            ck.write_history(history, folder / f"{history.name}.csv")
            groups.setdefault(temperature, []).append(history)
    return groups


def identified(groups: dict[float, list[ck.History]], folder: Path) -> None:
    """An identification, its law with values, a ranking with the file of its law, and a law of temperature."""
    fit = ck.identify("norton", groups[1073.15])
    fit.save(folder / "identification.json")
    ck.export(fit, "json", to=folder / "valued_law.json")
    ck.rank([fit]).save(folder / "ranking.json")
    ck.discover([ck.identify("norton", group) for group in groups.values()]).save(folder / "temperature_law.json")


def planned(folder: Path) -> None:
    """A data set of 16 draws, rejected ones among them, and a network that was trained on it for two epochs."""
    with tempfile.TemporaryDirectory() as scratch:
        file = Path(scratch) / "data_set.h5"
        data = ck.generate("norton", "uniaxial", draws=16, seed=1, to=file, every=3600.0)
        (folder / "data_set.h5").write_bytes(file.read_bytes())
        recipe = ck.ParameterGru(hidden=4, layers=1)
        network = ck.train(data, recipe, to=Path(scratch) / "network.safetensors", training=ck.Training(epochs=2))
        network.save(folder / "surrogate.safetensors")


def rupture_tests() -> list[ck.History]:
    """Eight tests to rupture, with lives by Larson and Miller: log10 t = (20 300 - 10 700 log10(s / 100)) / T - 20, h.

    Lives are alternately a tenth longer and shorter: without scatter no intervals could be stated.
    """
    tests = []
    conditions = {823.15: (120.0, 150.0, 190.0), 873.15: (90.0, 110.0, 140.0), 923.15: (70.0, 90.0)}
    for T, stresses in conditions.items():
        for stress in stresses:
            life = 10.0 ** ((20300.0 - 10700.0 * np.log10(stress / 100.0)) / T - 20.0)  # h
            life *= 1.1 if len(tests) % 2 else 0.9
            name = f"{T:.0f}K_{stress:.0f}MPa"
            load = ck.constant_stress(stress)
            tests.append(ck.History(name, np.zeros(1), {}, load, T, rupture_time=3600.0 * life))
    return tests


if __name__ == "__main__":
    main()
