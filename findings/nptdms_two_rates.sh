#!/usr/bin/env bash
# npTDMS: the times of a creep test whose logger slows down after loading
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet npTDMS==1.13.0 numpy==2.4.6
cd "$folder"
env/bin/python - <<'PYTHON'
from importlib.metadata import version

import numpy
from nptdms import ChannelObject, TdmsFile, TdmsWriter

strain = numpy.array([0.0, 0.0008, 0.0012, 0.0015, 0.0021, 0.0026])
with TdmsWriter("creep.tdms") as writer:  # four readings each second while loading, then one each hour
    for rows, properties in (
        (slice(0, 4), {"wf_increment": 1.0, "wf_start_offset": 0.0, "wf_samples": 4}),
        (slice(4, 6), {"wf_increment": 3600.0, "wf_start_offset": 3603.0, "wf_samples": 2}),
    ):
        writer.write_segment([ChannelObject("creep", "strain", strain[rows], properties=properties)])
channel = TdmsFile.read("creep.tdms")["creep"]["strain"]
times = channel.time_track()
print(f"npTDMS {version('nptdms')}: one channel of two segments, readings at 0, 1, 2, 3, 3603 and 7203 s")
print("strain    ", channel[:].tolist())
print("time_track", times.tolist())
print("A good guess: each segment keeps the spacing and start that were written with it, as it keeps its readings. Seen:")
print("properties belong to the channel, the last segment's replace all earlier ones, and time_track gives its spacing and")
print("start to every reading: the loading of three seconds takes three hours, and creep begins where the test has ended.")
seen = times.tolist() == [3603.0 + 3600.0 * k for k in range(6)] and channel[:].tolist() == strain.tolist()
raise SystemExit(0 if seen else "changed: this is no longer what happens")
PYTHON
