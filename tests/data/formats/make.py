"""Write small files of every format as it is today: `python tests/data/formats/make.py`.

They go into the folder of this version. A folder that is there stays as it is: what an earlier version wrote has to be
read by all later ones (tests/unit/files/test_formats.py). Raise the version of creepkit, then run this program,
whenever a format gets a new version.
"""

from dataclasses import replace
from pathlib import Path

import creepkit as ck
from creepkit.inverse.ranking_document import write_ranking_document

HOURS = [0.0, 1.0, 2.0, 5.0, 10.0, 20.0]
"""h"""


def main() -> None:
    folder = Path(__file__).parent / ck.__version__
    if folder.is_dir() and any(folder.iterdir()):
        raise SystemExit(f"{folder}: is there already, and stays as it is")
    folder.mkdir(exist_ok=True)
    groups: dict[float, list[ck.History]] = {}
    for temperature in (1023.15, 1073.15, 1123.15):
        for stress in (60.0, 90.0):
            values = {"A": 1e-18 * (temperature / 1073.15) ** 30, "n": 5.0}
            test = {"loading": ck.constant_stress(stress), "elastic": ck.Elastic(E=150e3), "temperature": temperature}
            history = ck.simulate("norton", "uniaxial", values, times=[3600 * h for h in HOURS], **test)
            history = replace(history, name=f"{temperature:.0f}K_{stress:.0f}MPa")
            ck.write_history(history, folder / f"{history.name}.csv")
            groups.setdefault(temperature, []).append(history)
    fit = ck.identify("norton", groups[1073.15])
    fit.save(folder / "identification.json")
    ck.export(fit, "json", to=folder / "valued_law.json")
    write_ranking_document({"identification.json": 1.0}, folder / "ranking.json")
    ck.discover([ck.identify("norton", group) for group in groups.values()]).save(folder / "temperature_law.json")


if __name__ == "__main__":
    main()
