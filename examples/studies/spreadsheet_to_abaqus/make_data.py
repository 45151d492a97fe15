"""Write creep_tests.xlsx as a laboratory might have it: hours, per cent, a sheet of curves and one of conditions.

Six bars under constant load at three temperatures. The law is strain hardening times an Arrhenius factor. Rates scatter
between test pieces (standard deviation 8 %), each test has a loading strain of its own, and the extensometer has white
noise and a resolution of 0.001 %. To write the spreadsheet anew::

    python examples/studies/spreadsheet_to_abaqus/make_data.py
"""

import datetime
import json
from pathlib import Path

import numpy as np
import openpyxl

import creepkit as ck

HERE = Path(__file__).parent
HOUR = 3600.0
TRUTH = {"A": 3.0e-17, "n": 4.0, "m": -0.3, "Q": 300e3}
T_REF, RATE_SCATTER, LOADING_STRAIN, NOISE, SEED = 873.15, 0.08, 1e-4, 2e-5, 4
TESTS = {  # test piece: temperature in C, stress in MPa, hours
    "K1": (575, 180, 200), "K2": (575, 230, 150), "K3": (600, 140, 200),
    "K4": (600, 190, 120), "K5": (625, 110, 150), "K6": (625, 150, 80),
}  # fmt: skip
FRAMES = 40


def main() -> None:
    """Write creep_tests.xlsx and truth.json."""
    rng = np.random.default_rng(SEED)
    law = ck.law("strain-hardening").times(ck.arrhenius(T_ref=T_REF))
    book = openpyxl.Workbook()
    curves, conditions = book.active, book.create_sheet("Conditions")
    curves.title = "Curves"
    conditions.append(["Test", "Stress (MPa)", "Temperature (°C)", "Modulus (GPa)"])
    heads: list[list[str | None]] = [[], []]
    columns: list[list[float]] = []
    for name, (celsius, stress, hours) in TESTS.items():
        conditions.append([name, stress, celsius, 160])
        times = np.unique(np.round(np.geomspace(0.1, hours, FRAMES), 2))
        exact = ck.simulate(
            law,
            "uniaxial",
            {**TRUTH, "A": TRUTH["A"] * np.exp(rng.normal(0, RATE_SCATTER))},
            loading=ck.constant_stress(float(stress), "load"),
            times=times * HOUR,
            temperature=celsius + 273.15,
        )
        engineering = np.expm1(exact.outputs["strain"])
        noisy = engineering + rng.normal(0, LOADING_STRAIN) + rng.normal(0, NOISE, times.size)
        heads[0] += [name, None]
        heads[1] += ["Time (h)", "Creep strain (%)"]
        columns += [times.tolist(), np.round(100 * noisy, 3).tolist()]
    for head in heads:
        curves.append(head)
    for row in range(max(map(len, columns))):
        curves.append([column[row] if row < len(column) else None for column in columns])
    book.properties.created = book.properties.modified = datetime.datetime(2026, 1, 1)
    book.save(HERE / "creep_tests.xlsx")
    truth = {"law": "strain-hardening", "T_ref": T_REF, "values": TRUTH}
    (HERE / "truth.json").write_text(json.dumps(truth) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
