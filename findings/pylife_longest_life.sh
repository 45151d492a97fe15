#!/usr/bin/env bash
# pyLife: a table of lives in which every specimen broke
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet pylife==2.3.1
cd "$folder"
env/bin/python - <<'PYTHON'
from importlib.metadata import version

import pandas
from pylife.materialdata.woehler import determine_fractures

tests = pandas.DataFrame({"load": [300.0, 250.0, 200.0, 180.0], "cycles": [100.0, 1000.0, 9000.0, 25000.0]})
by_default = determine_fractures(tests)
with_limit = determine_fractures(tests, load_cycle_limit=1e5)
print(f"pylife {version('pylife')}: four specimens, all broken, none stopped")
print("default               ", by_default["fracture"].tolist())
print("load_cycle_limit=1e5  ", with_limit["fracture"].tolist())
print("A good guess: without a limit nothing was stopped at one, so all are fractures. Seen: the longest life of the table is")
print("taken for the limit, and the specimen that lasted longest, which says most of low loads, becomes a run-out. A limit")
print("above all lives, or a column `fracture` of one's own, keeps it.")
seen = by_default["fracture"].tolist() == [True, True, True, False] and bool(with_limit["fracture"].all())
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
