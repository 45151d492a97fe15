#!/usr/bin/env bash
# safetensors: does the same content give the same file?
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet safetensors==0.8.0 numpy==2.4.6
cat > "$folder/write.py" <<'PYTHON'
import sys
import numpy as np
from safetensors.numpy import save_file

keys = sys.argv[2:]
save_file({"weights": np.zeros(2)}, sys.argv[1], metadata={key: "value" for key in keys})
PYTHON
for k in 1 2 3 4 5 6 7 8; do
    "$folder/env/bin/python" "$folder/write.py" "$folder/many_$k" law unit seed date author
    "$folder/env/bin/python" "$folder/write.py" "$folder/one_$k" law
done
"$folder/env/bin/python" - "$folder" <<'PYTHON'
import hashlib
import sys
from importlib.metadata import version
from pathlib import Path

folder = Path(sys.argv[1])
many, one = (
    {hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.glob(f"{name}_*")} for name in ("many", "one")
)
print(f"safetensors {version('safetensors')}: one tensor, written by eight processes")
print(f"with five keys of metadata: {len(many)} different files; with one key: {len(one)}")
print("A good guess: the same tensors and metadata give the same bytes, so that a hash tells whether a model is the same.")
print("Seen: the keys of the metadata come in another order in each process. Put them into one key, as sorted JSON.")
raise SystemExit(0 if len(many) > 1 and len(one) == 1 else "changed: this is no longer what happens")
PYTHON
