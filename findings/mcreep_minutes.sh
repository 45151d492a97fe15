#!/usr/bin/env bash
# mcreep: a tensile creep test whose times are written in minutes
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet mcreep==1.1.6 numpy==2.4.6 scipy==1.17.1 pandas==3.1.1 matplotlib==3.11.2
cd "$folder"
MPLBACKEND=Agg env/bin/python -W ignore - <<'PYTHON'
from contextlib import redirect_stdout
from importlib.metadata import version
from io import StringIO

import numpy as np
from mcreep.const import DataParameters, Experiment, PlotParameters
from mcreep.func import evp_s_d_1kv
from mcreep.model import Model

STRESS, TAU = 0.01, 6000.0  # GPa, s
minutes = np.arange(0.0, 1000.5, 0.5)
seconds = 60 * minutes
accuracy = 2e-5
strain = STRESS * (1 + 1e-5 * seconds + 0.5 * (1 - np.exp(-seconds / TAU)))
strain += accuracy * np.random.default_rng(1).normal(size=strain.size)
np.savetxt("minutes.txt", np.column_stack([minutes, strain]))
np.savetxt("seconds.txt", np.column_stack([seconds, strain]))


def compliances(file, seconds_per_unit, start, hold):
    """C0, Cv and C1 of spring, dashpot and Kelvin-Voigt element by mcreep, and its R2 of all readings that it read."""
    data = DataParameters(time_to_seconds=seconds_per_unit)
    model = Model(Experiment("Tensile", sigma=STRESS), data, PlotParameters("t", "e", showfigs=False), "EVP", evp_s_d_1kv, rtimes=[TAU])
    with redirect_stdout(StringIO()):
        model.run(file, start, hold)
    final, fit = model.table_of_results_evp.iloc[0], model.table_of_results.iloc[0]
    return np.array([final["C0"], final["Cv"], final["C1"]], float), fit["R2all"]


def least_squares(used):
    """The same by linear least squares of the readings in `used`."""
    t = seconds[used]
    columns = STRESS * np.column_stack([np.ones_like(t), t, 1 - np.exp(-t / TAU)])
    return np.linalg.lstsq(columns, strain[used], rcond=None)[0]


print(f"mcreep {version('mcreep')}: a test of 1000 minutes at 10 MPa, C0 = 1 /GPa, Cv = 1e-5 /(GPa s), C1 = 0.5 /GPa, strains known to {accuracy}")
calls = {
    "file in seconds, from 600 s on": ("seconds.txt", 1, 600, 59400),
    "file in minutes, from 0 min on": ("minutes.txt", 60, 0, 1000),
    "file in minutes, from 600 s on": ("minutes.txt", 60, 600, 59400),
}
found = {}
for words, call in calls.items():
    found[words], score = compliances(*call)
    print("  {}: C0 {:.3f}, Cv {:.2e}, C1 {:.3f}; R2 {:.3f}".format(words, *found[words], score))
print("A good guess: with time_to_seconds=60 a file in minutes gives what the file in seconds gives, where t_start and t_hold are in minutes or")
print("in seconds. Seen: readings are selected twice with one pair of numbers, before the times are converted and after. In minutes the first")
print("1000 seconds are fitted, a 60th of the test: Cv is 8 times too large, C1 a 19th. In seconds the first 600 minutes are left out, not")
print("seconds: C1 is less than half, and R2 has nothing against it. In hours it is the first 3600th. Only converted before, all is well.")
fast, first, late = found.values()
pairs = [(fast, seconds >= 600), (first, seconds <= 1000), (late, minutes >= 600)]
seen = all(np.allclose(values, least_squares(used), rtol=5e-3) for values, used in pairs)
seen = seen and np.allclose(fast, [1, 1e-5, 0.5], rtol=0.02) and first[1] > 5e-5 and first[2] < 0.1 and late[2] < 0.3
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
